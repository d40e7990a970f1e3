"""One emulated STS servo: what a write does, errors, restarts.

It moves when looked at: ``advance`` brings it up to a time, nothing runs by itself. Memory is
in sim_mock.feetech.memory, what turns the shaft in sts_motion, heat, load and voltage in
sts_protection, what documents leave open in sts_habits. What it does not do: reversed phases,
angle resolution (30), a blinking LED, backup (09).
"""

import struct

from drivers.feetech.memory_table import (
    BAUD_RATES,
    EEPROM_END,
    MODELS,
    RETURN_DELAY_UNIT_S,
    SET_MIDDLE,
)
from sim_mock.dynamixel.motor import long_pause
from sim_mock.feetech.memory import FeetechMemory
from sim_mock.feetech.motor import GOALS_AT, FeetechDrive
from sim_mock.feetech.packets import unsigned
from sim_mock.feetech.protection import ANGLE, CURRENT, LOOK_MS, OVERLOAD, FeetechProtection
from sim_mock.feetech.quirks import FeetechQuirks
from sim_mock.smart_servo.physics import Physics, ServoSpec, checked

REBOOT_MS = 800
MIDDLE = 2048
ADDRESS, FACTORY_AT = slice(5, 7), 80
TORQUE_AT, GOAL_AT, GOAL_END, GOALS_END, LIMIT_END = 40, 42, 44, 48, 50
SENSED_AT = 56
_SENSED = struct.Struct("<HHHBBBBBHH")
"""56 position, speed, load, voltage, temperature, registered, status, moving, target, current."""


class FeetechServo:
    """One servo on the chain. Its clock counts the chain's whole milliseconds.

    The spec's ``firmware`` is the number behind 3; its ``quirks`` are those of Dynamixel
    servos and mean nothing here.

    Raises:
        ValueError: there is no such model, or the spec's physics cannot exist.
    """

    def __init__(self, spec: ServoSpec, now_ms: int, quirks: FeetechQuirks) -> None:
        if spec.model not in MODELS:
            raise ValueError(f"model {spec.model!r}: STS servos are {', '.join(MODELS)}")
        self.model = MODELS[spec.model]
        self.firmware = spec.firmware
        physics = checked(Physics(*spec.physics))
        self.memory = FeetechMemory(self.model, spec.id, spec.firmware)
        seed = spec.id if spec.seed is None else spec.seed
        self.drive = FeetechDrive(self.memory, self.model, physics, float(spec.start_steps), seed)
        self.shaft = self.drive.shaft
        self.protection = FeetechProtection(self.model, physics, self.memory)
        self._ms = self._deaf_until_ms = now_ms
        self._look_ms = now_ms + LOOK_MS
        self.adopt(quirks)
        self._boot()

    def adopt(self, quirks: FeetechQuirks) -> None:
        """Do from now on what these quirks say."""
        self.quirks = quirks
        self.drive.timed(quirks.goal_time == "obey")

    def _boot(self) -> None:
        """Begin as after power-on: what was kept, and no torque."""
        self.memory.power_up()
        self._pending: tuple[int, bytes] | None = None
        self.protection.restart()
        self.drive.boot()
        self._remember()

    # --- time

    def advance(self, now_ms: int) -> bool:
        """Move on to now; gives whether it listens: it is deaf while it restarts."""
        if now_ms > self._ms:
            if self.shaft.quiet and now_ms < self._look_ms:
                self._ms = now_ms
            else:
                self._move(now_ms)
        return now_ms >= self._deaf_until_ms

    def _move(self, until_ms: int) -> None:
        """Move on; a long pause is passed at once, so that whoever asks then is answered."""
        pause_at_ms, pause_ms = long_pause(self._ms, until_ms, LOOK_MS)
        self._live_on(pause_at_ms)
        if pause_ms:
            self.shaft.skip(pause_ms)
            self._ms += pause_ms
            self._look_ms += pause_ms - LOOK_MS
            self._look(pause_ms // LOOK_MS)
            self._live_on(until_ms)

    def _live_on(self, until_ms: int) -> None:
        """Move on, and look at heat, load and voltage every 20 ms of its own time."""
        shaft = self.shaft
        while self._ms < until_ms:
            stop = min(until_ms, self._look_ms)
            shaft.run(stop - self._ms)
            self._ms = stop
            if stop == self._look_ms:
                self._look()
                if self._calm and shaft.quiet and until_ms > self._look_ms:
                    self._look_ms += (until_ms - self._look_ms) // LOOK_MS * LOOK_MS

    def _look(self, looks: int = 1) -> None:
        """Watch over itself: protect itself, restart where the voltage is gone."""
        self._look_ms += LOOK_MS
        shaft, protection = self.shaft, self.protection
        before, was = protection.temperature_c, protection.status
        protection.look(shaft.effort, shaft.volts, looks)
        self._calm = protection.temperature_c == before and protection.steady
        if protection.status != was:
            self._protect()
        if protection.browned_out(shaft.volts):
            self.restart()

    def _protect(self) -> None:
        """Do what Unload Conditions say: an overload lowers the torque, all else takes it."""
        drive = self.drive
        self._pushed = self.shaft.u
        wrong = self.protection.status & self.memory.get("unload_conditions")
        if wrong & ~OVERLOAD and drive.torque:
            self.memory.set("torque", 0)
            drive.switch(0, False)
        drive.most = self.memory.get("protective_torque") / 100.0 if wrong & OVERLOAD else 1.0
        drive.tune()

    # --- reading

    @property
    def id(self) -> int:
        """Give the id."""
        return self.memory.bytes[ADDRESS.start]

    @property
    def address(self) -> bytearray:
        """Give under what it is spoken to: id and baud rate as they are in the registers."""
        return self.memory.bytes[ADDRESS]

    @property
    def torque(self) -> bool:
        """Tell whether the torque is on."""
        return self.drive.torque

    @property
    def position_steps(self) -> float:
        """Give the true position of the shaft in the registers' terms, finer than they are."""
        return self.drive.position_steps

    @property
    def error(self) -> int:
        """Give the error byte that stands in every status."""
        return self.protection.status

    def read(self, address: int, length: int) -> bytes:
        """Give bytes of the memory; what is no register is 0."""
        if address < SENSED_AT + _SENSED.size and address + length > SENSED_AT:
            self._refresh()
        return self.memory.read(address, length)

    def _refresh(self) -> None:
        """Bring the registers that live up to date."""
        drive, protection = self.drive, self.protection
        sensed = drive.sensed(self._ms)
        volts = round(self.shaft.volts * self.model.rated_v * 10.0)
        _SENSED.pack_into(
            self.memory.bytes,
            SENSED_AT,
            unsigned(sensed.position, 15),
            unsigned(sensed.speed, 15),
            unsigned(sensed.load, 10),
            max(0, min(255, volts)),
            max(0, min(255, round(protection.temperature_c))),
            self._pending is not None,
            protection.status,
            drive.moving,
            unsigned(drive.target(), 15),
            unsigned(sensed.current, 15),
        )

    # --- writing

    def write(self, address: int, data: bytes) -> None:
        """Write bytes as an instruction does; nothing is ever refused."""
        memory, end = self.memory, address + len(data)
        goal = memory.bytes[GOAL_AT:GOAL_END]
        if GOALS_AT <= address < end <= GOALS_END:
            # The one write of every tick, the short way.
            memory.bytes[address:end] = data
            self._command(address < GOAL_END and end > GOAL_AT, goal)
            return
        written: list[int] = []
        memory.write(address, data, written.append)
        if not written:
            return
        if written[0] < EEPROM_END or written[-1] >= FACTORY_AT:
            self._remember()
        if TORQUE_AT in written:
            self._switch(memory.get("torque"))
        if written[0] < LIMIT_END and written[-1] >= GOALS_AT:
            self.drive.tune()
            self._command(GOAL_AT in written, goal)

    def _command(self, new_goal: bool, goal_before: bytearray) -> None:
        """Follow new goals."""
        drive, memory = self.drive, self.memory
        if self.error & OVERLOAD and memory.bytes[GOAL_AT:GOAL_END] != goal_before:
            self._goal_after_overload()
        if new_goal and not drive.torque and self.quirks.goal == "torque-on":
            memory.set("torque", 1)
            self._switch(1)
        drive.follow(new_goal)

    def _goal_after_overload(self) -> None:
        """Let a goal that is not the old one end the overload, where one does."""
        ends = self.quirks.overload_ends
        ahead = self.memory.get("goal_position") - self.position_steps
        if ends == "new-goal" or (ends == "goal-away" and ahead * self._pushed < 0.0):
            self._end_overload()

    def _switch(self, value: int) -> None:
        """Switch the torque, or make the present position the middle."""
        drive, protection = self.drive, self.protection
        if value == SET_MIDDLE:
            self.memory.set("torque", int(drive.torque))
            drive.calibrate(MIDDLE)
            return
        protection.end(CURRENT)
        if value == 0 and self.quirks.overload_ends != "restart":
            self._end_overload()
        unload = self.memory.get("unload_conditions")
        if protection.status & unload & ~OVERLOAD:
            self.memory.set("torque", 0)
            value = 0
        drive.switch(value, self.quirks.torque_on == "present")
        self._calm = False

    def _end_overload(self) -> None:
        if self.protection.status & OVERLOAD:
            self.protection.end(OVERLOAD)
            self._protect()

    def _remember(self) -> None:
        """Take over settings that have changed."""
        self._calm = False
        self.protection.settle()
        self.drive.settle()
        self.drive.follow()
        self._protect()

    # --- instructions

    def register(self, address: int, data: bytes) -> None:
        """Keep a write for Action; a later one takes its place."""
        self._pending = (address, data)

    def action(self) -> None:
        """Carry out the kept write, if there is one."""
        if self._pending is not None:
            (address, data), self._pending = self._pending, None
            self.write(address, data)

    def restart(self) -> None:
        """Restart by instruction or a dip of the supply: deaf for 0.8 s, then as at power-on."""
        self._deaf_until_ms = self._ms + REBOOT_MS
        self._boot()

    def factory_reset(self, new_id: int | None = None) -> None:
        """Put the EEPROM as it left the factory, all but the id, and restart."""
        self.memory.factory_settings()
        if new_id is not None:
            self.memory.keep("id", new_id)
        self.restart()

    # --- for the line

    @property
    def answers_all(self) -> bool:
        """Tell whether it answers more than ping and reads, by register 8."""
        return self.memory.get("status_level") != 0

    @property
    def baud(self) -> int:
        """Give bit/s by register 6; a new one acts after the status of its write has gone out."""
        return BAUD_RATES[self.memory.get("baud_rate")]

    @property
    def return_delay_s(self) -> float:
        """Give the pause before a status, by register 7."""
        return self.memory.get("return_delay") * RETURN_DELAY_UNIT_S

    # --- from outside

    def turn(self, steps: float) -> None:
        """Turn the joint by hand; under torque it fights back."""
        self.drive.turn(steps)

    def hold_fast(self, stuck: bool = True) -> None:
        """Jam the joint where it is, or free it."""
        self.shaft.hold_fast(stuck)

    def pull(self, load_nm: float) -> None:
        """Hang a constant torque on the joint, as a spring or a cable does, from now on."""
        self.shaft.pull(load_nm / self.model.stall_torque_nm)

    def trip(self) -> None:
        """Let the overload protection act now."""
        self.protection.status |= OVERLOAD
        self._protect()

    def lose_angle(self) -> None:
        """Let it find its angle sensor broken, until it restarts."""
        self.protection.status |= ANGLE
        self._protect()

    @property
    def supply_v(self) -> float:
        """Give the open-circuit voltage; far too little makes it restart again and again."""
        return self.shaft.supply * self.model.rated_v

    @supply_v.setter
    def supply_v(self, volts: float) -> None:
        self._calm = False
        self.shaft.feed(max(0.0, volts) / self.model.rated_v)

    @property
    def temperature_c(self) -> float:
        """Give the temperature of the motor; it drifts to what load and room make it."""
        return self.protection.temperature_c

    @temperature_c.setter
    def temperature_c(self, celsius: float) -> None:
        self._calm = False
        self.protection.temperature_c = celsius
