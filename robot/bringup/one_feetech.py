"""One Feetech STS servo by itself, for calibrating; implements robot.bringup.servo_access.OneServo.

Its limits are opened with the lock (55) shut: the servo obeys and its EEPROM keeps the old
ones, so switching it off and on puts back what a killed program left.
"""

from drivers.errors import ServoFault, ServoMissing
from drivers.feetech.homing import set_middle
from drivers.feetech.memory_table import (
    CURRENT_UNIT_MA,
    MODELS,
    MULTI_TURN,
    STEPS_PER_TURN,
    TORQUE_FULL,
    name_errors,
    speed_units,
)
from drivers.feetech.registers import StsRegisters
from drivers.serial.port import BusPort
from robot.bringup.servo_access import Asked, Found

POSITION_MODE = 0
GENTLE_ACCELERATION = 10
"""1000 steps/s2: a search begins within a tenth of a second."""

_BORROWED = ("torque_limit", "goal_speed", "acceleration", "goal_time")
_LIMITS = ("min_position_limit", "max_position_limit")


class OneFeetech:
    """The servo of one joint.

    Args:
        name: the joint's.
        servo_id, model: as configured.
        port: opened.
    """

    def __init__(self, name: str, servo_id: int, model: str, port: BusPort) -> None:
        self.who = f"{name} (servo {servo_id})"
        self.alone = (
            "these servos have no watchdog: if this program is killed, it holds its last goal "
            "weakly until the servo power is cut"
        )
        self._id, self._model, self._port = servo_id, MODELS[model], port
        self._registers = StsRegisters(port)
        self._asked = Asked(self._registers, servo_id, self.who)
        self._was: dict[str, int] = {}

    def check(self) -> Found:
        """See that it is the right servo, sound, and in position mode; see OneServo."""
        # A servo may be set to answer questions alone; this takes no answer and ends that.
        self._registers.write_all((self._id,), "status_return_level", 1)
        found = self._registers.identify(self._id)
        if found is None:
            raise ServoMissing(f"{self.who} does not answer: check power, cable, id and baud rate")
        if found.model_number != self._model.number:
            names = {model.number: model.name for model in MODELS.values()}
            other = names.get(found.model_number, f"model number {found.model_number}")
            raise ServoMissing(
                f"{self.who} is {other}, not {self._model.name}: correct the rig file, "
                "or check the ids"
            )
        value = self._asked.value
        self._refuse_setting("operating_mode", value("operating_mode"), POSITION_MODE)
        self._refuse_setting("phase", value("phase"), value("phase") & ~MULTI_TURN)
        self._refuse_setting("angular_resolution", value("angular_resolution"), 1)
        errors = value("status")
        if errors:
            raise ServoFault(
                f"{self.who}: {' and '.join(name_errors(errors))}: let it cool, free it, "
                "check its supply"
            )
        low, high = (value(name) for name in _LIMITS)
        return Found(found.firmware, (low, high), value("position_offset"))

    def _refuse_setting(self, register: str, value: int, wanted: int) -> None:
        if value != wanted:
            raise ServoMissing(
                f"{self.who}: {register} is {value}, not {wanted}: gazerig doctor --fix sets it"
            )

    def clear_offset(self) -> int:
        """Set the offset of its place to 0, torque off; gives what it was."""
        was = self._asked.value("position_offset")
        if was:
            self.let_go()
            if not self._registers.keep(self._id, "position_offset", 0):
                raise ServoMissing(f"{self.who} does not take position_offset 0: restart its power")
        return was

    def set_middle(self) -> int:
        """Let it call its present place 2048; gives the offset it has now; see OneServo."""
        self.let_go()
        return set_middle(self._port, self._id)

    def let_go(self) -> None:
        """Take the torque away, and see that it is gone.

        Raises:
            drivers.errors.ServoFault: it is not.
        """
        self._asked.put("torque_enable", 0)
        if self._asked.value("torque_enable"):
            raise ServoFault(f"{self.who} does not let go: cut the servo power")

    def position(self) -> int:
        """Give the present position."""
        return self._asked.value("present_position")

    def load(self) -> float:
        """Give the present current as a share of the stall current."""
        amperes = self._asked.value("present_current") * CURRENT_UNIT_MA / 1000.0
        return amperes / self._model.stall_current_a

    def hold(self, strength: float, speed_steps_s: float) -> None:
        """Switch the torque on where it is, weak and slow; see OneServo."""
        value, put = self._asked.value, self._asked.put
        self.let_go()
        put("lock", 1)
        self._was = {name: value(name) for name in (*_BORROWED, *_LIMITS)}
        put("min_position_limit", 0)
        put("max_position_limit", STEPS_PER_TURN - 1)
        put("torque_limit", max(1, round(TORQUE_FULL * strength)))
        put("goal_time", 0)
        put("goal_speed", speed_units(speed_steps_s))
        put("acceleration", GENTLE_ACCELERATION)
        before = self.position()
        put("goal_position", before)
        put("torque_enable", 1)
        now = self.position()
        if not value("torque_enable"):
            raise ServoFault(f"{self.who}: the torque does not come on: gazerig doctor says why")
        if abs(now - before) > STEPS_PER_TURN // 4:
            raise ServoFault(f"{self.who}: its position jumped from {before} to {now}")

    def holds(self) -> bool:
        """Tell whether the torque is on."""
        return self._asked.value("torque_enable") == 1

    def send(self, goal_steps: int) -> None:
        """Send a goal."""
        self._asked.put("goal_position", goal_steps)

    def leave(self) -> None:
        """Torque off, and everything else as it was found."""
        self.let_go()
        for name, value in self._was.items():
            self._asked.put(name, value)
        self._was = {}
