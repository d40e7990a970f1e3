"""Eyes, head and lids together on a body that follows perfectly.

Numbered checks are listed in docs/checks.md. The head's centre of rotation is put
between the eyes, as in the sources of those numbers, unless a test states otherwise.
"""

from dataclasses import replace
from math import degrees, radians

import numpy as np
import pytest
from gaze_targets import DT, joints_at, target
from gaze_trace_rig import CENTRED, DESK, EXACT, HUMAN, SACCADE, Rig, still
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import structs

from gazerig.gaze.angles import (
    add,
    angle_between,
    cross,
    direction,
    dot,
    rotate,
    scale,
    sub,
    unit,
    yaw_pitch,
)
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.oculomotor.drift import Drift
from gazerig.gaze.oculomotor.gaze_point import OculomotorParams
from gazerig.gaze.oculomotor.head import HeadParams, HeadShare
from gazerig.gaze.oculomotor.saccade import SaccadeParams
from gazerig.gaze.types import ORDERED, Target
from gazerig.robot.model.kinematics import GeometryParams
from gazerig.robot.model.types import JointState

PEOPLE = OculomotorParams(refixations=False, eye_lag_ms=5.0)


def test_e17_gaze_timeline_of_a_60_degree_shift() -> None:
    trace = Rig().run(still(60.0), 2.0)
    t = trace.t - 0.1
    arrived = t[np.argmax(trace.error < 1.0)]
    within = t[(trace.error < 1.0) & (t > 0.05)]
    assert within[0] == pytest.approx(0.190, abs=0.015), arrived
    assert trace.eye.max() == pytest.approx(55.0, abs=0.01)
    assert trace.eye[-1] == pytest.approx(0.03, abs=0.1)
    assert trace.head[-1] == pytest.approx(59.97, abs=0.1)
    assert trace.error[t > within[0] + 0.1].max() < 0.3


@pytest.mark.parametrize("size", [20.0, 25.0, 29.0, 31.0, 45.0, 60.0])
@pytest.mark.parametrize("top_down", [False, True])
def test_e15_head_start_rule(size: float, top_down: bool) -> None:
    trace = Rig().run(still(size, top_down=top_down), 0.6)
    eye_onset = np.argmax(np.abs(trace.eye) > 1e-6)
    if size < 30.0:
        assert np.abs(trace.head).max() < 1e-9
        return
    head_onset = np.argmax(np.abs(trace.head) > 1e-9)
    expected = 0.0 if top_down else 0.020
    assert (head_onset - eye_onset) * DT == pytest.approx(expected, abs=DT + 1e-9)


@pytest.mark.parametrize("size", range(5, 85, 5))
def test_e16_every_target_is_reached_with_a_small_eye_range(size: float) -> None:
    trace = Rig(eye_deg=20.0, head=HeadParams()).run(still(size, salience=0.2), 3.0)
    assert trace.error[-1] <= 0.5


@pytest.mark.parametrize("distance_m", [0.22, 0.3, 0.4, 0.8])
@pytest.mark.parametrize(("model", "kind"), [("stahl", "thing"), ("align", ORDERED)])
def test_the_head_leaves_room_for_both_eyes_to_converge(
    model: str, kind: str, distance_m: float
) -> None:
    """A head that stops short for one line of sight would hold an eye at its limit."""
    head = HeadParams(
        goal_model=model  # type: ignore[arg-type]
    )
    for yaw in (15.0, 18.0, 24.0, 27.0, 40.0, 60.0):
        rig = Rig(eye_deg=25.0, geometry=DESK, head=head)
        middle = rig.kinematics.forward(rig.joints).p_world_head_m
        aside = add(middle, scale(direction((radians(yaw), 0.0)), distance_m))
        there = structs.replace(still(0.0, salience=0.2)(0.2), p_world_m=aside, kind=kind)
        last = rig.run(lambda t, there=there: there, 2.0).commands[-1]  # type: ignore[misc]
        assert last.phase == "fixate" and last.limited == (), yaw


def test_only_a_near_target_takes_range_of_the_eyes() -> None:
    share = HeadShare(HeadParams(), radians(20.0))
    assert share.for_near_target(radians(18.1)) is share
    assert degrees(share.for_near_target(radians(15.0)).reach_rad) == pytest.approx(15.0)


@pytest.mark.parametrize("profile", [SACCADE, HUMAN])
def test_e8_oblique_saccade_keeps_to_the_great_circle(profile: SaccadeParams) -> None:
    trace = Rig(saccade=profile).run(still(20.0, pitch_deg=12.0), 0.4)
    ways = [unit(c.gaze_point_world_m) for c in trace.commands]
    pole = unit(cross((1.0, 0.0, 0.0), ways[-1]))
    assert max(abs(degrees(dot(way, pole))) for way in ways) < 0.2
    angles = np.array([yaw_pitch(way) for way in ways]).T
    moves = [np.flatnonzero(np.abs(np.diff(a)) > 1e-6) for a in angles]
    assert abs(moves[0][0] - moves[1][0]) <= 1
    assert abs(moves[0][-1] - moves[1][-1]) <= 1


def test_scattered_landings_are_corrected_by_small_saccades() -> None:
    after, misses = [], []
    for seed in range(12):
        trace = Rig(params=PEOPLE, dice=seed).run(still(28.0), 0.8)
        misses.append(trace.error[trace.landed + 1])
        assert trace.saccades == (2 if misses[-1] > 1.2 else 1)
        if trace.saccades == 2:
            after.append(trace.rest_s)
        assert trace.error[-1] < 0.1 and not trace.in_flight[-1]
    assert 1.2 < np.mean(misses) < 3.2  # 0.08 of 28 deg
    assert after and min(after) >= 0.1 and max(after) <= 0.205


def test_drift_moves_the_head_and_not_the_gaze() -> None:
    rig = Rig(geometry=DESK, drift=Drift("people", np.random.default_rng(0)))
    seen = target((1.0, 0.1, 0.2), kind="thing", salience=0.2)
    trace = rig.run(lambda t: seen, 12.0)
    pitch = np.degrees([c.head_rad[1] for c in trace.commands])
    assert np.ptp(pitch[-800:]) > 0.8
    assert trace.error[100:].max() < 0.05
    assert trace.saccades == 1


def test_the_head_faces_the_centre_while_the_gaze_wanders_over_parts() -> None:
    rig = Rig()
    centre = scale(direction((radians(45.0), 0.0)), 1.0)

    def where(t: float) -> Target:
        part = int(t / 0.4)
        point = scale(direction((radians(45.0 + 3.0 * (part % 3 - 1)), 0.0)), 1.0)
        return target(point, at_s=t, salience=0.6, top_down=True, shift=part, centre=centre)

    trace = rig.run(where, 4.0)
    assert np.ptp(trace.head[400:]) < 1e-6
    assert trace.error[350] < 0.05 and trace.saccades == 10


def test_e58_a_lost_target_is_followed_for_a_moment_and_then_no_more() -> None:
    rig = Rig(params=PEOPLE)
    v = radians(20.0)

    def where(t: float) -> Target:
        at = min(t, 1.0)
        return target((1.0, v * (at - 0.5), 0.0), (0.0, v, 0.0), at, salience=0.2)

    trace = rig.run(where, 3.0)
    speeds = np.diff(trace.eye) / DT
    assert speeds[round(1.05 / DT)] == pytest.approx(20.0, rel=0.1)
    assert speeds[round(1.3 / DT)] == pytest.approx(9.6, abs=2.0)
    assert abs(speeds[-1]) < 0.1
    assert trace.saccades == 1


def test_a_target_faster_than_pursuit_is_caught_up_with_by_saccades() -> None:
    v = radians(90.0)

    def where(t: float) -> Target:
        yaw = v * t - 0.6
        point = (float(np.cos(yaw)), float(np.sin(yaw)), 0.0)
        return target(point, (-v * point[1], v * point[0], 0.0), t, "hand", salience=0.2)

    trace = Rig(params=PEOPLE).run(where, 0.8)
    assert trace.saccades >= 3
    assert np.median(trace.error[40:]) < 4.0


def test_e31_eyes_hold_the_gaze_through_any_turn_of_the_head() -> None:
    rig = Rig(geometry=DESK)
    fixed = target((1.5, 0.2, 0.2), kind="thing", salience=0.2)
    rig.run(lambda t: fixed, 1.0)
    for k in range(200):
        share = k / 199
        turned = (radians(40.0) * share, radians(20.0) * share, radians(10.0) * share)
        state = rig.kinematics.forward(joints_at(*rig.joints.position_rad[:6], *turned))
        command = rig.oculomotor.step(fixed, state, 1.0 + k * DT, DT)
        seen = rig.kinematics.forward(joints_at(*rig.kinematics.inverse(command)[:6], *turned))
        for left in (True, False):
            eye = seen.p_world_eye_left_m if left else seen.p_world_eye_right_m
            error = angle_between(line_of_sight(seen, left), sub(fixed.p_world_m, eye))
            assert degrees(error) < 0.1
    assert degrees(seen.head_rad[0]) == pytest.approx(40.0)


def test_e27_vergence_comes_from_geometry() -> None:
    kinematics = Rig().kinematics
    R, p = kinematics.head_pose((0.0, 0.0, 0.0))
    left, right = kinematics.eye_angles_to((1.0, 0.0, 0.0), R, p)
    assert degrees(left[0]) == pytest.approx(-1.773, abs=0.01)
    assert degrees(right[0]) == pytest.approx(1.773, abs=0.01)


def test_small_errors_are_followed_and_not_jumped_to() -> None:
    rig = Rig()
    walk = 0.2  # m/s at 1 m: 11 deg/s

    def where(t: float) -> Target:
        return target((1.0, walk * t, 0.0), (0.0, walk, 0.0), t, "thing", salience=0.2)

    trace = rig.run(where, 2.0)
    assert trace.error[100:].max() < 0.5
    assert trace.saccades <= 1
    assert trace.commands[-1].phase == "pursue"


def test_a_target_change_in_flight_waits_for_the_landing() -> None:
    rig = Rig(params=PEOPLE)
    a, b = still(30.0)(1.0), structs.replace(still(-30.0)(1.0), id=2, shift=3)
    trace = rig.run(lambda t: a if t < 0.03 else b, 1.5)
    assert trace.rest_s == pytest.approx(0.1, abs=DT)
    assert trace.saccades in (2, 3), "one more corrects the second"
    speed = np.abs(np.diff(trace.eye)) / DT
    assert speed.max() < 505.0
    assert trace.error[-1] < 0.01


def test_a_point_on_the_nose_is_converged_on_no_nearer_than_the_limit() -> None:
    rig = Rig()
    near = target((0.02, 0.0, 0.0), kind="thing", top_down=True)
    command = rig.run(lambda t: near, 2.0).commands[-1]
    vergence = degrees(command.eye_right_rad[0] - command.eye_left_rad[0])
    assert 17.0 < vergence < 18.0


def test_it_begins_where_head_and_eyes_are() -> None:
    rig = Rig(geometry=DESK)
    q = (0.2, -0.1, 0.25, -0.1, 0.0, 0.0, 0.4, 0.1, 0.05)
    state = rig.kinematics.forward(joints_at(*q))
    ahead = add(state.p_world_head_m, rotate(state.R_world_head, (1.0, 0.2, -0.1)))
    first = rig.oculomotor.step(target(ahead, kind="thing", top_down=True), state, 0.0, DT)
    assert first.head_rad == pytest.approx(state.head_rad)
    eye = first.eye_left_rad
    assert degrees(abs(eye[0] - q[0])) < 3.0 and degrees(abs(eye[1] - q[1])) < 3.0


# Eyes and head keep their limits and reach any target. Checks: docs/checks.md


@settings(max_examples=30, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    eye=st.floats(15, 55),
    profile=st.sampled_from((SACCADE, HUMAN)),
    geometry=st.sampled_from((CENTRED, DESK)),
)
def test_no_eye_beyond_its_limit_nothing_infinite_and_no_gaze_above_the_cap(
    seed: int, eye: float, profile: SaccadeParams, geometry: GeometryParams
) -> None:
    """For any path of targets, any motion of the head, obeying or not, and any timing."""
    rng = np.random.default_rng(seed)
    rig = Rig(
        eye,
        geometry,
        HeadParams(),
        params=replace(EXACT, eye_lag_ms=0.0),
        saccade=profile,
    )
    t, shift, before = 0.0, 0, None
    seen = _any_target(rng, 0.0, 0)
    pushed = np.zeros(3)
    for _ in range(250):
        dt = float(rng.choice((0.0, 0.001, 0.005, 0.005, 0.005, 0.020, 0.2)))
        t += dt
        if rng.random() < 0.08:
            shift += int(rng.integers(0, 2))
            seen = _any_target(rng, t - float(rng.uniform(0.0, 0.3)), shift)
        if rng.random() < 0.1:
            pushed = rng.normal(0.0, (0.8, 0.4, 0.2))
        head = np.array(rig.joints.position_rad[6:]) + (pushed * dt if dt < 0.1 else 0.0)
        joints = JointState((*rig.joints.position_rad[:6], *head), (0.0,) * 9, (t,) * 9, ())
        state = rig.kinematics.forward(joints)
        command = rig.oculomotor.step(seen, state, t, dt)
        now = rig.kinematics.inverse(command)
        assert np.isfinite(now).all() and np.isfinite(command.gaze_point_world_m).all()
        eyes = (*command.eye_left_rad, *command.eye_right_rad)
        assert max(abs(a) for a in eyes) <= radians(eye) + 1e-12
        way = sub(command.gaze_point_world_m, state.p_world_head_m)
        # A head that shifts its eyes sideways adds what the shifted view asks for.
        if before is not None and geometry is CENTRED:
            assert angle_between(way, before) <= radians(500.0) * dt + 1e-9
        before = way
        rig.joints = structs.replace(joints, position_rad=now) if rng.random() < 0.8 else joints


def _any_target(rng: np.random.Generator, at_s: float, shift: int) -> Target:
    yaw, pitch = rng.uniform((-3.2, -1.6), (3.2, 1.6))
    distance = float(10 ** rng.uniform(-2, 1.5))
    point = scale(direction((float(yaw), float(pitch))), distance)
    x, y, z = rng.normal(0.0, 10 ** rng.uniform(-2, 1.5), 3).tolist()
    centre = add(point, (0.0, 0.1, -0.05)) if rng.random() < 0.5 else None
    salience, top_down = float(rng.uniform(0, 2)), bool(rng.integers(0, 2))
    return target(
        point, (x, y, z), at_s, salience=salience, top_down=top_down, shift=shift, centre=centre
    )


def test_e19_no_eye_beyond_its_limit_and_no_head_beyond_its_range() -> None:
    rng = np.random.default_rng(5)
    rig = Rig(eye_deg=35.0, geometry=DESK, neck_deg=60.0)
    targets = [_any_target(rng, 0.2 * k, k) for k in range(300)]
    trace = rig.run(lambda t: targets[min(int(t / 0.2), 299)], 60.0)
    for command in trace.commands:
        eyes = (*command.eye_left_rad, *command.eye_right_rad)
        assert max(abs(a) for a in eyes) <= radians(35.0) + 1e-12
    assert 50.0 < np.abs(trace.head).max() <= 60.0 + 1e-9


@settings(max_examples=16, deadline=None)
@given(
    yaw=st.floats(-70, 70), pitch=st.floats(-30, 30), salience=st.floats(0, 3), top=st.booleans()
)
def test_gaze_lands_on_any_still_target(
    yaw: float, pitch: float, salience: float, top: bool
) -> None:
    rig = Rig(eye_deg=35.0, geometry=DESK)
    trace = rig.run(still(yaw, salience, top, pitch), 2.5)
    assert trace.error[-1] <= 0.5
    speeds = [
        angle_between(a.gaze_point_world_m, b.gaze_point_world_m) / DT
        for a, b in zip(trace.commands, trace.commands[1:], strict=False)
    ]
    assert degrees(max(speeds)) <= 520.0
