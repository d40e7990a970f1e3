"""Eyes, head and lids together on a body that follows perfectly.

The head's centre of rotation is put between the eyes, as in the sources of the numbers, unless a
test states otherwise.
"""

from dataclasses import replace
from itertools import pairwise
from math import cos, degrees, hypot, pi, radians, sin, tan
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest
from gaze_targets import DT, joints_at, target
from gaze_trace_rig import CENTRED, DESK, EXACT, HUMAN, SACCADE, Rig, still
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import structs

from gazerig.config.schema import load_rig
from gazerig.gaze.angles import (
    add,
    angle_between,
    direction,
    norm,
    rotate,
    scale,
    sub,
    unit,
)
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.oculomotor.binocular import (
    BinocularController,
    EyeGeometry,
    MeanGaze,
    OppositeAngles,
)
from gazerig.gaze.oculomotor.gaze_point import OculomotorParams, Refixations, endpoint
from gazerig.gaze.oculomotor.head import HeadParams, HeadShare
from gazerig.gaze.oculomotor.saccade import SaccadeModel, SaccadeParams
from gazerig.gaze.oculomotor.saccade_trajectory import RedirectedTrajectory, SaccadeTrajectory
from gazerig.gaze.types import Target
from gazerig.robot.model.types import JointState
from gazerig.robot.run.models import rig_kinematics


def test_e17_gaze_timeline_of_a_60_degree_shift():
    head = HeadParams(goal_model="attention", base_speed_deg_s=70.0)
    trace = Rig(head=head).run(still(60.0), 2.0)
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
def test_e15_head_start_rule(size, top_down):
    trace = Rig().run(still(size, top_down=top_down), 0.6)
    eye_onset = np.argmax(np.abs(trace.eye) > 1e-6)
    if size < 30.0:
        assert np.abs(trace.head).max() < 1e-9
        return
    head_onset = np.argmax(np.abs(trace.head) > 1e-9)
    expected = 0.0 if top_down else 0.020
    assert (head_onset - eye_onset) * DT == pytest.approx(expected, abs=DT + 1e-9)


def test_only_a_near_target_takes_range_of_the_eyes():
    share = HeadShare(HeadParams(), radians(20.0))
    assert share.for_near_target(radians(18.1)) is share
    assert degrees(share.for_near_target(radians(15.0)).reach_rad) == pytest.approx(15.0)


def test_the_head_faces_the_centre_while_the_gaze_wanders_over_parts():
    rig = Rig()
    centre = scale(direction((radians(45.0), 0.0)), 1.0)

    def where(t):
        part = int(t / 0.4)
        point = scale(direction((radians(45.0 + 3.0 * (part % 3 - 1)), 0.0)), 1.0)
        return target(point, at_s=t, salience=0.6, top_down=True, shift=part, centre=centre)

    trace = rig.run(where, 4.0)
    assert np.ptp(trace.head[400:]) < 1e-6
    assert trace.error[350] < 0.05 and trace.saccades == 10


def test_e31_eyes_hold_the_gaze_through_any_turn_of_the_head():
    rig = Rig(geometry=DESK)
    fixed = target((1.5, 0.2, 0.2), kind="thing", salience=0.2)
    rig.run(lambda t: fixed, 1.0)
    for k in range(200):
        share = k / 199
        turned = (radians(40.0) * share, radians(20.0) * share, radians(10.0) * share)
        state = rig.kinematics.forward(joints_at((*rig.joints.position_rad[:6], *turned)))
        command = rig.oculomotor.step(fixed, state, 1.0 + k * DT, DT)
        seen = rig.kinematics.forward(joints_at((*rig.kinematics.inverse(command)[:6], *turned)))
        for left in (True, False):
            eye = seen.p_world_eye_left_m if left else seen.p_world_eye_right_m
            error = angle_between(line_of_sight(seen, left), sub(fixed.p_world_m, eye))
            assert degrees(error) < 0.1
    assert degrees(seen.head_rad[0]) == pytest.approx(40.0)


def test_it_begins_where_head_and_eyes_are():
    rig = Rig(geometry=DESK)
    q = (0.2, -0.1, 0.25, -0.1, 0.0, 0.0, 0.4, 0.1, 0.05)
    state = rig.kinematics.forward(joints_at(q))
    ahead = add(state.p_world_head_m, rotate(state.R_world_head, (1.0, 0.2, -0.1)))
    first = rig.oculomotor.step(target(ahead, kind="thing", top_down=True), state, 0.0, DT)
    assert first.head_rad == pytest.approx(state.head_rad)
    eye = first.eye_left_rad
    assert degrees(abs(eye[0] - q[0])) < 3.0 and degrees(abs(eye[1] - q[1])) < 3.0


# Eyes and head keep their limits and reach any target.


@settings(max_examples=15)
@given(
    seed=st.integers(0, 2**32 - 1),
    eye=st.floats(15, 55),
    profile=st.sampled_from((SACCADE, HUMAN)),
    geometry=st.sampled_from((CENTRED, DESK)),
)
def test_e19_no_eye_or_head_beyond_its_limit_nothing_infinite_no_gaze_above_the_cap(
    seed, eye, profile, geometry
):
    """For any path of targets, any motion of the head, obeying or not, and any timing."""
    rng = np.random.default_rng(seed)
    rig = Rig(
        eye,
        geometry,
        HeadParams(),
        60.0,
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
        assert max(abs(a) for a in command.head_rad[:2]) <= radians(60.0) + 1e-12
        way = sub(command.gaze_point_world_m, state.p_world_head_m)
        # A head that shifts its eyes sideways adds what the shifted view asks for.
        if before is not None and geometry is CENTRED:
            assert angle_between(way, before) <= radians(500.0) * dt + 1e-9
        before = way
        rig.joints = structs.replace(joints, position_rad=now) if rng.random() < 0.8 else joints


def _any_target(rng, at_s, shift):
    yaw, pitch = rng.uniform((-3.2, -1.6), (3.2, 1.6))
    distance = float(10 ** rng.uniform(-2, 1.5))
    point = scale(direction((float(yaw), float(pitch))), distance)
    x, y, z = rng.normal(0.0, 10 ** rng.uniform(-2, 1.5), 3).tolist()
    centre = add(point, (0.0, 0.1, -0.05)) if rng.random() < 0.5 else None
    salience, top_down = float(rng.uniform(0, 2)), bool(rng.integers(0, 2))
    return target(
        point, (x, y, z), at_s, salience=salience, top_down=top_down, shift=shift, centre=centre
    )


# ---- Saccades of the gaze point: bent in flight, falling short, corrected; re-fixations.


EYE = (0.0, 0.0, 0.0)
MODEL = SaccadeModel(SaccadeParams())
NO_REFIXATIONS = OculomotorParams(refixations=False)


def at(yaw_deg, pitch_deg=0.0, distance_m=1.0):
    return scale(direction((radians(yaw_deg), radians(pitch_deg))), distance_m)


def path(first, then, jump_s, h_s):
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
def test_a_bent_saccade_has_no_step_of_speed_and_ends_on_the_new_target(first, then, jump_ms):
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


def double_step(jump_s):
    rig = Rig(params=replace(NO_REFIXATIONS, eye_lag_ms=5.0), saccade=HUMAN)

    def where(t):
        late = t >= jump_s
        place = at(34.0 if late else 28.0)
        return target(place, at_s=t, kind="thing", salience=0.2, shift=1 + late)

    return rig.run(where, 0.6)


def test_a_target_that_jumps_early_bends_the_saccade_and_a_late_jump_waits_100_ms():
    early = double_step(0.010)
    assert early.saccades == 1
    assert early.eye[-1] + early.head[-1] == pytest.approx(34.0, abs=0.1)
    late = double_step(0.040)
    assert late.saccades == 2
    assert late.rest_s == pytest.approx(0.1, abs=0.005)
    assert late.eye[-1] + late.head[-1] == pytest.approx(34.0, abs=0.1)


@pytest.mark.parametrize(
    ("size", "further", "across", "yaw", "pitch"),
    [(4.0, 0, 0, 4.0, 0.0), (7.5, 0, 0, 7.2, 0.0), (10.0, 0, 0, 9.2, 0.0), (20.0, 0, 0, 18.4, 0.0),
     (20.0, 1, 0, 19.2, 0.0), (4.0, -1, 0, 3.84, 0.0), (20.0, 0, -1, 18.4, 0.4)],
)  # fmt: skip
def test_a_saccade_falls_short_from_10_deg_on_and_scatters_with_its_size(
    size, further, across, yaw, pitch
):
    """By 8 % from 10 deg on; by 4 % of its size along the path and 2 % across, as deviations."""
    drawn: Any = SimpleNamespace(standard_normal=lambda size: (further, across))
    eye = (0.1, 0.2, 0.3)
    landed = endpoint(add(eye, at(size, 0.0, 3.0)), add(eye, at(0.0)), eye, drawn)
    assert landed == pytest.approx(add(eye, at(yaw, pitch, 3.0)), abs=1e-6)


# ---- The eyes of the profile mitake against the numbers of their controller.


HALF_M = CENTRED.interocular_mm / 2e3
FAR_M = 10.0


class NoSaccades:
    is_saccade_due = is_correction_due = False


class Alone:
    """Eyes that the controller moves without any saccade, on a head that is held."""

    def __init__(self):
        self.kinematics = Rig().kinematics
        self._controller, self._gaze = BinocularController(), (1.0, 0.0, 0.0)

    def tick(self, target, head_rad, t, dt):
        state = self.kinematics.forward(joints_at((*(0.0,) * 6, *head_rad)))
        on = self.kinematics.eye_angles_to
        view = EyeGeometry(state.R_world_head, state.p_world_head_m, on, lambda eyes: eyes)
        if not self._controller.started:
            self._gaze = target.p_world_m
        eyes, self._gaze = self._controller.fixate(
            target, self._gaze, None, NoSaccades(), view, t, dt
        )
        return eyes


class Followed(NamedTuple):
    """Time at which each angle holds, version and vergence; degrees."""

    t: np.ndarray
    version: np.ndarray
    vergence: np.ndarray


def aim(yaw_deg, speed_deg_s=0.0, distance=FAR_M, t=0.0):
    """Return a target in a present frame that moves around the head."""
    p = scale(direction((radians(yaw_deg), 0.0)), distance)
    v = scale((-p[1], p[0], 0.0), radians(speed_deg_s))
    return target(p, v, t, "thing", salience=0.2)


def eyes(
    where,
    seconds,
    dt=DT,
    begin=None,
    turning=None,
):
    """Let the eyes follow; they begin at rest on ``begin`` or the first target.

    turning: yaw of the head in radians, which is held by hand
    """
    alone, rows = Alone(), []
    first = begin if begin is not None else structs.replace(where(0.0), v_world_m_s=(0.0, 0.0, 0.0))
    settle = round(4.0 / dt)
    for k in range(-settle, round(seconds / dt)):
        t = k * dt
        target = where(t) if k >= 0 else structs.replace(first, at_s=t)
        yaw = turning(max(0.0, t)) if turning is not None else 0.0
        left, right = (eye[0] for eye in alone.tick(target, (yaw, 0.0, 0.0), t, dt))
        if k >= 0:
            rows.append((t + dt, degrees(0.5 * (left + right)), degrees(right - left)))
    return Followed(*np.array(rows).T)


@pytest.mark.parametrize("speed", [10.0, 20.0, 30.0])
def test_e20_ramp(speed):
    start = -0.6 * speed
    trace = eyes(lambda t: aim(start + speed * t, speed, t=t), 1.2)
    done, starts = trace.version - start, trace.t - DT
    speeds = np.diff(done, prepend=0.0) / DT
    assert starts[np.argmax(speeds > 0.05 * speed)] == pytest.approx(0.105, abs=0.01)
    assert starts[np.argmax(speeds > 0.9 * speed)] == pytest.approx(0.195, abs=0.02)
    assert speeds[-1] / speed == pytest.approx(1.0, abs=0.02)
    assert trace.t[-1] - done[-1] / speed == pytest.approx(0.1415, rel=0.08)


@pytest.mark.parametrize("hz", [0.1, 0.2, 0.3, 0.4, 0.5])
def test_e21_sine(hz):
    """Gain and phase of +-5 deg, over the last whole cycles."""
    w = 2.0 * pi * hz
    cycles = 2 if hz < 0.3 else 4
    trace = eyes(lambda t: aim(5.0 * sin(w * t), 5.0 * w * cos(w * t), t=t), cycles / hz)
    keep = trace.t > trace.t[-1] - cycles / 2 / hz + 1e-9
    z = 2j * np.mean(trace.version[keep] * np.exp(-1j * w * trace.t[keep])) / 5.0
    assert 0.98 <= abs(z) <= 1.01
    assert degrees(np.angle(z)) == pytest.approx(-360.0 * hz * 0.140, abs=3.0)


def test_a_step_of_the_target_is_no_velocity():
    begin = aim(0.0, t=-4.0)
    trace = eyes(lambda t: aim(1.5, 1e-6, t=t), 1.5, begin=begin)
    for share, time in ((0.05, 0.110), (0.63, 0.220), (0.90, 0.380)):
        assert trace.t[np.argmax(trace.version >= share * 1.5)] == pytest.approx(time, abs=0.02)
    assert trace.version.max() <= 1.5 + 1e-3


def converging(vergence_deg):
    """Return the distance on which eyes converge by an angle."""
    return HALF_M / tan(radians(vergence_deg) / 2.0)


@pytest.mark.parametrize(("start", "step", "t63", "gain"), [(2, 4, 0.405, 4), (8, -4, 0.490, 3)])
def test_e25_vergence_step(start, step, t63, gain):
    near = converging(start + step)
    trace = eyes(
        lambda t: aim(0.0, 0.0, near, t), 2.0, begin=aim(0.0, 0.0, converging(start), -4.0)
    )
    done = (trace.vergence - start) / step
    assert trace.t[np.argmax(done >= 0.63)] == pytest.approx(t63, abs=0.03)
    # A first-order control peaks at its gain times the step: 16 and 12 deg/s.
    assert np.abs(np.diff(trace.vergence)).max() / DT == pytest.approx(gain * 4.0, rel=0.05)
    assert np.abs(trace.version).max() < 0.01


@pytest.mark.parametrize(("hz", "phase", "residual"), [(0.5, -1.9, 0.033), (2.0, -7.6, 0.132)])
def test_e29_reflex_without_a_target(hz, phase, residual):
    """Gain and phase of the eyes in a head that swings by 10 deg in the dark.

    The command of tick k follows from the head at tick k and holds at its end.
    """
    w = 2.0 * pi * hz
    begin = aim(0.0, 0.0, 100.0, -4.0)
    lost = structs.replace(begin, v_world_m_s=(0.0, 1e-9, 0.0), at_s=0.0)
    trace = eyes(lambda t: lost, 4.0 / hz, 0.001, begin, lambda t: radians(10.0) * sin(w * t))
    keep = trace.t > 2.0 / hz
    z = complex(2j * np.mean(-trace.version[keep] * np.exp(-1j * w * trace.t[keep])) / 10.0)
    assert abs(z) == pytest.approx(1.0, abs=0.02)
    assert degrees(np.angle(z)) == pytest.approx(phase, abs=2.0)
    assert abs(1.0 - z) == pytest.approx(residual, abs=0.02)


def test_e58_a_lost_target_fades():
    def where(t):
        seen_s = min(t, 2.0)
        return aim(20.0 * seen_s - 25.0, 20.0, t=seen_s)

    trace = eyes(where, 4.0)
    speeds = np.diff(trace.version) / DT

    def after(s):
        return float(speeds[round((2.0 + s) / DT)])

    # The last observation arrives after a delay, and one missed frame is not yet a loss.
    assert after(0.1) == pytest.approx(20.0, abs=0.5)
    assert after(0.3) == pytest.approx(9.6, abs=2.0)
    assert after(0.6) / after(0.3) == pytest.approx(np.exp(-1.0), rel=0.05)
    assert after(1.5) < 0.5


def test_both_lines_of_sight_meet_where_the_vergence_has_them():
    controller = BinocularController()
    for apart_rad, vergence_rad, meets_m in (
        (0.03, 0.06, 1.0), (0.03, 0.2, tan(0.03) / tan(0.1)), (0.03, 0.0, 100.0),
        (0.03, 1e-6, 100.0), (0.0, 0.2, 7.0),
    ):  # fmt: skip
        controller.version = MeanGaze((1.0, 0.0, 0.0), vergence_rad)
        one_m = (-apart_rad, 0.0), (apart_rad, 0.0)
        assert controller.distance_m(one_m, 7.0) == pytest.approx(meets_m)


# ---- The eyes of Nakamoto & Tsuruno 3.4, which the profile nakamoto runs.


POINT = (1.0, 0.0, 0.125)
TARGET = Target(POINT, (0.0, 0.0, 0.0), 0.0, "face", 1, 0.5, True, "N", 1, "a face")
LIMIT_RAD = radians(20.0)


def in_range(eyes):
    left, right = (tuple(min(max(a, -LIMIT_RAD), LIMIT_RAD) for a in eye) for eye in eyes)
    return (left[0], left[1]), (right[0], right[1])


def view(head_deg):
    yaw, pitch, roll = head_deg
    kinematics = rig_kinematics(load_rig("desk"))
    R, p = kinematics.head_pose((radians(yaw), radians(pitch), radians(roll)))
    return EyeGeometry(R, p, kinematics.eye_angles_to, in_range)


def stand(model, head_deg, gaze=POINT):
    return model.fixate(TARGET, gaze, None, NoSaccades(), view(head_deg), 0.0, 0.005)


def off_deg(gaze, head_deg):
    p_head = view(head_deg).p_head
    return degrees(angle_between(sub(gaze, p_head), sub(POINT, p_head)))


def test_e31_opposite_angles_hold_the_gaze_through_a_turn_about_one_axis():
    model = OppositeAngles()
    (before, _), gaze = stand(model, (0.0, 0.0, 0.0))
    for yaw in range(1, 16):
        (left, _), gaze = stand(model, (float(yaw), 0.0, 0.0))
    assert degrees(left[0] - before[0]) == pytest.approx(-15.0, abs=1e-6)
    # The eyes sit ahead of the neck: that, and nothing of the turn, is left.
    assert off_deg(gaze, (15.0, 0.0, 0.0)) < 1.0


def test_eyes_that_begin_out_of_range_begin_straight():
    eyes, _ = stand(OppositeAngles(), (0.0, 0.0, 0.0), (1.0, 1.0, 0.125))
    assert eyes == ((0.0, 0.0), (0.0, 0.0))


def test_a_new_target_is_looked_at_in_its_middle_and_a_moving_one_is_only_followed():
    points = Refixations(np.random.default_rng(0))
    times = np.arange(0.0, 20.0, 0.005)
    assert not any(points.is_due(t, still=False) for t in times)
    assert any(points.is_due(20.0 + t) for t in times)
    assert 0.0 < degrees(hypot(*points.offset_rad)) <= 1.28
    points.reset()
    assert points.offset_rad == (0.0, 0.0)
