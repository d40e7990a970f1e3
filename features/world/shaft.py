"""The shaft of an emulated servo whose mechanics are the world's: its control loop moves a joint.

Registers, modes, profiles and protections stay those of the servo. Each millisecond its control
loop makes a torque of the shaft's position; what depends on the speed at the millisecond's end,
which is D, part of P and what the turning motor induces, goes into MuJoCo's implicit step. So the
equations are those of ``ShaftMotion``, with the world's inertia, gravity, contacts and stops.
Left out: play between shaft and joint.
"""

from math import inf, pi

from gazerig.features.world.shaft_axis import ShaftAxis
from gazerig.sim_mock.smart_servo.controller import (
    DISABLED,
    MS_S,
    STEPS_PER_RAD,
    Loop,
    Motor,
)
from gazerig.sim_mock.smart_servo.integration import RESOLUTION, SLOWEST
from gazerig.sim_mock.smart_servo.motor import Shaft
from gazerig.sim_mock.smart_servo.physics import Physics
from gazerig.sim_mock.smart_servo.profile import PositionProfile
from gazerig.sim_mock.smart_servo.span import SMOOTHING

SPEED_UNIT = STEPS_PER_RAD * MS_S
"""Steps/ms of a radian a second."""


Effort = tuple[float, float, float, float]
"""What an actuator does in the next millisecond: a torque and a gain on the shaft's speed, whose
sum acts within a lowest and a highest torque; Nm, and Nm a rad/s."""
LIMP: Effort = (0.0, 0.0, 0.0, 0.0)


class WorldShaft(Shaft):
    """A shaft whose position and speed are the world's.

    Args:
        model: motor and gear.
        physics: friction of the gear, rotor, supply; inertia, stops and gravity are the world's.
        axis: the shaft in the world.
    """

    __slots__ = (
        "_free_nm_s",
        "_induced_nm_s",
        "_least",
        "_most",
        "_off",
        "_profiled",
        "_stall_nm",
        "axis",
    )

    def __init__(self, model: Motor, physics: Physics, axis: ShaftAxis) -> None:
        self.axis = axis
        stall = self._stall_nm = model.stall_torque_nm
        top_rad_s = model.no_load_rpm * pi / 30.0
        self._free_nm_s = stall * physics.viscous_share / top_rad_s
        self._least = self._most = 0.0
        self._off = True
        self._profiled = 0.0
        super().__init__(model, physics, axis.position())
        self._induced_nm_s = stall * self._built.rate * SPEED_UNIT
        axis.build(physics.rotor_s * stall / top_rad_s, stall * physics.coulomb_share, 0.0)
        self._brake()

    # --- from outside

    def resume(self) -> None:
        """Go on; the world does so by itself."""
        self.quiet = True
        self._since_ms = 0

    def place(self, position_steps: float) -> None:
        """Set the shaft to where the world has it, whatever position is given."""
        self.x = self.joint = self.axis.position()
        self.v = self._rv = self.u = self.effort = self._integral = 0.0
        if isinstance(self.profile, PositionProfile):
            self.profile.rest(self.x)
        self.resume()

    def turn(self, steps: float) -> None:
        """Turn the shaft by hand, up to its joint's stops; the controller keeps acting."""
        self.axis.turn(steps)
        self.x = self.joint = self.axis.position()

    def jam(self, stuck: bool) -> None:
        """Jam the shaft where it is, or free it."""
        self.axis.jam(stuck)

    def set_load(self, share: float) -> None:
        """Set a constant torque on the shaft as a share of the stall torque."""
        self.axis.load(share * self._stall_nm)

    # --- from the servo

    def run(self, ticks: int) -> None:
        """Do nothing: the world moves its shafts."""

    def skip(self, ticks: int) -> None:
        """Do nothing: the world moves its shafts."""

    def drive(self, loop: Loop) -> None:
        """Apply controller settings."""
        if loop != self._loop:
            super().drive(loop)
            self._off = loop == DISABLED
            self._brake()

    def _brake(self) -> None:
        """Let the motor brake with what it induces, unless it is off or its torque is limited."""
        # A torque limit counts that torque in, so it is then a part of the effort.
        braked = self._loop.torque_max == inf
        self.axis.damp(self._free_nm_s + (self._induced_nm_s if braked else 0.0))

    # --- from the world, every millisecond

    def command(self) -> Effort:
        """Let the control loop have one millisecond; return what the motor does in it."""
        if self._off:
            return LIMP
        kp, _, kd, _, f1, f2, bias, most, torque_max, slew = self._loop
        profile, rv = self.profile, self._rv
        before = r = profile.r
        if profile.running:
            r = profile.ahead(1)[0]
        if rv or r != before:
            rv += (r - before - rv) * SMOOTHING
            if -SLOWEST < rv < SLOWEST:
                rv = 0.0
        c = kp * self._error(r) + self._integral + bias
        if rv and not profile.jumps:
            c += (kd + f1) * rv
        if f2:
            c += f2 * (rv - self._rv)
        self._rv = rv
        least = -most
        if slew != inf:
            u = self.u
            least, most = max(least, u - slew), min(most, u + slew)
        self._least, self._most, self._profiled = least, most, c
        push = self._stall_nm * self.volts
        gain = -push * (kp + kd) * SPEED_UNIT
        if torque_max != inf:
            return self._within(torque_max, push * c, gain, push * least, push * most)
        return push * c, gain, push * least, push * most

    def _within(
        self, torque_max: float, torque: float, gain: float, low: float, high: float
    ) -> Effort:
        """Limit a torque in which what the motor induces counts."""
        most = self._stall_nm * torque_max
        induced = self._induced_nm_s * self.v / SPEED_UNIT
        low, high = max(-most, low - induced), min(most, high - induced)
        return torque, gain - self._induced_nm_s, min(low, high), max(low, high)

    def _error(self, r: float) -> float:
        """Return the position error, in steps."""
        return r - self.x

    def sense(self, x: float, v: float) -> None:
        """Set position (steps) and speed (steps/ms) to what the world has made of them."""
        if -SLOWEST < v < SLOWEST:
            v = 0.0
        self.x = self.joint = x
        self.v = v
        if self._off:
            self.volts = self.supply
            return
        loop = self._loop
        least, most = self._least, self._most
        u = self._profiled - (loop.p + loop.d) * v
        clipped = not least <= u <= most
        if clipped:
            u = most if u > most else least
        volts = self.volts
        t = u * volts - v * self._built.rate
        torque_max = loop.torque_max
        if not -torque_max <= t <= torque_max:
            clipped = True
            t = torque_max if t > torque_max else -torque_max
            u = (t + v * self._built.rate) / volts if volts > 0.0 and torque_max > 0.0 else 0.0
        if (loop.i or loop.vi) and not clipped:
            self._sum_up(loop, v)
        power = u * t
        self.volts = self.supply - self._built.sag * power if power > 0.0 else self.supply
        self.u, self.effort = u, t

    def _sum_up(self, loop: Loop, v: float) -> None:
        """Let the I part go on."""
        i, error = self._integral, self.profile.r - self.x
        if loop.vi:
            i += loop.vi * (self._rv - v)
        elif error > RESOLUTION or error < -RESOLUTION:
            i += loop.i * error
        self._integral = min(max(i, -loop.u_max), loop.u_max)
