"""Tracks begin, end and are interrupted at random moments: no joint jumps or breaks a limit."""

from typing import NamedTuple

import numpy as np
import pytest

from gazerig.config.load import shipped_names
from gazerig.config.schema import load_rig
from gazerig.config.tracks import shipped_tracks
from gazerig.gaze.lids.lids import LidOpenings
from gazerig.gaze.track.pose_offset import PoseOffset
from gazerig.gaze.track.track_player import TrackPlayer
from gazerig.gaze.types import Floats
from gazerig.robot.app.gaze_models import rig_kinematics
from gazerig.robot.app.rig_limits import lid_ends, lid_spans, limits
from gazerig.robot.control.track_choices import TrackChoices
from gazerig.robot.model.commands import Play
from gazerig.robot.model.kinematics import LIDS, NECK
from gazerig.robot.model.types import further_joints

DT_S = 0.01
TARGET = (1.0, 0.0, 0.25)


class Moments(NamedTuple):
    """What a chain of interrupted tracks asked of the joints.

    step_deg, speed_share, accel_share: (joints,) largest step in a tick, and largest speed and
        acceleration over the joint's limit
    began: tracks that were begun
    """

    step_deg: Floats
    speed_share: Floats
    accel_share: Floats
    began: int


def joint_angles(rig_name: str, offsets: list[PoseOffset]) -> Floats:
    """Return (n, joints) angles of a head that looks at a point straight ahead all the while."""
    rig = load_rig(rig_name)
    kinematics, ends = rig_kinematics(rig), lid_ends(rig)
    eyes = [
        kinematics.eye_angles_to(TARGET, *kinematics.head_pose(one.head_rad)) for one in offsets
    ]
    left, right = np.array(eyes)[:, 0, :2].T, np.array(eyes)[:, 1, :2].T
    yaw, pitch = np.array([one.eyes_rad for one in offsets]).T
    lids = [LidOpenings(0.9, 0.9, False, 0.9, 0.9).scale(one.lids) for one in offsets]
    openings = np.array([(one.left, one.right, one.lower_left, one.lower_right) for one in lids]).T
    head, joints = (
        np.array([one.head_rad for one in offsets]).T,
        np.array([one.joints_rad for one in offsets]).T,
    )
    angles = {
        "left_eye_pan": left[0] + yaw, "left_eye_tilt": left[1] + pitch,
        "right_eye_pan": right[0] + yaw, "right_eye_tilt": right[1] + pitch,
        "eyes_pan": 0.5 * (left[0] + right[0]) + yaw, "eyes_tilt": left[1] + pitch,
        **dict(zip(NECK, head, strict=True)),
        **dict(zip(further_joints(rig.joints), joints, strict=True)),
        **{lid: ends[lid][0] + opening * (ends[lid][1] - ends[lid][0])
           for lid, opening in zip(LIDS, openings, strict=True) if lid in ends},
    }  # fmt: skip
    return np.stack([angles[name] for name in rig.names], axis=1)


def interrupted(track: str, rig_name: str, moments: int, seed: int) -> Moments:
    """Play a track and, at random moments, another one, the same again, or nothing."""
    rig, random = load_rig(rig_name), np.random.default_rng(seed)
    player = TrackPlayer(len(further_joints(rig.joints)))
    choices = TrackChoices(shipped_tracks(), player, rig.names, lid_spans(rig))
    bounds, others = limits(rig.joints), (*choices.names, track, track, "")
    at_rest = tuple([0.0] * len(rig.names))
    offsets, t, began = [player.step(0.0)] * 3, 0.0, 0
    for _ in range(moments):
        name = track if not player.playing else others[int(random.integers(len(others)))]
        speed = float(random.uniform(0.5, 2.0))
        reply = choices.play(Play(name, speed), t, at_rest, bounds)
        began += bool(name) and not reply.refused
        for _ in range(int(random.integers(1, round(0.25 / DT_S)))):
            t += DT_S
            offsets.append(player.step(t))
    angles = joint_angles(rig_name, offsets)
    step = np.abs(np.diff(angles, axis=0)).max(axis=0)
    accel = np.abs(np.diff(angles, 2, axis=0)).max(axis=0) / DT_S**2
    return Moments(
        np.degrees(step),
        step / DT_S / [one.speed_rad_s for one in bounds],
        accel / [one.accel_rad_s2 for one in bounds],
        began,
    )


TRACKS = shipped_names("tracks")
RIG_OF = dict(
    zip(TRACKS, ("expressive", "desk", "maker", "expressive", "feetech") * 9, strict=False)
)  # fmt: skip


@pytest.mark.parametrize("track", TRACKS)
def test_no_joint_jumps_or_breaks_a_limit_at_400_random_moments(track: str) -> None:
    found = interrupted(track, RIG_OF[track], 400, seed=len(track))
    assert found.began > 280
    assert found.step_deg.max() > 0.1  # something has moved
    assert found.speed_share.max() < 1.0
    assert found.accel_share.max() < 1.0
