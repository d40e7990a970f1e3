"""Eyes and head keep their limits and reach any target. Checks: docs/checks.md."""

from dataclasses import replace
from math import degrees, radians

import numpy as np
from gaze_trace_rig import CENTRED, DESK, DT, EXACT, HUMAN, SACCADE, Rig, still
from hypothesis import given, settings
from hypothesis import strategies as st

from gazerig.gaze.angles import (
    add,
    angle_between,
    direction,
    scale,
    sub,
)
from gazerig.gaze.oculomotor.params import HeadParams
from gazerig.gaze.oculomotor.saccade import SaccadeParams
from gazerig.gaze.types import Target
from gazerig.robot.model.kinematics import GeometryParams
from gazerig.robot.model.types import JointState


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
        HeadParams(lead_ms=float(rng.choice((0.0, 80.0)))),
        params=replace(EXACT, eye_lag_ms=0.0, latency_ms=float(rng.choice((0.0, 120.0)))),
        saccade=profile,
    )
    t, shift, before = 0.0, 0, None
    target = _any_target(rng, 0.0, 0)
    pushed = np.zeros(3)
    for _ in range(250):
        dt = float(rng.choice((0.0, 0.001, 0.005, 0.005, 0.005, 0.020, 0.2)))
        t += dt
        if rng.random() < 0.08:
            shift += int(rng.integers(0, 2))
            target = _any_target(rng, t - float(rng.uniform(0.0, 0.3)), shift)
        if rng.random() < 0.1:
            pushed = rng.normal(0.0, (0.8, 0.4, 0.2))
        head = np.array(rig.joints.position_rad[6:]) + (pushed * dt if dt < 0.1 else 0.0)
        joints = JointState((*rig.joints.position_rad[:6], *head), (0.0,) * 9, (t,) * 9, ())
        state = rig.kinematics.forward(joints)
        command = rig.oculomotor.step(target, state, t, dt)
        now = rig.kinematics.inverse(command)
        assert np.isfinite(now).all() and np.isfinite(command.gaze_point_world_m).all()
        eyes = (*command.eye_left_rad, *command.eye_right_rad)
        assert max(abs(a) for a in eyes) <= radians(eye) + 1e-12
        way = sub(command.gaze_point_world_m, state.p_world_head_m)
        # A head that shifts its eyes sideways adds what the shifted view asks for.
        if before is not None and geometry is CENTRED:
            assert angle_between(way, before) <= radians(500.0) * dt + 1e-9
        before = way
        rig.joints = joints._replace(position_rad=now) if rng.random() < 0.8 else joints


def _any_target(rng: np.random.Generator, at_s: float, shift: int) -> Target:
    yaw, pitch = rng.uniform((-3.2, -1.6), (3.2, 1.6))
    distance = float(10 ** rng.uniform(-2, 1.5))
    point = scale(direction((float(yaw), float(pitch))), distance)
    x, y, z = rng.normal(0.0, 10 ** rng.uniform(-2, 1.5), 3)
    centre = add(point, (0.0, 0.1, -0.05)) if rng.random() < 0.5 else None
    return Target(
        point, (float(x), float(y), float(z)), at_s, "face", 1, float(rng.uniform(0, 2)),
        bool(rng.integers(0, 2)), None, shift, "", centre,
    )  # fmt: skip


@settings(max_examples=16, deadline=None)
@given(
    eye=st.floats(15, 55),
    yaw=st.floats(-80, 80),
    pitch=st.floats(-30, 30),
    salience=st.floats(0, 3),
    seed=st.integers(0, 2**32 - 1),
)
def test_e16_any_eye_range_and_timing_reaches_the_target(
    eye: float, yaw: float, pitch: float, salience: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    rig = Rig(eye_deg=eye, geometry=DESK)
    where, t = still(yaw, salience, bool(seed % 2), pitch), 0.0
    for _ in range(600):
        dt = float(rng.choice((0.002, 0.005, 0.005, 0.010, 0.030)))
        t += dt
        rig.tick(where(t), t, dt)
    assert rig.row(t, where(t))[3] <= 0.5


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
