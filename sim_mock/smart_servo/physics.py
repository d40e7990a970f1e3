"""Physical parameters of an emulated servo, its specification, and its controller.

Stall torque and no-load speed are the motor's, from the data sheets in the drivers' tables. Values
that no data sheet contains are assumptions, marked [A]; values that follow from a report of users
are marked [R]. Inside an emulated servo lengths are steps (4096 per turn) and times milliseconds;
torque is a share of the stall torque at the rated voltage, PWM a share of full PWM.
"""

from math import inf, pi
from typing import NamedTuple

from gazerig.robot.model.weight import GEAR_FRICTION


class Physics(NamedTuple):
    """The body of a servo, the joint it carries, its supply and its surroundings.

    rotor_s: s; rotor inertia as the time to no-load speed at stall torque. 0.0373 [A] gives an
        XL330-M077 2.0e-4 kg m2 at its output; the same motor has the same behind any gear.
    load_kg_m2: kg m2; inertia of the joint's load, in addition to the rotor's.
    coulomb_share: dry friction as a share of the stall torque. 0.03 lets a P gain of 640 stop up
        to 5 steps short, as XL430 do (4-10) [R].
    viscous_share: share of the stall torque lost at no-load speed [A]. With both frictions
        the servo still reaches the no-load speed of its data sheet.
    gravity_nm: Nm; weight times lever: the torque is gravity_nm * sin(x - upright_steps), so
        it drives the joint away from ``upright_steps`` if positive, towards it if negative.
    upright_steps: steps of the encoder at which gravity has no lever.
    gravity_turns: turns of the weight for one turn of the shaft.
    stop_low_steps, stop_high_steps: steps of the encoder; hard stops of the joint, no bounce.
    play_deg: deg; dead travel between output shaft and joint, 0.25 as in the data sheets of
        the X430. The encoder of X servos is at the output, so the registers show no play;
        a world has it. Play inside the gear is omitted.
    """

    rotor_s: float = 0.0373
    load_kg_m2: float = 0.0
    coulomb_share: float = GEAR_FRICTION
    viscous_share: float = 0.02
    gravity_nm: float = 0.0
    upright_steps: float = 2048.0
    gravity_turns: float = 1.0
    stop_low_steps: float = -inf
    stop_high_steps: float = inf
    play_deg: float = 0.25


class ServoSpec(NamedTuple):
    """Specification of one servo."""

    id: int
    model: str
    start_steps: float = 2048
    firmware: int = 53
    physics: Physics = Physics()


STEPS_PER_TURN = 4096
"""Resolution of the encoder on the shaft; registers of a make may have another one."""
STEPS_PER_RAD = STEPS_PER_TURN / (2.0 * pi)
MS_S = 0.001


class Motor(NamedTuple):
    """Motor and gear of a servo, from its data sheet."""

    stall_torque_nm: float
    no_load_rpm: float


class Loop(NamedTuple):
    """Controller gains and limits, in shares of full PWM per step, per step/ms and so on.

    p, d: gains on position error and speed error; i: gain per ms on position error
    u_max: PWM limit; slew: largest change of PWM per ms
    """

    p: float = 0.0
    i: float = 0.0
    d: float = 0.0
    u_max: float = 1.0
    slew: float = inf


class Mechanics(NamedTuple):
    """Constants of a motor and its shaft, in steps and milliseconds.

    accel: speed that the stall torque adds in 1 ms
    drag, free: divisor of a speed per 1 ms, with the motor's own braking and without
    dry: speed that dry friction removes in 1 ms
    rate: share of the rated voltage that the motor induces per step/ms
    play: half the dead travel
    """

    accel: float
    drag: float
    free: float
    dry: float
    rate: float
    play: float


def mechanics_of(motor: Motor, physics: Physics) -> Mechanics:
    """Return the mechanics of a motor with its physics."""
    stall_nm = motor.stall_torque_nm
    top_rad_s = motor.no_load_rpm * pi / 30.0
    inertia = physics.rotor_s * stall_nm / top_rad_s + physics.load_kg_m2
    # Speed in steps/ms that the stall torque adds in 1 ms.
    accel = stall_nm / inertia * STEPS_PER_RAD * MS_S * MS_S
    top = motor.no_load_rpm / 60.0 * STEPS_PER_TURN * MS_S
    # Friction is part of the data sheet's no-load speed: the motor alone would be faster.
    rate = (1.0 - physics.coulomb_share - physics.viscous_share) / top
    viscous = physics.viscous_share / top
    return Mechanics(
        accel,
        drag=1.0 + accel * (rate + viscous),
        free=1.0 + accel * viscous,
        dry=accel * physics.coulomb_share,
        rate=rate,
        play=physics.play_deg * STEPS_PER_TURN / 720.0,
    )


DISABLED = Loop(u_max=0.0)
