"""One Dynamixel servo by itself, for calibrating; implements robot.bringup.servo_access.OneServo.

The bus watchdog is armed while the torque is on, so a servo that is left alone stops.
"""

from drivers.dynamixel.control_table import (
    MODELS,
    STEPS_PER_TURN,
    VELOCITY_UNIT_STEPS_S,
    WATCHDOG_UNIT_S,
    name_errors,
)
from drivers.errors import ServoFault, ServoMissing, SetupError
from drivers.servo_bus.registers import Registers
from robot.bringup.servo_access import Asked, Found
from robot.bringup.telemetry import load_share

WATCHDOG_S = 0.3
"""Three readings that were lost in a row must not let it trip."""

POSITION_MODE = 3


class OneDynamixel:
    """The servo of one joint.

    Args:
        name: the joint's.
        servo_id, model: as configured.
        registers: of the opened port.
    """

    def __init__(self, name: str, servo_id: int, model: str, registers: Registers) -> None:
        self.who = f"{name} (servo {servo_id})"
        self.alone = ""
        self._id, self._model = servo_id, MODELS[model]
        self._registers = registers
        self._asked = Asked(registers, servo_id, self.who)
        self._limits: tuple[int, int] | None = None

    def check(self) -> Found:
        """See that it is the right servo, sound, and in position mode; see OneServo."""
        value = self._asked.value
        self._refuse_another()
        latched = value("hardware_error_status")
        if latched:
            raise ServoFault(
                f"{self.who}: {' and '.join(name_errors(latched))}: find the cause, then "
                f"gazerig reboot {self._id}"
            )
        found = Found(
            value("firmware_version"),
            (value("min_position_limit"), value("max_position_limit")),
            value("homing_offset"),
        )
        for register, wanted in (("operating_mode", POSITION_MODE), ("drive_mode", 0)):
            is_now = value(register)
            if is_now != wanted:
                raise ServoMissing(
                    f"{self.who}: {register} is {is_now}, not {wanted}: "
                    "gazerig doctor --fix sets it"
                )
        if found.homing_offset:
            raise ServoMissing(
                f"{self.who}: its Homing Offset is {found.homing_offset} steps, which some "
                "firmware loses by a whole turn as the torque comes on: set it to 0 "
                "(--clear-offset), the calibration makes up for it"
            )
        return found

    def _refuse_another(self) -> None:
        number = self._registers.ping(self._id)
        if number is None:
            raise ServoMissing(f"{self.who} does not answer: check power, cable, id and baud rate")
        if number != self._model.number:
            names = {model.number: model.name for model in MODELS.values()}
            raise ServoMissing(
                f"{self.who} is {names.get(number, f'model number {number}')}, "
                f"not {self._model.name}: correct the rig file, or check the ids"
            )

    def clear_offset(self) -> int:
        """Set the Homing Offset to 0, torque off; gives what it was."""
        was = self._asked.value("homing_offset")
        if was:
            self.let_go()
            self._asked.put("homing_offset", 0)
        return was

    def set_middle(self) -> int:
        """Refuse: see OneServo.

        Raises:
            drivers.errors.SetupError: always, with the cure.
        """
        raise SetupError(
            f"{self.who}: a Dynamixel servo cannot set its middle: in position mode some firmware "
            "loses its Homing Offset; take the horn off and turn the shaft"
        )

    def let_go(self) -> None:
        """Take the torque away, and see that it is gone."""
        self._asked.put("bus_watchdog", 0)
        self._asked.put("torque_enable", 0)

    def position(self) -> int:
        """Give the present position."""
        return self._asked.value("present_position")

    def load(self) -> float:
        """Give the present current as a share of the stall current; 0 where it has none."""
        return load_share(self._model, self._asked.value("present_current"))

    def hold(self, strength: float, speed_steps_s: float) -> None:
        """Switch the torque on where it is, weak and slow; see OneServo."""
        value, put = self._asked.value, self._asked.put
        self._unlimited()
        put("goal_pwm", max(1, round(value("pwm_limit") * strength)))
        put("profile_acceleration", 0)
        put("profile_velocity", max(1, round(speed_steps_s / VELOCITY_UNIT_STEPS_S)))
        before = self.position()
        if not 0 <= before < STEPS_PER_TURN:
            raise ServoMissing(
                f"{self.who} has been turned over the seam of its encoder (it reads {before}): "
                "turn it back, or switch the servo power off and on, and begin anew"
            )
        put("goal_position", before)
        put("torque_enable", 1)
        now = self.position()
        if not value("torque_enable"):
            raise ServoFault(f"{self.who}: the torque does not come on: gazerig doctor says why")
        if abs(now - before) > STEPS_PER_TURN // 4:
            raise ServoFault(f"{self.who}: its position jumped from {before} to {now}")
        put("bus_watchdog", round(WATCHDOG_S / WATCHDOG_UNIT_S))

    def holds(self) -> bool:
        """Tell whether the torque is on."""
        return self._asked.value("torque_enable") == 1

    def send(self, goal_steps: int) -> None:
        """Send a goal."""
        self._asked.put("goal_position", goal_steps)

    def leave(self) -> None:
        """Torque off, and everything else as it was found."""
        self.let_go()
        self._asked.put("goal_pwm", self._asked.value("pwm_limit"))
        if self._limits is not None:
            self._limit(*self._limits)
            self._limits = None

    def _unlimited(self) -> None:
        """Let goals lead anywhere in the turn; the stops alone are to be found."""
        value = self._asked.value
        limits = value("min_position_limit"), value("max_position_limit")
        if limits == (0, STEPS_PER_TURN - 1):
            return
        self.let_go()
        self._limits = limits
        self._limit(0, STEPS_PER_TURN - 1)

    def _limit(self, low: int, high: int) -> None:
        self._asked.put("min_position_limit", low)
        self._asked.put("max_position_limit", high)
