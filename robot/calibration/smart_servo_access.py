"""One smart servo by itself, for calibrating; implements ``servo_access.OneServo``.

Where it has a bus watchdog that is armed while the torque is on, so a servo that is left alone
stops. Where its memory has a lock its limits are opened with the lock shut: the servo obeys and
its EEPROM keeps the old ones, so switching it off and on puts back what a killed program left.
"""

from gazerig.drivers.errors import ServoFault, ServoMissing, SetupError
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.registers import Registers
from gazerig.robot.bringup.servo_families import kind_of
from gazerig.robot.calibration.servo_access import Asked, Found

WATCHDOG_S = 0.3
"""Three readings that were lost in a row must not let it trip."""

LIMITS = ("min_position_limit", "max_position_limit")


class SmartServo:
    """The servo of one joint.

    Args:
        name: the joint's.
        servo_id: as configured.
        model: as configured.
        port: opened.
    """

    def __init__(self, name: str, servo_id: int, model: str, port: BusPort) -> None:
        self.who = f"{name} (servo {servo_id})"
        self._kind = kind_of(model)
        self._family = self._kind.family
        self.alone = ""
        if self._family.watchdog_unit_s is None:
            self.alone = (
                "these servos have no watchdog: if this program is killed, it holds its last goal "
                "weakly until the servo power is cut"
            )
        self._id, self._model, self._port = servo_id, model, port
        self._registers = Registers(port, self._kind.family)
        self._asked = Asked(self._registers, servo_id, self.who)
        self._was: dict[str, int] = {}

    def check(self) -> Found:
        """See that it is the right servo, sound, and in position mode; see OneServo."""
        # A servo may be set to answer questions alone; this takes no answer and ends that.
        self._registers.write_all((self._id,), "status_return_level", self._family.answer_level)
        firmware = self._refuse_another()
        value, driving = self._asked.value, self._kind.driving
        self._refuse_errors(value(self._family.error_register))
        low, high = (value(name) for name in LIMITS)
        for setting in driving.settings:
            now = value(setting.register)
            if now != setting.of(now):
                raise ServoMissing(
                    f"{self.who}: {setting.register} is {now}, not {setting.of(now)}: "
                    "gazerig doctor --fix sets it"
                )
        offset = value(driving.offset)
        if offset and not driving.offset_usable:
            raise ServoMissing(
                f"{self.who}: its Homing Offset is {offset} steps, which some "
                "firmware loses by a whole turn as the torque comes on: set it to 0 "
                "(--clear-offset), the calibration makes up for it"
            )
        return Found(firmware, (low, high), offset)

    def _refuse_another(self) -> int:
        """Return the firmware of the servo, which is of the model that is wanted."""
        found = self._registers.identify(self._id)
        if found is None:
            raise ServoMissing(f"{self.who} does not answer: check power, cable, id and baud rate")
        if found.model_number != self._family.models[self._model].number:
            raise ServoMissing(
                f"{self.who} is {self._family.model_name(found.model_number)}, "
                f"not {self._model}: correct the rig file, or check the ids"
            )
        return found.firmware

    def _refuse_errors(self, status: int) -> None:
        if status:
            remedy = (
                f"find the cause, then gazerig reboot {self._id}"
                if self._family.faults_latch
                else "let it cool, free it, check its supply"
            )
            names = " and ".join(self._family.name_errors(status))
            raise ServoFault(f"{self.who}: {names}: {remedy}")

    def clear_offset(self) -> int:
        """Set the offset of its position to 0, torque off; returns what it was."""
        register = self._kind.driving.offset
        was = self._asked.value(register)
        if was:
            self.let_go()
            if not self._registers.write_lasting(self._id, register, 0):
                raise ServoMissing(f"{self.who} does not take {register} 0: restart its power")
        return was

    def set_middle(self) -> int:
        """Make its present position 2048; returns the offset it has now; see OneServo."""
        if self._kind.set_middle is None:
            raise SetupError(
                f"{self.who}: a {self._kind.title} servo cannot set its middle: in position mode "
                "some firmware loses its Homing Offset; take the horn off and turn the shaft"
            )
        self.let_go()
        return self._kind.set_middle(self._port, self._kind.family, self._id)

    def let_go(self) -> None:
        """Switch the torque off, and see that it is.

        Raises:
            ServoFault: it is not.
        """
        if self._family.watchdog_unit_s is not None:
            self._asked.put("bus_watchdog", 0)
        self._asked.put("torque_enable", 0)
        if self._asked.value("torque_enable"):
            raise ServoFault(f"{self.who} does not let go: cut the servo power")

    def position(self) -> int:
        """Return the present position in steps."""
        return self._asked.value("present_position")

    def load(self) -> float:
        """Return the present current as a share of the stall current."""
        return self._kind.driving.load(self._model, self._asked.value("present_current"))

    def hold(self, strength: float, speed_steps_s: float) -> None:
        """Switch the torque on where it is, weak and slow; see OneServo."""
        value, put = self._asked.value, self._asked.put
        self.let_go()
        if self._family.lock is not None:
            put(self._family.lock, 1)
        self._borrow(strength, speed_steps_s)
        before = self.position()
        if not 0 <= before < self._family.steps_per_turn:
            raise ServoMissing(
                f"{self.who} has been turned over the seam of its encoder (it reads {before}): "
                "turn it back, or switch the servo power off and on, and begin anew"
            )
        put("goal_position", before)
        put("torque_enable", 1)
        now = self.position()
        if not value("torque_enable"):
            raise ServoFault(f"{self.who}: the torque does not come on: gazerig doctor says why")
        if abs(now - before) > self._family.steps_per_turn // 4:
            raise ServoFault(f"{self.who}: its position jumped from {before} to {now}")
        unit_s = self._family.watchdog_unit_s
        if unit_s is not None:
            put("bus_watchdog", round(WATCHDOG_S / unit_s))

    def _borrow(self, strength: float, speed_steps_s: float) -> None:
        """Let goals lead anywhere in the turn, weak and slow; the stops alone are to be found."""
        value, driving = self._asked.value, self._kind.driving
        wanted = {
            **dict(zip(LIMITS, (0, self._family.steps_per_turn - 1), strict=True)),
            **driving.gentle(value, strength, speed_steps_s),
        }
        was = {name: value(name) for name in wanted}
        found = dict(was)
        if driving.full_drive is not None:
            register, largest = driving.full_drive
            found[register] = value(largest)
        self._was = found | self._was
        for name, wish in wanted.items():
            if was[name] != wish:
                self._asked.put(name, wish)

    def holds(self) -> bool:
        """Return whether the torque is on."""
        return self._asked.value("torque_enable") == 1

    def send(self, goal_steps: int) -> None:
        """Send a goal."""
        self._asked.put("goal_position", goal_steps)

    def leave(self) -> None:
        """Switch the torque off and leave everything else as it was found."""
        self.let_go()
        for name, value in self._was.items():
            if self._asked.value(name) != value:
                self._asked.put(name, value)
        self._was = {}
