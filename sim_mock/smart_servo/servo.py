"""Common base of emulated smart servos: registers and a shaft that advance on demand.

``advance`` brings a servo up to a time; nothing runs in the background. A make of servo adds the
effects of writing and reading its registers, and of errors.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from math import sin

from gazerig.robot.model.weight import AMBIENT_C
from gazerig.sim_mock.smart_servo.memory import ServoMemory
from gazerig.sim_mock.smart_servo.physics import (
    STEPS_PER_RAD,
    STEPS_PER_TURN,
    Motor,
    ServoSpec,
)
from gazerig.sim_mock.smart_servo.shaft import ShaftMaker, create_shaft

PING, READ, WRITE, REBOOT = 1, 2, 3, 8
"""Codes of the instructions for one servo that are common to all makes."""

RETURN_DELAY_UNIT_S = 2e-6
CHECK_MS = 20
"""Period of weight and protections, in the servo's own time: reading does not change them."""
LONGEST_MS = 10_000
"""Only the end of a longer time without a packet is simulated."""
OVERLOAD_SHARE, OVERLOAD_S = 0.8, 2.0
"""Share of the stall torque that latches an overload, and its duration; [A: in no data sheet]."""
Result = tuple[int, bytes]
"""Error number and parameters of an answer."""
VOLTAGE, HEAT, OVERLOAD = 1, 4, 32
"""Bits of the errors of the protections, as in the registers of all makes."""


class EmulatedServo(ABC):
    """One servo on the chain. Its clock counts the chain's whole milliseconds.

    The registers' position is (side * shaft.x + shift) * scale. A make sets ``baud_rates``, and
    ``present_input_voltage`` in its memory, before this class's constructor.

    Attributes:
        id: its address.
        errors: bits of its faults, as in their register.
        torque: whether it is switched on.
        baud_rates: bit/s by the value of their register.
        delay_s: its return delay.
        followed: address and bytes of the last write of goals, while repeating it would change
            nothing; None otherwise.
        on_address: called when id or baud rate have changed.
    """

    restart_ms: int
    """Time of a restart without answers, milliseconds."""
    read_level = 0
    answer_level = 1
    """Lowest Status Return Levels at which it answers reads, and all other instructions."""
    baud_rates: tuple[int, ...]
    group_reads, fast_reads = True, False
    """Whether it answers its part of a group read, and of a fast one."""

    def __init__(
        self,
        spec: ServoSpec,
        motor: Motor,
        memory: ServoMemory,
        now_ms: int,
        make_shaft: ShaftMaker = create_shaft,
        scale: float = 1.0,
    ) -> None:
        physics = spec.physics
        self.spec, self.memory = spec, memory
        self._scale = scale
        own = physics._replace(
            stop_low_steps=physics.stop_low_steps / scale,
            stop_high_steps=physics.stop_high_steps / scale,
        )
        self._gravity = physics.gravity_nm / motor.stall_torque_nm
        self._upright = physics.upright_steps / scale
        self._weight_rad = physics.gravity_turns / STEPS_PER_RAD
        self.shaft = make_shaft(spec.id, motor, own, spec.start_steps / scale)
        memory.set("present_temperature", round(AMBIENT_C))
        self.on_address: Callable[[], None] = lambda: None
        self._address = 0, 0
        self._ms = self._booted_ms = self._deaf_until_ms = now_ms
        self._check_ms = now_ms + CHECK_MS
        self._weigh()
        self._boot()

    def _boot(self) -> None:
        """Reset to power-on: torque off, position within one turn."""
        self.memory.power_up()
        self._watchdog_ms = self._heavy_checks = self.errors = 0
        self.torque = False
        self.followed: tuple[int, bytes] | None = None
        self.shaft.disable()
        self._wrap_to_one_turn()
        self._measure()
        self._apply_settings()

    def _apply_settings(self) -> None:
        """Apply settings that have changed."""
        get = self.memory.get
        self.followed = None
        self.id, self._status_level = get("id"), get("status_return_level")
        self.answers_groups = self.group_reads and self.answers_instruction(READ)
        self.answers_fast = self.fast_reads and self.answers_instruction(READ)
        self.delay_s = get("return_delay_time") * RETURN_DELAY_UNIT_S
        share, seconds = self._overload_limit()
        self._heavy_effort = share - 1e-11
        self._heavy_most = round(seconds * 1000.0 / CHECK_MS)
        self._set_controller()
        if self._address != (self.id, self.baud):
            self._address = self.id, self.baud
            self.on_address()

    def _overload_limit(self) -> tuple[float, float]:
        """Return the share of the stall torque that is an overload, and its duration in s."""
        return OVERLOAD_SHARE, OVERLOAD_S

    @abstractmethod
    def _set_controller(self) -> None:
        """Apply the registers of gains and limits to the shaft."""

    # --- time

    def advance(self, now_ms: int, fed_ms: int = 0) -> bool:
        """Advance to ``now_ms``; the last packet before was on the bus at ``fed_ms``.

        Return whether it receives bytes, which it does not do during a restart.
        """
        if now_ms > self._ms:
            if self._watchdog_ms and now_ms >= fed_ms + self._watchdog_ms and self.torque:
                self._run(max(self._ms, fed_ms + self._watchdog_ms))
                self._watchdog_ms = 0
                self._trip()
            if now_ms < self._check_ms:  # three of four times at 200 Hz
                if not self.shaft.quiet:
                    self.shaft.run(now_ms - self._ms)
                self._ms = now_ms
            else:
                self._run(now_ms)
        return now_ms >= self._deaf_until_ms

    def _run(self, until_ms: int) -> None:
        """Advance the shaft, and check its load every 20 ms."""
        shaft = self.shaft
        if until_ms - self._ms > LONGEST_MS:
            self._ms = until_ms - LONGEST_MS
            self._check_ms = self._ms + CHECK_MS
        while self._check_ms <= until_ms:
            if not shaft.quiet:
                shaft.run(self._check_ms - self._ms)
            self._ms = self._check_ms
            self._check_ms += CHECK_MS
            self._check()
        if until_ms > self._ms:
            if not shaft.quiet:
                shaft.run(until_ms - self._ms)
            self._ms = until_ms

    def _check(self) -> None:
        """Apply weight and protections. A heavy load is torque, not duty."""
        if self._gravity:
            self._weigh()
        effort = abs(self.shaft.effort)
        self._heavy_checks += 1
        if not effort or effort < self._heavy_effort:
            self._heavy_checks = 0
        bits = self._surroundings
        if self._heavy_checks >= self._heavy_most:
            bits |= OVERLOAD
        if bits or self.errors:
            self._protect_from(bits)

    def _weigh(self) -> None:
        """Apply the weight at the present position."""
        angle = (self.shaft.x - self._upright) * self._weight_rad
        self.shaft.set_weight(self._gravity * sin(angle))

    def _measure(self) -> None:
        """Update the errors of voltage and temperature."""
        get = self.memory.get
        low, high = get("min_voltage_limit"), get("max_voltage_limit")
        hot = get("present_temperature") > get("temperature_limit")
        out = not low <= get("present_input_voltage") <= high
        self._surroundings = out * VOLTAGE | hot * HEAT

    def restart(self) -> None:
        """Restart by instruction or after a dip of the supply; it receives nothing meanwhile."""
        self._booted_ms = self._ms
        self._deaf_until_ms = self._ms + self.restart_ms
        self._boot()

    def _trip(self) -> None:  # noqa: B027  # Feetech servos have no watchdog
        """Stop as the bus watchdog does."""

    @abstractmethod
    def _protect_from(self, bits: int) -> None:
        """React to the present errors of its protections."""

    # --- motion

    @property
    def position_steps(self) -> float:
        """Return the true position of the shaft in the registers' unit, with fractions."""
        return (self._side * self.shaft.x + self._shift) * self._scale

    def _wrap_to_one_turn(self) -> None:
        """Wrap the position of the shaft into one turn, as power-on does."""
        self._side, self._offset = self._origin()
        turns = int(self._side * self.shaft.x // STEPS_PER_TURN)
        self._shift = self._offset - turns * STEPS_PER_TURN

    @abstractmethod
    def _origin(self) -> tuple[int, int]:
        """Return the direction, 1 or -1, and the offset of the registers' position."""

    def _set_goal_here(self) -> None:
        """Set the goal position to the present position."""
        self.followed = None
        self.memory.set("goal_position", round(self.position_steps))

    def _switch(self, on: bool) -> None:
        """Switch the torque; a stored goal is followed immediately."""
        was, self.torque = self.torque, on
        if on and not was:
            self.shaft.start()
            self._heavy_checks = 0
        elif was and not on:
            self.shaft.disable()
        self.memory.set("torque_enable", int(on))
        self._apply_settings()
        if on and not was:
            self._follow()

    @abstractmethod
    def _follow(self) -> None:
        """Follow the goal registers."""

    # --- instructions

    def answers_instruction(self, code: int) -> bool:
        """Return whether it answers an instruction that addresses it alone."""
        if code == READ:
            return self._status_level >= self.read_level
        return code == PING or self._status_level >= self.answer_level

    def identity(self) -> bytes:
        """Return the parameters of the answer to a ping."""
        return b""

    @abstractmethod
    def read(self, address: int, length: int) -> Result:
        """Return bytes of the memory, or an error number."""

    @abstractmethod
    def write(self, address: int, data: bytes) -> int:
        """Write bytes as an instruction does; return the error number, 0 on success."""

    @property
    @abstractmethod
    def error_flag(self) -> int:
        """Return the bits in the error byte of every status."""

    @property
    def baud(self) -> int:
        """Return the register's bit/s; a new one is valid after the status of its write."""
        return self.baud_rates[self.memory.get("baud_rate")]

    def set_baud(self, baud: int) -> None:
        """Set its baud rate permanently.

        Raises:
            ValueError: it does not support this rate.
        """
        if baud not in self.baud_rates:
            known = ", ".join(map(str, self.baud_rates))
            raise ValueError(f"baud {baud}: {self.spec.model} supports {known}")
        self.memory.set_permanently("baud_rate", self.baud_rates.index(baud))
        self._apply_settings()

    # --- external events

    def report(self) -> dict[str, object]:
        """Return its state for ``status``."""
        return {
            "id": self.id,
            "model": self.spec.model,
            "position": round(self.position_steps),
            "goal": self.memory.get("goal_position"),
            "torque": int(self.torque),
            "error": self.errors,
        }

    def overload(self) -> None:
        """Trigger the overload protection."""
        self._protect_from(self.errors | OVERLOAD)

    def reset_all(self) -> None:
        """Restore factory settings, id 1, and restart."""
        self.memory.restore(eeprom=True)
        self.restart()

    def turn(self, steps: float) -> None:
        """Turn the joint by hand, in the registers' direction; under torque it resists."""
        self.shaft.turn(self._side * steps / self._scale)

    def jam(self, stuck: bool = True) -> None:
        """Jam the joint at its position, or free it."""
        self.shaft.jam(stuck)

    def sense(self, what: str, value: float) -> None:
        """Set a sensor's register, ``input_voltage`` (0.1 V) or ``temperature`` (degC)."""
        self.memory.set(f"present_{what}", round(value))
        self._measure()
