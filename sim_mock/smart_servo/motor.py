"""The shaft of an emulated servo: controller, motor, friction, stops, play.

Readings do not depend on how often they are taken.
"""

from collections.abc import Callable

from gazerig.sim_mock.smart_servo.integration import ShaftMotion
from gazerig.sim_mock.smart_servo.physics import (
    DISABLED,
    MS_S,
    Loop,
    Motor,
    Physics,
    is_linear,
    mechanics_of,
)
from gazerig.sim_mock.smart_servo.profile import PositionProfile

LEAST_WEIGHT = 1e-4
"""Smallest change of the weight that counts, so that a shaft at rest remains so."""


class Shaft(ShaftMotion):
    """Position and speed of one output shaft, advanced in whole milliseconds."""

    __slots__ = ("_held", "_pace", "_low_high", "_set_load", "_weight")

    def __init__(self, model: Motor, physics: Physics, position_steps: float) -> None:
        self._built = mechanics_of(model, physics)
        self._set_load, self._weight = physics.load_nm / model.stall_torque_nm, 0.0
        self._constant = self._load = self._built.accel * self._set_load
        self._heavy = self._built.gravity != 0.0
        self._low_high = physics.stop_low_steps, physics.stop_high_steps
        self._low, self._high = self._low_high
        self.supply = self.volts = (physics.supply_v or model.rated_v) / model.rated_v
        self._loop = DISABLED
        self._linear = False
        self._span_start = None
        self._weights = {}
        self._held, self._pace = False, (0.0, 0.0)
        self.profile = PositionProfile(position_steps)
        self.place(position_steps)

    # --- external events

    def resume(self) -> None:
        """Continue from the present state after any change, including the profile's."""
        self.quiet = False
        self._since_ms = 0

    def place(self, position_steps: float) -> None:
        """Place the shaft at rest between its stops; profile and controller continue from there."""
        x = min(max(float(position_steps), self._low_high[0]), self._low_high[1])
        self.x = self.joint = x
        self.v = self._rv = self.u = self.effort = self._integral = 0.0
        if isinstance(self.profile, PositionProfile):
            self.profile.rest(x)
        if self._held:
            self.jam(True)
        self.resume()

    def turn(self, steps: float) -> None:
        """Turn the shaft by hand, up to its stops; the controller remains active."""
        self.x = min(max(self.x + steps, self._low), self._high)
        self.resume()

    def jam(self, stuck: bool) -> None:
        """Jam the joint at its position, or free it."""
        self._held = stuck
        self._low, self._high = (self.x, self.x) if stuck else self._low_high
        self.resume()

    def set_load(self, share: float) -> None:
        """Set the constant torque on the joint as a share of the stall torque."""
        self._set_load = share
        self._change_load()

    def set_weight(self, share: float) -> None:
        """Set the torque of the weight on the joint as a share of the stall torque."""
        if abs(share - self._weight) > LEAST_WEIGHT:
            self._weight = share
            self._change_load()

    def _change_load(self) -> None:
        self._constant = self._load = self._built.accel * (self._set_load + self._weight)
        self.resume()

    def feed(self, supply: float) -> None:
        """Set the open-circuit voltage as a share of the rated one."""
        self.supply = self.volts = supply
        self.resume()

    # --- calls of the servo

    def drive(self, loop: Loop) -> None:
        """Apply controller settings."""
        if loop != self._loop:
            self._loop = loop
            self._linear = is_linear(loop)
            self._weights = {}
            self._integral = max(-loop.u_max, min(loop.u_max, self._integral))
            self.resume()

    def start(self) -> None:
        """Switch on with an empty integrator."""
        self.profile = PositionProfile(self.x)
        self._rv = self._integral = 0.0
        self.resume()

    def lead_to(self, goal: float, cruise: float, ramp: float) -> None:
        """Lead to a goal; an equal one changes nothing."""
        profile = self.profile
        if isinstance(profile, PositionProfile) and (
            goal != profile.goal or (cruise, ramp) != self._pace
        ):
            self._pace = cruise, ramp
            profile.plan_by_velocity(goal, cruise, ramp)
            self.resume()

    def hold(self) -> None:
        """Stop at the present position."""
        if isinstance(self.profile, PositionProfile):
            self.profile.rest(self.x)
        self.resume()

    @property
    def goal(self) -> float:
        """Return the end of the profile."""
        return self.profile.goal

    @property
    def led(self) -> bool:
        """Return whether the profile has not reached its end."""
        return self.profile.running

    @property
    def r(self) -> float:
        """Return the profile's position."""
        return self.profile.r

    @property
    def r_v(self) -> float:
        """Return the profile's speed."""
        return self.profile.v

    def disable(self) -> None:
        """Switch off: the motor has no current and does not brake."""
        self.drive(DISABLED)
        self.profile = PositionProfile(self.x)
        self.u = self.effort = self._integral = 0.0
        self.resume()

    def skip(self, ticks: int) -> None:
        """Skip a long time: the shaft moves as far as its profile, between its stops.

        A shaft that is not at rest after seconds without a packet follows a slow profile, turns
        permanently, or oscillates around its goal; the last does not change.
        """
        if self.quiet or ticks <= 0:
            return
        self._since_ms = 0
        before = self.profile.r
        self.profile.skip(ticks)
        moved = self.profile.r - before
        if self._loop.bias:  # without feedback: it keeps its speed
            moved = self.v * ticks
        self.x = min(max(self.x + moved, self._low), self._high)
        play = self._built.play
        self.joint = min(max(self.joint, self.x - play), self.x + play)

    @property
    def speed_steps_s(self) -> float:
        """Return the speed of the shaft."""
        return self.v / MS_S


ShaftMaker = Callable[[int, Motor, Physics, float], Shaft]
"""Creates the shaft of a servo from its id, motor, physics and first position in steps."""


def create_shaft(servo_id: int, model: Motor, physics: Physics, position_steps: float) -> Shaft:
    """Return an independent shaft: only its own load acts on it."""
    return Shaft(model, physics, position_steps)
