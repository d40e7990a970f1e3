"""Whatever the parameters and whatever happens, lids stay between shut and open and never jump."""

from math import radians
from typing import NamedTuple

import numpy as np
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from gazerig.gaze.lids.blink import LidParams, closure
from gazerig.gaze.lids.lids import Lids
from gazerig.params import declarations

DT = 0.005
STEEPEST = 1.875  # slope of minimum jerk at its middle
GLIDE_S = 0.3
# To simplify sixty numbers takes minutes; the found example is sufficient.
WITHOUT_SHRINKING = (Phase.explicit, Phase.generate)


def steepest_opening() -> float:
    """Return the steepest slope of an opening that takes 1 s."""
    shut = [closure(1.0 + s, 0.0, 1.0, 1.0) for s in np.linspace(0.0, 1.0, 20_001)]
    return float(-np.diff(shut).min() * 20_000)


OPENING = steepest_opening()


def admissible() -> st.SearchStrategy[LidParams]:
    """Draw any parameters that a file may hold."""
    ranges: dict[str, st.SearchStrategy[float | str | bool]] = {}
    for name, item in declarations(LidParams).items():
        if item.choices:
            ranges[name] = st.sampled_from(item.choices)
        elif item.low is None or item.high is None:
            ranges[name] = st.booleans()
        else:
            ranges[name] = st.floats(item.low, item.high)
    return st.builds(LidParams, **ranges)


class Event(NamedTuple):
    """Something that happens, and the gaze in the ticks after it."""

    what: str
    level: float
    pitch_deg: float
    shift_deg: float | None
    ticks: int


EVENTS = st.builds(
    Event,
    st.sampled_from(["", "", "left", "right", "rest", "conversation", "retune"]),
    st.floats(0.0, 1.0),
    st.floats(-60.0, 60.0),
    st.none() | st.floats(-90.0, 90.0),
    st.integers(1, 60),
)


def happen(model: Lids, event: Event, other: LidParams, t_s: float) -> None:
    if event.what in ("left", "right"):
        model.wink(event.what, t_s + event.level - 0.5)  # type: ignore[arg-type]
    elif event.what in ("rest", "conversation"):
        model.set_conversation(event.what == "conversation")
    elif event.what == "retune":
        model.retune(other)


def fastest_per_s(params: LidParams) -> float:
    """Return the steepest slope that blink and glide may have together."""
    blink = max(STEEPEST / (params.close_ms / 1e3), OPENING / (params.open_ms / 1e3))
    return blink + 4.0 * STEEPEST / GLIDE_S  # following changes as well, by up to 60 deg


@settings(max_examples=60, deadline=None, phases=WITHOUT_SHRINKING)
@given(admissible(), admissible(), st.lists(EVENTS, min_size=1, max_size=10), st.integers(0, 99))
def test_lids_stay_within_bounds_and_never_jump(
    first: LidParams, other: LidParams, events: list[Event], seed: int
) -> None:
    model = Lids(first, np.random.default_rng(seed))
    most = max(fastest_per_s(first), fastest_per_s(other)) * DT
    t_s, pitch_deg, before = 0.0, 0.0, None
    for event in events:
        happen(model, event, other, t_s)
        for tick in range(event.ticks):
            t_s += DT
            shift = None if tick or event.shift_deg is None else radians(event.shift_deg)
            # The eye turns at up to 600 deg/s.
            turn_deg = min(3.0, max(-3.0, event.pitch_deg - pitch_deg))
            pitch_deg += turn_deg
            left, right, _, *lower = model.step(t_s, radians(pitch_deg), shift)
            now = np.array([left, right, *lower])
            assert (now >= 0.0).all() and (now <= 1.0).all()
            if before is not None:
                step = np.abs(now - before).max()
                assert step <= most + 0.0222 * abs(turn_deg) + 1e-9
            before = now


def test_rounding_errors_lead_no_lid_beyond_shut_or_open() -> None:
    # Minimum jerk comes out beyond its end by up to 2e-15 just before it.
    near = 1.0 - np.logspace(-2.0, -8.0, 4001)
    assert min(closure(1.0 + float(s), 0.0, 1.0, 1.0) for s in near) == 0.0
    winking = Lids(LidParams(blinks_per_min=0.0, close_ms=500.0), np.random.default_rng(0))
    winking.wink("left", 0.0)
    winks = [winking.step(0.5 * float(t_s), 0.0, None) for t_s in near]
    assert min(o.left for o in winks) == min(o.lower_left for o in winks) == 0.0
