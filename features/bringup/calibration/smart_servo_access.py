"""Access to one smart servo for calibration: other servos on its line are not changed.

A bus watchdog, if it has one, is armed while the torque is on, so that a servo without a program
stops. If its memory has a lock, its limits are extended with the lock closed: the servo applies the
new limits while its EEPROM keeps the old ones, so a power cycle restores them after a killed
program.
"""

from collections.abc import Callable

from gazerig.drivers.bus.servo_models import STEPS_PER_TURN
from gazerig.drivers.errors import BusLost, DriverError, ServoFault, ServoMissing, SetupError
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.discovery import ping
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.calibration.endstop_search import (
    SPEED_DEG_S,
    STEPS_PER_DEG,
    STRENGTH,
    EndStop,
    find_end_stop,
    move_to_goal,
)
from gazerig.features.bringup.doctor.servo_rules import find_obstacles, read_state
from gazerig.features.bringup.servo_kinds import servo_kind
from gazerig.robot.guardian.guardian import Guardian
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.joint import JointParams

WATCHDOG_S = 0.3
"""Timeout of the watchdog; three consecutive lost readings must not trip it."""

LIMITS = ("min_position_limit", "max_position_limit")


NEAR_STEPS = 8
"""Motion of the joint caused by a hand's tremor while its middle is set."""

PERIOD_S = 0.02
"""A search reads 50 times a second if the line is fast enough."""


class CalibrationStopped(DriverError):
    """The user or the system requested the end: torque off. The message names the source."""


class SmartServoAccess:
    """One joint and its servo.

    Changes in the servo are restored. Every method raises BusLost if the servo does not answer
    any more.

    Args:
        name: name of the joint.
        joint: configuration of the joint.
        port: open port.
        clock: clock of the host.
        stopped: called regularly; returns why to stop, None without a reason.
        guardian: switches the torque off if this program dies; it has one plan, for this servo, and
            the port calls its ``beat``. None: only the servo's watchdog does so.

    who: its name in messages, "neck_yaw (servo 7)"
    alone: note about a servo without a watchdog, "" if it has one
    """

    def __init__(
        self,
        name: str,
        joint: JointParams,
        port: BusPort,
        clock: Clock,
        stopped: Callable[[], str | None],
        guardian: Guardian | None = None,
    ) -> None:
        self.name, self.joint = name, joint
        self.who = f"{name} (servo {joint.id})"
        self._kind = servo_kind(joint.model)
        if self._kind.calibration is None:
            raise SetupError(
                f"{self.who}: {self._kind.title} servos are not calibrated by this program: turn "
                "the joint by hand, read its steps with gazerig monitor, and write zero_step, min_deg "
                "and max_deg into the YAML"
            )
        self._driving, self._family = self._kind.calibration, self._kind.family
        self.alone = ""
        if self._family.watchdog_unit_s is None:
            self.alone = (
                "; these servos have no watchdog: should this program die, its guardian switches "
                "the torque off"
            )
        self._id, self._model, self._port = joint.id, joint.model, port
        self._clock, self._stopped, self._at_s = clock, stopped, clock.now_s()
        self._line = Transactions(port, self._kind.family)
        self._guardian = guardian
        self._was: dict[str, int] = {}

    def check(self) -> None:
        """Check that it is the right servo, without faults, and in position mode.

        Raises:
            ServoMissing: it does not answer.
            ServoFault: the doctor's rules have an error, or a setting gives its steps another
                meaning.
        """
        # A servo may be set to answer only queries; this write needs no answer and changes that.
        self._line.write_all((self._id,), "status_return_level", [self._family.answer_level])
        found = ping(self._line.port, self._family, self._id, self._line.baud)
        if found is None:
            raise ServoMissing(f"{self.who} does not answer: check power, cable, id and baud rate")
        whole_turn = 0, self._family.steps_per_turn - 1
        setup = ServoConfig(self._id, self.joint.model, *whole_turn, 0.0, self.name)
        for finding in find_obstacles(read_state(self._line, self._kind, setup, found, False)):
            raise ServoFault(f"{self.who}: {finding.what}: {finding.remedy}")

    def set_middle(self) -> int:
        """Set the servo's present position as its middle, 2048; return the new offset.

        The servo computes the offset itself on request and keeps it in its EEPROM. Earlier
        calibrations in steps are invalid afterwards. Source: Feetech memory table STS3215,
        register 40.

        Raises:
            SetupError: this kind does not support it.
            ServoFault: the servo rejects it.
        """
        if self._kind.set_middle is None:
            raise SetupError(
                f"{self.who}: a {self._kind.title} servo cannot set its middle: in position mode "
                "some firmware loses its Homing Offset; take the horn off and turn the shaft"
            )
        self._torque_off()
        self._put("lock", 0)
        self._line.write(self._id, "torque_enable", self._kind.set_middle)
        self._torque_off()  # some firmware leaves it on
        self._put("lock", 1)
        place = self._value("present_position")
        if abs(place - self._family.steps_per_turn // 2) > NEAR_STEPS:
            raise ServoFault(
                f"{self.who} does not accept its present position as its middle (it reads {place}): "
                "switch its power off and on and try again"
            )
        return self._value("position_offset")

    def disable_torque(self) -> None:
        """Switch the torque off and verify it; then the guardian has nothing to watch.

        Raises:
            ServoFault: the torque is still on.
        """
        self._torque_off()
        self._unguard()

    def _torque_off(self) -> None:
        if self._family.watchdog_unit_s is not None:
            self._put("bus_watchdog", 0)
        self._put("torque_enable", 0)
        if self._value("torque_enable"):
            raise ServoFault(f"{self.who} does not let go: cut the servo power")

    def position(self) -> tuple[int, float]:
        """Return the present position in steps and the time of the reading."""
        value = self._value("present_position")
        self._at_s = self._clock.now_s()
        return value, self._at_s

    # --- motion with low drive

    def enable_torque(self) -> None:
        """Switch the torque on at its position, weak and slow, for goals anywhere in the turn.

        Raises:
            ServoMissing: the position is not within one turn.
            ServoFault: the torque is not on, or the position jumped.
            SetupError: the guardian does not start.
        """
        value, put, driving = self._value, self._put, self._driving
        if self._guardian is not None:
            self._guardian.join(0)
            self._guardian.arm(0)
        self._torque_off()
        if self._family.lock_register is not None:
            put(self._family.lock_register, 1)
        wanted = {
            **dict(zip(LIMITS, (0, self._family.steps_per_turn - 1), strict=True)),
            **driving.gentle_drive(value, STRENGTH, 2.0 * SPEED_DEG_S * STEPS_PER_DEG),
        }
        was = {name: value(name) for name in wanted}
        found = dict(was)
        if driving.full_drive is not None:
            register, largest = driving.full_drive
            found[register] = value(largest)
        self._was = found | self._was
        for name, desired in wanted.items():
            if was[name] != desired:
                put(name, desired)
        before = value("present_position")
        if not 0 <= before < self._family.steps_per_turn:
            raise ServoMissing(
                f"{self.who} has been turned over the seam of its encoder (it reads {before}): "
                "turn it back, or switch the servo power off and on, and start again"
            )
        put("goal_position", before)
        put("torque_enable", 1)
        now = value("present_position")
        if not value("torque_enable"):
            raise ServoFault(
                f"{self.who}: the torque does not come on: gazerig doctor names the cause"
            )
        if abs(now - before) > self._family.steps_per_turn // 4:
            raise ServoFault(f"{self.who}: its position jumped from {before} to {now}")
        unit_s = self._family.watchdog_unit_s
        if unit_s is not None:
            put("bus_watchdog", round(WATCHDOG_S / unit_s))

    def find_stop(self, direction: int) -> EndStop:
        """Move it to its stop towards more (1) or fewer (-1) steps, and a little back.

        Raises:
            ServoFault: its torque went off during the search, so it was not at a stop.
            CalibrationStopped: a person or the system requested the end.
        """
        stop = find_end_stop(direction, (0, STEPS_PER_TURN - 1), self._exchange)
        if not self._value("torque_enable"):
            raise ServoFault(
                f"{self.who} let go during the search: it protected itself or restarted; "
                "check its supply and start again"
            )
        return stop

    def go(self, goal_steps: int) -> bool:
        """Move it slowly to a position; return whether it arrived unhindered."""
        return move_to_goal(goal_steps, self._exchange)

    def _exchange(self, goal: int | None) -> tuple[int, float, float]:
        """Send a goal, if any; return position, load and time."""
        why = self._stopped()
        if why is not None:
            raise CalibrationStopped(why)
        self._clock.sleep_until(self._at_s + PERIOD_S)
        if goal is not None:
            if self._guardian is not None and self._guardian.is_released(0):
                raise ServoFault(
                    f"{self.who}: the program did not run, so its guardian switched the torque "
                    "off: start again"
                )
            self._put("goal_position", goal)
        position, at_s = self.position()
        load = self._driving.load(self._model, self._value("present_current"))
        return position, load, at_s

    def restore(self) -> None:
        """Switch the torque off and restore everything else."""
        self._torque_off()
        for name, value in self._was.items():
            if self._value(name) != value:
                self._put(name, value)
        self._was = {}
        self._unguard()

    def _unguard(self) -> None:
        if self._guardian is not None:
            self._guardian.disarm(0)
            self._guardian.leave(0)

    def _value(self, register: str) -> int:
        value = self._line.read(self._id, register)
        if value is None:
            raise BusLost(f"{self.who} does not answer any more: check its cable and power")
        return value

    def _put(self, register: str, value: int) -> None:
        if not self._line.write(self._id, register, value):
            raise BusLost(f"{self.who} does not take {register} {value}: check its cable and power")
