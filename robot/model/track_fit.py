"""Fit of a track to a rig's joints, ranges and speeds."""

from collections.abc import Mapping, Sequence

import numpy as np

from gazerig.gaze.track.animation import NO_TABLES, FaceTables
from gazerig.gaze.track.motion import ChannelBounds, ChannelKeys, Motion
from gazerig.gaze.track.player import SPEECH
from gazerig.gaze.track.track import (
    EYE_CHANNELS,
    GROUPS,
    HEAD_CHANNELS,
    LEVEL,
    LID_CHANNELS,
    LIMIT_SHARE,
    POSE_CHANNELS,
    RETURN_S,
    Track,
    rest_value,
)
from gazerig.robot.model.commands import Speak
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.kinematics import NECK
from gazerig.robot.model.types import GAZE_JOINTS, further_joints

_SLOWED = 1e-3
"""Larger part of a track's time by which it is slower is reported."""

Limits = Sequence[JointLimit]


class TrackRefused(ValueError):
    """A track that a rig cannot play; the message gives the reason."""


def channel_of_joint(joint: str) -> str:
    """Return the channel of a joint: both eyes have one."""
    if joint in NECK:
        return joint.replace("neck", "head")
    if joint in GAZE_JOINTS and joint.endswith("_pan"):
        return "eyes_yaw"
    return "eyes_pitch" if joint in GAZE_JOINTS and joint.endswith("_tilt") else joint


class TrackFit:
    """The fit of tracks to the joints of one rig.

    Args:
        joints: Joints of the rig, in the order of all sequences of joints.
        lid_spans_rad: Range of each lid from shut to open, by joint.
        tables: Expressions and levels of the rig.
    """

    def __init__(
        self, joints: tuple[str, ...], lid_spans_rad: Mapping[str, float],
        tables: FaceTables = NO_TABLES,
    ) -> None:  # fmt: skip
        self._joints, self._spans_rad, self._ranges = joints, lid_spans_rad, tables.ranges
        self._of_joints = [channel_of_joint(name) for name in joints]
        self._channels = (*POSE_CHANNELS, *further_joints(joints))

    def motion(
        self, track: Track, limits: Limits, speed: float = 1.0, sound_s: float = 0.0
    ) -> Motion:
        """Return the curves of a track, slower where the limits of the joints need it.

        Args:
            track: The track.
            limits: Limits of the joints.
            speed: Factor on its defined speed.
            sound_s: Duration of its sound, 0 without one.

        Raises:
            TrackRefused: The rig has nothing that it moves.
        """
        bounds, limited = self._bounds(limits), list[str]()
        rows, lacking = self._keys(track)
        if not (rows or track.sound or sound_s):
            names = ", ".join(lacking) or "lids"
            raise TrackRefused(f"this rig has none of the joints that it moves: {names}")
        for i, (channel, times_s, values) in enumerate(rows):
            kept = np.clip(values, bounds.low[channel], bounds.high[channel])
            worst = np.abs(values - kept).argmax()
            if kept[worst] != values[worst]:
                share = kept[worst] / values[worst]
                limited.append(f"{_joint_name(self._channels[channel])} moves {share:.0%} as far")
            rows[i] = channel, times_s, kept
        members = {channel for name in track.owns for channel in _members(name)}
        owned = members.intersection(self._of_joints)
        indices = frozenset([self._channels.index(channel) for channel in owned])
        motion = Motion(track, rows, bounds, indices, speed, sound_s)
        pairs = zip(self._joints, self._of_joints, strict=True)
        motion.owns = tuple([joint for joint, channel in pairs if channel in owned])
        if motion.slowed_by > 1.0 + _SLOWED:
            slow = _joint_name(self._channels[motion.slowest])
            limited.insert(0, f"slower by {motion.slowed_by:.2f} for {slow}")
        if lacking:
            limited.append(f"without {', '.join(dict.fromkeys(map(_joint_name, lacking)))}")
        motion.limited = "; ".join(limited)
        return motion

    def speech(self, command: Speak, limits: Limits) -> Motion:
        """Return the motion of a speech: none but that of a level, whose channels it takes."""
        track = Track(SPEECH, sound=command.sound, volume=command.volume)
        motion = self.motion(track, limits, sound_s=command.duration_s)
        if (level := self._ranges.get(command.level)) is not None:
            motion.channels = frozenset(np.flatnonzero(level.gain).tolist())
            if command.mouth:
                motion.mouth = (*np.array(command.mouth).T,)
                motion.lead_s = 0.5 * level.smoothing_s
        return motion

    def _bounds(self, limits: Limits) -> ChannelBounds:
        """Return the limits of the channels by those of the joints.

        A lid turns by its factor times its full range, which is the range of its channel.
        """
        bounds = np.full((len(self._channels), 4), np.inf)
        bounds[:, 0] = -np.inf
        for joint, channel, limit in zip(self._joints, self._of_joints, limits, strict=True):
            span = self._spans_rad.get(joint, 1.0)
            low, high, speed, acceleration = bounds[self._channels.index(channel)]
            if channel not in LID_CHANNELS:
                low, high = max(low, min(0.0, limit.low_rad)), min(high, max(0.0, limit.high_rad))
            speed = min(speed, LIMIT_SHARE * limit.speed_rad_s / span)
            acceleration = min(acceleration, LIMIT_SHARE * limit.accel_rad_s2 / span)
            bounds[self._channels.index(channel)] = low, high, speed, acceleration
        return ChannelBounds(*bounds.T)

    def _keys(self, track: Track) -> tuple[list[ChannelKeys], list[str]]:
        """Return a track's keys on the rig's channels, and what the rig lacks.

        The eyes of a rig without a neck move instead, unless the track moves them as well.
        """
        keys: dict[str, list[tuple[float, float]]] = {}
        for frame in track.frames:
            for name, value in frame.values().items():
                keys.setdefault(name, [(0.0, rest_value(name))]).append((frame.time_s, value))
        moved = tuple(keys)
        for head, eye in zip(HEAD_CHANNELS, EYE_CHANNELS, strict=False):
            if head in keys and head not in self._of_joints and eye not in keys:
                keys[eye] = keys.pop(head)
        rows: list[ChannelKeys] = []
        lacking = [name for name in moved if name not in keys]
        for name, pairs in keys.items():
            rest = rest_value(name)
            if pairs[-1][1] != rest:
                pairs.append((pairs[-1][0] + RETURN_S, rest))
            times_s, values = np.array(pairs).T
            level = self._ranges.get(name.removeprefix(LEVEL))
            if level is not None and name.startswith(LEVEL):
                moves = np.flatnonzero(level.gain).tolist()
                rows += [(channel, times_s, level.gain[channel] * values) for channel in moves]
            elif name in self._of_joints:
                rows.append((self._channels.index(name), times_s, values - rest))
            elif name not in LID_CHANNELS:
                lacking.append(name)
        lacking += [name for name in track.owns if not {*_members(name)} & {*self._of_joints}]
        return rows, lacking


def _joint_name(channel: str) -> str:
    """Return the name of a channel or level for users."""
    return channel.removeprefix(LEVEL).replace("head_", "neck_")


def _members(name: str) -> tuple[str, ...]:
    """Return the channels of a group or a joint."""
    return GROUPS.get(name, (channel_of_joint(name),))
