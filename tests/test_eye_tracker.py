"""Our own trace before an independent judge: pymovements, as a laboratory would use it.

Half a minute of the default head on a body that follows perfectly, looking about on a face
and now and then aside, written as an eye tracker writes it (time, x, y in degrees, with a
tracker's noise), and segmented by the velocity algorithm of Engbert & Kliegl.
"""

from math import degrees, radians
from typing import Any, NamedTuple

import numpy as np
import pytest
from desk import GAZE_JOINTS, LIDS

from gazerig.gaze.angles import add, scale, unit, yaw_pitch
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.head import HeadModel, HeadParams
from gazerig.gaze.lids import LidParams, Lids
from gazerig.gaze.oculomotor import Oculomotor, OculomotorParams
from gazerig.gaze.pursuit import Pursuit, PursuitParams
from gazerig.gaze.saccade import SaccadeModel, SaccadeParams
from gazerig.gaze.types import Target, Vec3
from gazerig.robot.model.kinematics import GeometryParams, Kinematics
from gazerig.robot.model.types import JointState

RATE_HZ = 1000
SECONDS = 36
NOISE_DEG = 0.01
# Eight places on a face of usual size, m: sideways and up of the nose.
PARTS = np.array(
    [
        [0.0, -0.08],
        [0.07, 0.0],
        [0.031, 0.035],
        [0.0, -0.035],
        [0.0, 0.0],
        [-0.07, 0.0],
        [-0.031, 0.035],
        [0.0, 0.08],
    ]
)


class Trace(NamedTuple):
    """Time in ms, gaze in space in degrees (n, 2), and our own saccade onsets in ms."""

    ms: np.ndarray
    gaze_deg: np.ndarray
    onsets_ms: np.ndarray


def walk(rng: np.random.Generator) -> list[tuple[float, Vec3, Vec3]]:
    """Return when which point is looked at, and its velocity: a face that drifts, and things."""
    t, last, plan = 0.0, -1, []
    while t < SECONDS:
        velocity: Vec3 = (0.0, 0.02, 0.0) if t % 20 > 12 else (0.0, 0.0, 0.0)
        if rng.random() < 0.12:
            yaw = float(rng.uniform(-0.6, 0.6))
            point: Vec3 = (1.2, 1.2 * yaw, float(rng.uniform(-0.2, 0.3)))
            last, velocity = -1, (0.0, 0.0, 0.0)
        else:
            part = int(rng.choice([k for k in range(8) if k != last]))
            y, z = PARTS[part]
            last, point = part, (1.0, float(y), float(z) + 0.15)
        plan.append((t, point, velocity))
        t += float(rng.lognormal(-1.2, 0.5)) + 0.12
    return plan


def look_about(seed: int, saccade: SaccadeParams) -> Trace:
    rng = np.random.default_rng(seed)
    kinematics = Kinematics(GeometryParams(60.0, 40.0, 50.0), GAZE_JOINTS, LIDS)
    span, neck = (-radians(35.0), radians(35.0)), (-radians(70.0), radians(70.0))
    oculomotor = Oculomotor(
        OculomotorParams(eye_lag_ms=1000.0 / RATE_HZ),
        kinematics,
        ((span, span), (span, span)),
        SaccadeModel(saccade),
        Pursuit(PursuitParams()),
        HeadModel(HeadParams(), radians(35.0), (neck, neck)),
        Lids(LidParams(), np.random.default_rng(0)),
    )
    joints, plan, k = JointState((0.0,) * 9, (0.0,) * 9, (0.0,) * 9, ()), walk(rng), 0
    dt, gaze, onsets, count = 1.0 / RATE_HZ, [], [], 0
    for n in range(RATE_HZ * SECONDS):
        t = n * dt
        while k + 1 < len(plan) and plan[k + 1][0] <= t:
            k += 1
        since, point, velocity = plan[k]
        moved = add(point, scale(velocity, t - since))
        target = Target(moved, velocity, t, "face", 1, 0.5, True, None, k, "")
        command = oculomotor.step(target, kinematics.forward(joints), t, dt)
        now = kinematics.inverse(command)
        rates = tuple((a - b) / dt for a, b in zip(now, joints.position_rad, strict=True))
        joints = JointState(now, rates, (t,) * 9, ())
        state = kinematics.forward(joints)
        way = unit(add(line_of_sight(state, True), line_of_sight(state, False)))
        gaze.append([degrees(a) for a in yaw_pitch(way)])
        if command.saccades > count:
            count = command.saccades
            onsets.append(n)
    noise = rng.normal(0.0, NOISE_DEG, (len(gaze), 2))
    return Trace(np.arange(len(gaze)), np.array(gaze) + noise, np.array(onsets))


def judged(trace: Trace) -> np.ndarray:
    """Return onset and end of every saccade that the judge sees, in ms."""
    pymovements = pytest.importorskip("pymovements")  # a second of processor: not while collecting
    recording = pymovements.gaze.from_numpy(
        time=trace.ms,
        position=trace.gaze_deg.T,
        experiment=pymovements.Experiment(1920, 1080, 60, 34, 65, "center", RATE_HZ),
    )
    recording.pos2vel("savitzky_golay", window_length=11, degree=2)
    recording.detect("microsaccades", minimum_duration=10, threshold_factor=6)
    return recording.events.frame.select("onset", "offset").to_numpy()


@pytest.mark.parametrize("profile", ["min_jerk", "main_sequence"])
def test_the_judge_finds_our_saccades_and_hardly_any_other(profile: Any) -> None:
    trace = look_about(1, SaccadeParams(profile=profile))
    seen = judged(trace)
    assert len(trace.onsets_ms) > 60
    apart = np.abs(seen[:, 0][None, :] - trace.onsets_ms[:, None])
    assert np.mean(apart.min(axis=1) <= 10) >= 0.95
    assert np.mean(apart.min(axis=0) > 10) <= 0.02
    # And it is the onsets that agree: 40 ms later there is none.
    late = np.abs(seen[:, 0][None, :] - trace.onsets_ms[:, None] - 40)
    assert np.mean(late.min(axis=1) <= 10) < 0.1
