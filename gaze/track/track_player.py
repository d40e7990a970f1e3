"""Player of several tracks, without steps at a start, an end or an interruption.

The offsets of a track begin from rest and return to rest. When another one replaces it, or it ends
early, its offset returns to rest on a fifth-order polynomial that begins with the present offset,
speed and acceleration. An error against another clock changes the speed of the track's own.
Channels that a track owns blend from gaze to the track and back.
"""

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from gazerig.gaze.minimum_jerk import PEAK_SPEED, Quintic, min_jerk
from gazerig.gaze.track.expression import Expressions
from gazerig.gaze.track.pose_offset import OwnedPose, PoseOffset
from gazerig.gaze.track.track import BLEND_OUT_S, HEAD_CHANNELS, KEEP, POSE_CHANNELS, rest_value
from gazerig.gaze.track.track_motion import TrackMotion
from gazerig.gaze.types import Floats

_SYNC_SHARE = 0.05
"""Largest change of the speed that corrects the position by another clock."""
_SYNCED_S = 0.005

MoveTime = Callable[[Floats], float]
"""Returns the shortest time in which (channels,) values may change by given sizes."""


class Voice:
    """One track that plays.

    passed: names of the cues that it has passed since they were taken
    begins_s, entry_s: time of the loop at which it begins, and time in which it takes over the
        channels that it owns
    length_s: position at its end

    Args:
        number: its number.
        name: its name.
        motion: its curves.
        sizes: factor of every channel.
        move_s: shortest times of moves.
        leads_s: time by which each channel is ahead of its position, because its servos are late;
            () for none.
        sound_s: duration of its sound.
        again: motion when it repeats, None if it does not.
    """

    def __init__(
        self, number: int, name: str, motion: TrackMotion, sizes: Sequence[float],
        move_s: MoveTime, leads_s: Sequence[float] = (), sound_s: float = 0.0,
        again: TrackMotion | None = None,
    ) -> None:  # fmt: skip
        self.number, self.name, self.motion = number, name, motion
        self.passed: list[str] = []
        self.begins_s = self.entry_s = 0.0
        self.length_s = max(motion.length_s, sound_s)
        self._sizes, self._move_s, self._again = sizes, move_s, again
        # Faster joints begin later than the slowest one.
        leads = leads_s or [0.0] * len(sizes)
        self.lead_s = max([leads[i] for i in motion.channels], default=0.0)
        self._delays = [max(0.0, self.lead_s - one) for one in leads]
        self._base_s = 0.0
        self._correction: tuple[float, float, Quintic] | None = None
        begin_s = motion.position_at(0.0)
        self._cue = sum([time < begin_s for time, _ in motion.events.cues])
        self._exit: tuple[float, float] | None = None

    @property
    def duration_s(self) -> float:
        """Return the time from its start to its end."""
        motion = self.motion
        more_s = self.length_s - motion.position_at(motion.duration_s)
        return self.lead_s + motion.duration_s + max(0.0, more_s) / motion.speed

    def time_s(self, t_s: float) -> float:
        """Return the time of its motion at a time of the loop."""
        time_s = self._base_s + max(0.0, t_s - self.begins_s)
        if self._correction is not None:
            begin_s, _, move = self._correction
            time_s += move.position(t_s - begin_s)
        return time_s

    def position_s(self, t_s: float) -> float:
        """Return the position in the track, and in its sound."""
        return self.motion.position_at(self.time_s(t_s)) - self.lead_s * self.motion.speed

    def advance(self, t_s: float) -> bool:
        """Pass cues and repeat; return whether its end is reached."""
        position_s, cues = self.position_s(t_s), self.motion.events.cues
        while self._cue < len(cues) and cues[self._cue][0] <= position_s:
            self.passed.append(cues[self._cue][1])
            self._cue += 1
        if position_s < self.length_s:
            return False
        if self._again is not None and self.length_s > 0.0:
            self._base_s -= self.duration_s - self.lead_s
            self.motion, self._cue = self._again, 0
            return False
        return True

    def add_to(self, flat: list[float], t_s: float) -> None:
        """Add the motion at a time to a flat PoseOffset."""
        time_s = self.time_s(t_s)
        for i, curve in self.motion.curves:
            flat[i] += self._sizes[i] * curve.value_at(time_s - self._delays[i])

    def state(self, t_s: float) -> Floats:
        """Return (3, channels): the offset at a time, its speed and acceleration."""
        found: Floats = self.motion.sample_at(np.array([self.time_s(t_s)]), self._delays)[:, 0]
        found *= self._sizes
        return found

    def sync(self, t_s: float, position_s: float) -> None:
        """Correct the position by another clock, slowly; not during a correction."""
        if self._correction is not None:
            begin_s, time_s, move = self._correction
            if t_s < begin_s + time_s:
                return
            self._base_s += move.position(time_s)
            self._correction = None
        off_s = (position_s - self.position_s(t_s)) / self.motion.speed
        if self._again is not None:  # the clock may have begun the next round before
            half_s = 0.5 * self.duration_s
            off_s = (off_s + half_s) % (2.0 * half_s) - half_s
        if abs(off_s) >= _SYNCED_S:
            time_s = PEAK_SPEED * abs(off_s) / _SYNC_SHARE
            self._correction = t_s, time_s, Quintic((0.0, 0.0, 0.0), off_s, time_s)

    def leave(self, t_s: float, gaze: OwnedPose, taken_s: float) -> None:
        """Begin to return the owned channels to gaze.

        Args:
            t_s: present time.
            gaze: the angles by gaze.
            taken_s: time in which a newer track takes over some of them; until then they stay.
        """
        gap = np.zeros(len(self._sizes))
        value = self.state(t_s)[0]
        for i in self.motion.owned:
            gap[i] = value[i] + _rest(i) - gaze.gaze.get(i, 0.0)
        self._exit = t_s + taken_s, max(BLEND_OUT_S, self._move_s(gap))

    def has_left(self, t_s: float) -> bool:
        """Return whether it no longer owns a channel."""
        return self._exit is not None and t_s >= sum(self._exit)

    def weight(self, t_s: float) -> float:
        """Return the share of the track in the channels that it owns, 0..1."""
        entered = min_jerk((t_s - self.begins_s) / self.entry_s)
        if self._exit is None:
            return entered
        begin_s, time_s = self._exit
        return entered * (1.0 - min_jerk((t_s - begin_s) / time_s))


def _rest(channel: int) -> float:
    return rest_value(POSE_CHANNELS[channel]) if channel < len(POSE_CHANNELS) else 0.0


class TrackPlayer:
    """Player of tracks.

    voices: tracks that play, the newest last
    moves: whether ``step`` may return another offset than last time
    replaces_gaze: whether a track gives a gaze point or the head's angles
    look: gaze point of the newest track that has one (``KeyFrame.look_at``), else ``KEEP``

    Args:
        joints: number of joints that gaze does not move.
        expressions: the expression, which tracks may change while they play.
    """

    def __init__(self, joints: int, expressions: Expressions | None = None) -> None:
        self._rest_flat = tuple([_rest(i) for i in range(len(POSE_CHANNELS) + joints)])
        self._rest = PoseOffset.from_flat(self._rest_flat)
        self._expressions = expressions
        self.owned = OwnedPose()
        self.reset()

    def reset(self) -> None:
        """Rest immediately, for a head whose joints are hand-guided or switched off."""
        self.voices: list[Voice] = []
        self._leaving: list[Voice] = []
        self._fade: tuple[float, float, Quintic] | None = None
        # Of each track that has changed the expression: its newest key, and the one before.
        self._expressed: dict[int, tuple[int, tuple[str, float]]] = {}
        self.look: object = KEEP
        self.replaces_gaze = False
        self.owned.layers = {}
        self.moves = True

    @property
    def playing(self) -> str:
        """Return the name of the newest track, "" without one."""
        return self.voices[-1].name if self.voices else ""

    def overlapping(self, motion: TrackMotion, name: str) -> list[Voice]:
        """Return the tracks that another one replaces, as it has one of their channels or events.

        A track replaces the one of its name: a stream of speech moves the mouth by a level.
        """
        return [
            one
            for one in self.voices
            if one.name == name
            or one.motion.channels & motion.channels
            or any(a and b for a, b in zip(one.motion.events[:2], motion.events[:2], strict=True))
        ]

    def end(
        self, voices: Iterable[Voice], t_s: float, fade_s: float, by: Voice | None = None
    ) -> None:
        """End tracks: their offsets return to rest, their owned channels to gaze.

        Args:
            voices: the tracks.
            t_s: present time, seconds.
            fade_s: time in which offsets return to rest, with those of earlier tracks.
            by: track that replaces them.
        """
        ended = list(voices)
        state = self.state(t_s, ended)
        self._fade = (t_s, fade_s, Quintic(tuple(state), 0.0, fade_s)) if state.any() else None
        taken_s = by.begins_s + by.entry_s - t_s if by is not None else 0.0
        for voice in ended:
            self._remove(voice, t_s, taken_s)
        self.moves = True

    def _remove(self, voice: Voice, t_s: float, taken_s: float = 0.0) -> None:
        """Remove a track; the expression before it returns."""
        self.voices.remove(voice)
        if voice.motion.owned:
            voice.leave(t_s, self.owned, taken_s)
            self._leaving.append(voice)
        if self._expressions is not None and voice.number in self._expressed:
            self._expressions.express(*self._expressed.pop(voice.number)[1])

    def play(self, voice: Voice, t_s: float, fade_s: float) -> None:
        """Begin a track at its time; those which it replaces return to rest meanwhile."""
        self.end(self.overlapping(voice.motion, voice.name), t_s, fade_s, voice)
        self.voices.append(voice)

    def state(self, t_s: float, voices: Sequence[Voice] | None = None) -> Floats:
        """Return the sum of offsets of tracks (default all) and of those that have ended.

        The result is (3, channels): values, speeds, accelerations. Owned channels have no offset.
        """
        total: Floats = np.zeros((3, len(self._rest_flat)))
        if self._fade is not None:
            begin_s, _, move = self._fade
            total += np.stack(np.broadcast_arrays(total[0], *move.state_at(t_s - begin_s))[1:])
        for voice in self.voices if voices is None else voices:
            state = voice.state(t_s)
            state[:, list(voice.motion.owned)] = 0.0
            total += state
        return total

    def step(self, t_s: float) -> PoseOffset:
        """Return the offset at a time; at rest it is always the same object."""
        if self._fade is not None and t_s >= self._fade[0] + self._fade[1]:
            self._fade = None
        for voice in [one for one in self.voices if one.advance(t_s)]:
            self._remove(voice, t_s)
        self._leaving = [one for one in self._leaving if not one.has_left(t_s)]
        self._apply_events(t_s)
        self.owned.layers = {}
        self.replaces_gaze = isinstance(self.look, tuple)
        if not (self.voices or self._fade or self._leaving):
            self.moves = False
            return self._rest
        flat = list(self._rest_flat)
        if self._fade is not None:
            begin_s, _, move = self._fade
            flat = (np.array(flat) + move.position(t_s - begin_s)).tolist()
        for voice in sorted((*self._leaving, *self.voices), key=lambda one: one.number):
            owned = voice.motion.owned
            if not owned:
                voice.add_to(flat, t_s)
                continue
            own = list(self._rest_flat)
            voice.add_to(own, t_s)
            for i, value in enumerate(own):
                if i in owned:
                    self.owned.layers.setdefault(i, []).append((value, voice.weight(t_s)))
                    self.replaces_gaze |= i < len(HEAD_CHANNELS)
                elif voice in self.voices:
                    flat[i] += value - self._rest_flat[i]
        return PoseOffset.from_flat(tuple(flat))

    def _apply_events(self, t_s: float) -> None:
        """Set the gaze point and the expression of the tracks' present positions."""
        self.look = KEEP
        for voice in self.voices:
            looks, expressions, _ = voice.motion.events
            if looks and (at := voice.motion.event_at(0, voice.position_s(t_s))) >= 0:
                self.look = looks[at][1]
            face = self._expressions
            if expressions and face is not None:
                at = voice.motion.event_at(1, voice.position_s(t_s))
                newest, before = self._expressed.get(voice.number, (-1, (face.name, face.strength)))
                if at >= 0 and at != newest:
                    self._expressed[voice.number] = at, before
                    face.express(*expressions[at][1])
