"""Common base of emulated smart servos: registers and a motor that advance on demand.

``advance`` brings a servo up to a time; nothing runs in the background. A make of servo adds the
effects of writing and reading its registers, and of errors.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Protocol

from gazerig.sim_mock.smart_servo.drive import Drive
from gazerig.sim_mock.smart_servo.framing import PING, READ, REBOOT
from gazerig.sim_mock.smart_servo.memory import ServoMemory
from gazerig.sim_mock.smart_servo.physics import Motor, Physics, ServoSpec, check_physics
from gazerig.sim_mock.smart_servo.protection import CHECK_MS, Limits, ServoProtection
from gazerig.sim_mock.smart_servo.quirks import PAUSE_MS, long_pause

RETURN_DELAY_UNIT_S = 2e-6


class ServoModel(Motor, Protocol):
    """Data of a servo model."""

    @property
    def name(self) -> str:
        """Return its name in a rig file."""
        ...


class EmulatedServo(ABC):
    """One servo on the chain. Its clock counts the chain's whole milliseconds.

    A make sets ``model``, ``memory``, ``drive`` and ``baud_rates`` before this class's constructor.

    Attributes:
        id: its address.
        errors: bits of its faults, as in their register.
        baud_rates: bit/s by the value of their register.
        on_address: called when id, baud rate or return delay have changed.

    Raises:
        ValueError: the spec's physics cannot exist.
    """

    restart_ms: int
    """Time of a restart without answers, milliseconds."""
    unreadable = 0
    """Error number of a read of an undefined address."""
    none_registered = 0
    """Error number of an Action without a stored write."""
    read_level = 0
    answer_level = 1
    """Lowest Status Return Levels at which it answers reads, and all other instructions."""
    mute_reboot = False
    """Whether it restarts without an answer."""
    error_bits: ClassVar[Mapping[str, int]]
    """Bits of the errors that can be triggered, by name."""
    model: ServoModel
    memory: ServoMemory[Any]
    drive: Drive
    baud_rates: tuple[int, ...]
    id: int
    answers_groups = True
    """Whether it answers its part of a group read."""
    stale_surroundings = True
    """Whether voltage and temperature were measured again since their registers were read."""
    shadow_id: int | None = None
    """An id under which it executes writes to RAM and never answers."""

    def __init__(self, spec: ServoSpec, now_ms: int) -> None:
        self._physics = check_physics(Physics(*spec.physics))
        self.firmware = spec.firmware
        self.shaft = self.drive.shaft
        self.protection = ServoProtection(self.model, self._physics, self._limits())
        self.on_address: Callable[[], None] = lambda: None
        self._address: object = None
        self._ms = self._booted_ms = self._deaf_until_ms = now_ms
        self._check_ms = now_ms + CHECK_MS
        self._boot()

    def _boot(self) -> None:
        """Reset to power-on."""
        self.memory.power_up()
        self._pending: tuple[int, bytes] | None = None
        self._watchdog_ms = 0
        self._measure_surroundings()
        self.errors = 0
        self.protection.restart()
        self.drive.boot()
        self._apply_settings()

    def _apply_settings(self) -> None:
        """Apply settings that have changed."""
        get = self.memory.get
        self._calm = False
        self.id = get("id")
        self.status_level = get("status_return_level")
        self.answers_groups = self.status_level >= self.read_level
        self.protection.limits = self._limits()
        self.drive.apply_settings()
        address = self.id, self.baud, self.return_delay_s, self.shadow_id
        if address != self._address:
            self._address = address
            self.on_address()

    def _limits(self) -> Limits:
        """Return its protection limits from its registers."""
        get = self.memory.get
        return Limits(
            get("temperature_limit"),
            get("max_voltage_limit"),
            get("min_voltage_limit"),
            *self._load_limits(),
        )

    # --- time

    def advance(self, now_ms: int, fed_ms: int = 0) -> bool:
        """Advance to ``now_ms``; the last packet before was on the bus at ``fed_ms``.

        Return whether it receives bytes, which it does not do during a restart.
        """
        ahead = now_ms - self._ms
        if ahead > 0:
            if self._watchdog_ms and now_ms >= fed_ms + self._watchdog_ms and self.torque:
                self._trip(max(0, fed_ms + self._watchdog_ms - self._ms))
            if now_ms < self._check_ms:
                if not self.shaft.quiet:
                    self.shaft.run(now_ms - self._ms)
                self._ms = now_ms
            elif ahead < PAUSE_MS:
                self._run_until(now_ms)
            else:
                self._move(now_ms)
        return now_ms >= self._deaf_until_ms

    def _move(self, until_ms: int) -> None:
        """Advance; the middle of a long pause is skipped, so that answers are not delayed."""
        pause_at_ms, pause_ms = long_pause(self._ms, until_ms, CHECK_MS)
        self._run_until(pause_at_ms)
        if pause_ms:
            self.shaft.skip(pause_ms)
            self._ms += pause_ms
            self._check_ms += pause_ms - CHECK_MS
            self._check(pause_ms // CHECK_MS)
            self._run_until(until_ms)

    def _run_until(self, until_ms: int) -> None:
        """Advance, and check heat, load and voltage every 20 ms of its own time."""
        shaft = self.shaft
        while self._ms < until_ms:
            stop = min(until_ms, self._check_ms)
            shaft.run(stop - self._ms)
            self._ms = stop
            if stop == self._check_ms:
                self._check()
                if self._calm and shaft.quiet and until_ms > self._check_ms:
                    self._check_ms += (until_ms - self._check_ms) // CHECK_MS * CHECK_MS

    def _check(self, checks: int = 1) -> None:
        """Apply the protections; restart if the voltage is too low."""
        self._check_ms += CHECK_MS
        shaft, protection = self.shaft, self.protection
        before_c = protection.temperature_c
        bits = protection.check(shaft.effort, shaft.volts, checks)
        self._calm = protection.temperature_c == before_c and protection.is_steady
        self._measure_surroundings()
        if bits or self.errors:
            self._protect_from(bits)
        if protection.is_browned_out(shaft.volts):
            self.restart()

    def _measure_surroundings(self) -> None:
        """Measure voltage and temperature, every 20 ms."""
        self._measured = self.shaft.volts, self.protection.temperature_c
        self.stale_surroundings = True

    def restart(self) -> None:
        """Restart by instruction or after a dip of the supply; it receives nothing meanwhile."""
        self._booted_ms = self._ms
        self._deaf_until_ms = self._ms + self.restart_ms
        self._boot()

    def _trip(self, after_ms: int) -> None:
        """Trip the bus watchdog, once, after a time from the servo's present time."""
        self._move(self._ms + after_ms)
        self._watchdog_ms = 0

    @abstractmethod
    def _protect_from(self, bits: int) -> None:
        """React to the present errors of its protections."""

    @abstractmethod
    def _load_limits(self) -> tuple[float, ...]:
        """Return the overload's share and time, and the current's if it has them."""

    # --- instructions

    def answers_instruction(self, code: int) -> bool:
        """Return whether it answers an instruction that addresses it alone."""
        if code == REBOOT and self.mute_reboot:
            return False
        needed = 0 if code == PING else self.read_level if code == READ else self.answer_level
        return self.status_level >= needed

    def identity(self) -> bytes:
        """Return the parameters of the answer to a ping."""
        return b""

    @abstractmethod
    def read(self, address: int, length: int) -> bytes | None:
        """Return bytes of the memory, None if an address is not defined."""

    @abstractmethod
    def write(self, address: int, data: bytes) -> int:
        """Write bytes as an instruction does; return the error number, 0 on success."""

    def store_write(self, address: int, data: bytes) -> int:
        """Store a write for Action; a later one replaces it. Return the error number."""
        self._pending = (address, data)
        self.memory.set("registered_instruction", 1)
        return 0

    def action(self) -> int:
        """Execute the stored write; return the error number."""
        if self._pending is None:
            return self.none_registered
        (address, data), self._pending = self._pending, None
        self.memory.set("registered_instruction", 0)
        return self.write(address, data)

    # --- for the line

    @property
    @abstractmethod
    def error_flag(self) -> int:
        """Return the bits in the error byte of every status."""

    @property
    def baud(self) -> int:
        """Return the register's bit/s; a new one is valid after the status of its write."""
        return self.baud_rates[self.memory.get("baud_rate")]

    @property
    def return_delay_s(self) -> float:
        """Return the register's pause before a status."""
        return self.memory.get("return_delay_time") * RETURN_DELAY_UNIT_S

    def set_baud(self, baud: int) -> None:
        """Set its baud rate permanently.

        Raises:
            ValueError: it does not support this rate.
        """
        if baud not in self.baud_rates:
            known = ", ".join(map(str, self.baud_rates))
            raise ValueError(f"baud {baud}: {self.model.name} supports {known}")
        self.memory.set_permanently("baud_rate", self.baud_rates.index(baud))
        self._apply_settings()

    # --- external events

    @property
    def torque(self) -> bool:
        """Return whether the torque is on."""
        return self.drive.torque

    @property
    def position_steps(self) -> float:
        """Return the true position of the shaft in the registers' unit, with fractions."""
        return self.drive.position_steps

    def report(self) -> dict[str, object]:
        """Return its state for ``status``."""
        return {
            "id": self.id,
            "model": self.model.name,
            "position": round(self.position_steps),
            "goal": self.memory.get("goal_position"),
            "torque": int(self.torque),
            "error": self.errors,
            "temperature_c": round(self.temperature_c),
            "voltage_01v": self.voltage_01v,
        }

    @property
    def voltage_01v(self) -> int:
        """Return the last measured voltage at the servo, in 0.1 V."""
        return round(self._measured[0] * self.model.rated_v * 10.0)

    @property
    def warmth_c(self) -> int:
        """Return the last measured temperature of the motor, as registers contain it."""
        return max(0, min(255, round(self._measured[1])))

    def fail(self, error: str) -> str:
        """Trigger an error by name, as the servo's own protection does; return its effect.

        Raises:
            ValueError: the error is unknown.
        """
        if error not in self.error_bits:
            raise ValueError(f"error {error!r}: expected {', '.join(self.error_bits)}")
        self._protect_from(self.errors | self.error_bits[error])
        return f"protects itself: {error}"

    @abstractmethod
    def reset_all(self) -> int:
        """Restore factory settings, id 1; return the error number, 0 on success."""

    def turn(self, steps: float) -> None:
        """Turn the joint by hand, in the registers' direction; under torque it resists."""
        self.drive.turn(steps)

    def jam(self, stuck: bool = True) -> None:
        """Jam the joint at its position, or free it."""
        self.shaft.jam(stuck)

    def set_load(self, load_nm: float) -> None:
        """Apply a constant torque to the joint from now on, as a cable does."""
        self.shaft.set_load(load_nm / self.model.stall_torque_nm)

    @property
    def supply_v(self) -> float:
        """Return the open-circuit voltage; far too low, it makes the servo restart repeatedly."""
        return self.shaft.supply * self.model.rated_v

    @supply_v.setter
    def supply_v(self, volts: float) -> None:
        self._calm = False
        self.shaft.feed(max(0.0, volts) / self.model.rated_v)
        self._measure_surroundings()

    @property
    def temperature_c(self) -> float:
        """Return the temperature of the motor, which approaches that of load and surroundings."""
        return self.protection.temperature_c

    @temperature_c.setter
    def temperature_c(self, celsius: float) -> None:
        self._calm = False
        self.protection.temperature_c = celsius
        self._measure_surroundings()

    @property
    def ambient_c(self) -> float:
        """Return the temperature around the servo."""
        return self.protection.ambient_c

    @ambient_c.setter
    def ambient_c(self, celsius: float) -> None:
        self._calm = False
        self.protection.ambient_c = celsius
