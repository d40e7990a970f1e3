"""Looking after servos between the exchanges: alerts, restarts, tripped watchdogs, slow entries."""

from collections.abc import Collection, Sequence
from math import inf

from drivers.dynamixel_line import Line
from drivers.dynamixel_setup import speed_units
from drivers.dynamixel_table import STEPS_PER_TURN, WATCHDOG_UNIT_S
from drivers.dynamixel_torque import TRIPPED, heal_tripped, name_latched
from drivers.errors import BusLost
from drivers.types import ServoReading, ServoSetup

SILENCE_S = 0.5
"""No answer from anybody for so long: the bus is lost."""

CHECK_S = 1.0
"""So often one servo is asked whether it is still armed, each in turn."""

NAME_AGAIN_S = 0.5
"""Time between attempts to learn what an alert is about."""

ENTRY_STEPS_S = 30.0 / 360.0 * STEPS_PER_TURN
"""Speed at which a joint found outside its limits is brought inside."""

RESTARTED = "restarted, torque off"


class Care:
    """What is known of the servos' health, and what is done about it.

    faults: what has befallen each servo so far, in words, by id
    engaged: the torque is on
    """

    def __init__(self, line: Line, setups: Sequence[ServoSetup], watchdog: int) -> None:
        self._line = line
        self._setups = {setup.id: setup for setup in setups}
        self._ids = tuple(self._setups)
        self._watchdog = watchdog
        self.faults: dict[int, str] = {}
        self.engaged = False
        self._entering: set[int] = set()
        self._unnamed: set[int] = set()
        self._name_at_s = self._check_at_s = -inf
        self._checked = 0
        self._silent_since_s: float | None = None

    def take_on(self, entering: Collection[int]) -> None:
        """Begin to look after servos under torque; some of them are outside their limits."""
        self.engaged = True
        self._entering = set(entering)
        self._line.starving_s = self._watchdog * WATCHDOG_UNIT_S or inf

    def let_go(self) -> None:
        """Leave servos without torque alone."""
        self.engaged = False
        self._entering.clear()
        self._line.starving_s, self._line.starved = inf, False

    def entry_speeds(self, outside: Collection[int]) -> list[int]:
        """Give every servo's Profile Velocity, slow for those outside their limits."""
        slow = speed_units(ENTRY_STEPS_S)
        speeds = {i: speed_units(setup.max_speed_steps_s) for i, setup in self._setups.items()}
        return [min(slow, speed) if i in outside else speed for i, speed in speeds.items()]

    def alert(self, servo_id: int) -> None:
        """Note that a servo has raised the alert bit."""
        if servo_id not in self.faults:
            self._unnamed.add(servo_id)

    def tend(
        self,
        readings: Sequence[ServoReading | None],
        heard: int,
        group: Collection[int],
        now_s: float,
    ) -> None:
        """Do what is due after a read in which ``heard`` servos answered.

        Raises:
            drivers.errors.BusLost: no servo has answered for 0.5 s.
        """
        self._mind_silence(heard, now_s)
        if self.engaged and now_s >= self._check_at_s:
            self._check_next(group, now_s)
        if self._unnamed and now_s >= self._name_at_s:
            self._name_at_s = now_s + NAME_AGAIN_S
            self.name_alerts()
        if self._entering:
            self._mind_entry(readings)

    def _mind_silence(self, heard: int, now_s: float) -> None:
        if heard:
            self._silent_since_s = None
        elif self._silent_since_s is None:
            self._silent_since_s = now_s
        elif now_s - self._silent_since_s >= SILENCE_S:
            raise BusLost(
                f"{self._line.port.port_name}: no servo has answered for {SILENCE_S} s: "
                "check servo power and the cable"
            )

    def name_alerts(self) -> None:
        """Ask servos that raised the alert bit what has happened."""
        for servo_id, fault in name_latched(self._line, tuple(self._unnamed)).items():
            self._unnamed.discard(servo_id)
            self.faults[servo_id] = fault
            self._line.errors["alert"] += 1

    def _mind_entry(self, readings: Sequence[ServoReading | None]) -> None:
        """Give back its speed to every joint that has come inside its limits."""
        for (servo_id, setup), reading in zip(self._setups.items(), readings, strict=True):
            if servo_id not in self._entering or reading is None:
                continue
            if setup.min_steps <= reading.position_steps <= setup.max_steps:
                self._entering.discard(servo_id)
                speed = speed_units(setup.max_speed_steps_s)
                self._line.write_all((servo_id,), "profile_velocity", (speed,))

    def _check_next(self, group: Collection[int], now_s: float) -> None:
        """Check one servo, the next at the next time; a host that slept is noticed so."""
        self._check_at_s = now_s + CHECK_S
        self._checked = (self._checked + 1) % len(self._ids)
        servo_id = self._ids[self._checked]
        if servo_id in group:
            self.check(servo_id)

    def check(self, servo_id: int) -> None:
        """See that a servo is still armed; after a restart its RAM is as from the factory."""
        name, armed = ("bus_watchdog", self._watchdog) if self._watchdog else ("torque_enable", 1)
        state = self._line.ask((servo_id,), name).get(servo_id, armed)
        if state == TRIPPED:
            self.heal()
        elif state != armed and servo_id not in self.faults:
            self.faults[servo_id] = RESTARTED
            self._line.errors["restarted"] += 1

    def heal(self) -> None:
        """Bring servos back whose own watchdog has stopped them."""
        self._line.starved = False
        healed = heal_tripped(self._line, self._ids, self._watchdog, self._clip)
        self._line.errors["watchdog"] += len(healed)

    def _clip(self, servo_id: int, steps: int) -> int:
        setup = self._setups[servo_id]
        return min(max(steps, setup.min_steps), setup.max_steps)
