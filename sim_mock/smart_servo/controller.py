"""What moves a shaft: its motor and mechanics as numbers, and the controller in front of it.

Inside an emulated servo lengths are steps (4096 a turn) and times milliseconds; torque is a share
of the stall torque at the rated voltage, PWM a share of full.
"""

from math import inf, pi
from typing import NamedTuple, Protocol

from gazerig.sim_mock.smart_servo.physics import Physics

STEPS_PER_TURN = 4096
"""Resolution of the encoder on the shaft; a make may count otherwise in its registers."""
STEPS_PER_RAD = STEPS_PER_TURN / (2.0 * pi)
MS_S = 0.001
SAG_MOST = 0.5
"""Share of the voltage that the supply may lose at stall; more would hunt."""


class Motor(Protocol):
    """What the shaft must know of a servo's motor and gear."""

    @property
    def stall_torque_nm(self) -> float:
        """Return the torque that holds it still."""
        ...

    @property
    def stall_current_a(self) -> float:
        """Return the current it draws then."""
        ...

    @property
    def no_load_rpm(self) -> float:
        """Return the speed without load."""
        ...

    @property
    def rated_v(self) -> float:
        """Return the voltage that all this is for."""
        ...


class Loop(NamedTuple):
    """Controller gains and limits, in shares of full PWM per step, per step/ms and so on.

    p, d, f1, f2: on position error, speed error, profile speed, profile acceleration
    i: per ms on position error; vi: per ms on speed error (velocity mode)
    bias: constant part, in the modes without feedback
    u_most: PWM limit; t_most: torque (current) limit; slew: most change of PWM per ms
    """

    p: float = 0.0
    i: float = 0.0
    d: float = 0.0
    vi: float = 0.0
    f1: float = 0.0
    f2: float = 0.0
    bias: float = 0.0
    u_max: float = 1.0
    torque_max: float = inf
    slew: float = inf


class Mechanics(NamedTuple):
    """What never changes of a motor and its shaft, in steps and milliseconds.

    accel: speed that the stall torque adds in 1 ms
    drag, free: what divides a speed after 1 ms, with the motor's own braking and without
    dry: speed that dry friction takes in 1 ms
    rate: share of the rated voltage that the motor induces per step/ms
    gravity: speed that the weight adds in 1 ms at its full lever; upright: where it has none
    play: half the dead travel; sag: share of the voltage that the supply loses at stall
    """

    accel: float
    drag: float
    free: float
    dry: float
    rate: float
    gravity: float
    upright: float
    play: float
    sag: float


def mechanics_of(model: Motor, physics: Physics) -> Mechanics:
    """Return the mechanics of a model in its physics."""
    stall_nm = model.stall_torque_nm
    top_rad_s = model.no_load_rpm * pi / 30.0
    inertia = physics.rotor_s * stall_nm / top_rad_s + physics.load_kg_m2
    # Speed in steps/ms that the stall torque adds in 1 ms.
    accel = stall_nm / inertia * STEPS_PER_RAD * MS_S * MS_S
    top = model.no_load_rpm / 60.0 * STEPS_PER_TURN * MS_S
    # Friction is part of the data sheet's no-load speed: the motor alone would be faster.
    rate = (1.0 - physics.coulomb_share - physics.viscous_share) / top
    viscous = physics.viscous_share / top
    return Mechanics(
        accel,
        drag=1.0 + accel * (rate + viscous),
        free=1.0 + accel * viscous,
        dry=accel * physics.coulomb_share,
        rate=rate,
        gravity=accel * physics.gravity_nm / stall_nm,
        upright=physics.upright_steps,
        play=physics.play_deg * STEPS_PER_TURN / 720.0,
        sag=min(SAG_MOST, physics.supply_ohm * model.stall_current_a / model.rated_v),
    )


DISABLED = Loop(u_max=0.0, torque_max=0.0)


def is_linear(loop: Loop, built: Mechanics) -> bool:
    """True if five steps can be one: nothing is summed up, nothing depends on the position."""
    return (
        loop.i == loop.vi == loop.f2 == loop.bias == built.gravity == 0.0 and loop.torque_max == inf
    )
