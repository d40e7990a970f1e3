"""Fit of a track to a rig's joints, ranges and speeds."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from gazerig.gaze.minimum_jerk import PEAK_ACCELERATION, PEAK_SPEED, Quintic
from gazerig.gaze.track.animation import NO_TABLES, AnimationTables
from gazerig.gaze.track.expression import NEUTRAL
from gazerig.gaze.track.track import (
    EYE_CHANNELS,
    HEAD_CHANNELS,
    KEEP,
    LEVEL,
    LID_CHANNELS,
    LIMIT_SHARE,
    POSE_CHANNELS,
    KeyFrame,
    Track,
    channel_keys,
    rest_value,
)
from gazerig.gaze.track.track_motion import ChannelKeys, Strain, TrackEvents, TrackMotion
from gazerig.gaze.types import Floats
from gazerig.params import unknown_text
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.kinematics import NECK
from gazerig.robot.model.reply import TrackReply
from gazerig.robot.model.types import GAZE_JOINTS, further_joints

_SMALLEST = 0.2
"""Smallest share of a track that a range may leave; less is hardly visible and is not played."""
_ROUNDING = 1e-6
_SHARES = np.linspace(0.0, 1.0, 101)
"""Times within a return to rest at which its limits are checked."""
_SLOWED = 1e-3
"""Larger part of a track's time by which it is slower is reported."""
_LONGER = tuple(1.25**i for i in range(16))


class TrackRefused(ValueError):
    """A track that a rig cannot play; the message gives the reason."""


class RigTrack(NamedTuple):
    """A track's keys on one rig.

    Attributes:
        track: The track.
        rows: Its keys on the rig's channels.
        owned: Channels that it owns.
        owns: Joints that it owns.
        events: Its gaze points, expressions and cues.
        left_out: Joints that the rig lacks.
    """

    track: Track
    rows: tuple[ChannelKeys, ...]
    owned: frozenset[int]
    owns: tuple[str, ...]
    events: TrackEvents
    left_out: tuple[str, ...]


_GROUPS: dict[str, Callable[[str], bool]] = {
    "neck": lambda name: name in NECK,
    "eyes": lambda name: name in GAZE_JOINTS and "eye" in name,
    "lids": lambda name: name in LID_CHANNELS,
}


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
        tables: AnimationTables = NO_TABLES,
    ) -> None:  # fmt: skip
        self.joints, self.channels = joints, (*POSE_CHANNELS, *further_joints(joints))
        self._tables = tables
        self._matrix = np.zeros((len(self.channels), len(joints)))
        for j, name in enumerate(joints):
            channel = channel_of_joint(name)
            self._matrix[self.channels.index(channel), j] = lid_spans_rad.get(name, 1.0)
            if channel in EYE_CHANNELS:
                self._matrix[EYE_CHANNELS.index(channel), j] = -1.0
        # Ranges are checked only for direct motion of a joint: lids are limited by their
        # openings, and eyes that compensate for the head move as far as they can.
        self._own = np.where(self._matrix > 0.0, self._matrix, 0.0)
        self._own[[self.channels.index(lid) for lid in LID_CHANNELS]] = 0.0

    def place(self, track: Track, count: int = 0) -> RigTrack:
        """Return a track's keys on the rig's channels.

        Args:
            track: The track.
            count: Number of repetitions, 0 for the track's own.

        Raises:
            TrackRefused: It needs a joint, a level or an expression that the rig lacks.
        """
        frames, left_out = self._frames(track)
        keys = channel_keys(track, frames, count or track.count)
        present = {channel_of_joint(joint) for joint in self.joints} | {*EYE_CHANNELS}
        rows = []
        for name, pairs in keys.items():
            times_s, values = np.array(pairs).T
            if name.startswith(LEVEL):
                rows += self._level_rows(track, name.removeprefix(LEVEL), times_s, values)
            elif name in present:
                index = self.channels.index(name)
                rows.append(ChannelKeys(index, times_s, values - rest_value(name)))
        looks = [
            (frame.time_s, tuple(at) if isinstance(at := frame.look_at, list) else at)
            for frame in frames
            if frame.look_at != KEEP
        ]
        faces = [(f.time_s, (f.express, f.strength)) for f in frames if f.express]
        for time_s, (face, _) in faces:
            known = (NEUTRAL, *self._tables.expressions)
            if face not in known:
                raise TrackRefused(f"at {time_s:g} s: {unknown_text('expression', face, known)}")
        cues = sorted((time_s, name) for name, time_s in track.cues.items())
        if not (rows or looks or faces or cues or track.sound):
            raise TrackRefused(f"this rig has none of the joints that it moves: {', '.join(keys)}")
        owned = {channel_of_joint(name) for name in self._owned_joints(track)}
        return RigTrack(
            track,
            tuple(rows),
            frozenset([self.channels.index(name) for name in owned]),
            tuple([name for name in self.joints if channel_of_joint(name) in owned]),
            TrackEvents(tuple(looks), tuple(faces), tuple(cues)),
            left_out,
        )

    def _owned_joints(self, track: Track) -> list[str]:
        """Return the joints of the rig that a track names as its own."""
        found = []
        for name in track.owns:
            members = [joint for joint in self.joints if _GROUPS.get(name, name.__eq__)(joint)]
            if not members and name not in track.optional:
                raise TrackRefused(
                    f"it owns {name}, which this rig lacks; available: "
                    f"{', '.join((*_GROUPS, *self.joints))}; list what it does not need under "
                    "optional"
                )
            found += members
        return found

    def _level_rows(
        self, track: Track, name: str, times_s: Floats, values: Floats
    ) -> list[ChannelKeys]:
        """Return the keys of a level on the channels that it moves."""
        levels = self._tables.levels
        if name not in levels:
            if name in track.optional:
                return []
            known = ", ".join(levels) or "none: add a table levels to the rig"
            raise TrackRefused(
                f"it sets the level {name}, which this rig lacks; available: {known}"
            )
        low, high = levels[name].low.to_flat(), levels[name].high.to_flat()
        gains = enumerate(np.subtract(high, low).tolist())
        return [ChannelKeys(i, times_s, gain * values) for i, gain in gains if gain]

    def _frames(self, track: Track) -> tuple[tuple[KeyFrame, ...], tuple[str, ...]]:
        """Return the frames that a rig plays, and the joints that it lacks."""
        frames, lacking = track.frames, self._missing(track.frames)
        needed = [name for name in lacking if name not in track.optional]
        if track.frames_without_neck and any(name in NECK for name in needed):
            frames, neck = track.frames_without_neck, lacking
            lacking = [*neck, *self._missing(frames)]
            needed = [n for n in lacking if n not in track.optional and n not in neck]
        if needed:
            raise TrackRefused(
                f"it moves {', '.join(needed)}, which this rig lacks; list joints that it does not "
                "need under optional"
            )
        return frames, tuple(lacking)

    def _missing(self, frames: Sequence[KeyFrame]) -> list[str]:
        """Return the joints in frames that a rig lacks; eyes and groups of lids adapt to it."""
        named: dict[str, None] = {}
        for frame in frames:
            heads = [
                channel.replace("head", "neck")
                for channel in frame.values()
                if channel in HEAD_CHANNELS
            ]
            lids = [lid for lid in frame.lids if lid in LID_CHANNELS]
            named |= dict.fromkeys([*heads, *lids, *frame.joints_deg])
        return [name for name in named if name not in self.joints]

    def motion(
        self,
        placed: RigTrack,
        limits: Sequence[JointLimit],
        speed: float = 1.0,
        from_s: float = 0.0,
    ) -> TrackMotion:
        """Return the curves of a track, slower where the limits of the joints need it.

        Args:
            placed: The track on this rig.
            limits: Limits of the joints.
            speed: Factor on its defined speed.
            from_s: Position at which it begins.
        """
        strain = _strain(self._matrix_of(placed.owned), limits)
        return TrackMotion(
            placed.rows, len(self.channels), placed.owned, placed.events, strain, speed, from_s
        )

    def sizes(
        self, placed: RigTrack, base_rad: Floats, limits: Sequence[JointLimit]
    ) -> tuple[Floats, tuple[tuple[str, float], ...]]:
        """Return each channel's factor that keeps all ranges, and the joints that need one.

        Args:
            placed: The track on this rig.
            base_rad: Joint angles to which it is added; those that it owns begin at 0.
            limits: Limits of the joints.

        Raises:
            TrackRefused: A range leaves hardly any motion.
        """
        sizes, smaller = np.ones(len(self.channels)), dict[str, float]()
        highest, lowest = np.zeros((2, len(self.channels)))
        for channel, _, values in placed.rows:
            highest[channel] += max(0.0, values.max())
            lowest[channel] += min(0.0, values.min())
        for c, j in zip(*np.nonzero(self._own), strict=True):
            base = 0.0 if self.joints[j] in placed.owns else base_rad[j]
            room = max(0.0, limits[j].high_rad - base), max(0.0, base - limits[j].low_rad)
            for far, most in zip((highest[c], -lowest[c]), room, strict=True):
                if far > most + _ROUNDING:
                    sizes[c] = min(sizes[c], most / far)
                    smaller[self.joints[j]] = float(sizes[c])
        if smaller and min(smaller.values()) < _SMALLEST:
            joint = min(smaller, key=smaller.__getitem__)
            raise TrackRefused(f"{joint} is at the end of its range")
        return sizes, tuple(smaller.items())

    def reply(
        self,
        name: str,
        placed: RigTrack,
        motion: TrackMotion,
        reduced: tuple[tuple[str, float], ...],
    ) -> TrackReply:
        """Return how a track is played.

        Args:
            name: Its name.
            placed: The track on this rig.
            motion: Its curves.
            reduced: Joints with too small ranges, from ``sizes``.
        """
        slowed = motion.slowed_by > 1.0 + _SLOWED
        return TrackReply(
            name,
            motion.duration_s,
            motion.slowed_by if slowed else 1.0,
            self.joints[motion.slowest] if slowed else "",
            reduced,
            placed.left_out,
        )

    def channel_means(self, values: Sequence[float]) -> list[float]:
        """Return the mean over the joints of each channel; 0 for a channel without a joint."""
        found: dict[str, list[float]] = {}
        for joint, value in zip(self.joints, values, strict=True):
            found.setdefault(channel_of_joint(joint), []).append(value)
        return [float(np.mean(found.get(name, 0.0))) for name in self.channels]

    def subtract_offset(self, commanded_rad: Sequence[float], state: Floats) -> Floats:
        """Return commanded joint angles without the offset's part."""
        angles: Floats = np.array(commanded_rad) - state[0] @ self._matrix
        return angles

    def _matrix_of(self, owned: frozenset[int]) -> Floats:
        """Return joint angles per offset: eyes that a track owns do not compensate the head."""
        matrix = self._matrix.copy()
        for head, name in enumerate(EYE_CHANNELS):
            eye = self.channels.index(name)
            if eye in owned:
                matrix[head, self._matrix[eye] != 0.0] = 0.0
        return matrix

    def entry_s(self, motion: TrackMotion, base_rad: Floats, limits: Sequence[JointLimit]) -> float:
        """Return the time in which the joints that a track owns reach its first second."""
        present = np.array(self.channel_means(base_rad.tolist()))
        values = motion.sample_at(np.linspace(0.0, 1.0, 11))[0]
        gap = np.abs(values - present).max(axis=0)
        lids = [self.channels.index(lid) for lid in LID_CHANNELS]
        gap[lids] = 1.0
        unowned = [i for i in range(len(gap)) if i not in motion.owned]
        gap[unowned] = 0.0
        return self.move_s(gap, limits)

    def move_s(self, sizes: Floats, limits: Sequence[JointLimit]) -> float:
        """Return the shortest time of moves with least jerk by (channels,) sizes."""
        speeds, accelerations = _track_limits(limits)
        far = np.abs(sizes) @ np.abs(self._matrix)
        by_speed = PEAK_SPEED * far / speeds
        by_acceleration = np.sqrt(PEAK_ACCELERATION * far / accelerations)
        return float(np.maximum(by_speed, by_acceleration).max())

    def fade_s(self, state: Floats, limits: Sequence[JointLimit], least_s: float) -> float:
        """Return the time in which a moving offset can return to rest within limits.

        If none keeps them, the one that exceeds them least: a long return from a high acceleration
        swings far. The guard limits the rest.

        Args:
            state: (3, channels) offset, speed and acceleration.
            limits: Limits of the joints.
            least_s: Shortest time.
        """
        best = (np.inf, least_s)
        for fade_s in [factor * least_s for factor in _LONGER]:
            excess = self._excess(state, _fade(state, fade_s), limits)
            best = min(best, (excess, fade_s))
            if excess <= 1.0:
                break
        return best[1]

    def wait_s(
        self, state: Floats, fade_s: float, motion: TrackMotion, limits: Sequence[JointLimit]
    ) -> float:
        """Return the time for which a track must wait for the return of a moving offset.

        Args:
            state: (3, channels) offset, speed and acceleration.
            fade_s: Time of the return.
            motion: The track.
            limits: Limits of the joints.
        """
        fade, times_s = _fade(state, fade_s), fade_s * _SHARES
        for wait_s in (0.0, 0.5 * fade_s):
            both = fade + motion.sample_at(times_s - wait_s)[1:]
            if self._excess(state, both, limits) <= 1.0:
                return wait_s
        return fade_s

    def _excess(self, state: Floats, motion: Floats, limits: Sequence[JointLimit]) -> float:
        """Return the largest ratio of (2, n, channels) motion to what a transition may have."""
        begins = np.abs(state[1:] @ self._matrix)
        most = np.maximum(_track_limits(limits), begins)[:, None] + _ROUNDING
        return float((np.abs(motion @ self._matrix) / most).max())


def _fade(state: Floats, fade_s: float) -> Floats:
    """Return (2, n, channels) speeds and accelerations of the return of an offset to rest."""
    coefficients = np.array(Quintic(tuple(state), 0.0, fade_s).coefficients)
    powers = (fade_s * _SHARES[:, None]) ** np.arange(5)
    order = np.arange(1, 6)[:, None]
    rate = order * coefficients[1:]
    return np.stack((powers @ rate, powers[:, :4] @ (order[:4] * rate[1:])))


def _track_limits(limits: Sequence[JointLimit]) -> tuple[Floats, Floats]:
    """Return the speeds and accelerations of the joints that tracks may use."""
    return (
        LIMIT_SHARE * np.array([limit.speed_rad_s for limit in limits]),
        LIMIT_SHARE * np.array([limit.accel_rad_s2 for limit in limits]),
    )


def _strain(matrix: Floats, limits: Sequence[JointLimit]) -> Strain:
    """Return the factors by which motion must take longer to keep the limits."""
    speeds, accelerations = _track_limits(limits)

    def strain(speed: Floats, acceleration: Floats) -> Floats:
        found: Floats = np.maximum(
            np.abs(speed @ matrix) / speeds, np.sqrt(np.abs(acceleration @ matrix) / accelerations)
        )
        return found

    return strain
