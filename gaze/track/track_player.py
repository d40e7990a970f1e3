"""Player of tracks on top of gaze: several at once, and each begins and ends in motion."""

from bisect import bisect_right
from collections.abc import Iterable
from typing import Literal

import numpy as np

from gazerig.gaze.minimum_jerk import min_jerk
from gazerig.gaze.track.track import FINISHED, HEAD_CHANNELS, POSE_CHANNELS, rest_value
from gazerig.gaze.track.track_motion import TrackMotion
from gazerig.gaze.types import Floats

BLEND_IN_S, BLEND_OUT_S = 0.4, 0.25
"""Shortest times in which a track grows from gaze, and fades to it."""
SPEECH = "speech"
"""Name of the track of a speech."""
_CLOCK_SHARE = 0.05
"""Largest change of the speed by which a track follows another clock."""
_LAST = "\uffff"
_CLOCK_GAIN, _CLOCK_SMOOTH_S = 1.0, 0.25


class PlayingTrack:
    """One track that plays.

    Args:
        name: Its name.
        motion: Its curves.
        begins_s: Time of the loop at which it begins.
        from_s: Position at which it begins.
        rounds: Number of repetitions, 0: until it is ended.
        lead_s: Time by which its motion is ahead of its sound and its cues.
        entry_s: Time in which it grows from gaze, 0: it begins at rest itself.

    Attributes:
        end_reason: Reason for its end, "" while it plays.
        ended_s: Time of this end, infinite while it plays.
        cue, cues: Name of the cue that it has passed last, and number of passed ones.
        clock: Clock that its position follows.
    """

    def __init__(
        self, name: str, motion: TrackMotion, begins_s: float, from_s: float = 0.0,
        rounds: int = 1, lead_s: float = 0.0, entry_s: float = 0.0,
    ) -> None:  # fmt: skip
        self.name, self.motion, self.rounds = name, motion, rounds
        self.begins_s, self.lead_s, self.entry_s = begins_s, lead_s, entry_s
        self.end_reason, self.cue, self.cues = "", "", 0
        self._since_s = begins_s
        self._time_s = motion.time_at(from_s) if from_s > 0.0 else 0.0
        self._next_cue = sum(at_s < from_s for at_s, _ in motion.cues)
        self._late_s = self._rate = 0.0
        self.clock: Literal["loop", "sound", "external"] = "loop"
        self.ended_s = self._leaves_s = np.inf
        self._exit_s = 0.0

    def time_s(self, t_s: float) -> float:
        """Return the time of its motion at a time of the loop."""
        return self._time_s + max(0.0, t_s - self._since_s)

    def position_s(self, t_s: float) -> float:
        """Return the position in the track, and in its sound."""
        return self.motion.position_at(self.time_s(t_s)) - self.lead_s * self.motion.speed

    def advance(self, t_s: float) -> bool:
        """Pass cues and repeat; return whether its end is reached."""
        motion, dt_s = self.motion, max(0.0, t_s - self._since_s)
        wanted = min(max(_CLOCK_GAIN * self._late_s, -_CLOCK_SHARE), _CLOCK_SHARE)
        self._rate += (wanted - self._rate) * min(1.0, dt_s / _CLOCK_SMOOTH_S)
        self._late_s -= self._rate * dt_s
        self._time_s += (1.0 + self._rate) * dt_s
        self._since_s = max(t_s, self._since_s)
        passed = bisect_right(motion.cues, (self.position_s(t_s), _LAST))
        if passed > self._next_cue:
            self.cue, self.cues = motion.cues[passed - 1][1], self.cues + passed - self._next_cue
            self._next_cue = passed
        if self._time_s < motion.duration_s + self.lead_s:
            return False
        if self.rounds == 1:
            return True
        self.rounds = max(0, self.rounds - 1)
        self._time_s -= motion.duration_s
        self._next_cue = 0
        return False

    def correct(self, t_s: float, position_s: float) -> None:
        """Follow another clock: its position at a time, approached slowly."""
        self._late_s = (position_s - self.position_s(t_s)) / self.motion.speed
        if self.rounds != 1:  # the clock may be in another round
            self._late_s -= self.motion.duration_s * round(self._late_s / self.motion.duration_s)

    def leave(self, reason: str, t_s: float, exit_s: float, until_s: float | None = None) -> None:
        """End, and fade to gaze from now on or from a later time."""
        self.end_reason, self.ended_s, self._exit_s = reason, t_s, exit_s
        self._leaves_s = t_s if until_s is None else until_s

    @property
    def gone_s(self) -> float:
        """Return the time from which it does not move the head, infinite while it plays."""
        return self._leaves_s + self._exit_s

    def weight(self, t_s: float) -> float:
        """Return its share in the motion, 0..1."""
        weight = min_jerk((t_s - self.begins_s) / self.entry_s) if self.entry_s else 1.0
        if t_s > self._leaves_s:
            weight *= 1.0 - min_jerk((t_s - self._leaves_s) / self._exit_s)
        return weight


class TrackPlayer:
    """Player of tracks.

    Args:
        joints: Number of joints that gaze does not move.

    Attributes:
        voices: Tracks that move the head, the newest last; also those that are ending.
        owned: Value and share of each channel that tracks give instead of gaze.
        moves: Whether ``step`` may return another offset than last time.
    """

    def __init__(self, joints: int) -> None:
        names = (*POSE_CHANNELS, *[""] * joints)
        self.rest: Floats = np.array([rest_value(name) for name in names])
        self.reset()

    def reset(self) -> None:
        """Rest immediately, for a head whose joints are hand-guided or switched off."""
        self.voices: list[PlayingTrack] = []
        self.owned: dict[int, tuple[float, float]] = {}
        self.moves = True

    @property
    def playing(self) -> list[PlayingTrack]:
        """Return the tracks that play, the newest last."""
        return [voice for voice in self.voices if not voice.end_reason]

    @property
    def speech(self) -> PlayingTrack | None:
        """Return the speech that plays."""
        for voice in self.voices:
            if voice.name == SPEECH and not voice.end_reason:
                return voice
        return None

    @property
    def replaces_gaze(self) -> bool:
        """Return whether a track gives the head's angles."""
        return min(self.owned, default=len(HEAD_CHANNELS)) < len(HEAD_CHANNELS)

    def play(self, voice: PlayingTrack) -> None:
        """Begin a track at its time."""
        self.voices.append(voice)
        self.moves = True

    def overlapping(self, motion: TrackMotion, name: str) -> list[PlayingTrack]:
        """Return the tracks that another one replaces: those of its channels, or of its name."""
        return [
            voice
            for voice in self.playing
            if voice.name == name or voice.motion.channels & motion.channels
        ]

    def end(
        self, voices: Iterable[PlayingTrack], reason: str, t_s: float, until_s: float | None = None
    ) -> float:
        """End tracks: they fade to gaze within the limits of the joints.

        Args:
            voices: The tracks.
            reason: Reason for their end.
            t_s: Present time, s.
            until_s: Time until which they stay, None for the present one.

        Returns:
            Time until all have faded, s.
        """
        longest_s = 0.0
        for voice in voices:
            exit_s, motion = 0.0, voice.motion
            if motion.moves and t_s >= voice.begins_s:
                exit_s = motion.blend_s(voice.time_s(t_s), BLEND_OUT_S, rising=False)
            voice.leave(reason, t_s, exit_s, until_s)
            longest_s = max(longest_s, voice.gone_s - t_s)
        self.moves = True
        return longest_s

    def step(self, t_s: float) -> Floats:
        """Return the (channels,) offset from rest at a time."""
        for voice in self.playing:
            if voice.advance(t_s):
                if voice.motion.owned:
                    self.end([voice], FINISHED, t_s)
                else:
                    voice.leave(FINISHED, t_s, 0.0)
        self.voices = [voice for voice in self.voices if t_s < voice.gone_s]
        self.moves, self.owned = bool(self.voices), {}
        offset: Floats = np.zeros(len(self.rest))
        for voice in self.voices:
            weight, motion = voice.weight(t_s), voice.motion
            values = motion.sample_at(np.array([voice.time_s(t_s)]))[0, 0]
            for i in motion.owned:  # the newest above the others
                value, share = self.owned.get(i, (0.0, 0.0))
                both = weight + share * (1.0 - weight)
                mixed = weight * (self.rest[i] + values[i]) + share * (1.0 - weight) * value
                self.owned[i] = float(mixed / both if both else 0.0), both
                values[i] = 0.0
            offset += weight * values
        return offset
