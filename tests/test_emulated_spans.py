"""Five milliseconds of a shaft at once against single ones; steps in two forms."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from stepped_shaft import EYE, LID, NECK, STS, SteppedShaft

from gazerig.drivers.dynamixel.control_table import MODELS
from gazerig.drivers.feetech.memory_table import MODELS as FEETECH_MODELS
from gazerig.sim_mock.smart_servo.controller import Loop, Motor
from gazerig.sim_mock.smart_servo.motor import Shaft
from gazerig.sim_mock.smart_servo.physics import Physics
from gazerig.sim_mock.smart_servo.profile import PositionProfile

APART_STEPS = 0.02
"""The encoder's step is 1."""

CASES: dict[str, tuple[Motor, Loop, Physics, float, float]] = {
    "eye": (MODELS["xl330-m077"], EYE, Physics(), 6.8, 0.5),
    "lid": (MODELS["xl330-m077"], LID, Physics(), 13.6, 0.66),
    "neck": (MODELS["xc330-m288"], NECK, Physics(load_kg_m2=2e-3), 2.26, 0.0224),
    "sts": (FEETECH_MODELS["sts3215"], STS, Physics(load_kg_m2=2e-3), 3.4, 0.0116),
    "pulled": (FEETECH_MODELS["sts3215"], STS, Physics(load_nm=-0.2), 3.4, 0.0116),
}
"""Motor, controller, body, and speed and ramp of the profile, of joints of the shipped rigs."""


class Both:
    """One shaft in spans and one in steps, led to the same goals."""

    def __init__(self, case: str) -> None:
        model, loop, physics, *self.pace = CASES[case]
        self.spans = Shaft(model, physics, 2048.0)
        self.spans.drive(loop)
        self.single = SteppedShaft(model, physics, loop, 2048.0)

    def lead(self, goal: float, ms: int) -> float:
        """Lead both to a goal for a while; return how far they are apart then."""
        for shaft in (self.spans, self.single):
            assert isinstance(shaft.profile, PositionProfile)
            if shaft.profile.goal != goal:
                shaft.profile.plan_by_velocity(goal, *self.pace)
        self.spans.resume()
        self.spans.run(ms)
        self.single.run(ms)
        return abs(self.spans.x - self.single.x)


@pytest.mark.parametrize("case", CASES)
@given(
    moves=st.lists(st.tuples(st.integers(-400, 400), st.integers(1, 60)), min_size=1, max_size=8)
)
@settings(max_examples=25, deadline=None)
def test_spans_end_where_single_steps_do(case, moves):
    both = Both(case)
    for goal, ticks in moves:
        for _ in range(ticks):
            assert both.lead(2048.0 + goal, 5) < APART_STEPS


@pytest.mark.parametrize("case", CASES)
@given(seed=st.integers(0, 10_000), pace=st.floats(0.2, 12.0))
@settings(max_examples=15, deadline=None)
def test_a_path_followed_tick_by_tick_is_the_same(case, seed, pace):
    both, goal, speed, rng = Both(case), 2048.0, 0.0, random.Random(seed)
    for _ in range(150):
        speed = 0.9 * speed + pace * rng.uniform(-0.3, 0.3)
        goal += round(speed)
        assert both.lead(goal, 5) < APART_STEPS


@pytest.mark.parametrize(
    ("case", "way"),
    [("sts", "_glide"), ("pulled", "_glide"), ("eye", "_stick"), ("neck", "_stick")],
)
def test_spans_are_used(case, way, monkeypatch):
    """Else the tests above compare steps with steps."""
    spans, quick = [], getattr(Shaft, way)

    def counted(shaft, *given):
        spans.append(quick(shaft, *given))
        return spans[-1]

    monkeypatch.setattr(Shaft, way, counted)
    both = Both(case)
    both.lead(2348.0, 400)
    assert sum(spans) >= 2


@given(
    goal=st.floats(-600, 600),
    cruise=st.floats(0.0, 8.0),
    ramp=st.floats(0.0, 0.5),
    slew=st.sampled_from([0.02, 0.1, 1.0]),
    load_nm=st.floats(-0.1, 0.1),
    ms=st.integers(1, 200),
)
@settings(max_examples=60, deadline=None)
def test_steps_of_the_short_form_are_those_of_the_long_one(
    monkeypatch_of_steps, goal, cruise, ramp, slew, load_nm, ms
):
    ends = []
    for short in (True, False):
        monkeypatch_of_steps(short)
        made = Shaft(MODELS["xl330-m077"], Physics(load_nm=load_nm), 0.0)
        made.drive(EYE._replace(slew=slew))
        assert isinstance(made.profile, PositionProfile)
        made.profile.plan_by_velocity(goal, cruise, ramp)
        made.resume()
        for _ in range(ms):
            made.run(1)
            made.resume()  # a span never gets full
        ends.append((made.x, made.v, made.u, made.effort, made.joint, made.volts, made._rv))
    assert ends[0] == ends[1]


@pytest.fixture(scope="module")
def monkeypatch_of_steps():
    step = Shaft._step
    with pytest.MonkeyPatch.context() as patch:

        def use(short):
            patch.setattr(Shaft, "_step", step if short else lambda *given: False)

        yield use
