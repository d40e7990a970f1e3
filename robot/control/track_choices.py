"""Tracks of a robot: the available ones, their fit to this rig, and their start."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from gazerig.gaze.track.track import Track, TrackParams
from gazerig.gaze.track.track_player import TrackPlayer
from gazerig.robot.model.commands import Play
from gazerig.robot.model.control_source import NO_TRACK, TrackState
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.reply import CommandReply, TrackReply
from gazerig.robot.model.track_fit import (
    FittedTrack,
    TrackFit,
    TrackMotions,
    TrackRefused,
    track_motions,
)
from gazerig.robot.model.types import JointAngles

_MOST_KEPT = 64
"""Number of tracks with a non-default count whose curves are cached."""


class TrackInfo(NamedTuple):
    """A track on this rig, played from the middle of all ranges.

    Attributes:
        name: Name of the track.
        description: Its description.
        duration_s: Duration in s, 0 if it is refused.
        slowed_by: Factor by which it takes longer than defined.
        refused: Reason why this rig cannot do it, "" if it can.
    """

    name: str
    description: str
    duration_s: float = 0.0
    slowed_by: float = 1.0
    refused: str = ""


class TrackChoices:
    """The tracks of one rig.

    Args:
        tracks: All known tracks by name.
        player: Plays them.
        params: Share of the joints' limits that they may use.
        joints: Joints of the rig, in the order of all sequences of joints.
        lid_spans_rad: Range of each lid from shut to open, by joint.
    """

    def __init__(
        self,
        tracks: Mapping[str, Track],
        player: TrackPlayer,
        params: TrackParams,
        joints: tuple[str, ...],
        lid_spans_rad: Mapping[str, float],
    ) -> None:
        self._tracks, self._player, self._joints = tracks, player, joints
        self._state = NO_TRACK
        self._cache: dict[tuple[str, int], TrackMotions | TrackRefused] = {}
        self.retune(params, lid_spans_rad)
        for name in tracks:
            self._motions(name, 0)

    def retune(self, params: TrackParams, lid_spans_rad: Mapping[str, float]) -> None:
        """Change the share of limits and the lids' ranges for the next track."""
        self._params = params
        self._fit = TrackFit(self._joints, lid_spans_rad)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the tracks whose joints this rig has."""
        return tuple(
            name for name in self._tracks if not isinstance(self._motions(name, 0), Exception)
        )

    @property
    def playing(self) -> str:
        """Return the present track, "" if there is none."""
        return self._player.playing

    @property
    def state(self) -> TrackState:
        """Return the newest track and its state."""
        if self._state.name and not self._player.playing:
            self._state = self._state._replace(name="")
        return self._state

    def require(self, command: Play) -> None:
        """Check that a track exists, and compute its curves. Thread-safe.

        Raises:
            ValueError: There is no such track; the message lists the available ones.
        """
        if not command.track:
            return
        if command.track not in self._tracks:
            there = ", ".join(self.names)
            raise ValueError(f"no track {command.track!r}; available: {there}")
        made = self._motions(command.track, command.times)
        if isinstance(made, TrackRefused):
            raise ValueError(f"{command.track}: {made}")

    def all_tracks(self, limits: Sequence[JointLimit]) -> tuple[TrackInfo, ...]:
        """Return all tracks with their fit to this rig.

        Args:
            limits: Limits of the joints.
        """
        return tuple(self._info(name, track, limits) for name, track in self._tracks.items())

    def _info(self, name: str, track: Track, limits: Sequence[JointLimit]) -> TrackInfo:
        middle = np.clip(0.0, [one.low_rad for one in limits], [one.high_rad for one in limits])
        try:
            fitted = self._fit_track(name, 0, 1.0, middle, limits)
        except TrackRefused as refused:
            return TrackInfo(name, track.description, refused=str(refused))
        return TrackInfo(name, track.description, fitted.track.duration_s, fitted.slowed_by)

    def play(
        self, command: Play, t_s: float, commanded_rad: JointAngles, limits: Sequence[JointLimit]
    ) -> CommandReply:
        """Start a track from the joints' present angles, or end the present one.

        Args:
            command: Track, speed and count.
            t_s: Present time.
            commanded_rad: Joint angles last sent.
            limits: Present limits of the joints.
        """
        share, state = self._params.limit_share, self._player.state(t_s)
        fade_s = self._fit.fade_s(state, limits, share, self._params.blend_out_ms / 1e3)
        by = command.who or "a user"
        if not command.track:
            self._player.play(None, t_s, fade_s, 0.0)
            if self.state.name:
                self._state = self._state._replace(name="", end_reason=f"{by} has ended it")
            return CommandReply(track=TrackReply("", fade_s))
        base = self._fit.subtract_offset(commanded_rad, state)
        try:
            fitted = self._fit_track(command.track, command.times, command.speed, base, limits)
        except TrackRefused as refused:
            return CommandReply(f"{command.track}: {refused}")
        wait_s = self._fit.wait_s(state, fade_s, fitted.track, limits, share)
        self._player.play(fitted.track, t_s, fade_s, wait_s)
        number = self._state.number + 1
        self._state = TrackState(number, command.track, who=command.who, since_s=t_s)
        left_out = self._require_motions(command.track, command.times).left_out
        return CommandReply(
            track=TrackReply(
                command.track,
                wait_s + fitted.track.duration_s,
                fitted.slowed_by,
                fitted.slow_joint,
                fitted.reduced_joints,
                left_out,
                self._state.number,
            )
        )

    def drop_present(self) -> str:
        """Drop the present track, as a client holds its joints or the torque is off.

        Returns:
            The name of the track, "" if there was none.
        """
        name = self._player.playing
        self._player.reset()
        if name:
            self._state = self._state._replace(
                name="", end_reason="its joints are controlled by a client or switched off"
            )
        return name

    def _fit_track(
        self,
        name: str,
        count: int,
        speed: float,
        base_rad: np.ndarray[tuple[int, ...], np.dtype[np.float64]],
        limits: Sequence[JointLimit],
    ) -> FittedTrack:
        made = self._require_motions(name, count)
        return self._fit.fit(name, made, speed, base_rad, limits, self._params.limit_share)

    def _require_motions(self, name: str, count: int) -> TrackMotions:
        made = self._motions(name, count)
        if isinstance(made, TrackRefused):
            raise made
        return made

    def _motions(self, name: str, count: int) -> TrackMotions | TrackRefused:
        """Return the curves of a track, or the reason why this rig has none."""
        key = name, count if count != self._tracks[name].count else 0
        if key not in self._cache:
            if len(self._cache) >= len(self._tracks) + _MOST_KEPT:
                self._cache = {kept: made for kept, made in self._cache.items() if kept[1] == 0}
            try:
                self._cache[key] = track_motions(self._tracks[name], self._joints, count)
            except TrackRefused as refused:
                self._cache[key] = refused
        return self._cache[key]
