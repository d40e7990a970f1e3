"""Measures of landings, rests, gains, blinks and reactions, from synthetic traces."""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from made_traces import run_of, verdicts

from gazerig.features.lab.analysis.reaction_finder import ReactionFinder
from gazerig.features.lab.report import blinks, eye_contact, landing, rests
from gazerig.features.lab.report.gaze_trace import GazeTrace, TraceRow
from gazerig.features.lab.report.lid_closure import blinks_of
from gazerig.gaze.lids.lids import LidParams, Lids
from gazerig.gaze.types import Bodies, Percept
from gazerig.robot.analysis.blink_finder import BlinkEvent
from gazerig.robot.analysis.event_detector import Commanded, SaccadeEvent
from gazerig.robot.control.tick import Tick


def flown(
    jumps: list[tuple[float, float, float]], goal: float = 12.0, over: float = 0.0
) -> GazeTrace:
    """Make a run of planned saccades to a goal, onset in s, and from and to in deg of yaw.

    over: how far the gaze swings beyond in flight, in deg
    """
    t = np.arange(0.0, 3.0, 0.005)
    rows = np.zeros((len(t), len(TraceRow._fields)))
    column = {name: at for at, name in enumerate(TraceRow._fields)}
    rows[:, column["t"]], rows[:, column["target_yaw"]] = t, goal
    gaze, events = np.full(len(t), jumps[0][1]), []
    for onset, start, end in jumps:
        s = np.clip((t - onset) / 0.05, 0.0, 1.0)
        gaze += (end - start) * s * s * (3.0 - 2.0 * s)
        gaze += over * np.exp(-(((t - onset - 0.06) / 0.008) ** 2))
        rows[(t >= onset) & (t < onset + 0.05), column["phase"]] = 1.0
        size = abs(end - start)
        events.append(
            SaccadeEvent(onset, 0.05, size, 300.0, 0.4, Commanded(onset, 0.05, size, 300.0))
        )
    rows[:, column["gaze_yaw"]] = gaze
    return GazeTrace(rows, tuple(events), (), ())


def test_a_landing_is_short_and_corrected_or_beyond() -> None:
    short = landing.landings(flown([(0.5, 0.0, 11.0), (0.7, 11.0, 12.0)]))
    assert short[0] == pytest.approx((11.0 / 12.0, 1.0), abs=0.01) and len(short) == 1
    late = landing.landings(flown([(0.5, 0.0, 11.0), (1.1, 11.0, 12.0)]))
    assert late[0, 1] == 0.0
    assert landing.overshoots(flown([(0.5, 0.0, 12.0)])) == pytest.approx([0.0], abs=0.01)
    assert landing.overshoots(flown([(0.5, 0.0, 12.0)], over=1.8)) == pytest.approx(
        [0.15], abs=0.03
    )


def test_an_eye_at_the_end_of_its_range_has_not_landed() -> None:
    run = flown([(0.5, 0.0, 11.0), (1.1, 11.0, 12.0)])
    rows = run.rows.copy()
    rows[80:200, TraceRow._fields.index("eye_limited")] = 1.0
    assert len(landing.landings(run)) == 1
    assert len(landing.landings(replace(run, rows=rows))) == 0


def test_a_floor_under_rests_is_a_spike_and_a_smooth_law_is_none() -> None:
    dice = np.random.default_rng(2)
    smooth = [dice.lognormal(-1.4, 0.45, 600) for _ in range(40)]
    found = [rests.spike(each) for each in smooth]
    assert abs(np.mean(found)) < 0.005 and max(found) < 0.04  # chance makes none
    assert all(rests.spike(np.maximum(each, 0.2)) > 0.2 for each in smooth)


@pytest.mark.parametrize(("gain", "verdict"), [(0.97, "pass"), (1.2, "outside")])
def test_the_highest_gain_knows_how_uncertain_it_is(gain: float, verdict: str) -> None:
    """A face sways at all frequencies below 1 Hz; what the gaze adds is noise."""
    dice = np.random.default_rng(5)
    t = np.arange(0.0, 300.0, 0.02)
    f = dice.uniform(0.05, 1.0, 40)
    phases = dice.uniform(0.0, 2.0 * np.pi, 40)
    target = np.sin(2.0 * np.pi * np.outer(t, f) + phases).sum(axis=1)
    speed = (2.0 * np.pi * f * np.cos(2.0 * np.pi * np.outer(t, f) + phases)).sum(axis=1)
    rows = np.zeros((len(t), len(TraceRow._fields)))
    noise = np.convolve(dice.standard_normal(len(t)), np.ones(50) / 4.0, "same")
    for name, values in (("t", t), ("target_yaw", target), ("target_yaw_rate", speed),
                         ("gaze_yaw", gain * target + noise)):  # fmt: skip
        rows[:, TraceRow._fields.index(name)] = values
    most = verdicts(GazeTrace(rows, (), (), ()))["pursuit_most"]
    assert most.value > gain + 0.01  # the largest of many is beyond the truth
    assert most.low95 < gain + 0.02 and most.high95 - most.low95 > 0.03
    assert most.verdict == verdict


def looked(*looks_s: tuple[float, float]) -> GazeTrace:
    """Make a run of 30 s in which the gaze is on the face at these times."""
    t = np.arange(0.0, 30.0, 0.01)
    rows = np.full((len(t), len(TraceRow._fields)), np.nan)
    rows[:, TraceRow._fields.index("t")] = t
    on = np.any([(t >= begin) & (t < end) for begin, end in looks_s], axis=0)
    for name in ("face_y", "face_z"):
        rows[:, TraceRow._fields.index(name)] = np.where(on, 0.0, 1.0)
    return GazeTrace(rows, (), (), ())


@pytest.mark.parametrize("cut", [(0.0, 6.0), (22.0, 31.0)], ids=["begins", "ends"])
def test_a_look_that_the_run_cuts_off_is_no_whole_bout(cut: tuple[float, float]) -> None:
    """Its full length is unknown; only a lower bound is known."""
    found = {m.key: m for m in eye_contact.measures(looked((10.0, 12.0), (15.0, 19.0), cut))}
    for key in ("bout_none", "bout_talk", "bout_listen"):
        assert sorted(found[key].rows) == pytest.approx([2.0, 4.0], abs=0.02)
    assert found["longest_look"].rows.max() == pytest.approx(min(cut[1], 30.0) - cut[0], abs=0.02)


def test_a_blink_that_comes_with_a_glance_begins_when_it_does() -> None:
    """The lids go down with the eyes at 1.0 s, and shut .1 s later; they stay low."""
    t = np.arange(0.0, 20.0, 0.005)
    lids = Lids(LidParams(), np.random.default_rng(0))
    pitch = np.where(t % 4.0 < 1.0, 10.0, -10.0)
    pitch = np.convolve(np.pad(pitch, 5, "edge"), np.ones(11) / 11.0, "valid")
    rest = 0.55 + 0.025 * pitch
    shut = np.array([lids.closure(s % 4.0 - 1.1) for s in t])
    found = blinks_of(t, rest * (1.0 - shut), pitch)
    assert [b.onset_s % 4.0 for b in found] == pytest.approx([1.1] * 5, abs=0.01)
    assert all(b.depth > 0.95 for b in found)
    assert blinks_of(t, rest, pitch) == ()  # a glance down is none
    assert blinks_of(t, np.full(len(t), np.nan), pitch) == ()


def test_a_shift_of_eyes_that_are_shut_brings_no_blink() -> None:
    run = run_of([(40.0, 120.0, 400.0, 0.3)] * 40)
    with_each = tuple(BlinkEvent(0.4 * n + 0.03, 0.08, 0.04, 0.19, 1.0, 20.0, 10.0)
                      for n in range(0, 40, 4))  # fmt: skip
    trials = blinks.evoked_blinks(replace(run, blinks=with_each))
    # The next shift comes .4 s later, .07 s after the lids are open again: no trial.
    assert len(trials) == 30 and trials[:, 1].sum() == 10


def test_blinks_that_begin_with_saccades_are_told_from_others() -> None:
    run = run_of([(5.0, 40.0, 200.0, 0.45)] * 40)
    for late_s, share in ((0.0, 1.0), (0.05, 0.0)):
        shuts = tuple(
            BlinkEvent(0.4 * n + late_s, 0.08, 0.04, 0.19, 0.9, 20.0, 10.0) for n in range(20)
        )
        seen = verdicts(replace(run, blinks=shuts))
        assert seen["blink_tied"].value == share
        assert seen["blink_partial"].value == 1.0 and seen["blink_partial"].verdict == "outside"


def test_reactions_begin_with_the_first_frame_and_are_told_from_choices() -> None:
    def tick(t_s: float, ids: tuple[int, ...], on: int, saccades: int) -> Tick:
        n = len(ids)
        zero = np.zeros((n, 3))
        seen = Bodies(ids, ("hand",) * n, zero, zero, zero, np.zeros(n))
        return cast(
            Tick,
            SimpleNamespace(
                t_s=t_s, percept=Percept(t_s - 0.06, seen), stopped="",
                target=SimpleNamespace(kind="hand", id=on),
                gaze=SimpleNamespace(saccades=saccades),
            ),
        )  # fmt: skip

    finder = ReactionFinder()
    assert finder.update(tick(1.0, (1,), 1, 0)) is None
    assert finder.update(tick(1.1, (1,), 1, 1)) is None  # was there from the beginning
    assert finder.update(tick(2.0, (1, 2), 1, 1)) is None
    found = finder.update(tick(2.2, (1, 2), 2, 2))
    assert found is not None and found.latency_s == pytest.approx(0.26)
    assert finder.update(tick(2.5, (1, 2), 2, 3)) is None  # no longer new
    assert finder.update(tick(3.0, (1, 2, 3), 2, 3)) is None
    assert finder.update(tick(4.5, (1, 2, 3), 3, 4)) is None  # a choice
