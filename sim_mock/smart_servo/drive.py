"""Common base of the part between an emulated smart servo's registers and its shaft."""

from abc import ABC, abstractmethod
from typing import Any

from gazerig.sim_mock.smart_servo.memory import ServoMemory
from gazerig.sim_mock.smart_servo.motor import ShaftMaker, create_shaft
from gazerig.sim_mock.smart_servo.physics import Motor, Physics, ServoSpec
from gazerig.sim_mock.smart_servo.profile import PositionProfile, SpeedProfile
from gazerig.sim_mock.smart_servo.quirks import LENGTH, SEED_APART_MS, noise_table


class Drive(ABC):
    """Modes, goals and origin of one servo.

    It reads the registers and never refuses a value: the servo decides which writes are permitted.

    Args:
        memory: memory of the servo.
        model: model of the servo.
        spec: specification of the servo.
        scale: steps of the registers per step of the shaft (4096 per turn).
        make_shaft: creates its shaft.

    Attributes:
        torque: whether it is switched on.
        mode: present operating mode.
        followed: address and bytes of the last write of goals, while repeating it would change
            nothing; None otherwise.
    """

    torque = False
    mode: int
    followed: tuple[int, bytes] | None = None

    def __init__(
        self,
        memory: ServoMemory[Any],
        model: Motor,
        spec: ServoSpec,
        scale: float = 1.0,
        make_shaft: ShaftMaker = create_shaft,
    ) -> None:
        physics = Physics(*spec.physics)
        self.memory = memory
        self.shaft = make_shaft(spec.id, model, physics, spec.start_steps / scale)
        seed = spec.id if spec.seed is None else spec.seed
        self._noise = noise_table(physics.noise_current, physics.noise_velocity)
        self._noise_from_ms = seed * SEED_APART_MS
        self.boot()

    @abstractmethod
    def boot(self) -> None:
        """Reset to power-on: torque off, position within one turn."""

    @abstractmethod
    def apply_settings(self) -> None:
        """Apply the present register values."""

    @property
    @abstractmethod
    def position_steps(self) -> float:
        """Return the true position of the shaft in the registers' unit, with fractions."""

    @abstractmethod
    def turn(self, steps: float) -> None:
        """Turn the joint by hand, in the registers' direction."""

    def _noise_now(self, now_ms: int) -> tuple[int, int]:
        """Return the noise of current and velocity while the shaft holds its position."""
        return self._noise[now_ms + self._noise_from_ms & LENGTH - 1]

    def _start_profile(self, by_speed: bool) -> None:
        """Start a profile, of speeds or of positions, at the shaft's position."""
        shaft = self.shaft
        shaft.start(SpeedProfile(shaft.x, shaft.v) if by_speed else PositionProfile(shaft.x))

    def _set_goal_here(self) -> None:
        """Set the goal position to the present position."""
        self.followed = None
        self.memory.set("goal_position", round(self.position_steps))
