"""Fit of a track to a rig's joints, ranges and speeds."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from gazerig.gaze.track.animation import NO_TABLES, FaceTables
from gazerig.gaze.track.track import (
    EYE_CHANNELS,
    HEAD_CHANNELS,
    LEVEL,
    LID_CHANNELS,
    LIMIT_SHARE,
    POSE_CHANNELS,
    RETURN_S,
    Track,
    rest_value,
)
from gazerig.gaze.track.track_motion import ChannelKeys, Strain, TrackMotion
from gazerig.gaze.types import Floats
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.kinematics import NECK
from gazerig.robot.model.reply import TrackReply
from gazerig.robot.model.types import GAZE_JOINTS, further_joints

_SLOWED = 1e-3
"""Larger part of a track's time by which it is slower is reported."""
_GROUPS: dict[str, Callable[[str], bool]] = {
    "neck": lambda name: name in NECK,
    "eyes": lambda name: name in GAZE_JOINTS and "eye" in name,
    "lids": lambda name: name in LID_CHANNELS,
}


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

    Joint angles are linear in the offset: the eyes turn against the head, and a lid turns by
    its factor times its full range.

    Args:
        joints: Joints of the rig, in the order of all sequences of joints.
        lid_spans_rad: Range of each lid from shut to open, by joint.
        tables: Expressions and levels of the rig.
    """

    def __init__(
        self, joints: tuple[str, ...], lid_spans_rad: Mapping[str, float],
        tables: FaceTables = NO_TABLES,
    ) -> None:  # fmt: skip
        self.joints, self.channels = joints, (*POSE_CHANNELS, *further_joints(joints))
        self._ranges = {**tables.expressions, **tables.levels}
        self._matrix = np.zeros((len(self.channels), len(joints)))
        for j, name in enumerate(joints):
            channel = channel_of_joint(name)
            self._matrix[self.channels.index(channel), j] = lid_spans_rad.get(name, 1.0)
            if channel in EYE_CHANNELS:
                self._matrix[EYE_CHANNELS.index(channel), j] = -1.0

    def motion(
        self,
        name: str,
        track: Track,
        limits: Sequence[JointLimit],
        speed: float = 1.0,
        sound_s: float = 0.0,
    ) -> tuple[TrackMotion, TrackReply]:
        """Return the curves of a track, slower where the limits of the joints need it.

        Args:
            name: Name of the track.
            track: The track.
            limits: Limits of the joints.
            speed: Factor on its defined speed.
            sound_s: Duration of its sound, 0 without one.

        Returns:
            Its curves, and how it is played.

        Raises:
            TrackRefused: The rig has nothing that it moves.
        """
        rows, lacking = self.rows(track)
        rows, limited = self._clip(rows, limits)
        owned = frozenset([self.channels.index(channel_of_joint(j)) for j in self.owns(track)])
        strain = self._strain(owned, limits)
        motion = TrackMotion(track, rows, len(self.channels), owned, strain, speed, sound_s)
        if motion.slowed_by > 1.0 + _SLOWED:
            slow = self.joints[motion.slowest]
            limited.insert(0, f"slower by {motion.slowed_by:.2f} for {slow}")
        if lacking:
            limited.append(f"without {', '.join(lacking)}")
        return motion, TrackReply(name, motion.duration_s, "; ".join(limited))

    def speech(
        self,
        track: Track,
        level: str,
        mouth: Sequence[tuple[float, float]],
        duration_s: float,
        limits: Sequence[JointLimit],
    ) -> TrackMotion:
        """Return the motion of a speech: none but that of a level, whose channels it takes.

        Args:
            track: Its sound.
            level: Level that opens the mouth, "" without one.
            mouth: Times and openings; () if they arrive during the speech.
            duration_s: Its duration, s.
            limits: Limits of the joints.
        """
        strain = self._strain(frozenset(), limits)
        motion = TrackMotion(track, (), len(self.channels), frozenset(), strain, 1.0, duration_s)
        if level in self._ranges:
            motion.channels = frozenset(np.flatnonzero(self._ranges[level].gain).tolist())
            if mouth:
                motion.mouth = (*np.array(mouth).T,)
                motion.lead_s = 0.5 * self._ranges[level].smoothing_s
        return motion

    def rows(self, track: Track) -> tuple[list[ChannelKeys], list[str]]:
        """Return a track's keys on the rig's channels, and what the rig lacks and leaves out.

        The eyes of a rig without a neck move instead, unless the track moves them as well.

        Raises:
            TrackRefused: Nothing is left.
        """
        keys: dict[str, list[tuple[float, float]]] = {}
        for frame in track.frames:
            for channel, value in frame.values().items():
                keys.setdefault(channel, []).append((frame.time_s, value))
        moved, present = tuple(keys), {channel_of_joint(joint) for joint in self.joints}
        for head, eye in zip(HEAD_CHANNELS, EYE_CHANNELS, strict=False):
            if head in keys and head not in present and eye not in keys:
                keys[eye] = keys.pop(head)
        rows, lacking = [], [name for name in moved if name in HEAD_CHANNELS and name not in keys]
        for name, pairs in keys.items():
            rest = rest_value(name)
            if pairs[-1][1] != rest:
                pairs.append((pairs[-1][0] + RETURN_S, rest))
            times_s, values = np.array(pairs).T
            if (level := name.removeprefix(LEVEL)) in self._ranges and level != name:
                gains = enumerate(self._ranges[level].gain.tolist())
                rows += [ChannelKeys(i, times_s, gain * values) for i, gain in gains if gain]
            elif name in present or name in EYE_CHANNELS:
                rows.append(ChannelKeys(self.channels.index(name), times_s, values - rest))
            elif name not in LID_CHANNELS:
                lacking.append(name)
        if not rows and not track.sound:
            raise TrackRefused(
                f"this rig has none of the joints that it moves: {', '.join(lacking or moved)}"
            )
        lacking += [name for name in track.owns if not self._members(name)]
        named = [name.removeprefix(LEVEL).replace("head_", "neck_") for name in lacking]
        return rows, list(dict.fromkeys(named))

    def owns(self, track: Track) -> tuple[str, ...]:
        """Return the joints of the rig that a track owns."""
        owned = {channel_of_joint(one) for name in track.owns for one in self._members(name)}
        return tuple([name for name in self.joints if channel_of_joint(name) in owned])

    def _members(self, name: str) -> list[str]:
        return [joint for joint in self.joints if _GROUPS.get(name, name.__eq__)(joint)]

    def _clip(
        self, rows: Sequence[ChannelKeys], limits: Sequence[JointLimit]
    ) -> tuple[list[ChannelKeys], list[str]]:
        """Return the keys within the ranges of the joints, and a text for each smaller motion.

        Lids are limited by their openings, and eyes that compensate for the head move as far as
        they can.
        """
        found, smaller = [], list[str]()
        for row in rows:
            values = row.values
            for joint, limit in zip(self.joints, limits, strict=True):
                if channel_of_joint(joint) != self.channels[row.channel] or joint in LID_CHANNELS:
                    continue
                clipped = np.clip(values, min(0.0, limit.low_rad), max(0.0, limit.high_rad))
                worst = int(np.abs(values - clipped).argmax())
                if abs(values[worst] - clipped[worst]) > 1e-6:
                    share = float(clipped[worst] / values[worst])
                    smaller.append(f"{joint} moves {share:.0%} as far")
                values = clipped
            found.append(row._replace(values=values))
        return found, smaller

    def _strain(self, owned: frozenset[int], limits: Sequence[JointLimit]) -> Strain:
        """Return the factors by which motion must take longer to keep the limits.

        Eyes that a track owns do not compensate the head.
        """
        matrix = self._matrix.copy()
        for head, name in enumerate(EYE_CHANNELS):
            eye = self.channels.index(name)
            if eye in owned:
                matrix[head, self._matrix[eye] != 0.0] = 0.0
        speeds = LIMIT_SHARE * np.array([limit.speed_rad_s for limit in limits])
        accelerations = LIMIT_SHARE * np.array([limit.accel_rad_s2 for limit in limits])

        def strain(speed: Floats, acceleration: Floats) -> Floats:
            by_speed = np.abs(speed @ matrix) / speeds
            by_acceleration = np.sqrt(np.abs(acceleration @ matrix) / accelerations)
            found: Floats = np.maximum(by_speed, by_acceleration)
            return found

        return strain
