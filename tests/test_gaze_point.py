"""Saccades of the gaze point: bent in flight, falling short, corrected; re-fixations."""

from dataclasses import replace
from itertools import pairwise
from math import degrees, hypot, radians

import numpy as np
import pytest
from gaze_targets import target
from gaze_trace_rig import HUMAN, Rig, Trace, still

from gazerig.gaze.angles import angle_between, direction, norm, scale, sub, unit
from gazerig.gaze.oculomotor.gaze_point import OculomotorParams, Refixations, endpoint
from gazerig.gaze.oculomotor.saccade import SaccadeModel, SaccadeParams
from gazerig.gaze.oculomotor.saccade_trajectory import RedirectedTrajectory, SaccadeTrajectory
from gazerig.gaze.types import Target, Vec3

EYE = (0.0, 0.0, 0.0)
MODEL = SaccadeModel(SaccadeParams())
PEOPLE = OculomotorParams(refixations=False)


def at(yaw_deg: float, pitch_deg: float = 0.0, distance_m: float = 1.0) -> Vec3:
    return scale(direction((radians(yaw_deg), radians(pitch_deg))), distance_m)


def path(first: Vec3, then: Vec3, jump_s: float, h_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Return times and points of a saccade that is redirected to another end."""
    before = SaccadeTrajectory(MODEL, at(0.0), first, EYE, 0.0)
    after = RedirectedTrajectory(before, MODEL, then, EYE, jump_s)
    times = np.arange(0.0, after.ends_s + 0.02, h_s)
    return times, np.array([(before if t < jump_s else after).point_at(EYE, t) for t in times])


@pytest.mark.parametrize(
    ("first", "then", "jump_ms"),
    [
        (at(20.0), at(28.0), 15.0),
        (at(20.0), at(14.0), 5.0),
        (at(30.0), at(30.0, 9.0), 30.0),
        (at(20.0), at(-10.0, 5.0), 8.0),
        (at(25.0), at(20.0, 0.0, 0.4), 10.0),
        (at(20.0), at(20.0), 10.0),
    ],
)
def test_a_bent_saccade_has_no_step_of_speed_and_ends_on_the_new_target(
    first: Vec3, then: Vec3, jump_ms: float
) -> None:
    h = 0.00025
    _, points = path(first, then, jump_ms / 1e3, h)
    ways = np.array([unit(tuple(p)) for p in points])
    steps = np.linalg.norm(np.diff(ways, 2, axis=0), axis=1) / h
    # The limit of acceleration and the turn of the path itself.
    assert steps.max() <= radians(MAX_ACCELERATION_DEG_S2) * 1.05 * h
    nearness = 1.0 / np.linalg.norm(points, axis=1)
    assert np.abs(np.diff(nearness, 2)).max() / h <= 3.5  # 1/m/s; a step would be some 60
    assert norm(sub(tuple(points[-1]), then)) < 1e-6
    fastest = max(angle_between(tuple(a), tuple(b)) for a, b in pairwise(points)) / h
    assert degrees(fastest) <= MAX_SPEED_DEG_S * 1.02


MAX_SPEED_DEG_S = SaccadeParams().max_speed_deg_s
MAX_ACCELERATION_DEG_S2 = SaccadeParams().max_acceleration_deg_s2


def double_step(jump_s: float, first_deg: float = 28.0, then_deg: float = 34.0) -> Trace:
    rig = Rig(params=replace(PEOPLE, eye_lag_ms=5.0), saccade=HUMAN)

    def where(t: float) -> Target:
        late = t >= jump_s
        place = at(then_deg if late else first_deg)
        return target(place, at_s=t, kind="thing", salience=0.2, shift=1 + late)

    return rig.run(where, 0.6)


def test_a_target_that_jumps_early_bends_the_saccade_and_a_late_jump_waits_100_ms() -> None:
    early = double_step(0.010)
    assert early.saccades == 1
    assert early.eye[-1] + early.head[-1] == pytest.approx(34.0, abs=0.1)
    late = double_step(0.040)
    assert late.saccades == 2
    assert late.rest_s == pytest.approx(0.1, abs=0.005)
    assert late.eye[-1] + late.head[-1] == pytest.approx(34.0, abs=0.1)


def test_a_saccade_falls_short_from_10_deg_on_and_scatters_with_its_size() -> None:
    for size, short in ((4.0, 0.0), (7.5, 0.3), (10.0, 0.8), (20.0, 1.6)):
        rng = np.random.default_rng(0)
        landings = [endpoint(at(size), at(0.0), EYE, rng) for _ in range(2000)]
        short_deg = size - np.degrees([angle_between(at(0.0), one) for one in landings])
        assert np.mean(short_deg) == pytest.approx(short, abs=0.05)
    rng = np.random.default_rng(0)
    ends = [endpoint(at(20.0), at(0.0), EYE, rng) for _ in range(2000)]
    yaw = np.degrees([np.arctan2(y, x) for x, y, _ in ends])
    pitch = np.degrees([np.arcsin(unit(e)[2]) for e in ends])
    assert np.mean(yaw) == pytest.approx(18.4, abs=0.06) and np.std(yaw) == pytest.approx(
        0.8, rel=0.06
    )
    assert np.mean(pitch) == pytest.approx(0.0, abs=0.03) and np.std(pitch) == pytest.approx(
        0.4, rel=0.06
    )


def test_about_a_third_of_large_saccades_are_corrected_100_to_200_ms_later() -> None:
    corrected, after_ms = 0, []
    sizes = np.linspace(10.5, 16.0, 60)
    for n, size in enumerate(sizes):
        rig = Rig(params=PEOPLE, saccade=HUMAN, dice=n)
        trace = rig.run(still(float(size)), 0.5)
        if trace.saccades > 1:
            after_ms.append(1e3 * trace.rest_s)
            corrected += 1
    assert 0.2 < corrected / len(sizes) < 0.5
    assert min(after_ms) >= 100.0 and max(after_ms) <= 205.0


def test_refixations_stay_near_the_middle_and_come_once_a_second() -> None:
    rig = Rig(params=OculomotorParams(), saccade=HUMAN, dice=3)
    trace = rig.run(still(2.0), 60.0)
    jumps = trace.saccades - 1
    assert 0.75 < jumps / 60.0 < 1.1
    assert trace.error.max() < 2.3 and 0.2 < np.median(trace.error[200:]) < 1.28
    phases = np.array(trace.in_flight)
    on = np.flatnonzero(phases[1:] & ~phases[:-1])[1:]
    off = np.flatnonzero(~phases[1:] & phases[:-1])[1:] + 1
    points = np.array([c.gaze_point_world_m for c in trace.commands])
    sizes = [
        degrees(angle_between(tuple(points[a]), tuple(points[b])))
        for a, b in zip(on, off, strict=False)
    ]
    assert min(sizes) > 0.45 and max(sizes) < 1.85  # 1.7, and scatter


def test_a_new_target_is_looked_at_in_its_middle_and_a_moving_one_is_only_followed() -> None:
    points = Refixations(np.random.default_rng(0))
    times = np.arange(0.0, 20.0, 0.005)
    assert not any(points.is_due(t, still=False) for t in times)
    assert any(points.is_due(20.0 + t) for t in times)
    assert 0.0 < degrees(hypot(*points.offset_rad)) <= 1.28
    points.reset()
    assert points.offset_rad == (0.0, 0.0)


def test_hobby_servos_fixate_one_point() -> None:
    trace = Rig(params=PEOPLE, saccade=HUMAN, dice=3).run(still(2.0), 20.0)
    assert trace.saccades == 1
