"""Blinks, winks, sleepiness and lids that follow the gaze; numbered checks: docs/checks.md."""

from itertools import pairwise
from math import cos, radians, sin

import numpy as np
import pytest
from desk import GAZE_JOINTS, LIDS
from gaze_trace_rig import EXACT

from gazerig.gaze.lids.blink import blink_pause_s
from gazerig.gaze.lids.lids import LidMode, LidParams, Lids, Side
from gazerig.gaze.oculomotor.head import HeadModel
from gazerig.gaze.oculomotor.oculomotor import Oculomotor
from gazerig.gaze.oculomotor.params import HeadParams, PursuitParams
from gazerig.gaze.oculomotor.pursuit import Pursuit
from gazerig.gaze.oculomotor.saccade import SaccadeModel, SaccadeParams
from gazerig.gaze.types import Target
from gazerig.robot.model.kinematics import GeometryParams, Kinematics
from gazerig.robot.model.types import JointState

DT = 0.005
AWAKE = 0.75


def lids(seed: int = 0, **params: float | str | bool) -> Lids:
    alike = {"duration_spread": 0.0, "asymmetry": 0.0}
    return Lids(LidParams(**{**alike, **params}), np.random.default_rng(seed))  # type: ignore[arg-type]


def onsets(model: Lids, seconds: float, start_s: float = 0.0, dt_s: float = DT) -> list[float]:
    times, count = [], model.blinks
    for k in range(round(seconds / dt_s)):
        model.step(start_s + k * dt_s, 0.0, None)
        if model.blinks > count:
            count = model.blinks
            times.append(start_s + k * dt_s)
    return times


ROUGHLY_S = 0.02
"""Fine enough for times between blinks, which are no shorter than 0.6 s."""


@pytest.mark.parametrize(
    ("mode", "rate", "band"), [("rest", 17.0, 3.0), ("conversation", 26.0, 4.0)]
)
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_e50_blink_rate(mode: LidMode, rate: float, band: float, seed: int) -> None:
    model = lids(seed)
    model.set_mode(mode)
    times = np.array(onsets(model, 1200.0, dt_s=ROUGHLY_S))
    gaps = np.diff(times)
    assert len(times) / 20.0 == pytest.approx(rate, abs=band)
    assert 0.5 <= gaps.std() / gaps.mean() <= 1.2
    assert gaps.min() >= 0.6


def test_a_blink_is_part_of_its_interval() -> None:
    fixed = LidParams(interval_distribution="fixed")
    pause_s = blink_pause_s(fixed, 20.0, 0.4, np.random.default_rng(0))
    assert pause_s == pytest.approx(60.0 / 20.0 - 0.4)


def test_e51_blink_shape() -> None:
    model, fine = lids(5, incomplete_share=0.3), 0.001
    times = onsets(model, 240.0)[:50]
    assert len(times) == 50
    model = lids(5, incomplete_share=0.3)
    for onset in times:
        # From before the onset at the tick's rate, then closely: the dice fall alike.
        for k in range(round(onset / DT) - 2, round(onset / DT) + 1):
            model.step(k * DT, 0.0, None)
        t = onset + np.arange(1, 350) * fine
        shut = 1.0 - np.array([model.step(float(s), 0.0, None)[0] for s in t]) / AWAKE
        deepest = shut.max()
        assert deepest == pytest.approx(1.0) or 0.60 - 1e-9 <= deepest <= 0.95 + 1e-9
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
    ("size_deg", "low", "high"), [(10.0, 0.05, 0.35), (20.0, 0.45, 0.85), (40.0, 0.9, 1.0)]
)
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_e52_gaze_evoked_blinks(size_deg: float, low: float, high: float, seed: int) -> None:
    shifts = Shifts(size_deg, lids(seed, blinks_per_min=0.0))
    assert low <= shifts.share <= high
    assert max(shifts.counts) == 1
    assert max(shifts.delays) <= 0.060


def test_shifts_in_quick_succession_share_one_blink() -> None:
    model, times = lids(0, blinks_per_min=0.0), []
    for k in range(2000):
        count = model.blinks
        model.step(k * DT, 0.0, radians(-60.0) if k % 20 == 0 else None)
        if model.blinks > count:
            times.append(k * DT)
    assert len(times) > 10
    assert min(b - a for a, b in pairwise(times)) >= 0.6 - 1e-9


@pytest.mark.parametrize("literal", [False, True])
def test_e53_no_blink_storm(literal: bool) -> None:
    model = lids(2, gaze_evoked_blink_literal=literal)
    model.step(0.0, 0.0, radians(40.0))  # the shift that left the head 40 deg aside
    onsets(model, 60.0, DT)
    assert 5 <= model.blinks <= 25


@pytest.mark.parametrize("literal", [False, True])
def test_e53_no_blink_storm_with_the_head_held_aside(literal: bool) -> None:
    kinematics = Kinematics(GeometryParams(0.0, 0.0, 0.0), GAZE_JOINTS, LIDS)
    span = (-radians(55.0), radians(55.0))
    model = Oculomotor(
        EXACT,
        kinematics,
        ((span, span), (span, span)),
        SaccadeModel(SaccadeParams()),
        Pursuit(PursuitParams()),
        HeadModel(HeadParams(), radians(55.0), (span, span)),
        lids(2, gaze_evoked_blink_literal=literal),
    )
    held = JointState((0.0,) * 6 + (radians(40.0), 0.0, 0.0), (0.0,) * 9, (0.0,) * 9, ())
    state = kinematics.forward(held)
    aside = (np.cos(radians(40.0)), np.sin(radians(40.0)), 0.0)
    target = Target(aside, (0.0, 0.0, 0.0), 0.0, "face", 1, 0.5, True, None, 1, "")
    commands = [model.step(target, state, k * 0.02, 0.02) for k in range(round(60.0 / 0.02))]
    assert 5 <= commands[-1].blinks <= 25


def test_the_literal_rule_blinks_with_every_large_shift_and_no_small_one() -> None:
    def literal() -> Lids:
        return lids(
            gaze_evoked_blink_literal=True, blinks_per_min=0.0, gaze_evoked_blink_jitter_ms=0.0
        )

    large = Shifts(20.5, literal())
    assert large.counts == [1] * 200 and max(large.delays) == 0.0
    assert Shifts(-20.5, literal()).share == 1.0
    assert Shifts(19.5, literal()).share == 0.0


def test_e74_a_shift_of_3_degrees_brings_no_blink() -> None:
    assert Shifts(3.0, lids(blinks_per_min=0.0)).share == 0.0
    assert Shifts(5.9, lids(blinks_per_min=0.0)).share == 0.0


def test_e74_blinks_of_new_targets_begin_about_when_the_gaze_does_before_it_or_after() -> None:
    """A person moves from side to side every 2 s; eyes and head wait for the lids."""
    span = (-radians(60.0), radians(60.0))
    kinematics = Kinematics(GeometryParams(0.0, 0.0, 0.0), GAZE_JOINTS, LIDS)
    model = Oculomotor(
        EXACT,
        kinematics,
        ((span, span), (span, span)),
        SaccadeModel(SaccadeParams()),
        Pursuit(PursuitParams()),
        HeadModel(HeadParams(), radians(60.0), (span, span)),
        lids(3, blinks_per_min=0.0),
    )
    state = kinematics.forward(JointState((0.0,) * 9, (0.0,) * 9, (0.0,) * 9, ()))
    blinks_s, waits_s, counts, every = [], [], (0, 0), 400
    for k in range(120 * every):
        side = radians(20.0) * (1 if k // every % 2 else -1)
        at = (2.0 * cos(side), 2.0 * sin(side), 0.2)
        seen_s = k // 10 * 10 * DT  # twenty frames a second
        target = Target(at, (0.0,) * 3, seen_s, "face", 1, 0.5, True, None, k // every, "")
        command = model.step(target, state, k * DT, DT)
        if command.blinks > counts[1]:
            blinks_s.append((k // every, k % every * DT))
        if command.saccades > counts[0]:
            waits_s.append((k // every, k % every * DT))
        counts = command.saccades, command.blinks
    first = dict(reversed(waits_s))
    apart = np.array([at - first[look] for look, at in blinks_s])
    assert len(apart) >= 108  # 40 deg nearly always bring one, and one only
    assert len({look for look, _ in blinks_s}) == len(blinks_s)
    assert np.abs(apart).max() <= 0.066 and abs(np.median(apart)) <= 0.012
    assert 0.3 < (apart < -0.001).mean() < 0.7 and (np.abs(apart) < 0.001).mean() < 0.15
    assert max(first.values()) <= 0.066 and min(first.values()) == 0.0


def test_e74_blinks_of_shifts_that_come_unforeseen_set_off_after_them() -> None:
    delays = np.array(Shifts(45.0, lids(blinks_per_min=0.0)).delays)
    assert len(delays) >= 190
    assert (delays == 0.0).mean() <= 0.01
    assert 0.015 <= delays.mean() <= 0.035 and delays.std() >= 0.01 and delays.max() <= 0.065


@pytest.mark.parametrize("every_s", [4.0, 10.0])
@pytest.mark.parametrize(("mode", "rate"), [("rest", 17.0), ("conversation", 26.0)])
def test_e74_blinks_with_large_shifts_are_among_the_published_rate(
    mode: LidMode, rate: float, every_s: float
) -> None:
    """Shifts of 40 deg at random times, 6 or 15 a minute; nearly all bring a blink."""
    counts, gaps = [], []
    for replaces in (True, False):
        model = lids(3, gaze_evoked_blink_replaces=replaces)
        model.set_mode(mode)
        rng, last_s, onset_s = np.random.default_rng(9), 0.0, list[float]()
        at_s = float(rng.exponential(every_s))
        for k in range(round(1800.0 / ROUGHLY_S)):
            t_s, shift = k * ROUGHLY_S, None
            if t_s >= at_s and t_s - last_s > 1.0:
                shift, last_s, at_s = radians(40.0), t_s, t_s + float(rng.exponential(every_s))
            before = model.blinks
            model.step(t_s, 0.0, shift)
            if model.blinks > before:
                onset_s.append(t_s)
        counts.append(len(onset_s) / 30.0)
        gaps.append(np.diff(onset_s))
    assert counts[0] == pytest.approx(rate, abs=3.0)
    assert counts[1] > counts[0] + 1.0
    assert gaps[0].min() >= 0.6 and 0.5 <= gaps[0].std() / gaps[0].mean() <= 1.2


@pytest.mark.parametrize(
    ("law", "low", "high"), [("lognormal", 0.5, 1.2), ("exponential", 0.5, 1.0), ("fixed", 0, 0.01)]
)
def test_laws_of_the_intervals_keep_the_mean(law: str, low: float, high: float) -> None:
    gaps = np.diff(onsets(lids(3, interval_distribution=law), 2400.0, dt_s=0.05))
    assert gaps.mean() == pytest.approx(60.0 / 17.0, rel=0.12)
    assert low <= gaps.std() / gaps.mean() <= high


def test_one_mode_may_be_without_blinks_and_a_change_counts_at_once() -> None:
    model = lids(blinks_per_min=0.0)
    assert onsets(model, 60.0) == []
    model.set_mode("conversation")
    assert 8 <= len(onsets(model, 30.0, 60.0)) <= 20
    model.set_mode("rest")
    assert onsets(model, 60.0, 90.0) == []


def test_the_same_mode_again_changes_nothing() -> None:
    plain, reported = lids(4), lids(4)
    times = []
    for k in range(12_000):
        reported.set_mode("rest")
        count = reported.blinks
        reported.step(k * DT, 0.0, None)
        if reported.blinks > count:
            times.append(k * DT)
    assert times == onsets(plain, 60.0)


def test_share_of_incomplete_blinks() -> None:
    model, depths = lids(6), []
    onset, deepest = 0, 0.0
    for k in range(round(1200.0 / 0.01)):  # the bottom of a blink lasts twice as long
        shut = 1.0 - model.step(k * 0.01, 0.0, None)[0] / AWAKE
        if model.blinks > onset:
            onset = model.blinks
            depths.append(deepest)
            deepest = 0.0
        deepest = max(deepest, shut)
    shallow = [d for d in depths[1:] if d < 0.99]
    assert 0.45 <= len(shallow) / len(depths) <= 0.55
    assert min(shallow) >= 0.599 and max(shallow) <= 0.951
    assert 0.8 <= np.mean(shallow) <= 0.86, "most of them nearly shut"


def test_doubles_are_off_and_can_be_had() -> None:
    gaps = np.diff(onsets(lids(7, double_share=0.2), 600.0))
    close = gaps[gaps < 0.6]
    assert 0.12 <= len(close) / len(gaps) <= 0.28
    assert close == pytest.approx(0.285 + 0.1, abs=0.006)


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_wink_shuts_one_lid_and_opens_it_again(side: Side) -> None:
    model, index = lids(blinks_per_min=0.0), 0 if side == "left" else 1
    model.step(0.995, 0.0, None)
    model.wink(side, 1.0)
    trace = np.array([model.step(1.0 + k * DT, 0.0, None) for k in range(200)])
    assert trace[0, index] == AWAKE and trace[-1, index] == AWAKE
    assert 0.2 <= (trace[:, index] < 0.001).sum() * DT <= 0.25
    assert (trace[:, 1 - index] == AWAKE).all()
    assert model.blinks == 0 and not trace[:, 2].any()


def test_a_late_or_repeated_wink_makes_no_jump() -> None:
    model = lids(blinks_per_min=0.0)
    model.step(5.0, 0.0, None)
    model.wink("left", 4.9)
    left = [AWAKE]
    for k in range(1, 200):
        if k % 5 == 0:
            model.wink("left", 5.0 + k * DT)
        left.append(model.step(5.0 + k * DT, 0.0, None)[0])
    assert np.abs(np.diff(left)).max() <= 1.875 * AWAKE * DT / 0.075 + 1e-9


def test_no_blink_spoils_a_wink() -> None:
    model, right = lids(1, interval_distribution="fixed", gaze_evoked_blink_literal=True), []
    first = onsets(lids(1, interval_distribution="fixed"), 10.0)[0]
    model.step(first - 0.1, 0.0, None)
    model.wink("left", first - 0.1)
    for k in range(80):
        shift = radians(60.0) if k == 20 else None
        right.append(model.step(first - 0.1 + k * DT, 0.0, shift)[1])
    assert set(right) == {AWAKE} and model.blinks == 0
    assert len(onsets(model, 3.0, first + 0.3)) == 1


def test_sleepy_lids_sink_slowly_and_blink_long() -> None:
    model = lids(blinks_per_min=0.0)
    model.step(1.0, 0.0, None)
    model.set_sleepiness(1.0)
    trace = [model.step(1.0 + k * DT, 0.0, None)[0] for k in range(300)]
    assert trace[0] == AWAKE and trace[-1] == pytest.approx(AWAKE * 0.35)
    assert all(b <= a for a, b in pairwise(trace))
    assert np.abs(np.diff(trace)).max() < 0.01
    model.step(3.0, 0.0, radians(90.0))
    blinking = [model.step(3.0 + k * DT, 0.0, None)[2] for k in range(1, 300)]
    assert sum(blinking) * DT == pytest.approx(3 * 0.285, abs=0.02)
    model.set_sleepiness(0.0)
    model.step(9.0, 0.0, None)
    assert model.step(11.0, 0.0, None)[0] == AWAKE
    assert lids(sleepy_level=1.0, blinks_per_min=0.0).step(0.0, 0.0, None)[0] < 0.3


def test_commands_that_make_no_sense_are_refused() -> None:
    model = lids()
    with pytest.raises(ValueError, match="modes: rest, conversation"):
        model.set_mode("talk")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="sides: left, right"):
        model.wink("both", 0.0)  # type: ignore[arg-type]
    for level in (-0.1, 1.1, float("nan")):
        with pytest.raises(ValueError, match="0..1"):
            model.set_sleepiness(level)


def test_lids_follow_the_eyes_and_stay_between_shut_and_open() -> None:
    model = lids(blinks_per_min=0.0)
    level, up, down = (model.step(0.0, radians(a), None)[0] for a in (0.0, 10.0, -10.0))
    assert level - down == pytest.approx(0.222)  # gain 1 for a lid that travels 45 deg
    assert 0.7 <= (up - level) / (level - down) < 1.0
    assert model.step(0.0, radians(80.0), None)[0] == 1.0
    assert model.step(0.0, radians(-89.0), None)[0] == 0.0


def test_same_dice_same_blinks() -> None:
    assert onsets(lids(7), 60.0) == onsets(lids(7), 60.0) != onsets(lids(8), 60.0)


def test_no_two_blinks_are_alike_and_no_two_eyes() -> None:
    model = lids(3, duration_spread=0.2, asymmetry=0.06)
    rows = np.array([model.step(k * DT, 0.0, None) for k in range(round(600.0 / DT))])
    edges = np.flatnonzero(np.diff(rows[:, 2]))
    lasting = DT * (edges[1::2] - edges[::2])[: len(edges) // 2]
    assert 0.02 < lasting.std() < 0.08 and 0.25 < lasting.mean() < 0.33
    apart = np.abs(rows[:, 0] - rows[:, 1])
    assert 0.01 < apart.max() < 0.2 and apart[rows[:, 2] == 0.0].max() == 0.0
    # A complete blink shuts both eyes.
    shut = rows[:, :2].min(axis=1) < 1e-6
    assert shut.any() and rows[shut, :2].max() < 0.2


def test_the_eyes_turn_down_and_towards_the_nose_in_a_blink_and_back_before_the_lids() -> None:
    model = lids(3, incomplete_share=0.0, blinks_per_min=20.0)
    turns, shut = [], []
    for k in range(round(60.0 / DT)):
        shut.append(model.step(k * DT, 0.0, None).blink)
        turns.append(model.eye_turn_rad(k * DT) or ((0.0, 0.0), (0.0, 0.0)))
    (left_yaw, left_pitch), (right_yaw, right_pitch) = np.degrees(np.array(turns)).transpose(
        1, 2, 0
    )
    assert left_pitch.min() == pytest.approx(-1.3, abs=0.1) and left_pitch.max() < 1e-9
    assert left_yaw.min() == pytest.approx(-0.7, abs=0.1) and right_yaw.max() == pytest.approx(
        0.7, abs=0.1
    )
    assert (right_pitch == left_pitch).all()
    assert not np.any((left_pitch < -1e-9) & ~np.array(shut))
    assert lids(eye_down_deg=0.0, eye_nasal_deg=0.0).eye_turn_rad(0.0) is None
