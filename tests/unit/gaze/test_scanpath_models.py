"""The simple model, face tracking, random angles, and the readings of the measured walk."""

from dataclasses import replace
from math import degrees

import numpy as np
import pytest
from msgspec import structs

from gazerig.config.load import load, shipped_path
from gazerig.gaze.angles import add, angle_between, norm, rotation, scale, sub, yaw_pitch
from gazerig.gaze.angles import rotate_back as seen_from
from gazerig.gaze.scanpath.scanpath import (
    Scanpath,
    ScanpathParams,
    Walk,
    merge_refixations,
    normalise,
    row_sums_note,
)
from gazerig.gaze.types import PARTS, Face, Percept, Target

WALK = load(shipped_path("scanpaths", "nakamoto_tsuruno"), Walk)
HEAD = (0.02, -0.01, 0.25)
FACING = ((-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0))


def face_at(p, v=(0.0, 0.0, 0.0), number=3):
    parts = tuple(add(p, (0.0, 0.01 * i, 0.0)) for i in range(8))
    nose = PARTS.index("N")
    return Face(number, p, v, FACING, (*parts[:nose], p, *parts[nose + 1 :]), 0.9)


def target_of(face, at_s=0.0):
    at = face.p_world_m, face.v_world_m_s, at_s
    return Target(*at, "face", face.id, 0.5, True, None, 1, "face 3")


FACE = face_at((1.0, 0.3, 0.4))
PERCEPT = Percept(0.0, faces=(FACE,))
TARGET = target_of(FACE)


def looks_of(params, seconds, dt, seed=1):
    path = Scanpath(params, WALK, np.random.default_rng(seed))
    steps = range(round(seconds / dt))
    return [path.wander(TARGET, PERCEPT, k * dt, True, HEAD) for k in steps]


def visits(looks, dt):
    """Parts with their times, the last and unfinished one left out."""
    ends = [k for k in range(1, len(looks)) if looks[k].shift != looks[k - 1].shift]
    starts = [0, *ends]
    return [(looks[a].part, (b - a) * dt) for a, b in zip(starts, ends, strict=False)]


def test_e41_simple_model():
    dt = 0.001
    looks = looks_of(ScanpathParams(model="simple"), 60.0, dt)
    seen = visits(looks, dt)
    assert [part for part, _ in seen[:6]] == ["N", "RE", "LE"] * 2
    wanted = {"N": 0.45942, "RE": 0.40821, "LE": 0.40821}
    for part, time_s in seen:
        # A tick passes before the arrival of the gaze is reported, up to one before the end.
        assert 0.0 <= time_s - wanted[str(part)] <= 2.0 * dt + 1e-9
    assert len(seen) / 60.0 == pytest.approx(2.35, abs=0.02)
    assert {look.centre_world_m for look in looks} == {FACE.p_world_m}


def test_e42_random_baseline():
    from scipy import stats

    dt = 0.005
    looks = looks_of(ScanpathParams(model="random"), 300.0, dt, seed=6)
    starts = [0] + [k for k in range(1, len(looks)) if looks[k].shift != looks[k - 1].shift]
    intervals = np.diff(starts) * dt
    assert intervals.min() >= 0.0 and intervals.max() <= 3.0 + dt
    assert intervals.mean() == pytest.approx(1.5, abs=0.1)
    assert stats.kstest(intervals, stats.uniform(0.0, 3.0).cdf).pvalue > 0.01
    # Eye angles in a head that is turned to the face's centre, as it always is.
    R_world_head = rotation((*yaw_pitch(sub(FACE.p_world_m, HEAD)), 0.0))
    points = [sub(looks[k].p_world_m, HEAD) for k in starts]
    angles = np.degrees([yaw_pitch(seen_from(R_world_head, point)) for point in points])
    for axis in (0, 1):
        assert stats.kstest(angles[:, axis], stats.uniform(-20.0, 40.0).cdf).pvalue > 0.01
    assert abs(np.corrcoef(angles.T)[0, 1]) < 0.2
    assert {look.centre_world_m for look in looks} == {FACE.p_world_m}
    assert {look.part for look in looks} == {None}
    far = norm(sub(FACE.p_world_m, HEAD))
    assert all(norm(point) == pytest.approx(far) for point in points)


def test_e43_face_tracking_stays_at_the_centre_of_a_moving_face():
    path = Scanpath(ScanpathParams(model="face_tracking"), WALK, np.random.default_rng(1))
    start, v = (1.0, -0.6, 0.3), (0.0, 0.3, 0.02)
    worst, shifts = 0.0, set()
    for k in range(800):
        t_s = 0.005 * k
        captured_s = (t_s // 0.033) * 0.033 - 0.05  # 30 pictures a second, each 50 ms old
        face = face_at(add(start, scale(v, captured_s)), v)
        look = path.wander(target_of(face, captured_s), Percept(captured_s, faces=(face,)), t_s,
                           True, HEAD)  # fmt: skip
        aimed = add(look.p_world_m, scale(look.v_world_m_s, t_s - look.at_s))
        true = add(start, scale(v, t_s))
        worst = max(worst, degrees(angle_between(sub(aimed, HEAD), sub(true, HEAD))))
        shifts.add((look.shift, look.part))
    assert worst < 0.5
    assert shifts == {(1, "N")}


@pytest.mark.parametrize("model", ["markov", "simple", "face_tracking", "random"])
def test_every_model_passes_other_targets_on_and_gives_the_head_the_centre(model):
    path = Scanpath(ScanpathParams(model=model), WALK, np.random.default_rng(1))
    hand = structs.replace(TARGET, kind="hand", id=9, why="hand 9")
    assert path.wander(hand, PERCEPT, 0.0, True, HEAD) == hand
    look = path.wander(TARGET, PERCEPT, 0.1, True, HEAD)
    assert look.centre_world_m == FACE.p_world_m
    assert "face 3" in look.why
    unseen = structs.replace(TARGET, id=4)
    assert path.wander(unseen, PERCEPT, 0.2, True, HEAD) == unseen


# ---- readings of the measured walk ----------------------------------------------------


def test_whole_visit_merges_refixations():
    merged = merge_refixations(WALK.matrix)
    assert np.diag(merged).max() == 0.0
    assert merged.sum(axis=1) == pytest.approx(np.ones(8))
    # Proportions between the other parts stay: from N, M to RE as .1 to .3.
    n, m, re = (WALK.order.index(part) for part in ("N", "M", "RE"))
    assert merged[n, re] == pytest.approx(3.0 * merged[n, m])


def test_row_sums_are_reported_as_printed():
    assert WALK.row_sums == pytest.approx((0.9, 0.8, 1.1, 1.1, 0.9, 1.0, 1.0, 0.9))
    assert row_sums_note(WALK) == (
        "the walk's rows do not all sum to 1 (DN 0.9, FL 0.8, LE 1.1, M 1.1, N 0.9, UP 0.9); "
        "they are normalised"
    )
    whole = replace(WALK, matrix=tuple(map(tuple, normalise(WALK.matrix).round(4).tolist())))
    assert row_sums_note(whole) is None
