"""One emulated Feetech servo: effects of writes, errors, restarts.

The memory is in gazerig.sim_mock.feetech.memory, the drive of the shaft in its drive,
undocumented behaviour in its ``FeetechQuirks``. Not emulated: reversed phases, angle resolution
(30), a blinking LED, backup (09).
"""

import struct
from dataclasses import dataclass
from typing import ClassVar, Literal

from gazerig.drivers.feetech.memory_table import (
    EEPROM_END,
    SET_MIDDLE,
    FeetechModel,
)
from gazerig.sim_mock.feetech.drive import CURRENT_UNIT_A, GOALS_AT, FeetechDrive
from gazerig.sim_mock.feetech.memory import SERVO, FeetechMemory, model_and_table
from gazerig.sim_mock.smart_servo.motor import ShaftMaker, create_shaft
from gazerig.sim_mock.smart_servo.physics import ServoSpec
from gazerig.sim_mock.smart_servo.protection import CURRENT, HEAT, OVERLOAD, VOLTAGE
from gazerig.sim_mock.smart_servo.quirks import ChainQuirks
from gazerig.sim_mock.smart_servo.servo import EmulatedServo

BroadcastPing = Literal["answer", "mix", "silence"]
Goal = Literal["wait", "torque-on"]
TorqueOn = Literal["old-goal", "present"]
GoalTime = Literal["obey", "ignore"]
OverloadEnds = Literal["new-goal", "goal-away", "torque", "restart"]
Reboot = Literal["mute", "answer"]


@dataclass(frozen=True, kw_only=True)
class FeetechQuirks(ChainQuirks):
    """Choices of behaviour.

    broadcast_ping: all answer in the order of their ids, all at the same time (the bytes mix), or
        none
    goal: a goal position written without torque waits for it, or switches the torque on; the
        maker's own examples never switch it on, and the servo moves nevertheless [R]
    torque_on: when the torque is switched on, the servo follows the old goal, or the goal becomes
        the present position
    goal_time: Goal Time (44) sets the duration of a move unless it is 0, or has no effect
    overload_ends: the overload protection ends with a different goal, with a goal away from the
        obstacle, only with torque off, or (in addition to all of these) with a restart
    reboot: a reboot instruction is not answered, or is
    """

    broadcast_ping: BroadcastPing = "answer"
    goal: Goal = "wait"
    torque_on: TorqueOn = "old-goal"
    goal_time: GoalTime = "obey"
    overload_ends: OverloadEnds = "new-goal"
    reboot: Reboot = "mute"


MIDDLE = 2048
TIME_UNIT_S = 0.01
TOO_HOT_C = 5.0
"""Temperature above the limit of a motor that a fault has overheated."""

ANGLE = 2
"""Bit of Status (65) of a broken angle sensor; the other bits are its protection's."""

FACTORY_AT = 78
TORQUE_AT, GOAL_AT, GOAL_END, GOALS_END, LIMIT_END = 40, 42, 44, 48, 50
SENSED_AT, SENSED_END = 56, 71
_SENSED = {"little": struct.Struct("<HHHBBBBBHH"), "big": struct.Struct(">HHHBBBBBHH")}
"""56 position, speed, load, voltage, temperature, registered, status, moving, target, current."""


class FeetechServo(EmulatedServo):
    """One Feetech servo on the chain.

    The spec's ``firmware`` is the number after 3. Its ``quirks`` are those of Dynamixel servos and
    are ignored, as are ``overload_share`` and ``overload_s`` of its physics: here they are
    registers.

    Raises:
        ValueError: the model is unknown, or the spec's physics cannot exist.
    """

    restart_ms = 800
    error_bits: ClassVar = {"overload": OVERLOAD, "encoder": ANGLE, "overheating": HEAT}
    model: FeetechModel
    memory: FeetechMemory
    drive: FeetechDrive

    def __init__(self, spec: ServoSpec, now_ms: int, make_shaft: ShaftMaker = create_shaft) -> None:
        self.model, self.table = model_and_table(spec.model)
        self.baud_rates = self.table.baud_rates
        self.memory = FeetechMemory(self.model, spec.id, spec.firmware, self.table)
        self.drive = FeetechDrive(self.memory, self.model, spec, make_shaft)
        self._sensed = _SENSED[self.table.order]
        self._around = 0, 0
        self.apply_quirks(FeetechQuirks())
        super().__init__(spec, now_ms)

    def _load_limits(self) -> tuple[float, ...]:
        """Return its protection limits from its registers."""
        get = self.memory.get
        return (
            get("overload_torque") / 100.0,
            get("protection_time") * TIME_UNIT_S,
            get("protection_current") * CURRENT_UNIT_A,
            get("overcurrent_time") * TIME_UNIT_S,
        )

    def apply_quirks(self, quirks: FeetechQuirks) -> None:
        """Use quirks from now on."""
        self.quirks = quirks
        self.mute_reboot = quirks.reboot == "mute"
        self.drive.obey_goal_time(quirks.goal_time == "obey")

    def _apply_settings(self) -> None:
        """Apply settings that have changed."""
        super()._apply_settings()
        self.answers_groups = self.table.sync_read
        self.drive.follow()
        self._protect()

    def _protect_from(self, bits: int) -> None:
        """Flag voltage and heat while they are wrong, other errors until they are reset."""
        errors = self.errors & ~(HEAT | VOLTAGE) | bits
        if errors != self.errors:
            self.errors = errors
            self._protect()

    def _protect(self) -> None:
        """Apply Unload Conditions: an overload lowers the torque, other errors switch it off."""
        drive = self.drive
        self._pushed = self.shaft.u
        wrong = self.errors & self.memory.get("unloading_condition")
        if wrong & ~OVERLOAD and drive.torque:
            self.memory.set("torque_enable", 0)
            drive.switch(0, False)
        drive.max_duty = self.memory.get("protective_torque") / 100.0 if wrong & OVERLOAD else 1.0
        drive.apply_gains()

    # --- reading

    @property
    def error_flag(self) -> int:
        """Return the error byte of every status."""
        return self.errors

    def read(self, address: int, length: int) -> bytes:
        """Return bytes of the memory; addresses without a register are 0."""
        if address == SENSED_AT and length == SENSED_END - SENSED_AT:
            return self._sensed.pack(
                *self._read_live_words()
            )  # a control loop reads them every tick
        if address < SENSED_END and address + length > SENSED_AT:
            self._sensed.pack_into(self.memory.bytes, SENSED_AT, *self._read_live_words())
        return self.memory.read(address, length)

    def _read_live_words(self) -> tuple[int, ...]:
        """Return the registers with live values, 56 to 70."""
        if self.stale_surroundings:
            self.stale_surroundings = False
            self._around = max(0, min(255, self.voltage_01v)), self.warmth_c
        volts, warmth = self._around
        position, speed, load, current, target, moving = self.drive.motion_words(self._ms)
        pending = self._pending is not None
        return (
            position, speed, load, volts, warmth, pending, self.errors, moving, target, current,
        )  # fmt: skip

    # --- writing

    def write(self, address: int, data: bytes) -> int:
        """Write bytes as an instruction does; nothing is ever refused."""
        memory, end = self.memory, address + len(data)
        goal = memory.bytes[GOAL_AT:GOAL_END]
        if GOALS_AT <= address < end <= GOALS_END:
            # A shortcut for the only write of every tick.
            memory.bytes[address:end] = data
            self._command(address < GOAL_END and end > GOAL_AT, goal)
            drive = self.drive
            if drive.torque and drive.mode == SERVO:
                drive.followed = address, data
            return 0
        written: list[int] = []
        memory.write(address, data, written.append)
        if not written:
            return 0
        if written[0] < EEPROM_END or written[-1] >= FACTORY_AT:
            self._apply_settings()
        if TORQUE_AT in written:
            self._switch(memory.get("torque_enable"))
        if written[0] < LIMIT_END and written[-1] >= GOALS_AT:
            self.drive.apply_gains()
            self._command(GOAL_AT in written, goal)
        return 0

    def _command(self, new_goal: bool, goal_before: bytearray) -> None:
        """Follow new goals."""
        drive, memory = self.drive, self.memory
        if self.errors & OVERLOAD and memory.bytes[GOAL_AT:GOAL_END] != goal_before:
            ends = self.quirks.overload_ends
            ahead = self.memory.get("goal_position") - self.position_steps
            if ends == "new-goal" or (ends == "goal-away" and ahead * self._pushed < 0.0):
                self._end_overload()
        if new_goal and not drive.torque and self.quirks.goal == "torque-on":
            memory.set("torque_enable", 1)
            self._switch(1)
        drive.follow(new_goal)

    def _switch(self, value: int) -> None:
        """Switch the torque, or make the present position the centre."""
        drive = self.drive
        if value == SET_MIDDLE:
            self.memory.set("torque_enable", int(drive.torque))
            drive.calibrate(MIDDLE)
            return
        self._clear_error(CURRENT)
        if value == 0 and self.quirks.overload_ends != "restart":
            self._end_overload()
        unload = self.memory.get("unloading_condition")
        if self.errors & unload & ~OVERLOAD:
            self.memory.set("torque_enable", 0)
            value = 0
        drive.switch(value, self.quirks.torque_on == "present")
        self._calm = False

    def _end_overload(self) -> None:
        if self.errors & OVERLOAD:
            self._clear_error(OVERLOAD)
            self._protect()

    def _clear_error(self, bit: int) -> None:
        """Clear an error and reset the counts of its protection."""
        self.errors &= ~bit
        self.protection.restart()

    # --- external events

    def factory_reset(self, new_id: int | None = None) -> None:
        """Restore the factory settings of the EEPROM, except the id, and restart."""
        self.memory.factory_settings()
        if new_id is not None:
            self.memory.set_permanently("id", new_id)
        self.restart()

    def fail(self, error: str) -> str:
        """Trigger the overload protection, overheat the motor or break the angle sensor."""
        if error != "overheating":
            return super().fail(error)
        self.temperature_c = self.memory.get("temperature_limit") + TOO_HOT_C
        return f"has {self.temperature_c:g} degC"

    def reset_all(self) -> int:
        """Restore factory settings, id 1."""
        self.factory_reset(1)
        return 0
