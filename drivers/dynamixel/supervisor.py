"""Looking after servos between the exchanges: alerts, restarts, tripped watchdogs, slow entries."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from math import inf

from gazerig.drivers.dynamixel.control_table import (
    REGISTERS,
    WATCHDOG_UNIT_S,
    name_errors,
    speed_units,
)
from gazerig.drivers.dynamixel.feedback import DynamixelFeedback
from gazerig.drivers.dynamixel.protocol import ALERT
from gazerig.drivers.dynamixel.read_windows import Sample
from gazerig.drivers.servo_bus.faults import Health
from gazerig.drivers.servo_bus.recovery import Recovery
from gazerig.drivers.servo_bus.supervisor import AGAIN_S, Supervisor
from gazerig.drivers.servo_bus.torque import TRIPPED, heal_tripped
from gazerig.drivers.servo_bus.transaction import TRIES, Line
from gazerig.drivers.types import ServoSetup

CHECK_S = 1.0
"""So often one servo is asked whether it is still armed, each in turn."""

SLOW_S = 0.05
"""So often one servo is asked for what a group reading does not cover, each in turn."""


class DynamixelSupervisor(Supervisor):
    """What is done about the servos' health."""

    _feedback: DynamixelFeedback

    def __init__(
        self,
        line: Line,
        setups: Mapping[int, ServoSetup],
        watchdog: int,
        recovery: Recovery,
        health: Health,
        feedback: DynamixelFeedback,
        covered: bool,
    ) -> None:
        super().__init__(line, setups, recovery, health)
        self._watchdog = watchdog
        self._feedback = feedback
        self._covered = covered
        self._unnamed: set[int] = set()
        self._name_at_s = self._check_at_s = self._slow_at_s = -inf
        self._due_s = -inf
        self._checked = self._slow = 0

    def take_on(self, entering: Collection[int]) -> None:
        """Begin to look after servos under torque; some of them are outside their limits."""
        self.engaged = True
        self.entering.begin(entering)
        self._line.starving_s, self._line.tries = self._watchdog * WATCHDOG_UNIT_S or inf, 1
        self._feedback.expect_torque(True)
        self._feedback.places.forget()

    def let_go(self) -> None:
        """Leave servos without torque alone."""
        self.engaged = False
        self.entering.clear()
        self._suspects.clear()
        self._rearmed.clear()
        self._line.starving_s, self._line.starved, self._line.tries = inf, False, TRIES
        self._feedback.expect_torque(False)

    def mark_all_for_recovery(self) -> None:
        """Trust no servo to be as it was left."""
        super().mark_all_for_recovery()
        self._due_s = -inf

    def alert(self, servo_id: int) -> None:
        """Note that a servo has raised the alert bit."""
        if servo_id not in self._health.faults:
            self._unnamed.add(servo_id)
            self._due_s = -inf

    def check_status(self, servo_id: int, sample: Sample) -> bool:
        """Look at one servo's answer; gives whether its values can be believed."""
        error, torque = sample.hardware_error, sample.torque
        if error:
            # Damaged bytes may pass for a fault, which ends a run: the servo is asked once more.
            if servo_id in self._health.latches:
                self._latched(servo_id, error)
            else:
                self.alert(servo_id)
        elif sample.error & ALERT:
            self.alert(servo_id)
        elif servo_id in self._health.latches or sample.blank or self._limp(servo_id, torque):
            self._suspect(servo_id)
        return not sample.blank

    def _limp(self, servo_id: int, torque: int | None) -> bool:
        """Return whether a servo has no torque that should, and nothing known is the reason."""
        return self.engaged and torque == 0 and servo_id not in self._health.faults

    def _suspect(self, servo_id: int) -> None:
        self._suspects.add(servo_id)
        self._due_s = -inf

    def _latched(self, servo_id: int, status: int) -> None:
        if self._health.latched(servo_id, name_errors(status)):
            self._line.errors["alert"] += 1
            self._feedback.name_fault(self._slot[servo_id], self._health.faults[servo_id])

    # --- after every read

    def service(self, group: Collection[int], now_s: float) -> None:
        """Do what is due after a read; servos that are well again are taken here.

        Raises:
            BusLost: the port is gone.
        """
        if now_s >= self._due_s:
            self._do_due(group, now_s)
        if self.entering:
            self._mind_entry(now_s)
        if self._rearmed:
            self._mark_rearmed()

    def _do_due(self, group: Collection[int], now_s: float) -> None:
        if self._suspects and now_s >= self._recover_at_s:
            self._recover(group, now_s)
        if self._unnamed and now_s >= self._name_at_s:
            self._name_at_s = now_s + AGAIN_S
            self.find_alerts(tuple(self._unnamed))
        if self.engaged and now_s >= self._check_at_s:
            self._check_next(group, now_s)
        if not self._covered and now_s >= self._slow_at_s:
            self._ask_slow(group, now_s)
        self._due_s = min(
            self._recover_at_s if self._suspects else inf,
            self._name_at_s if self._unnamed else inf,
            self._check_at_s if self.engaged else inf,
            inf if self._covered else self._slow_at_s,
        )

    def wake(self) -> None:
        """Look for what is due at the next read."""
        self._due_s = -inf

    def find_alerts(self, ids: Sequence[int]) -> None:
        """Ask servos whether they have latched an error, and which."""
        found = self._line.ask(ids, "hardware_error_status")
        self._unnamed.difference_update(found)
        latched = {servo_id: status for servo_id, status in found.items() if status}
        for servo_id, status in latched.items():
            self._latched(servo_id, status)
        if latched and not self._covered:
            for servo_id, torque in self._line.ask(tuple(latched), "torque_enable").items():
                self._feedback.set_torque(self._slot[servo_id], bool(torque))

    def _mind_entry(self, now_s: float) -> None:
        """Give back its speed, confirmed, to every joint that has come inside its limits."""
        for servo_id in self._arrived(now_s):
            speed = speed_units(self._setups[servo_id].max_speed_steps_s)
            self._line.write_all((servo_id,), "profile_velocity", (speed,))
            if self._line.ask((servo_id,), "profile_velocity").get(servo_id) == speed:
                self.entering.end(servo_id)

    # --- asking in turn

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
            # Where one has starved the others have too.
            self._line.starved = True
        elif state != armed and servo_id not in self._health.faults:
            self._suspect(servo_id)

    def _ask_slow(self, group: Collection[int], now_s: float) -> None:
        """Read torque, or voltage and temperature, of one servo; the next at the next time."""
        self._slow_at_s = now_s + SLOW_S
        self._slow = (self._slow + 1) % (2 * len(self._ids))
        slot, climate = divmod(self._slow, 2)
        servo_id = self._ids[slot]
        if servo_id not in group:
            return
        if climate:
            register = REGISTERS["present_input_voltage"]
            for data in self._line.ask_bytes((servo_id,), register.address, 3).values():
                self._feedback.set_climate(slot, int.from_bytes(data[:2], "little"), data[2])
        else:
            for torque in self._line.ask((servo_id,), "torque_enable").values():
                self._feedback.set_torque(slot, bool(torque))
                if self._limp(servo_id, torque):
                    self._suspect(servo_id)

    def recover_tripped(self, group: Iterable[int]) -> None:
        """Bring servos back whose own watchdog has stopped them."""
        self._line.starved = False
        ids = tuple(group)
        if not ids:
            return
        healed = heal_tripped(self._line, ids, self._watchdog, self._recovery.clip)
        self._rearmed.update(healed)
        self._line.errors["watchdog"] += len(healed)
        if healed:
            self._health.stopped(len(healed), self._line.asleep_s, self._line.port.now_s())
        self._line.asleep_s = 0.0
