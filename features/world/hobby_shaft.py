"""A hobby servo with the mechanics of a world: pulses in, torque within its data sheet's out."""

from math import inf
from typing import NamedTuple

from gazerig.features.world.shaft import ShaftAxis, WorldShaft
from gazerig.sim_mock.hobby_servo import HobbyServo, HobbySpec
from gazerig.sim_mock.smart_servo.physics import STEPS_PER_TURN, Loop, Physics
from gazerig.sim_mock.smart_servo.profile import PositionProfile

PHYSICS = Physics(rotor_s=0.008, coulomb_share=0.04, viscous_share=0.0, supply_ohm=0.0)
"""A small motor that reaches full speed in 8 ms without a load; friction of cheap gears [A]. The
supply is a battery of unknown resistance."""

DAMPING = 1.0
"""Share of the duty that its controller takes back at full speed, so that a load overshoots only a
little [A]."""

REST_STEPS_MS = 1e-3
"""Speed below which it counts as resting."""


class HobbyMotor(NamedTuple):
    """Motor and gear of a hobby servo."""

    stall_torque_nm: float
    no_load_rpm: float
    stall_current_a: float = 0.0
    rated_v: float = 5.0


class DeadBandShaft(WorldShaft):
    """A shaft that ignores small errors."""

    __slots__ = ("dead",)

    dead: float

    def _error(self, r: float) -> float:
        """Return the position error, 0 within the dead band."""
        error = r - self.x
        return 0.0 if -self.dead <= error <= self.dead else error


class WorldHobbyServo(HobbyServo):
    """One servo and the joint it moves, in a world.

    Args:
        spec: its speed, lag, dead band and torque; the world has its start and stops.
        axis: its shaft in the world.
        steps_per_turn: quarter microseconds of a whole turn.

    Attributes:
        shaft: the shaft that the world moves.
    """

    def __init__(self, spec: HobbySpec, axis: ShaftAxis, steps_per_turn: float) -> None:
        self._unit = STEPS_PER_TURN / steps_per_turn
        motor = HobbyMotor(spec.stall_torque_nm, 60.0 * spec.speed_steps_s / steps_per_turn)
        self.shaft = DeadBandShaft(motor, PHYSICS, axis)
        self.shaft.dead = spec.dead_steps * self._unit
        top = spec.speed_steps_s * self._unit / 1000.0
        lag_ms = max(1.0, spec.lag_s * 1000.0)
        self._loop = Loop(p=(1.0 + DAMPING) / (lag_ms * top), d=DAMPING / top, torque_max=inf)
        self._width, self._stuck = 0, False
        super().__init__(spec)

    @property
    def place_steps(self) -> float:
        """Return the position of its shaft."""
        return self.shaft.axis.position() / self._unit

    @place_steps.setter
    def place_steps(self, steps: float) -> None:
        """Do nothing: the world already has its position."""

    @property
    def width_steps(self) -> int:
        """Return the width of the received pulses, 0 without pulses."""
        return self._width

    @width_steps.setter
    def width_steps(self, steps: int) -> None:
        if steps == self._width:
            return
        was, self._width = self._width, steps
        if not steps:
            self.shaft.disable()
            return
        profile = PositionProfile(self.shaft.x)
        profile.rest(steps * self._unit)
        if not was:
            self.shaft.start(profile)
        self.shaft.profile = profile
        self.shaft.drive(self._loop)

    @property
    def stuck(self) -> bool:
        """Return whether it is jammed."""
        return self._stuck

    @stuck.setter
    def stuck(self, stuck: bool) -> None:
        if stuck != self._stuck:
            self._stuck = stuck
            self.shaft.jam(stuck)

    @property
    def resting(self) -> bool:
        """Return whether it does not move."""
        return -REST_STEPS_MS < self.shaft.v < REST_STEPS_MS

    def step(self) -> None:
        """Do nothing: the world moves it."""

    def turn(self, steps: float) -> None:
        """Turn it by hand, as far as its joint's stops allow.

        Raises:
            ValueError: it is stuck.
        """
        if self.stuck:
            raise ValueError(f"channel {self.spec.channel} is stuck; free it first")
        self.shaft.turn(steps * self._unit)
