"""The Markov walk over face parts (Nakamoto & Tsuruno)."""

from dataclasses import replace
from functools import cache
from math import inf

import numpy as np
import pytest
from msgspec import structs
from present import present

from gazerig.config.load import load, shipped_path
from gazerig.gaze.scanpath.fit import PartFixation, fit_walk
from gazerig.gaze.scanpath.scanpath import (
    ENTRY_PARTS,
    Scanpath,
    ScanpathParams,
    Walk,
    markov_walk,
    normalise,
)
from gazerig.gaze.types import PARTS, Bodies, Face, Percept, Target
from gazerig.robot.model.face_geometry import PARTS_FACE_M

WALK = load(shipped_path("scanpaths", "nakamoto_tsuruno"), Walk)
PRINTED = ScanpathParams(law="literal")
"""The walk as the paper has it."""


def walker(seed=1, params=PRINTED):
    return Scanpath(params, WALK, np.random.default_rng(seed))


def test_e35_transitions_follow_the_normalised_matrix():
    walk, parts = markov_walk(PRINTED, WALK, np.random.default_rng(1)), [0]
    for _ in range(100_000):
        parts.append(walk.next_part(parts[-1]))
    counts = np.zeros((8, 8))
    np.add.at(counts, (parts[:-1], parts[1:]), 1)
    wanted = normalise(WALK.matrix)
    assert np.abs(counts / counts.sum(axis=1, keepdims=True) - wanted).max() < 0.02
    assert counts[wanted == 0.0].sum() == 0


FACE = Face(
    3,
    (1.0, 0.0, 0.2),
    (0.0, 0.0, 0.0),
    ((-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)),
    tuple((1.0, 0.01 * i, 0.2) for i in range(8)),
    0.9,
)
PERCEPT = Percept(0.0, Bodies(), (FACE,))
TARGET = Target(FACE.p_world_m, (0, 0, 0), 0.0, "face", 3, 0.5, True, None, 1, "face 3")


def test_e40_dwell_times():
    walk = markov_walk(PRINTED, WALK, np.random.default_rng(3))
    for part in range(8):
        times = np.array([walk.dwell_s(part) for _ in range(20_000)])
        assert times.min() > 0.0
        assert times.mean() == pytest.approx(WALK.dwell_mean_s[part], rel=0.04)
        assert times.std() == pytest.approx(WALK.dwell_sd_s[part], rel=0.10)


def test_wrong_shapes_are_named():
    with pytest.raises(ValueError, match="8 rows of 8"):
        replace(WALK, matrix=WALK.matrix[:7])
    with pytest.raises(ValueError, match="each of DN"):
        replace(WALK, order=("DN",) * 8)
    with pytest.raises(ValueError, match="positive"):
        replace(WALK, matrix=(*WALK.matrix[:7], (0.0,) * 8))
    with pytest.raises(ValueError, match="8 numbers each"):
        replace(WALK, dwell_sd_s=(0.1,))


# ---- rests as the default robot makes them ----------------------------------------------


def test_a_walk_with_a_part_that_is_never_left_still_rests():
    stuck = replace(WALK, matrix=(*WALK.matrix[:7], (0.0,) * 7 + (1.0,)))
    walk = markov_walk(ScanpathParams(), stuck, np.random.default_rng(0))
    assert walk.next_part(7) == 7
    assert all(0.14 <= walk.dwell_s(part) < 30.0 for part in range(8))


def test_rests_begin_at_the_shortest_one_and_keep_the_means_above():
    walk = markov_walk(ScanpathParams(), WALK, np.random.default_rng(6))
    parts = [0]
    for _ in range(2000):
        parts.append(walk.next_part(parts[-1]))
    assert (np.diff(parts) != 0).all()
    for part, mean_s in enumerate(WALK.dwell_mean_s):
        times = np.array([walk.dwell_s(part) for _ in range(10_000)])
        assert times.min() >= 0.14 and times.max() <= 3.0
        assert (times == times.min()).sum() == 1  # drawn, not cut off
        assert times.mean() == pytest.approx(max(mean_s, 0.14 * 1.15), rel=0.12)
    quick = markov_walk(ScanpathParams(rate_scale=5.0), WALK, np.random.default_rng(6))
    assert min(quick.dwell_s(0) for _ in range(2000)) >= 0.14


@pytest.mark.parametrize(
    ("gaze_m", "end"),
    [((1.0, -0.5, 0.2), min), ((1.0, 0.9, 0.2), max)],
)
def test_a_face_is_entered_at_the_eye_or_the_nose_nearest_to_the_gaze(gaze_m, end):
    # The parts of FACE are in a row, the first in the middle, the last farthest to the left.
    walk = walker(6, ScanpathParams())
    wanted, farthest = end(ENTRY_PARTS, key=PARTS.index), max(ENTRY_PARTS, key=PARTS.index)
    head = (0.0, 0.0, 0.2)
    assert walk.wander(TARGET, PERCEPT, 0.0, False, head, gaze_m).part == wanted
    # Once on the face, the walk continues from its part, wherever the gaze points.
    assert walk.wander(TARGET, PERCEPT, 0.1, False, head, (0.0, 1.0, 0.2)).part == wanted
    away = structs.replace(TARGET, kind="away")
    assert walk.wander(away, PERCEPT, 0.2, True, head, (1.0, 0.9, 0.2)).part is None
    assert walk.wander(TARGET, PERCEPT, 0.3, True, head, (1.0, 0.9, 0.2)).part == farthest


def test_the_first_rest_on_a_face_begins_when_the_gaze_arrives():
    """What "settled" says in the tick of entry is of what was looked at before."""
    walk = walker(6, ScanpathParams())
    assert walk.rests_until_s == -inf
    entered = walk.wander(TARGET, PERCEPT, 0.0, True)
    assert walk.rests_until_s == inf and walk.looks.until_s is None
    walk.wander(TARGET, PERCEPT, 0.005, False)  # the saccade is in flight
    assert walk.rests_until_s == inf
    walk.wander(TARGET, PERCEPT, 0.060, True)
    until_s = walk.rests_until_s
    assert until_s >= 0.060 + 0.14
    moved = walk.wander(TARGET, PERCEPT, until_s, True)
    assert moved.part != entered.part and walk.rests_until_s == inf
    walk.wander(structs.replace(TARGET, kind="away"), PERCEPT, until_s + 0.1, True)
    assert walk.rests_until_s == -inf


# Fitting a walk to fixations: what is known comes back, what cannot be trusted is refused


@cache
def walked(count, seed=1):
    """Fixations of the known walk with gamma laws, 20 ms of flight between them."""
    rng = np.random.default_rng(seed)
    walk = markov_walk(PRINTED, WALK, rng)
    part, t_s, out = 5, 0.0, []
    for _ in range(count):
        mean_s, sd_s = WALK.dwell_mean_s[part], WALK.dwell_sd_s[part]
        dwell_s = float(rng.gamma((mean_s / sd_s) ** 2, sd_s**2 / mean_s)) + 1e-9
        out.append(PartFixation(PARTS[part], t_s, dwell_s))
        t_s += dwell_s + 0.02
        part = walk.next_part(part)
    return out


def dice():
    return np.random.default_rng(4)


@pytest.mark.parametrize("smoothing", ["none", "laplace"])
def test_a_known_walk_is_recovered(smoothing):
    fitted = fit_walk(walked(20_000), smoothing, dice())
    wanted = normalise(WALK.matrix)
    for row, counts, truth in zip(fitted.matrix, fitted.counts, wanted, strict=True):
        n = sum(counts)
        for cell, p in zip(row, truth, strict=True):
            # Four standard errors of a share, and what the added half counts may move it by.
            assert abs(cell.value - p) <= 4.0 * np.sqrt(p * (1.0 - p) / n) + 4.0 / n
    for i in range(8):
        n, sd = fitted.visits[i], WALK.dwell_sd_s[i]
        assert abs(fitted.dwell_mean_s[i].value - WALK.dwell_mean_s[i]) < 4.0 * sd / np.sqrt(n)
        assert fitted.dwell_sd_s[i].value == pytest.approx(sd, rel=0.15)
    assert fitted.start == "FR" and fitted.outside_fixations == 0 and fitted.pooled_parts == ()
    assert np.sum([[c.value for c in row] for row in fitted.matrix], axis=1) == pytest.approx(
        np.ones(8)
    )


def test_counts_are_of_neighbours_on_the_face_only():
    looks = [
        look
        for t_s in range(0, 30, 2)  # each time after a long gap
        for look in (
            PartFixation("N", t_s, 0.2),
            PartFixation("RE", t_s + 0.25, 0.2),
            PartFixation(None, t_s + 0.5, 0.1),
            PartFixation("LE", t_s + 0.65, 0.2),  # after a look elsewhere
            PartFixation("LE", t_s + 0.9, 0.2),  # a refixation
        )
    ]
    fitted = fit_walk([*looks, PartFixation("M", 40.0, 0.2)], "laplace", dice())
    n, re, le = (PARTS.index(part) for part in ("N", "RE", "LE"))
    seen = {(i, j): c for i, row in enumerate(fitted.counts) for j, c in enumerate(row) if c}
    assert seen == {(n, re): 15, (le, le): 15}
    assert fitted.outside_fixations == 15
    # Laplace: (15 + 1/2) / (15 + 8/2), and even odds from unseen parts.
    assert fitted.matrix[n][re].value == pytest.approx(15.5 / 19.0)
    assert fitted.matrix[0][3].value == pytest.approx(0.125)
    assert "M" in fitted.pooled_parts and "LE" not in fitted.pooled_parts
    assert fitted.dwell_mean_s[PARTS.index("M")].value == pytest.approx(0.2)


def test_what_cannot_be_trusted_is_refused():
    looks = walked(100)

    def refused(changed, why, smoothing="laplace"):
        with pytest.raises(ValueError, match=why):
            fit_walk(changed, smoothing, dice())

    refused([], "0 fixations on the face are too few, 50 are needed")
    refused(looks[:49], "49 fixations on the face are too few")
    refused([f._replace(part=None) for f in looks], "all 100 fixations are outside")
    refused([*looks[:60], looks[3]], "fixation 61 does not begin after the previous one")
    refused([f._replace(duration_s=1000.0 * f.duration_s) for f in looks], "check the units")
    refused([*looks[:60], looks[60]._replace(duration_s=float("nan"))], "fixation 61: .*finite")
    refused([looks[0]._replace(part="NOSE"), *looks[1:]], "fixation 1: unknown part 'NOSE'")
    staring = [PartFixation("N", 0.3 * k, 0.25) for k in range(60)]
    refused(staring, "no transition starts at chin", "none")
    apart = [PartFixation("N", 3.0 * k, 0.25) for k in range(60)]
    refused(apart, "no two fixations on the face follow each other")


# ---- the average observer, and one observer --------------------------------------------

PEOPLE = load(shipped_path("scanpaths", "people"), Walk)


def visited(face):
    """Return the share of the looks at each part of a face 1 m or more ahead."""
    walk = Scanpath(ScanpathParams(), PEOPLE, np.random.default_rng(1))
    percept, parts = Percept(0.0, Bodies(), (face,)), []
    target = structs.replace(TARGET, p_world_m=face.p_world_m)
    shift = None
    for k in range(20_000):
        look = walk.wander(target, percept, k * 0.02, settled=True)
        if look.shift != shift:
            parts.append(present(look.part))
            shift = look.shift
    return {part: parts.count(part) / len(parts) for part in PARTS}


def face_at(away_m, speaks=False):
    R = ((-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0))
    centre = (away_m, 0.0, 0.2)
    parts = tuple(
        (centre[0] - x, centre[1] - y, centre[2] + z)
        for x, y, z in (PARTS_FACE_M[part] for part in PARTS)
    )
    return Face(3, centre, (0.0, 0.0, 0.0), R, parts, 0.9, speaks=speaks)


def test_parts_of_a_far_face_that_are_close_together_are_one_look():
    far = visited(face_at(2.2))
    assert far["M"] < 0.06 < visited(face_at(0.8))["M"], "a degree below the nose"
    assert len({part for part, share in visited(face_at(9.0)).items() if share > 0.0}) == 1
