"""Parameters of a shaft's motor and mechanics, and its controller.

Inside an emulated servo lengths are steps (4096 per turn) and times milliseconds; torque is a
share of the stall torque at the rated voltage, PWM a share of full PWM.
"""

from math import inf, pi
from typing import NamedTuple, Protocol

from gazerig.sim_mock.smart_servo.physics import Physics

STEPS_PER_TURN = 4096
"""Resolution of the encoder on the shaft; registers of a make may have another one."""
STEPS_PER_RAD = STEPS_PER_TURN / (2.0 * pi)
MS_S = 0.001
SAG_MOST = 0.5
"""Largest drop of the supply voltage at stall, as a share; more would oscillate."""


class Motor(Protocol):
    """Data of a servo's motor and gear that the shaft needs."""

    @property
    def stall_torque_nm(self) -> float:
        """Return the torque at stall."""
        ...

    @property
    def stall_current_a(self) -> float:
        """Return the current at stall."""
        ...

    @property
    def no_load_rpm(self) -> float:
        """Return the speed without load."""
        ...

    @property
    def rated_v(self) -> float:
        """Return the voltage of these data."""
        ...


class Loop(NamedTuple):
    """Controller gains and limits, in shares of full PWM per step, per step/ms and so on.

    p, d, f1, f2: on position error, speed error, profile speed, profile acceleration
    i: per ms on position error; vi: per ms on speed error (velocity mode)
    bias: constant part, in modes without feedback
    u_max: PWM limit; torque_max: torque (current) limit; slew: largest change of PWM per ms
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
    """Constants of a motor and its shaft, in steps and milliseconds.

    accel: speed that the stall torque adds in 1 ms
    drag, free: divisor of a speed per 1 ms, with the motor's own braking and without
    dry: speed that dry friction removes in 1 ms
    rate: share of the rated voltage that the motor induces per step/ms
    gravity: speed that the weight adds in 1 ms at its full lever; upright: position without lever
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
    """Return the mechanics of a model with its physics."""
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
    """Return whether five steps can be one: no integral terms, no dependence on the position."""
    return (
        loop.i == loop.vi == loop.f2 == loop.bias == built.gravity == 0.0 and loop.torque_max == inf
    )
