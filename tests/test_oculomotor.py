"""Eyes, head and lids together on a body that follows perfectly.

Numbered checks are listed in docs/checks.md. The head's centre of rotation is put
between the eyes, as in the sources of those numbers, unless a test says otherwise.
"""

from collections.abc import Callable
from math import degrees, radians
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gaze.angles import add, angle_between, direction, rotate, scale, sub, unit
from gaze.field_of_view import line_of_sight
from gaze.head import Head, HeadParams
from gaze.lids import LidParams, Lids
from gaze.oculomotor import Oculomotor, OculomotorParams
from gaze.pursuit import Pursuit, PursuitParams
from gaze.saccade import Saccade, SaccadeParams
from gaze.types import Angles2, GazeCommand, GazeState, Target, Vec3
from robot.kinematics import GeometryParams, Kinematics
from robot.types import JointState

DT = 0.005
CENTRED = GeometryParams(0.0, 0.0, 0.0)
DESK = GeometryParams(60.0, 40.0, 50.0)
NO_RELIEF = HeadParams(recentre_after_ms=60_000.0)


class Trace(NamedTuple):
    """One row a tick: time, head yaw, mean eye yaw, gaze error to the target (degrees)."""

    t: np.ndarray
    head: np.ndarray
    eye: np.ndarray
    error: np.ndarray
    commands: list[GazeCommand]


class Rig:
    """A head that does at once what it is told."""

    def __init__(
        self,
        eye_deg: float = 55.0,
        geometry: GeometryParams = CENTRED,
        head: HeadParams = NO_RELIEF,
        neck_deg: float = 90.0,
    ) -> None:
        self.kinematics = Kinematics(geometry, (-0.4, -0.4), (0.4, 0.4))
        span = (-radians(eye_deg), radians(eye_deg))
        neck = (-radians(neck_deg), radians(neck_deg))
        self.oculomotor = Oculomotor(
            OculomotorParams(eye_lag_ms=DT * 1e3),
            self.kinematics,
            ((span, span), (span, span)),
            Saccade(SaccadeParams()),
            Pursuit(PursuitParams()),
            Head(head, radians(eye_deg), (neck, neck)),
            Lids(LidParams(), np.random.default_rng(0)),
        )
        self.joints = JointState((0.0,) * 9, (0.0,) * 9, (0.0,) * 9, ())

    def run(self, where: Callable[[float], Target], seconds: float) -> Trace:
        rows, commands = [], []
        for k in range(round(seconds / DT)):
            t = k * DT
            state = self.kinematics.forward(self.joints)
            command = self.oculomotor.step(where(t), state, t, DT)
            now = self.kinematics.inverse(command)
            rates = tuple((a - b) / DT for a, b in zip(now, self.joints.position_rad, strict=True))
            self.joints = JointState(now, rates, (t,) * 9, ())
            rows.append(self._row(t, where(t)))
            commands.append(command)
        return Trace(*np.array(rows).T, commands)

    def _row(self, t: float, target: Target) -> tuple[float, ...]:
        state = self.kinematics.forward(self.joints)
        gaze = unit(add(line_of_sight(state, True), line_of_sight(state, False)))
        point = add(target.p_world_m, scale(target.v_world_m_s, t - target.at_s))
        error = angle_between(gaze, sub(point, state.p_world_head_m))
        eye = 0.5 * (state.eye_left_rad[0] + state.eye_right_rad[0])
        return t, degrees(state.head_rad[0]), degrees(eye), degrees(error)


def still(
    yaw_deg: float, pull: float = 1.0, top_down: bool = False, pitch_deg: float = 0.0
) -> Callable[[float], Target]:
    point = scale(direction((radians(yaw_deg), radians(pitch_deg))), 10.0)
    ahead = Target((10.0, 0, 0), (0, 0, 0), 0.0, "thing", 0, pull, top_down, None, 1, "")
    there = ahead._replace(p_world_m=point, id=1, shift=2)
    return lambda t: there if t >= 0.1 else ahead


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
    trace = Rig(eye_deg=20.0).run(still(size, pull=0.2), 3.0)
    assert trace.error[-1] <= 0.5


def test_e19_no_eye_beyond_its_limit_and_no_head_beyond_its_range() -> None:
    rng = np.random.default_rng(5)
    rig = Rig(eye_deg=35.0, geometry=DESK, neck_deg=60.0)
    points = [
        (float(r * np.cos(y)), float(r * np.sin(y)), float(z))
        for r, y, z in rng.uniform((0.25, -1.9, -0.6), (3.0, 1.9, 0.9), (300, 3))
    ]

    def where(t: float) -> Target:
        k = min(int(t / 0.2), 299)
        return Target(
            points[k], (0, 0, 0), t, "thing", k, 0.2 + 0.8 * (k % 5) / 4, k % 2 == 0, None, k, ""
        )

    trace = rig.run(where, 60.0)
    for command in trace.commands:
        eyes = (*command.eye_left_rad, *command.eye_right_rad)
        assert max(abs(a) for a in eyes) <= radians(35.0) + 1e-12
    assert np.abs(trace.head).max() <= 60.0 + 1e-9


@settings(max_examples=30, deadline=None)
@given(yaw=st.floats(-70, 70), pitch=st.floats(-30, 30), pull=st.floats(0, 3), top=st.booleans())
def test_gaze_lands_on_any_still_target(yaw: float, pitch: float, pull: float, top: bool) -> None:
    rig = Rig(eye_deg=35.0, geometry=DESK)
    trace = rig.run(still(yaw, pull, top, pitch), 2.5)
    assert trace.error[-1] <= 0.5
    speeds = [
        angle_between(a.gaze_point_world_m, b.gaze_point_world_m) / DT
        for a, b in zip(trace.commands, trace.commands[1:], strict=False)
    ]
    assert degrees(max(speeds)) <= 520.0


def test_e31_eyes_hold_the_gaze_through_any_turn_of_the_head() -> None:
    rig = Rig(geometry=DESK)
    target = Target((1.5, 0.2, 0.2), (0, 0, 0), 0.0, "thing", 1, 0.2, False, None, 1, "")
    rig.run(lambda t: target, 1.0)
    before = None
    for k in range(200):
        share = k / 199
        turned = (radians(40.0) * share, radians(20.0) * share, radians(10.0) * share)
        q = rig.joints.position_rad
        joints = JointState((*q[:6], *turned), (0.0,) * 9, (0.0,) * 9, ())
        state = rig.kinematics.forward(joints)
        command = rig.oculomotor.step(target, state, 1.0 + k * DT, DT)
        seen = rig.kinematics.forward(
            JointState((*rig.kinematics.inverse(command)[:6], *turned), (0.0,) * 9, (0.0,) * 9, ())
        )
        for left in (True, False):
            eye = seen.p_world_eye_left_m if left else seen.p_world_eye_right_m
            error = angle_between(line_of_sight(seen, left), sub(target.p_world_m, eye))
            assert degrees(error) < 0.1
        before = seen
    assert before is not None and degrees(before.head_rad[0]) == pytest.approx(40.0)


def test_e27_vergence_comes_from_geometry() -> None:
    kinematics = Rig().kinematics
    R, p = kinematics.head_pose((0.0, 0.0, 0.0))
    left, right = kinematics.eyes_on((1.0, 0.0, 0.0), R, p)
    assert degrees(left[0]) == pytest.approx(-1.773, abs=0.01)
    assert degrees(right[0]) == pytest.approx(1.773, abs=0.01)


def test_small_errors_are_followed_and_large_ones_jumped_to() -> None:
    rig = Rig()
    walk = 0.2  # m/s at 1 m: 11 deg/s

    def where(t: float) -> Target:
        return Target((1.0, walk * t, 0), (0, walk, 0), t, "thing", 1, 0.2, False, None, 1, "")

    trace = rig.run(where, 2.0)
    assert trace.error[100:].max() < 0.5
    assert trace.commands[-1].saccades <= 1
    assert trace.commands[-1].phase == "pursue"


def test_a_target_change_in_flight_waits_for_the_landing() -> None:
    rig = Rig()
    a, b = still(30.0)(1.0), still(-30.0)(1.0)._replace(id=2, shift=3)
    trace = rig.run(lambda t: a if t < 0.03 else b, 0.5)
    assert trace.commands[-1].saccades == 2
    speed = np.abs(np.diff(trace.eye)) / DT
    assert speed.max() < 505.0
    assert trace.error[-1] < 0.01


def test_a_point_on_the_nose_is_converged_on_no_nearer_than_the_limit() -> None:
    rig = Rig()
    near = Target((0.02, 0.0, 0.0), (0, 0, 0), 0.0, "thing", 1, 0.5, True, None, 1, "")
    command = rig.run(lambda t: near, 2.0).commands[-1]
    vergence = degrees(command.eye_right_rad[0] - command.eye_left_rad[0])
    assert 17.0 < vergence < 18.0


def test_it_begins_where_head_and_eyes_are() -> None:
    rig = Rig(geometry=DESK)
    q = (0.2, -0.1, 0.25, -0.1, 0.0, 0.0, 0.4, 0.1, 0.05)
    rig.joints = JointState(q, (0.0,) * 9, (0.0,) * 9, ())
    state: GazeState = rig.kinematics.forward(rig.joints)
    ahead: Vec3 = add(state.p_world_head_m, rotate(state.R_world_head, (1.0, 0.2, -0.1)))
    target = Target(ahead, (0, 0, 0), 0.0, "thing", 1, 0.5, True, None, 1, "")
    first = rig.oculomotor.step(target, state, 0.0, DT)
    assert first.head_rad == pytest.approx(state.head_rad)
    eye: Angles2 = first.eye_left_rad
    assert degrees(abs(eye[0] - q[0])) < 3.0 and degrees(abs(eye[1] - q[1])) < 3.0
