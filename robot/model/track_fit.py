"""Fit of a track to a rig's joints, ranges and speeds."""

from collections.abc import Callable, Mapping, Sequence
from math import degrees
from typing import NamedTuple

import numpy as np

from gazerig.gaze.minimum_jerk import PEAK_ACCELERATION, PEAK_SPEED
from gazerig.gaze.track.animation import NO_TABLES, AnimationTables
from gazerig.gaze.track.expression import NEUTRAL
from gazerig.gaze.track.level import LevelRange
from gazerig.gaze.track.track import (
    EYE_CHANNELS,
    HEAD_CHANNELS,
    KEEP,
    LID_CHANNELS,
    LIMIT_SHARE,
    POSE_CHANNELS,
    ChannelKeys,
    KeyFrame,
    Track,
    channel_keys,
)
from gazerig.gaze.track.track_motion import LevelCurve, MotionSamples, TrackEvents, TrackMotion
from gazerig.gaze.track.track_player import OffsetState, PlayedTrack
from gazerig.gaze.types import Floats
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.kinematics import NECK
from gazerig.robot.model.types import GAZE_JOINTS, further_joints

_SMALLEST = 0.2
"""Smallest share of a track that a range may leave; less is hardly visible and is not played."""
_ROUNDING = 1e-6
_LONGER = tuple(1.25**i for i in range(16))
_WAITS = (0.0, 0.25, 0.5, 0.75, 1.0)


class TrackRefused(ValueError):
    """A track that a rig cannot play; the message gives the reason."""


class FittedTrack(NamedTuple):
    """A track fitted to this rig.

    Attributes:
        track: The track to play.
        slowed_by: Factor by which it takes longer than requested.
        slow_joint: Joint that needs this factor.
        reduced_joints: (joint, remaining share of its motion) for joints with too small ranges.
    """

    track: PlayedTrack
    slowed_by: float = 1.0
    slow_joint: str = ""
    reduced_joints: tuple[tuple[str, float], ...] = ()


class TrackMotions(NamedTuple):
    """A track's curves on one rig, the joints that the rig lacks, and those that it owns."""

    track: Track
    motion: TrackMotion
    left_out: tuple[str, ...]
    owns: tuple[str, ...] = ()


def track_motions(
    track: Track, joints: Sequence[str], count: int = 0,
    tables: AnimationTables = NO_TABLES,
) -> TrackMotions:  # fmt: skip
    """Return a track as curves of a rig's joints.

    Args:
        track: The track.
        joints: Joints of the rig.
        count: Number of repetitions, 0 for the track's own.
        tables: Expressions and levels of the rig.

    Raises:
        TrackRefused: It needs a joint, a level or an expression that the rig lacks.
    """
    frames, left_out = _frames_for(track, joints)
    channels = channel_keys(track, frames, count or track.count)
    there = {*joints, *EYE_CHANNELS} - {*HEAD_CHANNELS}
    there |= {channel for channel in HEAD_CHANNELS if _neck(channel) in joints}
    kept = {name: keys for name, keys in channels.items() if name in there}
    owns = _owned_joints(track, joints)
    owned = dict.fromkeys(channel_of_joint(name) for name in owns)
    curves, events = _level_curves(track, frames, tables.levels), _events(track, frames)
    for time_s, (face, _) in events.expressions:
        if face not in (NEUTRAL, *tables.expressions):
            known = ", ".join((NEUTRAL, *tables.expressions))
            raise TrackRefused(f"at {time_s:g} s: no expression {face!r}; available: {known}")
    if not (kept or curves or any(events) or track.sound):
        raise TrackRefused(f"this rig has none of the joints that it moves: {', '.join(channels)}")
    motion = TrackMotion(
        kept, further_joints(joints), track.space == "joint", tuple(owned), curves, events
    )
    whole = tuple(name for name in joints if channel_of_joint(name) in owned)
    return TrackMotions(track, motion, left_out, whole)


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


def _owned_joints(track: Track, joints: Sequence[str]) -> list[str]:
    """Return the joints of the rig that a track names as its own."""
    found: dict[str, None] = {}
    for name in track.owns:
        is_member = _GROUPS.get(name, name.__eq__)
        members = [joint for joint in joints if is_member(joint)]
        if not members and name not in track.optional:
            raise TrackRefused(
                f"it owns {name}, which this rig lacks; available: "
                f"{', '.join((*_GROUPS, *joints))}; list what it does not need under optional"
            )
        found |= dict.fromkeys(members)
    return list(found)


def _level_curves(
    track: Track, frames: Sequence[KeyFrame], levels: Mapping[str, LevelRange]
) -> list[LevelCurve]:
    """Return the curves of the levels that a track sets."""
    keys: dict[str, list[tuple[float, float]]] = {}
    for frame in frames:
        for name, value in frame.levels.items():
            keys.setdefault(name, []).append((frame.time_s, value))
    curves = []
    for name, found in keys.items():
        if name not in levels:
            if name in track.optional:
                continue
            there = ", ".join(levels) or "none: add a table levels to the rig"
            raise TrackRefused(
                f"it sets the level {name}, which this rig lacks; available: {there}"
            )
        if found[-1][1] > 0.0:
            found.append((found[-1][0] + track.return_s, 0.0))
        low, high = levels[name].low.to_flat(), levels[name].high.to_flat()
        gain = tuple([b - a for a, b in zip(low, high, strict=True)])
        times, values = zip(*found, strict=True)
        curves.append(LevelCurve(ChannelKeys(times, values), gain))
    return curves


def _events(track: Track, frames: Sequence[KeyFrame]) -> TrackEvents:
    """Return the gaze points, the expressions and the cues of a track."""
    looks = [
        (f.time_s, tuple(f.look_at) if isinstance(f.look_at, list) else f.look_at)
        for f in frames
        if f.look_at != KEEP
    ]
    faces = [(f.time_s, (f.express, f.strength)) for f in frames if f.express]
    cues = sorted((time_s, name) for name, time_s in track.cues.items())
    return TrackEvents(tuple(looks), tuple(faces), tuple(cues))


def _frames_for(
    track: Track, joints: Sequence[str]
) -> tuple[tuple[KeyFrame, ...], tuple[str, ...]]:
    """Return the frames that a rig plays, and the joints that it lacks."""
    frames, lacking = track.frames, _missing_joints(track.frames, joints)
    needed = [name for name in lacking if name not in track.optional]
    if track.frames_without_neck and any(name.startswith("neck_") for name in needed):
        frames, neck = track.frames_without_neck, lacking
        lacking = [*neck, *_missing_joints(frames, joints)]
        needed = [n for n in lacking if n not in track.optional and n not in neck]
    if needed:
        raise TrackRefused(
            f"it moves {', '.join(needed)}, which this rig lacks; list joints that it does not need "
            "under optional"
        )
    return frames, tuple(lacking)


def _missing_joints(frames: tuple[KeyFrame, ...], joints: Sequence[str]) -> list[str]:
    """Return the joints in frames that a rig lacks; groups of lids adapt to the rig."""
    named: dict[str, None] = {}
    for frame in frames:
        heads = [_neck(t) for t in HEAD_CHANNELS if getattr(frame, f"{t}_deg") is not None]
        lids = [lid for lid in frame.lids if lid in LID_CHANNELS]
        named |= dict.fromkeys([*heads, *lids, *frame.joints_deg])
    return [name for name in named if name not in joints]


def _neck(channel: str) -> str:
    """Return the joint of a channel of the head."""
    return channel.replace("head", "neck")


class TrackFit:
    """The fit of tracks to the limits of one rig.

    Joint angles are linear in the offset: the eyes turn against the head, and a lid turns by
    its factor times its full range.

    Args:
        joints: Joints of the rig, in the order of all sequences of joints.
        lid_spans_rad: Range of each lid from shut to open, by joint.
    """

    def __init__(self, joints: tuple[str, ...], lid_spans_rad: Mapping[str, float]) -> None:
        self.joints = joints
        channels = (*POSE_CHANNELS, *further_joints(joints))
        self._matrix = np.zeros((len(channels), len(joints)))
        for j, name in enumerate(joints):
            channel = channel_of_joint(name)
            self._matrix[channels.index(channel), j] = lid_spans_rad.get(name, 1.0)
            if channel in EYE_CHANNELS:
                self._matrix[EYE_CHANNELS.index(channel), j] = -1.0
        # Ranges are checked only for direct motion of a joint: lids are limited by their
        # openings, and eyes that compensate for the head move as far as they can.
        self._own = np.where(self._matrix > 0.0, self._matrix, 0.0)
        self._own[[channels.index(lid) for lid in LID_CHANNELS]] = 0.0
        self._eyes = [channels.index(name) for name in EYE_CHANNELS]
        self._channels = channels

    def channel_means(self, values: Sequence[float]) -> list[float]:
        """Return the mean over the joints of each channel; 0 for a channel without a joint."""
        found: dict[str, list[float]] = {}
        for joint, value in zip(self.joints, values, strict=True):
            found.setdefault(channel_of_joint(joint), []).append(value)
        return [float(np.mean(found.get(name, 0.0))) for name in self._channels]

    def subtract_offset(self, commanded_rad: Sequence[float], state: OffsetState) -> Floats:
        """Return commanded joint angles without the offset's part."""
        angles: Floats = np.array(commanded_rad) - state.value @ self._matrix
        return angles

    def joint_angles(self, base_rad: Floats, motion: TrackMotion, times_s: Floats) -> Floats:
        """Return the (n, joints) angles of a motion at times, from base angles."""
        samples = motion.sample_at(times_s)
        angles: Floats = base_rad + samples.value @ self._matrix_of(motion)
        return angles

    def fit(
        self,
        name: str,
        made: TrackMotions,
        speed: float,
        base_rad: Floats,
        limits: Sequence[JointLimit],
        blend_s: tuple[float, float] = (0.4, 0.25),
        lead_s: float = 0.0,
        sound_s: float = 0.0,
    ) -> FittedTrack:
        """Fit a track to the rig at its present angles.

        Args:
            name: Name of the track.
            made: Its curves on this rig.
            speed: Factor on its defined speed.
            base_rad: Joint angles to which it is added.
            limits: Limits of the joints.
            blend_s: Shortest times in which it takes over its joints, and returns them.
            lead_s: Time by which its motion is early.
            sound_s: Duration of its sound.

        Raises:
            TrackRefused: It cannot be done, or only with changes that it does not allow.
        """
        slow, motion = made.track.fit == "slow", made.motion
        matrix, present = self._matrix_of(motion), self._present(base_rad)
        if motion.owned:  # of these joints it gives the angles from the neutral pose
            base_rad = np.array(base_rad)
            base_rad[[self.joints.index(name) for name in made.owns]] = 0.0

        sizes, smaller = self._sizes(motion.samples, base_rad, limits)
        if smaller and not slow:
            joint, share = smaller[0]
            raise TrackRefused(f"{joint} leaves its range: it can move {share:.0%} as far")
        if smaller and min(left for _, left in smaller) < _SMALLEST:
            joint = min(smaller, key=lambda one: one[1])[0]
            raise TrackRefused(f"{joint} is at the end of its range")
        samples = motion.samples.scale(sizes, speed)
        factor, joint, text = self._too_fast(samples, limits, matrix)
        if factor > 1.0 + _ROUNDING and not slow:
            raise TrackRefused(text)
        stretch = _stretch(matrix, limits)
        played = PlayedTrack(
            name,
            motion,
            speed / factor,
            tuple(sizes.tolist()),
            stretch,
            blend_s,
            present,
            lead_s,
            sound_s,
        )
        return FittedTrack(played, factor, joint if factor > 1.0 + _ROUNDING else "", smaller)

    def _sizes(
        self, samples: MotionSamples, base_rad: Floats, limits: Sequence[JointLimit]
    ) -> tuple[Floats, tuple[tuple[str, float], ...]]:
        """Return each channel's factor that keeps all ranges, and the joints that need one."""
        sizes = np.ones(len(self._matrix))
        smaller = {}
        highest, lowest = samples.value.max(axis=0), samples.value.min(axis=0)
        for c, j in zip(*np.nonzero(self._own), strict=True):
            low, high = limits[j][:2]
            room = max(0.0, high - base_rad[j]), max(0.0, base_rad[j] - low)
            for far, there in zip((highest[c], -lowest[c]), room, strict=True):
                if far > there + _ROUNDING:
                    sizes[c] = min(sizes[c], there / far)
                    smaller[self.joints[j]] = float(sizes[c])
        return sizes, tuple(smaller.items())

    def _matrix_of(self, motion: TrackMotion) -> Floats:
        """Return joint angles per offset: eyes that a track owns do not compensate the head."""
        owned = [i for i in self._eyes if i in motion.owned]
        if not owned:
            return self._matrix
        matrix = self._matrix.copy()
        for i in owned:
            matrix[self._eyes.index(i), self._matrix[i] != 0.0] = 0.0
        return matrix

    def _present(self, base_rad: Floats) -> tuple[float, ...]:
        """Return the values of the channels at joint angles; of lids those furthest away."""
        angles: dict[str, list[float]] = {}
        for joint, angle in zip(self.joints, base_rad.tolist(), strict=True):
            angles.setdefault(channel_of_joint(joint), []).append(angle)
        means = {name: sum(found) / len(found) for name, found in angles.items()}
        return tuple(
            [-1.0 if name in LID_CHANNELS else means.get(name, 0.0) for name in self._channels]
        )

    def _too_fast(
        self, samples: MotionSamples, limits: Sequence[JointLimit], matrix: Floats
    ) -> tuple[float, str, str]:
        """Return the time factor that keeps all limits, its joint and a text with the reason."""
        found = (1.0, "", "")
        speeds, accelerations = _track_limits(limits)
        for column, power, most, unit in (
            (samples.speed, 1.0, speeds, "deg/s"),
            (samples.acceleration, 0.5, accelerations, "deg/s2"),
        ):
            ratio = np.abs(column @ matrix) / most
            row, j = np.unravel_index(int(np.argmax(ratio)), ratio.shape)
            factor = float(ratio[row, j]) ** power
            if factor > found[0]:
                asked = degrees(ratio[row, j] * most[j])
                found = factor, self.joints[j], (
                    f"{self.joints[j]} at {samples.times_s[row]:.2f} s: needs {asked:.0f} {unit}, but "
                    f"tracks may use {degrees(most[j]):.0f} ({LIMIT_SHARE:g} of the joint's limit)"
                )  # fmt: skip
        return found

    def fade_s(self, state: OffsetState, limits: Sequence[JointLimit], least_s: float) -> float:
        """Return the time in which a moving offset can return to rest within limits.

        If none keeps them, the one that exceeds them least: a long return from a high acceleration
        swings far. The guard limits the rest.
        """
        most = self._transition_limits(state, limits)
        fades = {factor * least_s: _fade_samples(state, factor * least_s) for factor in _LONGER}
        for fade_s, samples in fades.items():
            if self._keeps_limits(samples, most):
                return fade_s
        return min(fades, key=lambda fade_s: self._excess(fades[fade_s], most))

    def wait_s(
        self,
        state: OffsetState,
        fade_s: float,
        played: PlayedTrack,
        limits: Sequence[JointLimit],
    ) -> float:
        """Return the time for which a track must wait for the present one to fade."""
        if not any(map(np.any, state)):
            return 0.0
        fade = _fade_samples(state, fade_s)
        most = self._transition_limits(state, limits)
        for wait in _WAITS:
            since = np.maximum(0.0, fade.times_s - wait * fade_s) * played.speed
            also = played.motion.sample_at(since).scale(np.array(played.sizes), played.speed)
            both = MotionSamples(
                fade.times_s, *(a + b for a, b in zip(fade[1:], also[1:], strict=True))
            )
            if self._keeps_limits(both, most):
                return wait * fade_s
        return fade_s

    def _transition_limits(self, state: OffsetState, limits: Sequence[JointLimit]) -> list[Floats]:
        """Return the joints' speeds and accelerations that a transition from a state may have."""
        begins = (state.speed @ self._matrix, state.acceleration @ self._matrix)
        return [
            np.maximum(most, np.abs(now)) + _ROUNDING
            for most, now in zip(_track_limits(limits), begins, strict=True)
        ]

    def _excess(self, samples: MotionSamples, most: Sequence[Floats]) -> float:
        """Return the largest ratio of a speed or an acceleration to a given one."""
        return max(
            float((np.abs(column @ self._matrix) / limit).max())
            for column, limit in zip(samples[2:], most, strict=True)
        )

    def _keeps_limits(self, samples: MotionSamples, most: Sequence[Floats]) -> bool:
        """Return whether speeds and accelerations stay below given ones."""
        return all(
            bool((np.abs(column @ self._matrix) <= limit).all())
            for column, limit in zip(samples[2:], most, strict=True)
        )


def _track_limits(limits: Sequence[JointLimit]) -> tuple[Floats, Floats]:
    """Return the speeds and accelerations of the joints that tracks may use."""
    return (
        LIMIT_SHARE * np.array([limit.speed_rad_s for limit in limits]),
        LIMIT_SHARE * np.array([limit.accel_rad_s2 for limit in limits]),
    )


def _stretch(matrix: Floats, limits: Sequence[JointLimit]) -> Callable[[Floats, Floats], float]:
    """Return the function ``PlayedTrack.stretch`` for limits."""
    speeds, accelerations = _track_limits(limits)

    def stretch(speed: Floats, acceleration: Floats) -> float:
        fastest = float((np.abs(speed @ matrix) / speeds).max())
        hardest = float((np.abs(acceleration @ matrix) / accelerations).max())
        return float(max(fastest, np.sqrt(hardest))) / (1.0 + _ROUNDING)

    return stretch


def _fade_samples(state: OffsetState, time_s: float) -> MotionSamples:
    """Return samples of the fifth-order polynomials from a state to rest in a time."""
    s = np.linspace(0.0, 1.0, 101)[:, None]
    p, v, a = state.value, state.speed * time_s, state.acceleration * time_s**2
    c3, c4, c5 = (
        -10.0 * p - 6.0 * v - 1.5 * a,
        15.0 * p + 8.0 * v + 1.5 * a,
        -6.0 * p - 3.0 * v - 0.5 * a,
    )
    return MotionSamples(
        s[:, 0] * time_s,
        p + s * (v + s * (0.5 * a + s * (c3 + s * (c4 + s * c5)))),
        (v + s * (a + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)))) / time_s,
        (a + s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5))) / time_s**2,
    )


def shortest_move_s(size_rad: Floats | float, limit: JointLimit) -> Floats:
    """Return the times of moves with least jerk that use a track's share of a joint's limits."""
    by_speed = PEAK_SPEED * np.asarray(size_rad) / (LIMIT_SHARE * limit.speed_rad_s)
    by_acceleration = np.sqrt(
        PEAK_ACCELERATION * np.asarray(size_rad) / (LIMIT_SHARE * limit.accel_rad_s2)
    )
    return np.maximum(by_speed, by_acceleration)
