"""One joint's servo by itself, register by register: limp for a hand, or gently driven.

The other servos of the chain are left as they are. What it changes in the servo it puts
back; the bus watchdog is armed while the torque is on, so a servo that is left alone stops.
"""

from collections.abc import Callable
from dataclasses import dataclass

from drivers.dynamixel_registers import Registers
from drivers.dynamixel_table import (
    MODELS,
    STEPS_PER_TURN,
    VELOCITY_UNIT_STEPS_S,
    WATCHDOG_UNIT_S,
    name_errors,
)
from drivers.errors import BusLost, DriverError, ServoFault, ServoMissing
from robot.bringup.monitor import load_share
from robot.calibrate.stop_search import STEPS_PER_DEG, Stop, StopSearchParams, go, search
from robot.clock import Clock
from robot.joint import JointParams

PERIOD_S = 0.02
"""A search looks 50 times a second where the line is quick enough."""

WATCHDOG_S = 0.3
"""Three readings that were lost in a row must not let it trip."""

POSITION_MODE = 3


class Stopped(DriverError):
    """Somebody wants it to end: let go of everything. The message says who."""


@dataclass(frozen=True)
class Found:
    """What a servo says of itself before it is calibrated; limits are those of its goals."""

    firmware: int
    limits: tuple[int, int]
    homing_offset: int


class SingleJoint:
    """The servo of one joint.

    Args:
        name, joint: the joint as configured.
        registers: of the opened port.
        clock: the host's.
        stopped: asked all the time; tells why to stop, None while there is no reason.
    """

    def __init__(
        self,
        name: str,
        joint: JointParams,
        registers: Registers,
        clock: Clock,
        stopped: Callable[[], str | None],
    ) -> None:
        self.name = name
        self.joint = joint
        self.who = f"{name} (servo {joint.id})"
        self._registers = registers
        self._clock = clock
        self._stopped = stopped
        self._at_s = clock.now_s()
        self._driven: tuple[int, int] | None = None

    def check(self) -> Found:
        """See that it is the right servo, sound, and in position mode.

        Raises:
            drivers.errors.ServoMissing: it does not answer, is another model, or is set up
                in another way.
            drivers.errors.ServoFault: it has latched a hardware error.
        """
        number = self._registers.ping(self.joint.id)
        if number is None:
            raise ServoMissing(f"{self.who} does not answer: check power, cable, id and baud rate")
        if number != MODELS[self.joint.model].number:
            names = {model.number: model.name for model in MODELS.values()}
            raise ServoMissing(
                f"{self.who} is {names.get(number, f'model number {number}')}, "
                f"not {self.joint.model}: correct the rig file, or check the ids"
            )
        latched = self._value("hardware_error_status")
        if latched:
            raise ServoFault(
                f"{self.who}: {' and '.join(name_errors(latched))}: find the cause, then "
                f"gazerig reboot {self.joint.id}"
            )
        found = Found(
            self._value("firmware_version"),
            (self._value("min_position_limit"), self._value("max_position_limit")),
            self._value("homing_offset"),
        )
        for register, wanted in (("operating_mode", POSITION_MODE), ("drive_mode", 0)):
            value = self._value(register)
            if value != wanted:
                raise ServoMissing(
                    f"{self.who}: {register} is {value}, not {wanted}: gazerig doctor --fix sets it"
                )
        if found.homing_offset:
            raise ServoMissing(
                f"{self.who}: its Homing Offset is {found.homing_offset} steps, which some "
                "firmware loses by a whole turn as the torque comes on: set it to 0 "
                "(--clear-offset), the calibration makes up for it"
            )
        return found

    def clear_offset(self) -> int:
        """Set the Homing Offset to 0, torque off; gives what it was."""
        was = self._value("homing_offset")
        if was:
            self.let_go()
            self._set("homing_offset", 0)
        return was

    def let_go(self) -> None:
        """Take the torque away, and see that it is gone.

        Raises:
            drivers.errors.BusLost: it does not answer.
        """
        self._set("bus_watchdog", 0)
        self._set("torque_enable", 0)

    def position(self) -> tuple[int, float]:
        """Give the present position and the time of the reading.

        Raises:
            drivers.errors.BusLost: it does not answer any more.
        """
        value = self._value("present_position")
        self._at_s = self._clock.now_s()
        return value, self._at_s

    # --- driven gently

    def take_on(self, params: StopSearchParams) -> None:
        """Switch the torque on where the joint is, weak and slow.

        Raises:
            drivers.errors.ServoMissing: the position does not lie within one turn.
            drivers.errors.ServoFault: the torque does not come on, or the position jumped.
            drivers.errors.BusLost: it does not answer any more.
        """
        self._unlimited()
        full = self._value("pwm_limit")
        self._set("goal_pwm", max(1, round(full * params.strength)))
        self._set("profile_acceleration", 0)
        fastest = 2.0 * params.speed_deg_s * STEPS_PER_DEG / VELOCITY_UNIT_STEPS_S
        self._set("profile_velocity", max(1, round(fastest)))
        before, _ = self.position()
        if not 0 <= before < STEPS_PER_TURN:
            raise ServoMissing(
                f"{self.who} has been turned over the seam of its encoder (it reads {before}): "
                "turn it back, or switch the servo power off and on, and begin anew"
            )
        self._set("goal_position", before)
        self._set("torque_enable", 1)
        now, _ = self.position()
        if not self._value("torque_enable"):
            raise ServoFault(f"{self.who}: the torque does not come on: gazerig doctor says why")
        if abs(now - before) > STEPS_PER_TURN // 4:
            raise ServoFault(f"{self.who}: its position jumped from {before} to {now}")
        self._set("bus_watchdog", round(WATCHDOG_S / WATCHDOG_UNIT_S))

    def find_stop(self, params: StopSearchParams, direction: int) -> Stop:
        """Lead it to its stop towards more (1) or fewer (-1) steps, and a little back.

        Raises:
            drivers.errors.BusLost: it does not answer any more.
            Stopped: a person or the system asked for it.
        """
        return search(params, direction, (0, STEPS_PER_TURN - 1), self._exchange)

    def go(self, params: StopSearchParams, goal_steps: int) -> bool:
        """Lead it slowly to a position; tells whether it came there unhindered."""
        return go(goal_steps, params, self._exchange)

    def leave(self) -> None:
        """Torque off, and everything else as it was found."""
        self.let_go()
        self._set("goal_pwm", self._value("pwm_limit"))
        if self._driven is not None:
            low, high = self._driven
            self._set("min_position_limit", low)
            self._set("max_position_limit", high)
            self._driven = None

    def _unlimited(self) -> None:
        """Let goals lead anywhere in the turn; the stops alone are to be found."""
        limits = self._value("min_position_limit"), self._value("max_position_limit")
        if limits == (0, STEPS_PER_TURN - 1):
            return
        self.let_go()
        self._driven = limits
        self._set("min_position_limit", 0)
        self._set("max_position_limit", STEPS_PER_TURN - 1)

    def _exchange(self, goal: int | None) -> tuple[int, float, float]:
        why = self._stopped()
        if why is not None:
            raise Stopped(why)
        self._clock.sleep_until(self._at_s + PERIOD_S)
        if goal is not None:
            self._set("goal_position", goal)
        position, at_s = self.position()
        return position, self._load(), at_s

    def _load(self) -> float:
        """Give the present current as a share of the stall current; 0 where it has none."""
        return load_share(MODELS[self.joint.model], self._value("present_current"))

    def _value(self, register: str) -> int:
        value = self._registers.read(self.joint.id, register)
        if value is None:
            raise BusLost(f"{self.who} does not answer any more: check its cable and power")
        return value

    def _set(self, register: str, value: int) -> None:
        if not self._registers.write(self.joint.id, register, value):
            raise BusLost(f"{self.who} does not take {register} {value}: check its cable and power")
