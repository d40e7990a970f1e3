"""Player of tracks on top of gaze: several at once, and each begins and ends in motion."""

from math import inf

import numpy as np
from msgspec import structs

from gazerig.gaze.minimum_jerk import min_jerk
from gazerig.gaze.track.motion import Motion
from gazerig.gaze.track.track import (
    FINISHED,
    HEAD,
    LIDS,
    POSE_CHANNELS,
    SHOWN_S,
    TrackState,
)
from gazerig.gaze.types import Floats

SPEECH = "speech"
"""Name of the track of a speech."""
_BLEND_IN_S, _BLEND_OUT_S = 0.4, 0.25
"""Shortest times in which a track grows from gaze, and fades to it."""
_AT_ONCE_S = 1e-9
"""Time of a beginning or an end without a blend."""
_CLOCK_SHARE = 0.05
"""Largest change of the speed by which a track follows another clock."""
_CLOCK_SMOOTH_S = 0.25


class Playback:
    """A track that plays.

    Args:
        motion: Its curves.
        number: Its number.
        begins_s: Time of the loop at which it begins.
        lead_s: Time by which its motion is ahead of its sound and its cues.

    Attributes:
        time_s: Present time of its motion.
    """

    def __init__(self, motion: Motion, number: int, begins_s: float, lead_s: float) -> None:
        state, self.motion, self._lead_s = motion.state, motion, lead_s
        self._begins_s = self._since_s = begins_s
        self._ended_s, self._fade_s, self._entry_s = inf, _AT_ONCE_S, _AT_ONCE_S
        self._rounds, self._late_s, self._rate = state.rounds, 0.0, 0.0
        self.time_s = motion.time_at(state.position_s) if state.position_s > 0.0 else 0.0
        if motion.owned.any() or state.position_s > 0.0:
            self._entry_s = motion.blend_s(self.time_s, _BLEND_IN_S, rising=True)
        duration_s = lead_s + motion.duration_s * max(1, state.rounds) - self.time_s
        self.state = structs.replace(
            state, number=number, duration_s=duration_s, position_s=self._position_s
        )

    @property
    def _position_s(self) -> float:
        """Return the position in the track, and in its sound."""
        heard_s = self.time_s - self._lead_s
        return round(self.motion.position_at(heard_s) + min(0.0, heard_s), 6)

    def advance(self, t_s: float) -> None:
        """Repeat, and end at its end."""
        dt_s = max(0.0, t_s - self._since_s)
        wanted = min(max(self._late_s, -_CLOCK_SHARE), _CLOCK_SHARE)
        self._rate += (wanted - self._rate) * min(1.0, dt_s / _CLOCK_SMOOTH_S)
        self._late_s -= self._rate * dt_s
        self.time_s += (1.0 + self._rate) * dt_s
        self._since_s = max(t_s, self._since_s)
        if not self.state.is_playing:
            return
        self.state = structs.replace(self.state, position_s=self._position_s)
        if self.time_s >= self.motion.duration_s + self._lead_s:
            self._rounds -= 1
            if self._rounds == 0:
                self.leave(FINISHED, t_s, fades=bool(self.motion.owned.any()))
            else:
                self.time_s -= self.motion.duration_s

    def follow(self, position_s: float, t_s: float) -> None:
        """Follow another clock: its position at a time, approached slowly."""
        wanted_s = self.motion.time_at(position_s) + self._lead_s
        self._late_s = wanted_s - self.time_s - (t_s - self._since_s)
        if self._rounds != 1:  # the clock may be in another round
            self._late_s -= self.motion.duration_s * round(self._late_s / self.motion.duration_s)

    def leave(self, reason: str, t_s: float, fades: bool = True) -> None:
        """End, at once or fading to gaze within the limits of the joints."""
        if self.state.is_playing:
            self.state = structs.replace(self.state, end_reason=reason)
            self._ended_s = t_s
            if fades and t_s >= self._begins_s:
                self._fade_s = self.motion.blend_s(self.time_s, _BLEND_OUT_S, rising=False)

    @property
    def gone_s(self) -> float:
        """Return the time from which it does not move the head any more."""
        return self._ended_s + self._fade_s

    def weight(self, t_s: float) -> float:
        """Return its share in the motion, 0..1."""
        grown = min_jerk((t_s - self._begins_s) / self._entry_s)
        return grown * (1.0 - min_jerk((t_s - self._ended_s) / self._fade_s))


class TrackPlayer:
    """Player of tracks.

    At most one track moves a channel: a newer one ends it, and begins when it has faded to gaze.

    Args:
        joints: Number of joints that gaze does not move.

    Attributes:
        latency_s: Latency of the joints, by which motion is ahead of its sound.
        moves: Whether ``step`` may return other values than last time.
        replaces_gaze: Whether a track gives the head's angles.
    """

    def __init__(self, joints: int) -> None:
        self._lids = np.zeros(len(POSE_CHANNELS) + joints)
        self._lids[LIDS] = 1.0
        self.latency_s, self._number = 0.0, 0
        self._playbacks: list[Playback] = []
        self.moves, self.replaces_gaze = True, False

    @property
    def playing(self) -> list[Playback]:
        """Return the tracks that play, the newest last."""
        return [one for one in self._playbacks if one.state.is_playing]

    @property
    def speech(self) -> Playback | None:
        """Return the speech that plays."""
        return next((one for one in self.playing if one.state.name == SPEECH), None)

    def start(self, motion: Motion, t_s: float) -> TrackState:
        """Begin a track as soon as those of its channels or its name have faded."""
        self.moves, begins_s, name = True, t_s, motion.state.name
        for one in self._playbacks:
            if one.state.name == name or (one.motion.channels & motion.channels).any():
                one.leave(f"another track: {name}", t_s)
                begins_s = max(begins_s, one.gone_s)
        self._number += 1
        lead_s = self.latency_s if motion.state.sound else 0.0
        self._playbacks.append(Playback(motion, self._number, begins_s, lead_s))
        return self._playbacks[-1].state

    def end(self, reason: str, t_s: float, name: str = "", fades: bool = True) -> None:
        """End the tracks of a name, "" for all; they fade to gaze, or not."""
        self.moves = True
        for one in self.playing:
            if name in ("", one.state.name):
                one.leave(reason, t_s, fades)

    def sync(self, number: int, position_s: float, t_s: float) -> None:
        """Correct the position of a track by another clock; an ended track is ignored."""
        for one in self.playing:
            if one.state.number == number:
                one.follow(position_s, t_s)

    def step(self, t_s: float) -> tuple[Floats, Floats]:
        """Return the factors on the values by gaze, and what is added to them, of all channels."""
        factors, added = np.ones_like(self._lids), np.zeros_like(self._lids)
        for one in self._playbacks:
            one.advance(t_s)
            if weight := one.weight(t_s):
                moved = weight * one.motion.curves.sample(np.array([one.time_s]))[0, 0]
                owned = one.motion.owned
                factors *= np.where(owned, 1.0 - weight, 1.0 + self._lids * moved)
                added += moved + self._lids * np.where(owned, weight, -moved)
        self.moves = any(t_s < one.gone_s for one in self._playbacks)
        self.replaces_gaze = bool(factors[HEAD].min() < 1.0)
        return factors, added

    def states(self, t_s: float) -> tuple[TrackState, ...]:
        """Return the tracks that play, and the last ones that have ended, by their numbers."""
        self._playbacks = [
            one
            for one in self._playbacks
            if t_s < one.gone_s + SHOWN_S or one.state.number == self._number
        ]
        return tuple([one.state for one in self._playbacks])
