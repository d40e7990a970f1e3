"""Motor and controller of a hobby servo with mechanics, which no data sheet contains [A]."""

from gazerig.sim_mock.hobby_servo import HobbySpec
from gazerig.sim_mock.smart_servo.physics import STEPS_PER_TURN, Loop, Motor, Physics

HOBBY_PHYSICS = Physics(rotor_s=0.008, coulomb_share=0.04, viscous_share=0.0, play_deg=0.0)
"""A small motor that reaches full speed in 8 ms without a load; friction of cheap gears."""

DAMPING = 1.0
"""Share of the duty that its controller takes back at full speed, so that a load overshoots only a
little."""


def hobby_motor(spec: HobbySpec, steps_per_turn: float) -> tuple[Motor, Loop]:
    """Return the motor and the controller of a hobby servo.

    Args:
        spec: its speed, lag and torque.
        steps_per_turn: quarter microseconds of a whole turn.
    """
    top = spec.speed_steps_s / steps_per_turn * STEPS_PER_TURN / 1000.0
    lag_ms = max(1.0, spec.lag_s * 1000.0)
    motor = Motor(spec.stall_torque_nm, 60.0 * spec.speed_steps_s / steps_per_turn)
    return motor, Loop(p=(1.0 + DAMPING) / (lag_ms * top), d=DAMPING / top)
