"""Access to one smart servo for calibration by hand: its torque is off, others are not changed."""

from collections.abc import Callable

from gazerig.drivers.bus.servo_models import STEPS_PER_TURN
from gazerig.drivers.errors import BusLost, DriverError, ServoFault, ServoMissing, SetupError
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.discovery import ping
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.doctor.servo_rules import find_obstacles, read_state
from gazerig.features.bringup.servo_kinds import servo_kind
from gazerig.robot.model.joint import JointParams

NEAR_STEPS = 8
"""Motion of the joint caused by a hand's tremor while its middle is set."""


class CalibrationStopped(DriverError):
    """The user or the system requested the end: torque off. The message names the source."""


class SmartServoAccess:
    """One joint and its servo.

    Every method raises BusLost if the servo does not answer any more.

    Args:
        name: name of the joint.
        joint: configuration of the joint.
        port: open port.
        now_s: clock of the host.

    who: its name in messages, "neck_yaw (servo 7)"
    """

    def __init__(
        self, name: str, joint: JointParams, port: BusPort, now_s: Callable[[], float]
    ) -> None:
        self.name, self.joint, self.who = name, joint, f"{name} (servo {joint.id})"
        self._kind, self._now_s, self._id = servo_kind(joint.model), now_s, joint.id
        self._line = Transactions(port, self._kind.family)
        if self._kind.family.steps_per_turn != STEPS_PER_TURN:
            raise SetupError(
                f"{self.who}: {self._kind.title} servos are not calibrated by this program: turn "
                "the joint by hand, read its steps with gazerig monitor, and write zero_step, min_deg "
                "and max_deg into the YAML"
            )

    def check(self) -> None:
        """Check that it is the right servo, without faults, and in position mode.

        Raises:
            ServoMissing: it does not answer.
            ServoFault: the doctor's rules have an error, or a setting gives its steps another
                meaning.
        """
        # A servo may be set to answer only queries; this write needs no answer and changes that.
        family = self._kind.family
        self._line.write_all((self._id,), "status_return_level", [family.answer_level])
        found = ping(self._line.port, family, self._id, self._line.baud)
        if found is None:
            raise ServoMissing(f"{self.who} does not answer: check power, cable, id and baud rate")
        setup = ServoConfig(self._id, self.joint.model, 0, STEPS_PER_TURN - 1, 0.0, self.name)
        for finding in find_obstacles(read_state(self._line, self._kind, setup, found, False)):
            raise ServoFault(f"{self.who}: {finding.what}: {finding.remedy}")

    def set_middle(self) -> int:
        """Set the servo's present position as its middle, 2048; return the new offset.

        The servo computes the offset itself on request and keeps it in its EEPROM. Earlier
        calibrations in steps are invalid afterwards. Source: Feetech memory table STS3215,
        register 40.

        Raises:
            ServoFault: the servo rejects it.
        """
        self.disable_torque()
        self._put("lock", 0)
        self._line.write(self._id, "torque_enable", self._kind.set_middle or 0)
        self.disable_torque()  # some firmware leaves it on
        self._put("lock", 1)
        place, _ = self.position()
        if abs(place - STEPS_PER_TURN // 2) > NEAR_STEPS:
            raise ServoFault(
                f"{self.who} does not accept its present position as its middle (it reads {place}): "
                "switch its power off and on and try again"
            )
        return self._value("position_offset")

    def disable_torque(self) -> None:
        """Switch the torque off and verify it.

        Raises:
            ServoFault: the torque is still on.
        """
        if self._kind.family.watchdog_unit_s is not None:
            self._put("bus_watchdog", 0)
        self._put("torque_enable", 0)
        if self._value("torque_enable"):
            raise ServoFault(f"{self.who} does not let go: cut the servo power")

    def position(self) -> tuple[int, float]:
        """Return the present position in steps and the time of the reading."""
        return self._value("present_position"), self._now_s()

    def _value(self, register: str) -> int:
        value = self._line.read(self._id, register)
        if value is None:
            raise BusLost(f"{self.who} does not answer any more: check its cable and power")
        return value

    def _put(self, register: str, value: int) -> None:
        if not self._line.write(self._id, register, value):
            raise BusLost(f"{self.who} does not take {register} {value}: check its cable and power")
