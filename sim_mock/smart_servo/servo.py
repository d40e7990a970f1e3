"""What every emulated smart servo is: a memory and a motor that live when looked at.

``advance`` brings it up to a time, nothing runs by itself. A make of servo adds what its
registers do when they are written and read, and what follows from an error.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Protocol

from gazerig.sim_mock.smart_servo.motor import Motor, Shaft, long_pause
from gazerig.sim_mock.smart_servo.physics import Physics, ServoSpec
from gazerig.sim_mock.smart_servo.protection import LOOK_MS, Limits, Protection


class Model(Motor, Protocol):
    """What must be known of a model of servo."""

    @property
    def name(self) -> str:
        """Return its name in a rig file."""
        ...


class Drive(Protocol):
    """What turns the shaft by the registers."""

    torque: bool
    shaft: Shaft

    @property
    def position_steps(self) -> float:
        """Return the true position of the shaft in the registers' terms, finer than they are."""
        ...

    def turn(self, steps: float) -> None:
        """Turn the joint by hand, in the registers' direction."""
        ...


class Memory(Protocol):
    """The registers as numbers."""

    def get(self, name: str) -> int:
        """Return a register's value."""
        ...


class SmartServo(ABC):
    """One servo on the chain. Its clock counts the chain's whole milliseconds.

    id: what it is spoken to by
    errors: bits of what is wrong, as in the register that tells them
    model, memory, drive: set by a make before this class's constructor
    on_address: called when id, baud rate or return delay are other than before
    """

    restart_ms: int
    """So long it is deaf while it restarts."""
    model: Model
    memory: Memory
    drive: Drive
    id: int
    answers_reads = True
    """Whether it answers more than a ping."""
    shadow_id: int | None = None
    """An id under which it carries out writes to RAM and never answers."""

    def __init__(self, spec: ServoSpec, physics: Physics, limits: Limits, now_ms: int) -> None:
        self.firmware = spec.firmware
        self.shaft = self.drive.shaft
        self.protection = Protection(self.model, physics, limits)
        self.errors = 0
        self.on_address: Callable[[], None] = lambda: None
        self._address: object = None
        self._pending: tuple[int, bytes] | None = None
        self._calm = False
        self._watchdog_ms = 0
        self._ms = self._booted_ms = self._deaf_until_ms = now_ms
        self._look_ms = now_ms + LOOK_MS

    # --- time

    def advance(self, now_ms: int, fed_ms: int = 0) -> bool:
        """Move on to now; the last packet before that was on the bus at ``fed_ms``.

        Return whether it listens: it is deaf while it restarts.
        """
        ahead = now_ms - self._ms
        if ahead > 0:
            if self._watchdog_ms and self.torque and now_ms >= fed_ms + self._watchdog_ms:
                self._trip(max(0, fed_ms + self._watchdog_ms - self._ms))
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
        before_c = protection.temperature_c
        bits = protection.look(shaft.effort, shaft.volts, looks)
        self._calm = protection.temperature_c == before_c and protection.steady
        self._protect_from(bits)
        if protection.browned_out(shaft.volts):
            self.restart()

    def restart(self) -> None:
        """Restart by instruction or a dip of the supply: deaf for a while, then as at power-on."""
        self._booted_ms = self._ms
        self._deaf_until_ms = self._ms + self.restart_ms
        self._boot()

    def _trip(self, after_ms: int) -> None:
        """Stop as a bus watchdog does, so many milliseconds from where its clock stands."""
        raise NotImplementedError

    @abstractmethod
    def _boot(self) -> None:
        """Begin as after power-on."""

    @abstractmethod
    def _protect_from(self, bits: int) -> None:
        """Do what follows from what its protection finds wrong now."""

    def _announce(self) -> None:
        """Tell the chain where it listens or answers otherwise than before."""
        address = self.id, self.baud, self.return_delay_s, self.shadow_id
        if address != self._address:
            self._address = address
            self.on_address()

    # --- for the line

    @property
    @abstractmethod
    def error_flag(self) -> int:
        """What stands in the error byte of every status."""

    @property
    @abstractmethod
    def baud(self) -> int:
        """Bit/s by its register; a new one acts after the status of its write has gone out."""

    @property
    @abstractmethod
    def return_delay_s(self) -> float:
        """The pause before a status, by its register."""

    @abstractmethod
    def read(self, address: int, length: int) -> bytes | None:
        """Return bytes of the memory, None where an address is not defined."""

    @abstractmethod
    def write(self, address: int, data: bytes) -> int:
        """Write bytes as an instruction does; return the error number, 0 when done."""

    # --- from outside

    @property
    def torque(self) -> bool:
        """True if the torque is on."""
        return self.drive.torque

    @property
    def position_steps(self) -> float:
        """True position of the shaft in the registers' terms, finer than they are."""
        return self.drive.position_steps

    def report(self) -> dict[str, object]:
        """Return its state, as ``status`` tells it."""
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
        """Voltage at the servo, in 0.1 V."""
        return round(self.shaft.volts * self.model.rated_v * 10.0)

    @abstractmethod
    def fail(self, error: str) -> str:
        """Let an error arise by name, as the servo's own protection would; return what it does.

        Raises:
            ValueError: there is no such error.
        """

    @abstractmethod
    def reset_all(self) -> int:
        """Be as from the factory, id 1; return the error number, 0 when done."""

    def turn(self, steps: float) -> None:
        """Turn the joint by hand, in the registers' direction; under torque it fights back."""
        self.drive.turn(steps)

    def hold_fast(self, stuck: bool = True) -> None:
        """Jam the joint where it is, or free it."""
        self.shaft.hold_fast(stuck)

    def pull(self, load_nm: float) -> None:
        """Hang a constant torque on the joint, as a spring or a cable does, from now on."""
        self.shaft.pull(load_nm / self.model.stall_torque_nm)

    @property
    def supply_v(self) -> float:
        """Open-circuit voltage; far too little makes it restart again and again."""
        return self.shaft.supply * self.model.rated_v

    @supply_v.setter
    def supply_v(self, volts: float) -> None:
        self._calm = False
        self.shaft.feed(max(0.0, volts) / self.model.rated_v)

    @property
    def temperature_c(self) -> float:
        """Temperature of the motor; it drifts to what load and room make it."""
        return self.protection.temperature_c

    @temperature_c.setter
    def temperature_c(self, celsius: float) -> None:
        self._calm = False
        self.protection.temperature_c = celsius

    @property
    def ambient_c(self) -> float:
        """Temperature around the servo."""
        return self.protection.ambient_c

    @ambient_c.setter
    def ambient_c(self, celsius: float) -> None:
        self._calm = False
        self.protection.ambient_c = celsius
