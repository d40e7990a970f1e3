"""Motion of one person over a round: hips, trunk, head, arms and legs from the acts of a script.

Frames of segments, standing upright: x ahead, y left, z up, origin at the joint nearest to the
pelvis (a limb's upper end; a hand: x out of the palm, z from the fingers to the wrist).
"""

from collections.abc import Mapping, Sequence

import numpy as np

from gazerig.features.world import faces, motions, object_handover
from gazerig.features.world.gait import BasePose, base_motion
from gazerig.features.world.measures import Measures
from gazerig.features.world.room import places_for, places_of
from gazerig.features.world.rotations import (
    axes_along,
    pitch_of,
    quaternions,
    rotate_vectors,
    two_bones,
    unit,
    wrap_angle,
    yaw_of,
    yaw_pitch_roll,
)
from gazerig.features.world.time_profiles import (
    moving_average,
    periodic,
    smooth_rise,
    there_and_back,
)
from gazerig.features.world.timeline import HEAD_M, floor_m
from gazerig.gaze.types import Floats
from gazerig.robot.description.people import EYE_FACE_M, MOUTH_FACE_M
from gazerig.sim_mock.scenes.script import HEAD, SceneScript
from gazerig.sim_mock.scenes.timeline import TimedAct

SIDES = ("left", "right")
SEGMENTS = (
    "pelvis",
    "torso",
    "neck",
    "head",
    "lips",
    "left_eye",
    "right_eye",
    "left_lid",
    "right_lid",
    "left_upper_arm",
    "left_forearm",
    "left_hand",
    "right_upper_arm",
    "right_forearm",
    "right_hand",
    "left_thigh",
    "left_shank",
    "left_foot",
    "right_thigh",
    "right_shank",
    "right_foot",
)
"""The segments of a body, in the order of their rows."""

_LIPS_DOWN_M = 0.009

_STAND_SHARE, _BOX_SHARE = 0.997, 0.955
_SEAT_FLESH_M = 0.085
_REACH_SHARE = 0.997
_SIT_LEAN_RAD, _RECLINE_RAD = 0.62, -0.05
_HEEL_RAD, _TOE_RAD, _BALL_M = 0.45, 0.22, 0.115

Pose = tuple[Floats, Floats]
"""Positions (n, 3) and rotations (n, 3, 3) of one segment at all times."""


class BodyMotion:
    """Motion of one person over a round, at times (n,); the seed is for blinks, sway and gaze."""

    def __init__(
        self,
        script: SceneScript,
        timelines: Mapping[str, tuple[TimedAct, ...]],
        name: str,
        body: Measures,
        t_s: Floats,
        seed: int,
    ) -> None:
        self.script, self.name, self.t_s = script, name, t_s
        self.person, self.body = script.people[name], body
        self.timelines, self.acts = timelines, timelines[name]
        self.hands: dict[str, Pose] = {}
        index = list(script.people).index(name)
        self.rng = np.random.default_rng([seed, index, 1])
        self.phases = self.rng.uniform(0.0, 2.0 * np.pi, 8)
        self.floor = floor_m(script)
        places = places_for(script, name)
        legs = [one for one in self.acts if "legs" in one.tracks]
        self.base: BasePose = base_motion(
            t_s, places[self.person.start], legs, places, self.body, self.person.gloves
        )
        self.yaw = self.base.heading_rad
        self.ahead = np.stack((np.cos(self.yaw), np.sin(self.yaw), 0.0 * self.yaw), axis=1)
        self.left = np.stack((-np.sin(self.yaw), np.cos(self.yaw), 0.0 * self.yaw), axis=1)
        self.hips_m = self._hips()
        upright = 0.936 * self.body.stature_m - self.body.hip_m
        self.eyes_about_m = self.hips_m + 0.07 * self.ahead + (0.0, 0.0, upright)

    def _hips(self) -> Floats:
        """Return the midpoint of the hip joints, low enough for the legs to reach the ground."""
        base, body = self.base, self.body
        sway = 0.006 * np.stack(
            [
                periodic(self.t_s, self.script.round_s, (0.21 + 0.03 * i, 0.47), self.phases[2 * i : 2 * i + 2].tolist())
                for i in (0, 1)
            ],
            axis=1,
        )  # fmt: skip
        flat = base.hips_m + sway * (1.0 - 0.7 * base.seated[:, None])
        share = _BOX_SHARE if self.person.gloves else _STAND_SHARE
        height = body.ankle_m + share * body.leg_m
        limit = np.full(len(self.t_s), height)
        for foot in (0, 1):
            ankle = self.ankle(foot)
            hip = flat + (1.0 - 2.0 * foot) * body.half_hips_m * self.left[:, :2]
            away = np.linalg.norm(hip - ankle[:, :2], axis=1)
            reach = np.sqrt(np.maximum((_REACH_SHARE * body.leg_m) ** 2 - away**2, 0.01))
            limit = np.minimum(limit, ankle[:, 2] - self.floor + reach)
        standing = moving_average(np.minimum(limit, moving_average(limit, 31)), 21)
        seat = base.seat_m + _SEAT_FLESH_M
        z = standing + base.seated * (np.where(base.seat_m > 0.0, seat, standing) - standing)
        return np.concatenate((flat, (self.floor + z)[:, None]), axis=1)

    def heel(self, foot: int) -> Floats:
        """Return the pitch of a foot (n,): heel up behind the hips, toes up in front of them."""
        base = self.base
        way = base.hips_m - base.feet_m[:, foot, :2]
        back = (way * self.ahead[:, :2]).sum(axis=1) * (1.0 - np.clip(4.0 * base.seated, 0.0, 1.0))
        if self.person.gloves:
            back = back - 0.12
        lifted = np.clip(base.feet_m[:, foot, 2] / 0.03, 0.0, 1.0)
        up = _HEEL_RAD * smooth_rise((back - 0.12) / 0.32)
        return np.asarray(up - _TOE_RAD * lifted * smooth_rise((-back - 0.10) / 0.30))

    def ankle(self, foot: int) -> Floats:
        """Return an ankle's positions (n, 3) in the world."""
        base, pitch = self.base, np.maximum(self.heel(foot), 0.0)
        yaw = base.feet_rad[:, foot]
        ahead = np.stack((np.cos(yaw), np.sin(yaw)), axis=1)
        place = base.feet_m[:, foot].copy()
        place[:, :2] += (_BALL_M * (1.0 - np.cos(pitch)))[:, None] * ahead
        place[:, 2] += self.floor + self.body.ankle_m + _BALL_M * np.sin(pitch)
        return place

    def pose(self, eyes: Mapping[str, Floats]) -> list[Floats]:
        """Return positions and quaternions (n, 7) of every segment, in order."""
        found: dict[str, Pose] = {}
        taken = object_handover.receiving_acts(self.timelines, self.name)
        hand_acts = [one for one in (*self.acts, *taken) if motions.moves_arm(one)]
        hand_acts.sort(key=lambda one: one.start_s)
        at = [self._at(one, eyes) for one in hand_acts]
        self._trunk(found, hand_acts, at)
        self._head(found, eyes)
        for side in (1.0, -1.0):
            self._arm(found, side, hand_acts, at)
            self._leg(found, side)
        return [
            np.concatenate((p, quaternions(R)), axis=1) for p, R in map(found.__getitem__, SEGMENTS)
        ]

    def _at(self, one: TimedAct, eyes: Mapping[str, Floats]) -> Floats:
        """Return the target point of an act at all times."""
        if one.target is not None:
            return np.broadcast_to(np.array(one.target), (len(self.t_s), 3))
        if one.act.do == "pass":
            other, own = eyes[one.act.to], self.eyes_about_m
            apart = 0.05 * unit(own - other)
            return np.asarray(0.5 * (own + other) + apart - (0.0, 0.0, 0.32))
        return eyes[one.act.to]

    def _trunk(
        self, found: dict[str, Pose], acts: Sequence[TimedAct], at: Sequence[Floats]
    ) -> None:
        body, base, round_s = self.body, self.base, self.script.round_s
        chest = self.hips_m + (0.0, 0.0, body.shoulder_m - body.hip_m)
        lean = motions.lean_rad(self.t_s, acts, at, chest, body)
        lean = lean + _SIT_LEAN_RAD * 4.0 * base.seated * (1.0 - base.seated)
        lean = lean + _RECLINE_RAD * base.seated + (0.10 if self.person.gloves else 0.02)
        lean = lean + 0.008 * periodic(self.t_s, round_s, (0.25,), self.phases[4:5].tolist())
        twist = motions.twist_rad(self.t_s, acts)
        if self.person.gloves:
            twist = twist - 0.35
        R_pelvis = yaw_pitch_roll(self.yaw + 0.3 * twist, -0.25 * lean)
        R_torso = yaw_pitch_roll(self.yaw + twist, -lean)
        found["pelvis"] = (self.hips_m, R_pelvis)
        waist = self.hips_m + rotate_vectors(R_pelvis, np.array((0.0, 0.0, body.waist_m)))
        found["torso"] = (waist, R_torso)

    def _head(self, found: dict[str, Pose], eyes: Mapping[str, Floats]) -> None:
        body = self.body
        waist, R_torso = found["torso"]
        neck_base = 0.838 * body.stature_m - body.hip_m - body.waist_m
        base_m = waist + rotate_vectors(R_torso, np.array((-0.012, 0.0, neck_base)))
        eyes_about = base_m + 0.08 * self.ahead + (0.0, 0.0, body.neck_m + 0.05)
        rows = (len(self.t_s), 3)
        targets = {HEAD: np.broadcast_to(np.array(HEAD_M), rows), **eyes}
        for one in self.acts:
            if one.act.do == "look_at" and one.target is not None and one.act.to != HEAD:
                targets[one.act.to] = np.broadcast_to(np.array(one.target), rows)
        first = targets.get(self.person.looks_at)
        if first is None:
            place = places_of(self.script)[self.person.looks_at]
            first = np.broadcast_to((place.x_m, place.y_m, self.floor + place.height_m), rows)
        chest_yaw = self.yaw + 0.5 * wrap_angle(yaw_of(R_torso[:, :, 0]) - self.yaw)
        look = faces.look_angles(
            self.t_s, self.acts, first, targets, eyes_about, chest_yaw, HEAD, self.rng
        )
        yaw, pitch = faces.head_gestures(self.t_s, self.acts, self.script.round_s)
        yaw, pitch = yaw + look.yaw, pitch + look.pitch
        torso_pitch = pitch_of(R_torso[:, :, 0])
        R_neck = yaw_pitch_roll(
            self.yaw + 0.4 * wrap_angle(yaw - self.yaw), 0.6 * torso_pitch + 0.35 * pitch - 0.12
        )
        skull = base_m + rotate_vectors(R_neck, np.array((0.0, 0.0, body.neck_m)))
        R_head = yaw_pitch_roll(yaw, pitch)
        found["neck"], found["head"] = (base_m, R_neck), (skull, R_head)
        self._face(found, skull, R_head, look)

    def _face(
        self, found: dict[str, Pose], skull: Floats, R_head: Floats, look: faces.LookAngles
    ) -> None:
        body = self.body
        nose = skull - rotate_vectors(R_head, np.array(body.skull_m))
        shut = faces.lid_closure(self.t_s, self.rng)
        speaks = faces.lip_opening(self.t_s, self.acts, self.rng)
        still = np.zeros_like(self.t_s)
        yaw, pitch = faces.eyes_in_head(R_head, self._eye(nose, R_head, 0.0), look)
        for name, side in zip(SIDES, (1.0, -1.0), strict=True):
            centre = self._eye(nose, R_head, side)
            found[f"{name}_eye"] = (centre, R_head @ yaw_pitch_roll(yaw, pitch))
            lid = 0.75 * np.clip(pitch, -0.5, 0.25) - faces.LID_SHUT_RAD * shut * (1.0 + pitch)
            found[f"{name}_lid"] = (centre, R_head @ yaw_pitch_roll(still, lid))
        down = np.array(MOUTH_FACE_M) * body.head_scale - (
            _LIPS_DOWN_M * body.head_scale * speaks[:, None] * np.array((-0.15, 0.0, 1.0))
        )
        found["lips"] = (nose + rotate_vectors(R_head, down), R_head)

    def _eye(self, nose: Floats, R_head: Floats, side: float) -> Floats:
        x, y, z = (self.body.head_scale * one for one in EYE_FACE_M)
        return nose + rotate_vectors(R_head, np.array((x, side * y, z)))

    def _arm(
        self, found: dict[str, Pose], side: float, acts: Sequence[TimedAct], at: Sequence[Floats]
    ) -> None:
        body, name = self.body, SIDES[0 if side > 0 else 1]
        waist, R_torso = found["torso"]
        up = body.shoulder_m - body.hip_m - body.waist_m
        shoulder = waist + rotate_vectors(
            R_torso, np.array((-0.01, side * body.half_shoulders_m, up))
        )
        chin = self.hips_m + (0.0, 0.0, 0.885 * body.stature_m - body.hip_m) + 0.08 * self.ahead
        ahead = unit(R_torso[:, :, 0] * (1.0, 1.0, 0.0))
        left = np.stack((-ahead[:, 1], ahead[:, 0], 0.0 * ahead[:, 0]), axis=1)
        frame = motions.Frame(shoulder, self.hips_m, chin, ahead, left, side, body)
        mine = [
            (one, target)
            for one, target in zip(acts, at, strict=True)
            if f"{name} arm" in one.tracks
        ]
        holds = np.zeros_like(self.t_s)
        for thing in self.script.things:
            holders = object_handover.holders(self.script, self.timelines, thing)
            share = object_handover.holding_share(self.t_s, holders, self.name, name)
            holds = np.maximum(holds, share)
        held = motions.PostureShares(smooth_rise(self.base.seated), self._guard_share(), holds)
        rest = motions.resting_pose(frame, held, self._swing(side), self.person.gloves)
        hand = motions.hand_pose(
            frame, self.t_s, [one for one, _ in mine], [target for _, target in mine], rest
        )
        upper, fore, own = arm_poses(shoulder, hand, body)
        found[f"{name}_upper_arm"], found[f"{name}_forearm"] = upper, fore
        found[f"{name}_hand"] = self.hands[name] = own

    def _swing(self, side: float) -> Floats:
        """Return the forward swing of an arm, which follows the foot of the other side."""
        other = 1 if side > 0 else 0
        way = self.base.feet_m[:, other, :2] - self.base.hips_m
        ahead = (way * self.ahead[:, :2]).sum(axis=1) * (1.0 - smooth_rise(2.0 * self.base.seated))
        if self.person.gloves:
            ahead = 0.0 * ahead
        return np.asarray(np.clip(1.1 * moving_average(ahead, 30), -0.5, 0.5) + 0.03)

    def _guard_share(self) -> Floats:
        total = np.full_like(self.t_s, 0.0)
        for one in self.acts:
            if one.act.do == "guard":
                whole = one.start_s <= 0.0 and one.end_s >= self.script.round_s - 0.05
                held = there_and_back(
                    self.t_s, one.start_s, 0.5, one.end_s - one.start_s - 1.0, 0.5
                )
                total = np.maximum(total, 1.0 if whole else held)
        return total

    def _leg(self, found: dict[str, Pose], side: float) -> None:
        body, foot = self.body, 0 if side > 0 else 1
        name = SIDES[foot]
        pelvis, R_pelvis = found["pelvis"]
        hip = pelvis + side * body.half_hips_m * R_pelvis[:, :, 1]
        yaw = self.base.feet_rad[:, foot]
        toes = np.stack((np.cos(yaw), np.sin(yaw), 0.0 * yaw), axis=1)
        out = 0.25 * self.base.seated[:, None] * side * self.left
        pole = self.ahead + 0.7 * toes + out + 0.4 * self.base.seated[:, None] * motions.UP
        knee, ankle, plane = two_bones(hip, self.ankle(foot), body.thigh_m, body.shank_m, pole)
        found[f"{name}_thigh"] = (hip, axes_along(hip - knee, np.cross(unit(hip - knee), plane)))
        shank = np.cross(unit(knee - ankle), plane)
        found[f"{name}_shank"] = (knee, axes_along(knee - ankle, shank))
        found[f"{name}_foot"] = (ankle, yaw_pitch_roll(yaw, -self.heel(foot)))


def arm_poses(shoulder: Floats, hand: motions.HandPose, body: Measures) -> tuple[Pose, Pose, Pose]:
    """Return upper arm, forearm and hand that reach from a shoulder to a hand."""
    elbow, wrist, plane = two_bones(
        shoulder, hand.wrist_m, body.upper_arm_m, body.forearm_m, hand.pole
    )
    ahead_of_plane = np.cross(plane, unit(shoulder - elbow))
    forearm = np.cross(plane, unit(elbow - wrist))
    return (
        (shoulder, axes_along(shoulder - elbow, ahead_of_plane)),
        (elbow, axes_along(elbow - wrist, forearm)),
        (wrist, motions.hand_axes(hand, elbow, wrist)),
    )
