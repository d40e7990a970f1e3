"""What every emulated smart servo has between its registers and its shaft."""

from abc import ABC, abstractmethod
from typing import Any, NamedTuple

from gazerig.sim_mock.smart_servo.memory import ServoMemory
from gazerig.sim_mock.smart_servo.motor import Motor, Shaft
from gazerig.sim_mock.smart_servo.physics import Physics, ServoSpec
from gazerig.sim_mock.smart_servo.profile import PositionProfile, SpeedProfile


class Noise(NamedTuple):
    """Seed and largest flicker of current and velocity, in register units."""

    seed: int
    current: int
    velocity: int


class Drive(ABC):
    """Modes, goals and origin of one servo.

    It reads the registers and never refuses anything: what may be written is decided elsewhere.

    Args:
        memory: of the servo.
        model: of the servo.
        spec: of the servo.
        scale: steps of the registers for one of the 4096 steps of the shaft's turn.

    Attributes:
        torque: whether it is switched on.
        mode: operating mode in force.
        followed, followed_at: the last write of goals and its address, while the same bytes
            again would change nothing; empty otherwise.
    """

    torque = False
    mode: int
    followed = b""
    followed_at = 0

    def __init__(
        self, memory: ServoMemory[Any], model: Motor, spec: ServoSpec, scale: float = 1.0
    ) -> None:
        physics = Physics(*spec.physics)
        self.memory = memory
        self.shaft = Shaft(model, physics, spec.start_steps / scale)
        seed = spec.id if spec.seed is None else spec.seed
        self._noise = Noise(seed, physics.noise_current, physics.noise_velocity)
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
        """Return the true position of the shaft in the registers' terms, finer than they are."""

    @abstractmethod
    def turn(self, steps: float) -> None:
        """Turn the joint by hand, in the registers' direction."""

    def _lead_from_here(self, by_speed: bool) -> None:
        """Start a profile, of speeds or of positions, at the shaft's position."""
        shaft = self.shaft
        shaft.start(SpeedProfile(shaft.x, shaft.v) if by_speed else PositionProfile(shaft.x))

    def _set_goal_here(self) -> None:
        """Make the goal position the present one."""
        self.followed = b""
        self.memory.set("goal_position", round(self.position_steps))
