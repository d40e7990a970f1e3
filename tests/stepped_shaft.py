"""The shaft of an emulated servo, integrated millisecond by millisecond: what spans are judged by.

Written apart from sim_mock, in the plainest form: a P and D controller with limits of duty and of
its change, a motor with inertia and both frictions, a supply that sags. No integral part, gravity
or torque limit: with those sim_mock makes single steps.
"""

from dataclasses import dataclass
from math import inf, pi

from gazerig.sim_mock.smart_servo.physics import Loop, Motor, Physics
from gazerig.sim_mock.smart_servo.profile import PositionProfile

SMOOTHING = 0.25
SLOWEST = 1e-4


@dataclass
class SteppedShaft:
    """One shaft; steps and milliseconds, torque and duty as shares."""

    model: Motor
    physics: Physics
    loop: Loop
    x: float
    v: float = 0.0
    rv: float = 0.0
    u: float = 0.0

    def __post_init__(self) -> None:
        model, physics = self.model, self.physics
        top_rad_s = model.no_load_rpm * pi / 30.0
        inertia = physics.rotor_s * model.stall_torque_nm / top_rad_s + physics.load_kg_m2
        self.accel = model.stall_torque_nm / inertia * 4096 / (2.0 * pi) * 1e-6
        top = model.no_load_rpm / 60.0 * 4.096
        self.induced = (1.0 - physics.coulomb_share - physics.viscous_share) / top
        self.viscous = physics.viscous_share / top
        self.sag = physics.supply_ohm * model.stall_current_a / model.rated_v
        self.volts = 1.0
        self.profile = PositionProfile(self.x)

    def run(self, ms: int) -> None:
        """Advance by n milliseconds, one after the other."""
        for _ in range(ms):
            before = self.profile.r
            (r,) = self.profile.advance(1)
            self._step(r, r - before)

    def _step(self, r: float, moved: float) -> None:
        loop, accel = self.loop, self.accel
        dry = accel * self.physics.coulomb_share
        self.rv += (moved - self.rv) * SMOOTHING
        if abs(self.rv) < SLOWEST:
            self.rv = 0.0
        kr = 0.0 if self.profile.is_jump else loop.d
        asked = loop.p * (r - self.x) + kr * self.rv
        free = 1.0 + accel * (self.induced + self.viscous)
        load = accel * self.physics.load_nm / self.model.stall_torque_nm
        # What the controller asks for at the end of the step, if it may.
        push = accel * self.volts
        v = self._rubbed(self.v + load + push * asked, dry) / (free + push * (loop.p + loop.d))
        u = asked - (loop.p + loop.d) * v
        allowed = min(max(u, self.u - loop.slew), self.u + loop.slew)
        allowed = min(max(allowed, -loop.u_max), loop.u_max)
        if allowed != u:
            u = allowed
            v = self._rubbed(self.v + load + push * u, dry) / free
        self.x, self.v, self.u = self.x + v, v, u
        power = u * (u * self.volts - v * self.induced)
        self.volts = 1.0 - self.sag * max(0.0, power)

    @staticmethod
    def _rubbed(w: float, dry: float) -> float:
        return w - dry if w > dry else w + dry if w < -dry else 0.0


EYE = Loop(p=1200 / 128 / 885, d=12000 / 16 / 885, slew=0.100827)
LID = Loop(p=700 / 128 / 885, d=5500 / 16 / 885, slew=0.100827)
NECK = Loop(p=2000 / 128 / 885, d=14000 / 16 / 885, slew=0.100827)
STS = Loop(p=32 / 1600, d=1.0, slew=inf)
"""Controllers of the shipped rigs."""
