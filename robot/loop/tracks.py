"""Tracks of a robot: their fit to its joints, and orders to play and end them."""

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from itertools import compress
from pathlib import Path

import numpy as np
from msgspec import structs

from gazerig.drivers.errors import SetupError
from gazerig.drivers.sound.sound_file import check_sound
from gazerig.gaze.track.animation import Face
from gazerig.gaze.track.motion import ChannelKeys, Motion
from gazerig.gaze.track.player import TrackPlayer
from gazerig.gaze.track.track import (
    EYE_CHANNELS,
    GROUPS,
    HEAD_CHANNELS,
    LEVEL,
    LID_CHANNELS,
    LIDS,
    LIMIT_SHARE,
    MAX_DURATION_S,
    POSE_CHANNELS,
    Track,
    TrackState,
)
from gazerig.gaze.types import Floats
from gazerig.params import unknown_text
from gazerig.robot.model.commands import EndTrack, Play
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.kinematics import NECK
from gazerig.robot.model.reply import CommandReply
from gazerig.robot.model.types import GAZE_JOINTS, further_joints

_LEAST_S = 0.02
"""Length of a track that has no motion of its own."""
_EYE_OF_HEAD = dict(zip(HEAD_CHANNELS, EYE_CHANNELS, strict=False))
"""Channel of the eyes that moves instead of one of the head."""
_OF_JOINT = dict(zip(NECK, HEAD_CHANNELS, strict=True)) | {
    name: EYE_CHANNELS[name.endswith("_tilt")] for name in GAZE_JOINTS if "eye" in name
}
"""Channels of the joints that have another name."""

Limits = Sequence[JointLimit]


def channel_of_joint(joint: str) -> str:
    """Return the channel of a joint: both eyes have one."""
    return _OF_JOINT.get(joint, joint)


class TrackFit:
    """The fit of tracks to the joints of one rig.

    Args:
        joints: Joints of the rig, in the order of all sequences of joints.
        lid_spans_rad: Range of each lid from shut to open, by joint.
        faces: Expressions and levels of the rig.
    """

    def __init__(
        self, joints: tuple[str, ...], lid_spans_rad: Mapping[str, float], faces: Mapping[str, Face]
    ) -> None:
        self._joints = joints
        self._spans_rad = np.array([lid_spans_rad.get(name, 1.0) for name in joints])
        self._names = (*POSE_CHANNELS, *further_joints(joints))
        self._channels = [self._names.index(channel_of_joint(name)) for name in joints]
        every = np.eye(len(self._names))
        self._moves: dict[str, Floats] = {self._names[i]: every[i] for i in self._channels}
        self._moves |= {f"{LEVEL}{name}": face.change for name, face in faces.items()}

    def motion(self, track: Track, limits: Limits, order: Play) -> Motion:
        """Return the curves of a track, slower where the limits of the joints need it.

        The eyes of a rig without a neck move instead, unless the track moves them as well.

        Args:
            track: The track.
            limits: Limits of the joints.
            order: The order to play it.

        Raises:
            ValueError: The rig has nothing that it moves, it has no such cue, or it ends before.
        """
        from_s = track.cues.get(order.from_s) if isinstance(order.from_s, str) else order.from_s
        if from_s is None:
            raise ValueError(unknown_text("cue", str(order.from_s), track.cues))
        bounds = self._bounds(limits)
        keys, limited, lacking = list[ChannelKeys](), list[str](), list[str]()
        named = track.series()
        for name, pairs in named.items():
            if name not in self._moves and name not in LID_CHANNELS:
                lacking.append(name)
            eye = _EYE_OF_HEAD.get(name, name)
            mover = name if name in self._moves or eye in named else eye
            moved = self._moves.get(mover, np.zeros(0))
            times_s, values = np.array(pairs).T
            for channel in np.flatnonzero(moved).tolist():
                offsets = moved[channel] * values
                kept = offsets.clip(-bounds[0, channel], bounds[1, channel])
                keys.append((channel, times_s, kept))
                if (kept != offsets).any():
                    limited.append(f"{_joint_name(self._names[channel])} ends at its range")
        if not (keys or track.sound):
            names = ", ".join(lacking) or "lids"
            raise ValueError(f"this rig has none of the joints that it moves: {names}")
        owned = np.zeros(len(self._names), dtype=np.bool)
        for name in track.owns:
            members = self._moves.keys() & GROUPS.get(name, (channel_of_joint(name),))
            owned[[self._names.index(member) for member in members]] = True
            lacking += [] if members else [name]
        end_s = order.sound_s if keys else max(order.sound_s, _LEAST_S)
        motion = Motion(keys, [end_s, *track.cues.values()], bounds[2:], owned, order.speed)
        if from_s > motion.length_s:
            raise ValueError(f"{order.track} lasts {motion.length_s:.2f} s: from_s must be less")
        slower = motion.duration_s * order.speed / motion.length_s
        if slower > 1.005:  # as the text shows it
            slow = _joint_name(self._names[motion.slowest])
            limited.append(f"slower by {slower:.2f} for {slow}")
        if lacking:
            limited.append(f"without {', '.join(dict.fromkeys(map(_joint_name, lacking)))}")
        if track.sound and motion.rate != 1.0:
            limited.append("without its sound, which plays at speed 1 only")
        motion.mouth = np.array(order.mouth).T
        motion.state = TrackState(
            order.track, track.description, motion.duration_s, motion.length_s, "; ".join(limited),
            owns=tuple(compress(self._joints, owned[self._channels])), sound=track.sound,
            volume=track.volume, cues=tuple(track.cues.items()), speed=motion.rate,
            rounds=0 if order.loop or track.loop else max(1, order.times), who=order.who,
            position_s=from_s,
        )  # fmt: skip
        return motion

    def _bounds(self, limits: Limits) -> Floats:
        """Return how far below and above rest each channel may be, its speed and acceleration.

        A lid turns by its factor times its full range, which is the range of its channel.
        """
        low, high, speed, acceleration = np.array(limits)[:, :4].T
        most = LIMIT_SHARE * np.array((speed, acceleration)) / self._spans_rad
        bounds = np.full((4, len(self._names)), np.inf)
        for bound, values in zip(bounds, (-low, high, *most), strict=True):
            np.minimum.at(bound, self._channels, np.maximum(values, 0.0))
        bounds[:2, LIDS] = np.inf
        return bounds


def _joint_name(channel: str) -> str:
    """Return the name of a channel or level for users."""
    return channel.removeprefix(LEVEL).replace("head_", "neck_")


class TrackChoices:
    """The tracks of one rig.

    Args:
        read: Returns all tracks by name as their files are now, or the fault of a file.
        player: Plays them.
        fit: Fits them to the rig.
        limits: Returns the present limits of the joints.
    """

    def __init__(
        self,
        read: Callable[[], Mapping[str, Track | Exception]],
        player: TrackPlayer,
        fit: TrackFit,
        limits: Callable[[], Limits],
    ) -> None:
        self._read, self._player, self._limits = read, player, limits
        self._tracks = read()
        self._at_start = dict(self._tracks)
        self._fit = lru_cache(fit.motion)

    def states(self) -> tuple[TrackState, ...]:
        """Return all tracks as this rig plays them, or why it cannot. Thread-safe."""
        states = []
        for name, track in tuple(self._read().items()):
            try:
                states.append(self._motion(self.prepare(Play(name))).state)
            except ValueError as refused:
                description = getattr(track, "description", "")
                states.append(TrackState(name, description, refused=str(refused)))
        return tuple(states)

    def prepare(self, order: Play) -> Play:
        """Return an order with what a recording needs: the duration of a sound, a new track.

        This also computes its curves, which takes time. Thread-safe.

        Raises:
            ValueError: It cannot be played; the message lists the available tracks or cues.
        """
        self._tracks = self._read()
        track, sound_s = self._track(order), order.sound_s
        if track.sound and not sound_s:
            try:
                sound_s = check_sound(Path(track.sound), MAX_DURATION_S).duration_s
            except SetupError as error:
                raise ValueError(str(error)) from None
        new = track if track is not self._at_start.get(order.track) else None
        order = structs.replace(order, sound_s=sound_s, definition=new)
        self._motion(order)
        return order

    def _track(self, order: Play) -> Track:
        track = order.definition or self._tracks.get(order.track)
        if track is None:
            names = [one.name for one in self.states() if not one.refused]
            raise ValueError(unknown_text("track", order.track, names))
        if isinstance(track, Exception):
            raise ValueError(str(track))
        return track

    def _motion(self, order: Play) -> Motion:
        return self._fit(self._track(order), tuple(self._limits()), order)

    def play(self, order: Play, t_s: float) -> CommandReply:
        """Start a prepared track.

        Raises:
            ValueError: It cannot be played.
        """
        return CommandReply(track=self._player.start(self._motion(order), t_s))

    def end(self, order: EndTrack, t_s: float) -> CommandReply:
        """End tracks that play; to end all is done with none.

        Raises:
            ValueError: There is no such track; the message lists those that play.
        """
        names = [one.state.name for one in self._player.playing]
        if order.track not in ("", *names):
            raise ValueError(unknown_text("playing track", order.track, names))
        self._player.end(f"{order.who or 'a user'} has ended it", t_s, order.track)
        return CommandReply()
