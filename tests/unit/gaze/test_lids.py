"""Blinks, winks and lids that follow the gaze."""

from math import exp, hypot, inf, radians
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
from gaze_targets import DT
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from gazerig.gaze.lids.blink import (
    LAWS,
    LidClosure,
    LidParams,
    blink_depth,
    blink_pause_s,
    closure,
    evoked_offset_s,
    evokes_blink,
)
from gazerig.gaze.lids.lids import Lids
from gazerig.gaze.minimum_jerk import min_jerk
from gazerig.params import declarations

AWAKE = 0.75


def lids(seed=0, **params):
    return Lids(LidParams(**params), np.random.default_rng(seed))


def onsets(
    model,
    seconds,
    start_s=0.0,
    dt_s=DT,
    shift=lambda t_s: None,
):
    """Return when blinks begin; shift: size of a gaze shift at a time, in radians."""
    times = []
    for k in range(round(seconds / dt_s)):
        t_s, before = start_s + k * dt_s, model.blinks
        model.step(t_s, 0.0, shift(t_s))
        if model.blinks > before:
            times.append(t_s)
    return times


def test_e51_blink_shape():
    usual = LidParams()
    close_ms, hold_ms, open_ms = usual.close_ms, usual.hold_ms, usual.open_ms
    assert 60.0 <= close_ms <= 100.0 and 20.0 <= hold_ms <= 60.0 and 130.0 <= open_ms <= 250.0
    speed = np.diff([closure(t, close_ms, hold_ms, open_ms) for t in range(300)])
    assert speed.max() >= 1.5 * -speed.min() > 0.0


def test_e74_an_announced_shift_waits_for_the_blink_that_precedes_it():
    apart_s, waits_s = [], []
    for seed in range(200):
        model = lids(seed, blinks_per_min=0.0)
        waits_s.append(model.draw_blink_of_shift(radians(60.0), 1.0, 1.0))
        first = 1 + round(waits_s[-1] / 0.001)
        ticks = iter([None] * first + [radians(60.0)] + [None] * 999)
        blinks_s = onsets(model, 0.2, 1.0, 0.001, lambda t_s, ticks=ticks: next(ticks))
        assert len(blinks_s) <= 1, "it has its blink already"
        apart_s += [blink_s - 1.0 - waits_s[-1] for blink_s in blinks_s]
    apart = np.array(apart_s)
    assert len(apart) >= 190 and np.abs(apart).max() <= 0.066 and abs(np.median(apart)) <= 0.012
    assert 0.3 < (apart < -0.001).mean() < 0.7
    assert min(waits_s) == 0.0 and 0.03 < max(waits_s) <= 0.066


@pytest.mark.parametrize(
    ("law", "converses", "low", "high"),
    [("people", False, 14.0, 20.0), ("people", True, 23.0, 29.0), ("nakamoto", False, 18.0, 32.0)],
)
def test_e74_blinks_with_large_shifts_are_among_the_published_rate(law, converses, low, high):
    """Shifts of 40 deg at random times, 15 a minute; nearly all bring a blink."""
    model = lids(3, law=law)
    model.set_conversation(converses)
    rng, times = np.random.default_rng(9), [0.0]
    at_s = [float(rng.exponential(4.0))]

    def shift(t_s):
        if t_s < at_s[-1] or t_s - times[-1] <= 1.0:
            return None
        times.append(t_s)
        at_s.append(t_s + float(rng.exponential(4.0)))
        return radians(40.0)

    # Ticks fine enough for times between blinks, which are no shorter than .6 s.
    onset_s = onsets(model, 1800.0, dt_s=0.02, shift=shift)
    assert low <= len(onset_s) / 30.0 <= high
    gaps = np.diff(onset_s)
    assert gaps.min() >= 0.6 and 0.5 <= gaps.std() / gaps.mean() <= 1.2


def test_a_change_of_the_rate_counts_at_once_and_the_same_again_changes_nothing():
    plain, reported = lids(4), lids(4)
    times = onsets(reported, 60.0, shift=lambda t_s: reported.set_conversation(False))
    assert times == onsets(plain, 60.0)
    plain.retune(LidParams(blinks_per_min=0.0))
    assert onsets(plain, 60.0, 60.0) == []
    plain.retune(LidParams())
    assert 4 <= len(onsets(plain, 30.0, 120.0)) <= 14


def dice(share=0.0, normal=0.0):
    """Return dice that fall as given."""
    return SimpleNamespace(
        random=lambda: share,
        standard_exponential=lambda: 2.0,
        standard_normal=lambda *size: np.array((1.0, 0.0, -1.0)) if size else normal,
    )


PEOPLE, NAKAMOTO = LAWS["people"], LAWS["nakamoto"]


def test_a_lid_closes_holds_and_opens_quickly_at_first():
    opening = 1.0 - min_jerk(1.0 - 0.5**1.4)
    for t, shut in (
        (0.0, 0.0), (0.025, min_jerk(0.25)), (0.1, 1.0), (0.29, 1.0), (0.5, opening), (0.7, 0.0),
        (0.69, 1.0 - min_jerk(1.0 - 0.025**1.4)), (9.0, 0.0),
    ):  # fmt: skip
        assert closure(t, 0.1, 0.2, 0.4) == pytest.approx(shut)
    assert opening < 0.5
    # Minimum jerk comes out beyond its end by up to 2e-15 just before it.
    near = 1.0 - np.logspace(-2.0, -8.0, 4001)
    assert min(closure(1.0 + float(s), 0.0, 1.0, 1.0) for s in near) == 0.0
    one = LidClosure(1.0, 0.1, 0.2, 0.4, 0.5)
    assert one.length_s == pytest.approx(0.7) and one.closure_at(1.5) == pytest.approx(opening / 2)
    assert [one.is_in_progress(t) for t in (0.9, 1.0, 1.6, 1.8)] == [False, True, True, False]
    varied = one.vary_durations(PEOPLE, dice())
    assert varied == pytest.approx((1.0, 0.1 * exp(0.2), 0.2, 0.4 * exp(-0.2), 0.5))
    assert one.vary_durations(NAKAMOTO, dice()) is one


def test_pauses_between_blinks():
    for law, per_min, length_s, pause_s in (
        # A mean of 2.7 s, 1 s of it the shortest; the median of a log-normal law is below its mean.
        (PEOPLE, 20.0, 0.3, 1.0 + 1.7 / hypot(1.0, 0.8 * 2.7 / 1.7)), (PEOPLE, 0.0, 0.3, inf),
        (NAKAMOTO, 20.0, 0.3, 1.0 + 2.0 * 1.7), (NAKAMOTO, 60.0, 0.5, 1.0 + 2.0 * 0.05),
    ):  # fmt: skip
        assert blink_pause_s(law, per_min, length_s, dice()) == pytest.approx(pause_s)


@pytest.mark.parametrize(
    ("law", "size_deg", "after_s"),
    [("people", 40.0, 0.03), ("people", -40.0, 0.03), ("people", 5.9, None), ("none", 90.0, None),
     ("nakamoto", 20.5, 0.0)],
)  # fmt: skip
def test_e52_a_shift_brings_one_blink_soon_after_it(law, size_deg, after_s):
    model, ticks = Lids(LidParams(0.0, law=law), dice(0.9, 1.0)), np.arange(100) * 0.01
    shut = [model.step(t, 0.0, radians(size_deg) if t == 0.5 else None).blink for t in ticks]
    assert model.blinks == (after_s is not None)
    assert after_s is None or shut.index(True) == 50 + round(after_s / 0.01) + 1


def test_e52_chances_of_blinks_are_those_published():
    def chance(law, shift_deg):
        shares = np.arange(0.0, 1.0, 0.001)
        return float(np.mean([evokes_blink(law, shift_deg, dice(one)) for one in shares]))

    # A logistic curve with .5 at 17 deg and .97 at 33 (Evinger), lowered to begin at 6 deg.
    least = 1.0 / (1.0 + exp(0.217 * 11.0))
    for deg, share in ((6.0, 0.0), (17.0, 0.5), (33.0, 0.97), (90.0, 1.0)):
        lowered = (share - least) / (1.0 - least)
        assert chance(PEOPLE, deg) == pytest.approx(max(0.0, lowered), abs=0.0015)
    assert [chance(NAKAMOTO, deg) for deg in (20.0, 20.1)] == [0.0, 1.0]
    late = [evoked_offset_s(PEOPLE, dice(normal=n)) for n in (-3.0, 1.0, 3.0)]
    assert late == pytest.approx([-0.06, 0.03, 0.06])
    assert evoked_offset_s(NAKAMOTO, dice(normal=1.0)) == 0.0
    # Half of all blinks stop at .6 to .95 of the way, most of them nearly shut.
    depths = [blink_depth(PEOPLE, dice(share)) for share in (0.0, 0.25, 0.49, 0.5, 1.0)]
    assert depths == pytest.approx([0.6, 0.775, 0.845, 1.0, 1.0])


@pytest.mark.parametrize(("side", "shuts"), [("left", [0, 3]), ("right", [1, 4])])
def test_a_wink_shuts_both_lids_of_one_eye_and_opens_them_again(side, shuts):
    model = lids(blinks_per_min=0.0)
    model.wink(side, 1.0)
    trace = np.array([model.step(0.995 + k * DT, 0.0, None) for k in range(200)])
    still = np.array([AWAKE, AWAKE, 0.0, 0.8, 0.8])
    assert (trace[[0, -1]] == still).all() and model.blinks == 0
    shut_s = (trace < 0.001 * still).sum(axis=0) * DT
    assert ((shut_s >= 0.2) & (shut_s <= 0.25)).nonzero()[0].tolist() == shuts


# ---- Lower lids: they go with the gaze and meet the upper ones in a blink.


LOWER_AWAKE = 0.8


def still_lids(**params):
    """Return lids that do not blink by themselves."""
    chosen = LidParams(**{"blinks_per_min": 0.0, **params})
    return Lids(chosen, np.random.default_rng(0))


def test_lower_lids_follow_by_less_than_the_upper_ones_and_evenly():
    model = still_lids()
    level, up, down = (model.step(0.0, radians(a), None) for a in (0.0, 10.0, -10.0))
    assert level.lower_left == level.lower_right == LOWER_AWAKE
    assert up.lower_left == pytest.approx(LOWER_AWAKE - 0.08)
    assert down.lower_left == pytest.approx(LOWER_AWAKE + 0.08)
    # On lids that travel 45 and 30 deg: a quarter of the upper lid's travel. Looking down narrows
    # the fissure, looking up a little does not.
    assert (up.left, down.left) == pytest.approx((AWAKE + 0.85 * 0.222, AWAKE - 0.222))
    assert model.step(0.0, radians(-80.0), None).lower_left == 1.0
    still = still_lids(law="nakamoto").step(0.0, radians(-30.0), None)
    assert (still.left, still.lower_left) == (0.75, LOWER_AWAKE)


def test_lids_glide_to_what_they_are_retuned_to():
    model = still_lids()
    before = model.step(1.0, radians(-20.0), None)
    model.retune(LidParams(blinks_per_min=0.0, rest_opening=0.3, law="nakamoto"))
    assert model.step(1.0, radians(-20.0), None) == before
    trace = [before, *(model.step(1.0 + k * DT, radians(-20.0), None) for k in range(70))]
    assert np.abs(np.diff(np.array(trace), axis=0)).max() <= 1.875 * 0.5 * DT / 0.3 + 1e-9
    assert trace[-1][0] == pytest.approx(0.3) and trace[-1][3] == pytest.approx(LOWER_AWAKE)


# ---- Whatever the parameters and whatever happens, lids stay between shut and open and never jump.


STEEPEST = 1.875  # slope of minimum jerk at its middle
GLIDE_S = 0.3
# To simplify sixty numbers takes minutes; the found example is sufficient.
WITHOUT_SHRINKING = (Phase.explicit, Phase.generate)


SHUT = [closure(1.0 + s, 0.0, 1.0, 1.0) for s in np.linspace(0.0, 1.0, 2_001)]
OPENING = float(-np.diff(SHUT).min() * 2_000)
"""Steepest slope of an opening that takes 1 s."""


def admissible():
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


def happen(model, event, other, t_s):
    if event.what in ("left", "right"):
        model.wink(event.what, t_s + event.level - 0.5)
    elif event.what in ("rest", "conversation"):
        model.set_conversation(event.what == "conversation")
    elif event.what == "retune":
        model.retune(other)


def fastest_per_s(params):
    """Return the steepest slope that blink and glide may have together."""
    blink = max(STEEPEST / (params.close_ms / 1e3), OPENING / (params.open_ms / 1e3))
    return blink + 4.0 * STEEPEST / GLIDE_S  # following changes as well, by up to 60 deg


@settings(max_examples=30, phases=WITHOUT_SHRINKING)
@given(admissible(), admissible(), st.lists(EVENTS, min_size=1, max_size=10), st.integers(0, 99))
def test_lids_stay_within_bounds_and_never_jump(first, other, events, seed):
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
