"""The emulated shaft: profile speed, acceleration, lag and standstill."""

import pytest

from drivers.dynamixel_table import MODELS
from sim_mock.servo_motion import Feel, Shaft

DEG = 4096.0 / 360.0


def shaft(model: str = "xl330-m077", feel: Feel = Feel()) -> Shaft:  # noqa: B008
    return Shaft(0.0, MODELS[model].no_load_steps_s, feel)


def path(made: Shaft, ms: int) -> list[float]:
    positions = []
    for _ in range(ms):
        made.advance(1)
        positions.append(made.x)
    return positions


def test_an_unloaded_m077_reaches_500_deg_s_in_10_to_15_ms():
    eye = shaft()
    eye.drive(90 * DEG)
    ms = 0
    while eye.speed_steps_s < 500 * DEG:
        eye.advance(1)
        ms += 1
    assert 10 <= ms <= 15


def test_a_larger_spin_up_time_is_slower():
    light, heavy = shaft("xc330-m288"), shaft("xc330-m288", Feel(spin_up_s=0.3))
    for made in (light, heavy):
        made.drive(20 * DEG)
        made.advance(30)
    assert heavy.x < 0.5 * light.x


@pytest.mark.parametrize("model", ["xl330-m077", "xc330-m288"])
@pytest.mark.parametrize(
    ("cruise", "ramp"), [(0, 0), (500, 0), (500, 8000), (80, 0), (80, 400)], ids=repr
)
@pytest.mark.parametrize("span", [-40, -1, 5, 40, 120])
def test_every_profile_ends_on_the_goal_without_overshoot(model, cruise, ramp, span):
    made = shaft(model)
    made.shape(cruise * DEG, ramp * DEG)
    made.drive(span * DEG)
    positions = path(made, 4000)
    assert made.settled
    assert positions[-1] == made.goal == span * DEG
    assert max(abs(p) for p in positions) <= abs(span * DEG) + 0.01


@pytest.mark.parametrize("ramp", [0, 8000])
def test_profile_speed_is_never_exceeded(ramp):
    made = shaft()
    made.shape(300 * DEG, ramp * DEG)
    made.drive(90 * DEG)
    steps = path(made, 800)
    fastest = max(b - a for a, b in zip(steps, steps[1:], strict=False))
    assert fastest == pytest.approx(300 * DEG / 1000.0, rel=1e-6)


def test_no_load_speed_is_never_exceeded():
    made = shaft("xc330-m288")
    made.drive(360 * DEG)
    steps = path(made, 1500)
    fastest = max(b - a for a, b in zip(steps, steps[1:], strict=False))
    assert fastest == pytest.approx(81 * 4096 / 60 / 1000, rel=1e-6)


def test_trapezoid_ramps_as_the_registers_say():
    # 64 V/A ms of ramp in register units: V = 100, A = 10 is 640 ms.
    made = shaft()
    v, a = 100 * 0.229 / 60 * 4096, 10 * 214.577 / 3600 * 4096
    made.shape(v, a)
    made.drive(3000)
    ms = 0
    while made.profile_speed_steps_s < v * (1 - 1e-9):
        made.advance(1)
        ms += 1
    assert ms == pytest.approx(640, abs=3)


def test_the_position_lags_the_profile_by_its_time_constant():
    made = shaft(feel=Feel(lag_s=0.010))
    made.shape(100 * DEG, 0)
    made.drive(90 * DEG)
    made.advance(300)
    # One internal step of 1 ms lies between profile and position.
    assert (made.r - made.x) / (100 * DEG) == pytest.approx(0.009, abs=0.0005)


def test_a_new_goal_in_mid_flight_starts_from_the_present_speed():
    made = shaft()
    made.shape(300 * DEG, 3000 * DEG)
    made.drive(60 * DEG)
    made.advance(100)
    before = made.profile_speed_steps_s
    made.aim(-60 * DEG)
    made.advance(1)
    assert made.profile_speed_steps_s == pytest.approx(before - 3 * DEG)


def test_standing_still_is_exact_and_free():
    made = shaft()
    made.drive(10 * DEG)
    made.advance(1000)
    assert (made.x, made.v, made.settled) == (10 * DEG, 0.0, True)
    made.advance(10**9)
    assert made.x == 10 * DEG


def test_in_one_go_or_in_steps_is_the_same():
    once, often = shaft(), shaft()
    for made in (once, often):
        made.shape(200 * DEG, 2000 * DEG)
        made.drive(33 * DEG)
    once.advance(123)
    for _ in range(123):
        often.advance(1)
    assert (once.x, once.v, once.r, once.rv) == (often.x, often.v, often.r, often.rv)
