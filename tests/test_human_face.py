"""Rests on a face and looks away from it in a running robot; the long form is tests/human."""

import numpy as np
import pytest
from human.measured_run import MeasuredRun, half_rate_run
from human.row_03_rests import beyond_the_law, visits
from human.row_09_mutual_gaze import nearest, stays
from human.row_11_in_flight import pauses_ms


@pytest.fixture(scope="module")
def run() -> MeasuredRun:
    # Rests are those of the plan, which servos without bytes show as well.
    return half_rate_run("face-to-face", seconds=45.0)


def test_e63_rests_on_a_face_are_as_different_as_peoples(run: MeasuredRun) -> None:
    found = visits(run)
    rests = np.array([visit.rest_s for visit in found])
    lasting = np.array([visit.seconds for visit in found])
    assert len(found) > 60
    assert 2.3 < 1.0 / lasting.mean() < 3.2
    assert (rests < 0.15 - 1e-6).mean() <= 0.08
    assert 0.4 < rests.std() / rests.mean() < 0.8
    assert 0.03 < (rests > 0.5).mean() < 0.2
    # Of 80 rests a slot of 10 ms has .04 more than the law's by chance.
    assert beyond_the_law(rests, [visit.part for visit in found]) < 0.09
    eyes = [visit.part in ("LE", "RE") for visit in found]
    assert 0.33 < np.mean(eyes) < 0.6


def test_e63_a_floor_by_max_is_seen_by_the_measure() -> None:
    rests = np.maximum(np.random.default_rng(0).lognormal(-2.2, 1.0, 200), 0.125)
    assert beyond_the_law(rests, ["RE"] * 200) > 0.3


def test_e69_a_face_is_left_after_bouts_and_entered_at_eyes_or_nose(run: MeasuredRun) -> None:
    every = list(stays(run))
    bouts = [seconds for on, seconds, _ in every if on]
    away = [seconds for on, seconds, _ in every if not on]
    assert len(bouts) >= 7 and 2.0 < np.median(bouts) < 5.0 and max(bouts) < 15.0
    assert 0.25 < np.median(away) < 1.2
    entries = [begin for on, _, begin in every if on]
    assert all(run.part[begin] in nearest(run, begin) for begin in entries)
    assert len({run.part[begin] for begin in entries}) >= 2


def test_e71_no_saccade_comes_sooner_than_100_ms_after_another(run: MeasuredRun) -> None:
    pauses = pauses_ms(run.phase == "saccade", run.t_s)
    assert len(pauses) > 60 and pauses.min() >= 99.0
