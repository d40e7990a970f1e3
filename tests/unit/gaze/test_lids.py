"""Blinks, winks and lids that follow the gaze."""

from collections.abc import Callable
from math import radians
from typing import NamedTuple

import numpy as np
import pytest
from gaze_targets import DT
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from gazerig.gaze.lids.blink import LAWS, LidParams, blink_depth, closure
from gazerig.gaze.lids.lids import Lids, Side
from gazerig.params import declarations

AWAKE = 0.75


def lids(seed: int = 0, **params: float | str) -> Lids:
    return Lids(LidParams(**params), np.random.default_rng(seed))  # type: ignore[arg-type]


def onsets(
    model: Lids,
    seconds: float,
    start_s: float = 0.0,
    dt_s: float = DT,
    shift: Callable[[float], float | None] = lambda t_s: None,
) -> list[float]:
    """Return when blinks begin; shift: size of a gaze shift at a time, in radians."""
    times = []
    for k in range(round(seconds / dt_s)):
        t_s, before = start_s + k * dt_s, model.blinks
        model.step(t_s, 0.0, shift(t_s))
        if model.blinks > before:
            times.append(t_s)
    return times


ROUGHLY_S, FINE_S = 0.02, 0.01
"""Fine enough for times between blinks, which are no shorter than 0.6 s; and for blinks."""


def test_e51_blink_shape():
    model, fine = lids(5, law="nakamoto"), 0.001
    times = onsets(model, 120.0)[:20]
    assert len(times) == 20
    model = lids(5, law="nakamoto")
    for onset in times:
        # From before the onset at the tick's rate, then closely: the dice fall alike.
        for k in range(round(onset / DT) - 2, round(onset / DT) + 1):
            model.step(k * DT, 0.0, None)
        t = onset + np.arange(1, 350) * fine
        shut = 1.0 - np.array([model.step(float(s), 0.0, None)[0] for s in t]) / AWAKE
        deepest = shut.max()
        assert deepest == pytest.approx(1.0)
        at_bottom = t[shut >= 0.999 * deepest]
        moving = t[shut > 0.001 * deepest]
        assert 0.060 <= at_bottom[0] - moving[0] <= 0.100
        assert 0.020 <= at_bottom[-1] - at_bottom[0] <= 0.060
        assert 0.130 <= moving[-1] - at_bottom[-1] <= 0.250
        speed = np.diff(shut)
        assert speed.max() >= 1.5 * -speed.min()


SOON_THEN_ROUGHLY_S = (*np.arange(0.0, 0.1, DT).tolist(), *np.arange(0.1, 3.0, 0.02).tolist())
"""Times after a shift: every tick while its blink may begin, then fine enough to count one."""


class Shifts:
    """200 shifts of one size, 3 s apart, each seen by its own dice."""

    def __init__(self, size_deg: float, model: Lids) -> None:
        self.delays: list[float] = []
        self.counts: list[int] = []
        for n in range(200):
            shift_s, before = n * 3.0, model.blinks
            for after_s in SOON_THEN_ROUGHLY_S:
                count = model.blinks
                model.step(shift_s + after_s, 0.0, radians(size_deg) if after_s == 0.0 else None)
                if model.blinks > count:
                    self.delays.append(after_s)
            self.counts.append(model.blinks - before)

    @property
    def share(self) -> float:
        return sum(n > 0 for n in self.counts) / 200


@pytest.mark.parametrize(
    ("law", "size_deg", "low", "high", "latest_s"),
    [
        ("people", 5.9, 0.0, 0.0, 0.0),
        ("people", 10.0, 0.05, 0.35, 0.06),
        ("people", 20.0, 0.45, 0.85, 0.06),
        ("people", 40.0, 0.9, 1.0, 0.06),
        ("nakamoto", 19.5, 0.0, 0.0, 0.0),
        ("nakamoto", 20.5, 1.0, 1.0, 0.0),
        ("nakamoto", -20.5, 1.0, 1.0, 0.0),
        ("none", 90.0, 0.0, 0.0, 0.0),
    ],
)
def test_e52_gaze_evoked_blinks(
    law: str, size_deg: float, low: float, high: float, latest_s: float
):
    shifts = Shifts(size_deg, lids(law=law, blinks_per_min=0.0))
    assert low <= shifts.share <= high and max(shifts.counts) <= 1
    assert max(shifts.delays, default=0.0) <= latest_s


def test_e74_an_announced_shift_waits_for_the_blink_that_precedes_it():
    apart_s, waits_s = [], []
    for seed in range(200):
        model = lids(seed, blinks_per_min=0.0)
        waits_s.append(model.draw_blink_of_shift(radians(60.0), 1.0, 1.0))
        first = 1 + round(waits_s[-1] / 0.001)
        ticks = iter([None] * first + [radians(60.0)] + [None] * 999)
        blinks_s = onsets(model, 0.2, 1.0, 0.001, lambda t_s, ticks=ticks: next(ticks))  # type: ignore[misc]
        assert len(blinks_s) <= 1, "it has its blink already"
        apart_s += [blink_s - 1.0 - waits_s[-1] for blink_s in blinks_s]
    apart = np.array(apart_s)
    assert len(apart) >= 190 and np.abs(apart).max() <= 0.066 and abs(np.median(apart)) <= 0.012
    assert 0.3 < (apart < -0.001).mean() < 0.7
    assert min(waits_s) == 0.0 and 0.03 < max(waits_s) <= 0.066


def test_e74_blinks_of_shifts_that_come_unforeseen_set_off_after_them():
    delays = np.array(Shifts(45.0, lids(blinks_per_min=0.0)).delays)
    assert len(delays) >= 190
    assert (delays == 0.0).mean() <= 0.01
    assert 0.015 <= delays.mean() <= 0.035 and delays.std() >= 0.01 and delays.max() <= 0.065


@pytest.mark.parametrize("every_s", [4.0, 10.0])
@pytest.mark.parametrize(
    ("law", "converses", "low", "high"),
    [("people", False, 14.0, 20.0), ("people", True, 23.0, 29.0), ("nakamoto", False, 18.0, 32.0)],
)
def test_e74_blinks_with_large_shifts_are_among_the_published_rate(
    law: str, converses: bool, low: float, high: float, every_s: float
):
    """Shifts of 40 deg at random times, 6 or 15 a minute; nearly all bring a blink."""
    model = lids(3, law=law)
    model.set_conversation(converses)
    rng, times = np.random.default_rng(9), [0.0]
    at_s = [float(rng.exponential(every_s))]

    def shift(t_s: float) -> float | None:
        if t_s < at_s[-1] or t_s - times[-1] <= 1.0:
            return None
        times.append(t_s)
        at_s.append(t_s + float(rng.exponential(every_s)))
        return radians(40.0)

    onset_s = onsets(model, 1800.0, dt_s=ROUGHLY_S, shift=shift)
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


def test_share_of_incomplete_blinks():
    rng = np.random.default_rng(6)
    depths = np.array([blink_depth(LAWS["people"], rng) for _ in range(2000)])
    shallow = depths[depths < 0.99]
    assert 0.45 <= len(shallow) / len(depths) <= 0.55
    assert min(shallow) >= 0.6 and max(shallow) <= 0.95
    assert 0.8 <= np.mean(shallow) <= 0.86, "most of them nearly shut"


@pytest.mark.parametrize(
    ("side", "shuts", "stays"), [("left", [0, 3], [1, 4]), ("right", [1, 4], [0, 3])]
)
def test_a_wink_shuts_both_lids_of_one_eye_and_opens_them_again(
    side: Side, shuts: list[int], stays: list[int]
):
    model = lids(blinks_per_min=0.0)
    model.step(0.995, 0.0, None)
    model.wink(side, 1.0)
    trace = np.array([model.step(1.0 + k * DT, 0.0, None) for k in range(200)])
    still = [AWAKE, 0.8]
    assert (trace[[0, -1]][:, shuts] == still).all() and (trace[:, stays] == still).all()
    shut_s = (trace[:, shuts] < 0.001).sum(axis=0) * DT
    assert ((shut_s >= 0.2) & (shut_s <= 0.25)).all()
    assert model.blinks == 0 and not trace[:, 2].any()


def test_no_two_blinks_are_alike():
    model = lids(3)
    rows = np.array([model.step(k * FINE_S, 0.0, None) for k in range(round(300.0 / FINE_S))])
    edges = np.flatnonzero(np.diff(rows[:, 2]))
    lasting = FINE_S * np.diff(edges)[::2]
    assert 0.02 < lasting.std() < 0.08 and 0.25 < lasting.mean() < 0.33


# ---- Lower lids: they go with the gaze and meet the upper ones in a blink.


LOWER_AWAKE = 0.8


def still_lids(**params: float | str) -> Lids:
    """Return lids that do not blink by themselves."""
    chosen = LidParams(**{"blinks_per_min": 0.0, **params})  # type: ignore[arg-type]
    return Lids(chosen, np.random.default_rng(0))


def test_lower_lids_follow_by_less_than_the_upper_ones_and_evenly():
    model = still_lids()
    level, up, down = (model.step(0.0, radians(a), None) for a in (0.0, 10.0, -10.0))
    assert level.lower_left == level.lower_right == LOWER_AWAKE
    assert up.lower_left == pytest.approx(LOWER_AWAKE - 0.08)
    assert down.lower_left == pytest.approx(LOWER_AWAKE + 0.08)
    # On lids that travel 45 and 30 deg: a quarter of the upper lid's travel.
    way = 30.0 * (down.lower_left - level.lower_left) / (45.0 * (level.left - down.left))
    assert way == pytest.approx(2.2 / 9.1, abs=0.01)
    # Looking down narrows the fissure, looking up a little does not.
    assert 45.0 * down.left + 30.0 * down.lower_left < 45.0 * level.left + 30.0 * level.lower_left
    assert 45.0 * up.left + 30.0 * up.lower_left > 45.0 * level.left + 30.0 * level.lower_left
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


@settings(max_examples=30, phases=WITHOUT_SHRINKING)
@given(admissible(), admissible(), st.lists(EVENTS, min_size=1, max_size=10), st.integers(0, 99))
def test_lids_stay_within_bounds_and_never_jump(
    first: LidParams, other: LidParams, events: list[Event], seed: int
):
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


def test_rounding_errors_lead_no_lid_beyond_shut_or_open():
    # Minimum jerk comes out beyond its end by up to 2e-15 just before it.
    near = 1.0 - np.logspace(-2.0, -8.0, 4001)
    assert min(closure(1.0 + float(s), 0.0, 1.0, 1.0) for s in near) == 0.0
    winking = Lids(LidParams(blinks_per_min=0.0, close_ms=500.0), np.random.default_rng(0))
    winking.wink("left", 0.0)
    winks = [winking.step(0.5 * float(t_s), 0.0, None) for t_s in near]
    assert min(o.left for o in winks) == min(o.lower_left for o in winks) == 0.0
