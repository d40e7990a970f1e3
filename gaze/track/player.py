"""Player of tracks on top of gaze: several at once, and each begins and ends in motion."""

from collections.abc import Iterable
from math import inf
from typing import Literal

import numpy as np
from msgspec import Struct, structs

from gazerig.gaze.minimum_jerk import min_jerk
from gazerig.gaze.track.motion import Motion
from gazerig.gaze.track.track import FINISHED, HEAD_CHANNELS, POSE_CHANNELS, rest_value
from gazerig.gaze.types import Floats

SHOWN_S = 2.0
"""Time for which an ended track is shown."""
SPEECH = "speech"
"""Name of the track of a speech."""
_BLEND_IN_S, _BLEND_OUT_S = 0.4, 0.25
"""Shortest times in which a track grows from gaze, and fades to it."""
_CLOCK_SHARE = 0.05
"""Largest change of the speed by which a track follows another clock."""
_CLOCK_SMOOTH_S = 0.25

Clock = Literal["loop", "sound", "external"]


class TrackState(Struct, frozen=True):
    """One track after a tick; an ended one is shown for ``SHOWN_S``, the newest one always.

    Attributes:
        number: Number of the track since the start, from 1.
        name: Its name.
        position_s: Position in the track; below 0 while the motion begins before the sound.
        duration_s: Its duration at its own speed.
        speed: Factor on that speed.
        loop: Whether it repeats until it is ended.
        owns: Joints that gaze does not move meanwhile.
        who: Name of the client, "" if unknown.
        sound: Path of the sound, "" without one.
        clock: Clock that the position follows.
        end_reason: Reason for its end, ``FINISHED`` at its own end, "" while it plays.
        limited: What the rig's limits changed, "" if nothing.
        volume: Volume of the sound, 0..1.
        cue: Name of the cue that it has passed last, "" before the first.
        cues: Number of cues that it has passed.
    """

    number: int
    name: str
    position_s: float = 0.0
    duration_s: float = 0.0
    speed: float = 1.0
    loop: bool = False
    owns: tuple[str, ...] = ()
    who: str = ""
    sound: str = ""
    clock: Clock = "loop"
    end_reason: str = ""
    limited: str = ""
    volume: float = 1.0
    cue: str = ""
    cues: int = 0

    @property
    def is_playing(self) -> bool:
        """Return whether it has not ended."""
        return not self.end_reason


class Voice:
    """One track that plays.

    Args:
        state: What is shown of it.
        motion: Its curves.
        from_s: Position at which it begins.
        rounds: Number of repetitions, 0: until it is ended.
        lead_s: Time by which its motion is ahead of its sound and its cues.

    Attributes:
        begins_s: Time of the loop at which it begins.
        ended_s, gone_s: Time of its end, and the time from which it does not move the head.
    """

    def __init__(
        self, state: TrackState, motion: Motion, from_s: float, rounds: int, lead_s: float
    ) -> None:
        self.state, self.motion, self.lead_s = state, motion, lead_s
        self.begins_s, self.ended_s, self.gone_s = 0.0, inf, inf
        self._rounds, self._since_s = rounds, 0.0
        self._time_s = motion.time_at(from_s) if from_s > 0.0 else 0.0
        self._next_cue = sum(at_s < from_s for at_s, _ in motion.cues)
        self._late_s = self._rate = self._entry_s = 0.0
        if motion.owned or from_s > 0.0:
            self._entry_s = motion.blend_s(self._time_s, _BLEND_IN_S, rising=True)

    def begin(self, number: int, t_s: float) -> None:
        """Get its number, and begin at a time."""
        self.begins_s = self._since_s = t_s
        self.state = structs.replace(self.state, number=number, position_s=self.position_s(t_s))

    def time_s(self, t_s: float) -> float:
        """Return the time of its motion at a time of the loop."""
        return self._time_s + max(0.0, t_s - self._since_s)

    def position_s(self, t_s: float) -> float:
        """Return the position in the track, and in its sound."""
        heard_s = self.time_s(t_s) - self.lead_s
        return self.motion.position_at(heard_s) + min(0.0, heard_s) * self.motion.speed

    def advance(self, t_s: float) -> None:
        """Pass cues, repeat, and end at its end."""
        motion, dt_s = self.motion, max(0.0, t_s - self._since_s)
        wanted = min(max(self._late_s, -_CLOCK_SHARE), _CLOCK_SHARE)
        self._rate += (wanted - self._rate) * min(1.0, dt_s / _CLOCK_SMOOTH_S)
        self._late_s -= self._rate * dt_s
        self._time_s += (1.0 + self._rate) * dt_s
        self._since_s = max(t_s, self._since_s)
        state, position_s = self.state, self.position_s(t_s)
        passed = sum(at_s <= position_s for at_s, _ in motion.cues)
        if passed > self._next_cue:
            cues = state.cues + passed - self._next_cue
            state = structs.replace(state, cue=motion.cues[passed - 1][1], cues=cues)
            self._next_cue = passed
        self.state = structs.replace(state, position_s=position_s)
        if self._time_s >= motion.duration_s + self.lead_s:
            if self._rounds == 1:
                self.leave(FINISHED, t_s, fades=bool(motion.owned))
                return
            self._rounds = max(0, self._rounds - 1)
            self._time_s -= motion.duration_s
            self._next_cue = 0

    def follow(self, clock: Clock, position_s: float, t_s: float) -> None:
        """Follow another clock: its position at a time, approached slowly."""
        self.state = structs.replace(self.state, clock=clock)
        self._late_s = (position_s - self.position_s(t_s)) / self.motion.speed
        if self._rounds != 1:  # the clock may be in another round
            self._late_s -= self.motion.duration_s * round(self._late_s / self.motion.duration_s)

    def leave(self, reason: str, t_s: float, fades: bool) -> None:
        """End, at once or fading to gaze within the limits of the joints."""
        self.state = structs.replace(self.state, end_reason=reason)
        self.ended_s = self.gone_s = t_s
        if fades and t_s >= self.begins_s:
            self.gone_s += self.motion.blend_s(self.time_s(t_s), _BLEND_OUT_S, rising=False)

    def weight(self, t_s: float) -> float:
        """Return its share in the motion, 0..1."""
        weight = min_jerk((t_s - self.begins_s) / self._entry_s) if self._entry_s else 1.0
        if t_s > self.ended_s:
            weight *= 1.0 - min_jerk((t_s - self.ended_s) / (self.gone_s - self.ended_s))
        return weight


class TrackPlayer:
    """Player of tracks.

    At most one track moves a channel: a newer one ends it, and begins when it has faded to gaze.

    Args:
        joints: Number of joints that gaze does not move.

    Attributes:
        owned: Value and share of each channel that tracks give instead of gaze.
        moves: Whether ``step`` may return another offset than last time.
    """

    def __init__(self, joints: int) -> None:
        names = (*POSE_CHANNELS, *[""] * joints)
        self.rest: Floats = np.array([rest_value(name) for name in names])
        self._number = 0
        self._voices: list[Voice] = []
        self.owned: dict[int, tuple[float, float]] = {}
        self.moves = True

    @property
    def playing(self) -> list[Voice]:
        """Return the tracks that play, the newest last."""
        return [voice for voice in self._voices if voice.state.is_playing]

    @property
    def speech(self) -> Voice | None:
        """Return the speech that plays."""
        for voice in self._voices:
            if voice.state.name == SPEECH and voice.state.is_playing:
                return voice
        return None

    @property
    def replaces_gaze(self) -> bool:
        """Return whether a track gives the head's angles."""
        return min(self.owned, default=len(HEAD_CHANNELS)) < len(HEAD_CHANNELS)

    def overlapping(self, motion: Motion, name: str) -> list[Voice]:
        """Return the tracks that another one replaces: those of its channels, or of its name."""
        return [
            voice
            for voice in self._voices
            if voice.state.name == name or voice.motion.channels & motion.channels
        ]

    def start(self, voice: Voice, t_s: float) -> None:
        """Begin a track as soon as those that it replaces have faded."""
        name = voice.state.name
        replaced = self.overlapping(voice.motion, name)
        self.end([one for one in replaced if one.state.is_playing], f"another track: {name}", t_s)
        self._number += 1
        voice.begin(self._number, max([t_s, *[one.gone_s for one in replaced]]))
        self._voices.append(voice)

    def end(self, voices: Iterable[Voice], reason: str, t_s: float, fades: bool = True) -> float:
        """End tracks, and return the time until all have faded to gaze, s."""
        self.moves, longest_s = True, 0.0
        for voice in voices:
            voice.leave(reason, t_s, fades and voice.motion.moves)
            longest_s = max(longest_s, voice.gone_s - t_s)
        return longest_s

    def sync(self, number: int, clock: Clock, position_s: float, t_s: float) -> None:
        """Correct the position of a track by another clock; an ended track is ignored."""
        for voice in self.playing:
            if voice.state.number == number:
                voice.follow(clock, position_s, t_s)

    def drop(self, t_s: float) -> str:
        """End all tracks at once, as a client holds the joints or the torque is off.

        Returns:
            The names of the tracks, "" if there were none.
        """
        playing = self.playing
        reason = "its joints are controlled by a client or switched off"
        self.end(playing, reason, t_s, fades=False)
        return ", ".join(voice.state.name for voice in playing)

    def step(self, t_s: float) -> Floats:
        """Return the (channels,) offset from rest at a time."""
        for voice in self.playing:
            voice.advance(t_s)
        self.owned, self.moves = {}, False
        offset: Floats = np.zeros(len(self.rest))
        for voice in self._voices:
            self.moves |= t_s < voice.gone_s
            if not voice.begins_s <= t_s < voice.gone_s:
                continue
            weight, motion = voice.weight(t_s), voice.motion
            values = motion.sample(np.array([voice.time_s(t_s)]))[0, 0]
            for i in motion.owned:
                self.owned[i] = float(self.rest[i] + values[i]), weight
                values[i] = 0.0
            offset += weight * values
        return offset

    def states(self, t_s: float) -> tuple[TrackState, ...]:
        """Return the tracks that play, and the last ones that have ended, by their numbers."""
        self._voices = [
            voice
            for voice in self._voices
            if t_s < max(voice.gone_s, voice.ended_s + SHOWN_S)
            or voice.state.number == self._number
        ]
        return tuple([voice.state for voice in self._voices])
