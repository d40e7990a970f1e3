"""The emulated shaft: what profile, gains, limits, load, friction, stops and play make of it."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gazerig.drivers.dynamixel.control_table import MODELS
from gazerig.sim_mock.smart_servo.physics import Loop, Motor, Physics
from gazerig.sim_mock.smart_servo.shaft import Shaft

P, D = 800 / 128 / 885, 800 / 16 / 885
PD = Loop(p=P, d=D)
SMOOTH: dict[str, Any] = {"coulomb_share": 0.0, "viscous_share": 0.0}


def shaft(model: str = "xl330-m077", loop: Loop = PD, weight_nm: float = 0.0, **physics) -> Shaft:
    sheet = MODELS[model]
    motor = Motor(sheet.stall_torque_nm, sheet.no_load_rpm)
    made = Shaft(motor, Physics(**physics), 0.0)
    made.drive(loop)
    made.set_weight(weight_nm / motor.stall_torque_nm)
    return made


def go(made: Shaft, goal: float, ms: int, cruise: float = 0.0, ramp: float = 0.0) -> list[float]:
    """Lead to a goal; give the position after every millisecond."""
    made.lead_to(goal, cruise, ramp)
    return run(made, ms)


def run(made: Shaft, ms: int) -> list[float]:
    path = []
    for _ in range(ms):
        made.run(1)
        path.append(made.x)
    return path


# --- the profile


FLOATS = st.floats(-5000, 5000).map(lambda steps: round(steps, 3))  # goals are whole steps


@given(FLOATS, FLOATS, st.integers(0, 400), st.floats(0.2, 20), st.floats(0.001, 1.0))
@settings(max_examples=60, deadline=None)
def test_a_new_goal_starts_from_the_present_speed_and_keeps_to_the_limits(
    first, second, after, cruise, ramp
):
    made = shaft()
    made.lead_to(first, cruise, ramp)
    path = [0.0, *made.lead(after + 1)]
    made.lead_to(second, cruise, ramp)
    while made.led:
        path += made.lead(100)
        assert len(path) < 200_000
    assert path[-1] == second
    speeds = np.diff([0.0, *path])
    assert np.abs(speeds).max() <= cruise + 1e-6
    assert np.abs(np.diff([*speeds, 0.0])).max() <= 2.0 * ramp + 1e-6


# --- gains and limits


@pytest.mark.parametrize(("more_p", "more_d"), [(1.0, 0.0), (2.0, 1.0)])
def test_pd_control_moves_a_shaft_as_its_differential_equation_says(more_p, more_d):
    # x'' = a (P (goal - x) - D x') - x' / T, a the no-load speed over the time T to reach it.
    from scipy.linalg import expm

    p, d, model = more_p * P, more_d * D, MODELS["xl330-m077"]
    path = np.array(go(shaft(model.name, Loop(p=p, d=d), **SMOOTH), 40, 300))
    T = Physics().rotor_s
    a = model.no_load_steps_s / T
    step = expm(0.001 * np.array([(0.0, 1.0), (-a * p, -a * d / 1000.0 - 1.0 / T)]))
    exact = [40.0 + (np.linalg.matrix_power(step, k + 1) @ (-40.0, 0.0))[0] for k in range(300)]
    assert path == pytest.approx(np.array(exact), abs=3.0)


def test_pwm_limit_and_slope_bound_the_output():
    made = shaft(loop=Loop(p=P, d=D, u_max=0.3, slew=0.01))
    made.lead_to(3000, 0.0, 0.0)
    before = 0.0
    for _ in range(200):
        made.run(1)
        assert abs(made.u) <= 0.3 and abs(made.u - before) <= 0.01 + 1e-12
        before = made.u
    assert made.u > 0.15


# --- body and surroundings


def test_stops_are_never_passed_and_a_stalled_motor_draws_its_stall_current():
    made = shaft(stop_low_steps=-50.0, stop_high_steps=80.0)
    assert max(go(made, 2000, 500)) == 80.0
    assert made.effort == pytest.approx(1.0)
    assert min(go(made, -2000, 500)) == -50.0
    assert made.effort == pytest.approx(-1.0)
