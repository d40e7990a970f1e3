"""Player of several tracks, without steps at a start, an end or an interruption.

The offsets of a track begin from rest and return to rest. When another one replaces it, or it ends
early, its offset returns to rest on a fifth-order polynomial that begins with the present offset,
speed and acceleration, and the next track is added to that. A track that begins in its middle grows
from rest. An error against another clock changes the speed of the track's own. Channels that a
track owns blend from gaze to the track and back. Each of these transitions takes as long as the
limits of the joints require.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from gazerig.gaze.minimum_jerk import PEAK_SPEED, Quintic, min_jerk
from gazerig.gaze.track.expression import Expressions
from gazerig.gaze.track.pose_offset import OwnedPose, PoseOffset
from gazerig.gaze.track.track import HEAD_CHANNELS, KEEP, POSE_CHANNELS, rest_value
from gazerig.gaze.track.track_motion import TrackMotion
from gazerig.gaze.types import Floats

_SYNC_SHARE = 0.05
"""Largest change of the speed that corrects the position by another clock."""
_SYNCED_S = 0.005
_ATTEMPTS, _LONGEST_S = 8, 8.0
_SAMPLES = 41
_HEAD = len(HEAD_CHANNELS)
_LONGER = 1.25


Share = TypeVar("Share", float, Floats)


def _unlimited(speed: Floats, acceleration: Floats) -> float:
    return 1.0


class PlayedTrack(NamedTuple):
    """A track with its speed and sizes of play.

    speed: factor on its original speed; sizes: factor of every channel
    stretch: returns for (n, channels) speeds and accelerations the factor by which the motion must
        take longer to keep the limits, at most 1 if it keeps them
    blend_s: shortest times in which it takes over owned channels, and returns them
    present: values of the channels before it, from which owned channels begin
    lead_s: time by which its motion is ahead of its position, because servos are late
    sound_s: duration of its sound, 0 without one
    """

    name: str
    motion: TrackMotion
    speed: float
    sizes: tuple[float, ...]
    stretch: Callable[[Floats, Floats], float] = _unlimited
    blend_s: tuple[float, float] = (0.4, 0.25)
    present: tuple[float, ...] = ()
    lead_s: float = 0.0
    sound_s: float = 0.0

    @property
    def length_s(self) -> float:
        """Return its duration at its original speed."""
        return max(self.motion.duration_s, self.sound_s)

    @property
    def duration_s(self) -> float:
        """Return the time from its start until everything is at rest again."""
        return self.length_s / self.speed


class OffsetState(NamedTuple):
    """Offset, speed and acceleration: (channels,) each, relative to rest."""

    value: Floats
    speed: Floats
    acceleration: Floats


class Fade:
    """Return of an offset to rest by fifth-order polynomials, one for each moving channel."""

    def __init__(self, state: OffsetState, from_s: float, fade_s: float) -> None:
        self.channels = [
            (i, Quintic((float(p), float(v), float(a)), 0.0, fade_s))
            for i, (p, v, a) in enumerate(zip(*state, strict=True))
            if p or v or a
        ]
        self.from_s, self.until_s = from_s, from_s + fade_s

    def add_to(self, flat: list[float], t_s: float) -> None:
        """Add the offset at a time to a flat PoseOffset."""
        for i, fade in self.channels:
            flat[i] += fade.position(t_s - self.from_s)

    def add_state(self, columns: Sequence[Floats], t_s: float) -> None:
        """Add value, speed and acceleration at a time to (channels,) each."""
        for i, fade in self.channels:
            for column, number in zip(columns, fade.state_at(t_s - self.from_s), strict=True):
                column[i] += number


class Voice:
    """One track that plays.

    ends: whether it has ended and only blends out
    passed: names of the cues that it has passed since they were taken

    Args:
        number: its number.
        played: the track.
        begins_s: time of the loop at which it begins.
        from_s: position at which it begins.
        loop: whether it repeats.
    """

    def __init__(
        self, number: int, played: PlayedTrack, begins_s: float, from_s: float, loop: bool
    ) -> None:
        self.number, self.played, self.loop = number, played, loop
        self.ends = False
        self.passed: list[str] = []
        self._begins_s = begins_s
        self._base_s = from_s + self.ahead_s if from_s > 0.0 else 0.0
        self._correction: tuple[float, float, Quintic] | None = None
        self._cue = sum([time < from_s for time, _ in self.motion.events.cues])
        owned = np.zeros(len(self.motion.rest), bool)
        owned[list(self.motion.owned)] = True
        self._owned, self._grows = owned, ~owned & (from_s > 0.0)
        self.entry_s = self._find_entry_s() if (owned | self._grows).any() else 0.0
        self._exits: dict[int, tuple[float, float]] = {}

    @property
    def motion(self) -> TrackMotion:
        """Return its curves."""
        return self.played.motion

    def position_s(self, t_s: float) -> float:
        """Return the position of the motion in the track."""
        return self._clock(t_s)[0]

    def _clock(self, t_s: float) -> tuple[float, float, float]:
        """Return the position, its speed and acceleration at a time of the loop."""
        speed = self.played.speed
        position_s = self._base_s + max(0.0, t_s - self._begins_s) * speed
        if self._correction is None:
            return position_s, speed, 0.0
        off_s, rate, change = self._correction[2].state_at(t_s - self._correction[0])
        return position_s + off_s, speed + rate, change

    @property
    def ahead_s(self) -> float:
        """Return the distance of the motion from the position of the sound, in the track."""
        return self.played.lead_s * self.played.speed

    def advance(self, t_s: float) -> bool:
        """Pass cues and repeat; return whether its end is reached."""
        position_s, duration_s = self.position_s(t_s), self.played.length_s
        cues = self.motion.events.cues
        while self._cue < len(cues) and cues[self._cue][0] <= position_s - self.ahead_s:
            self.passed.append(cues[self._cue][1])
            self._cue += 1
        if self.ends or position_s < duration_s + self.ahead_s:
            return False
        if self.loop and duration_s > 0.0:
            self._base_s -= duration_s
            self._cue = 0
            return False
        return True

    def add_to(self, flat: list[float], t_s: float) -> None:
        """Add the motion at a time to a flat PoseOffset."""
        sizes = self.played.sizes
        if t_s < self._begins_s + self.entry_s and self._grows.any():
            share = min_jerk((t_s - self._begins_s) / self.entry_s)
            sizes = tuple(
                [share * a if grows else a for a, grows in zip(sizes, self._grows, strict=True)]
            )
        self.motion.add_to(flat, self.position_s(t_s), sizes)

    def state(self, t_s: float) -> OffsetState:
        """Return the offset at a time, with its speed and acceleration."""
        position, rate, change = self._clock(t_s)
        value, speed, acceleration = self._motion_at(np.array([position]), rate, change)
        if self._grows.any():
            s = (t_s - self._begins_s) / self.entry_s
            share, rate, change = _blend(min(max(s, 0.0), 1.0), self.entry_s)
            w = np.where(self._grows, share, 1.0)
            dw, ddw = rate * self._grows, change * self._grows
            value, speed, acceleration = (
                w * value,
                w * speed + dw * value,
                w * acceleration + 2.0 * dw * speed + ddw * value,
            )
        return OffsetState(value[0], speed[0], acceleration[0])

    def _motion_at(self, positions: Floats, rate: float, change: float = 0.0) -> OffsetState:
        """Return (n, channels) states at positions that move with a speed and an acceleration."""
        found = self.motion.sample_at(np.maximum(positions, 0.0))
        size = np.array(self.played.sizes)
        return OffsetState(
            found.value * size,
            found.speed * size * rate,
            found.acceleration * size * rate * rate + found.speed * size * change,
        )

    def sync(self, t_s: float, position_s: float) -> None:
        """Correct the position by another clock, slowly; not during a correction."""
        if self._correction is not None:
            begin_s, time_s, move = self._correction
            if t_s < begin_s + time_s:
                return
            self._base_s += move.position(time_s)
            self._correction = None
        off_s = position_s + self.ahead_s - self.position_s(t_s)
        if self.loop:  # the clock may have begun the next round before
            half_s = 0.5 * self.played.length_s
            off_s = (off_s + half_s) % (2.0 * half_s) - half_s
        if abs(off_s) >= _SYNCED_S:
            time_s = PEAK_SPEED * abs(off_s) / (_SYNC_SHARE * self.played.speed)
            self._correction = t_s, time_s, Quintic((0.0, 0.0, 0.0), off_s, time_s)

    def _find_entry_s(self) -> float:
        """Return the time in which it takes over the owned channels, or grows from rest."""
        time_s, present = self.played.blend_s[0], np.array(self.played.present or 0.0)
        enters, s = self._owned | self._grows, np.linspace(0.0, 1.0, _SAMPLES)[:, None]
        for _ in range(_ATTEMPTS):
            w, dw, ddw = _blend(s, time_s)
            positions = self._base_s + s[:, 0] * time_s * self.played.speed
            value, speed, acceleration = self._motion_at(positions, self.played.speed)
            gap = value - np.where(self._owned, present, 0.0)
            excess = self.played.stretch(
                enters * (w * speed + dw * gap),
                enters * (w * acceleration + 2.0 * dw * speed + ddw * gap),
            )
            if excess <= 1.0:
                break
            time_s = min(time_s * max(_LONGER, excess), _LONGEST_S)
        return time_s

    def leave(self, t_s: float, gaze: OwnedPose, covered: frozenset[int], covered_s: float) -> None:
        """Begin to return the owned channels to gaze.

        Args:
            t_s: present time.
            gaze: the angles by gaze.
            covered: channels that a newer track takes over; they end when it has.
            covered_s: time that it takes.
        """
        self.ends = True
        gap = np.zeros(len(self.motion.rest))
        value = self.state(t_s).value + self.motion.rest
        for i in self.motion.owned - covered:
            gap[i] = value[i] - gaze.gaze.get(i, 0.0)
        time_s = self.played.blend_s[1]
        _, dw, ddw = _blend(np.linspace(0.0, 1.0, _SAMPLES)[:, None], time_s)
        time_s *= max(1.0, self.played.stretch(dw * gap, ddw * gap))
        for i in self.motion.owned:
            self._exits[i] = (t_s + covered_s, 0.0) if i in covered else (t_s, time_s)

    def has_left(self, t_s: float) -> bool:
        """Return whether it has ended and no longer owns a channel."""
        return self.ends and all([t_s >= begin + time for begin, time in self._exits.values()])

    def weight(self, channel: int, t_s: float) -> float:
        """Return the share of the track in a channel that it owns, 0..1."""
        entered = min_jerk((t_s - self._begins_s) / self.entry_s)
        if channel not in self._exits:
            return entered
        begin_s, time_s = self._exits[channel]
        if time_s == 0.0:
            return entered if t_s < begin_s else 0.0
        return entered * (1.0 - min_jerk((t_s - begin_s) / time_s))


class TrackPlayer:
    """Player of tracks.

    moves: whether ``step`` may return another offset than last time
    replaces_gaze: whether a track gives a gaze point or the head's angles
    look: gaze point of the newest track that has one (``KeyFrame.look_at``), else ``KEEP``

    Args:
        joints: number of joints that gaze does not move.
        expressions: the expression, which tracks may change while they play.
    """

    def __init__(self, joints: int, expressions: Expressions | None = None) -> None:
        self._rest_flat = (*map(rest_value, POSE_CHANNELS), *(0.0,) * joints)
        self._rest = PoseOffset.from_flat(self._rest_flat)
        self._expressions = expressions
        self.owned = OwnedPose()
        self.reset()

    def reset(self) -> None:
        """Rest immediately, for a head whose joints are hand-guided or switched off."""
        self.voices: list[Voice] = []
        self._leaving: list[Voice] = []
        self._fade: Fade | None = None
        # Of each track that has changed the expression: its newest key, and the one before.
        self._expressed: dict[int, tuple[int, tuple[str, float]]] = {}
        self.look: object = KEEP
        self.replaces_gaze = False
        self.owned.layers = {}
        self.moves = True

    @property
    def playing(self) -> str:
        """Return the name of the newest track, "" without one."""
        return self.voices[-1].played.name if self.voices else ""

    def overlapping(self, motion: TrackMotion) -> list[Voice]:
        """Return the tracks that move or own a channel which another one moves, or also look."""
        return [
            one
            for one in self.voices
            if one.motion.channels & motion.channels
            or (one.motion.events.looks and motion.events.looks)
            or (one.motion.events.expressions and motion.events.expressions)
        ]

    def end(
        self, voices: Iterable[Voice], t_s: float, fade_s: float, by: TrackMotion | None = None,
        taken_s: float = 0.0,
    ) -> None:  # fmt: skip
        """End tracks: their offsets return to rest, their owned channels to gaze.

        Args:
            voices: the tracks.
            t_s: present time, seconds.
            fade_s: time in which offsets return to rest, with those of earlier tracks.
            by: track that replaces them.
            taken_s: time in which it takes over its owned channels.
        """
        ended = list(voices)
        fade = Fade(self.state(t_s, ended), t_s, fade_s)
        self._fade = fade if fade.channels else None
        for voice in ended:
            self.voices.remove(voice)
            if voice.motion.owned:
                covered = voice.motion.owned & by.owned if by is not None else frozenset()
                voice.leave(t_s, self.owned, frozenset(covered), taken_s)
                self._leaving.append(voice)
            self._restore_expression(voice)
        self.moves = True

    def play(
        self, played: PlayedTrack, number: int, t_s: float, fade_s: float, wait_s: float,
        from_s: float = 0.0, loop: bool = False,
    ) -> Voice:  # fmt: skip
        """Begin a track; those which it replaces return to rest meanwhile.

        Args:
            played: the track.
            number: its number.
            t_s: present time, seconds.
            fade_s: time in which the replaced tracks return to rest.
            wait_s: time until it begins.
            from_s: position at which it begins.
            loop: whether it repeats until it is ended.
        """
        voice = Voice(number, played, t_s + wait_s, min(from_s, played.length_s), loop)
        taken_s = wait_s + voice.entry_s
        self.end(self.overlapping(played.motion), t_s, fade_s, played.motion, taken_s)
        self.voices.append(voice)
        return voice

    def state(self, t_s: float, voices: Sequence[Voice] | None = None) -> OffsetState:
        """Return the sum of offsets of tracks (default all) and of those that have ended.

        Owned channels have no offset.
        """
        total = OffsetState(*(np.zeros(len(self._rest_flat)) for _ in range(3)))
        if self._fade is not None:
            self._fade.add_state(total, t_s)
        for voice in self.voices if voices is None else voices:
            found = voice.state(t_s)
            owned = list(voice.motion.owned)
            for column, more in zip(total, found, strict=True):
                more[owned] = 0.0
                column += more
        return total

    def step(self, t_s: float) -> PoseOffset:
        """Return the offset at a time; at rest it is always the same object."""
        if self._fade is not None and t_s >= self._fade.until_s:
            self._fade = None
        for voice in [one for one in self.voices if one.advance(t_s)]:
            self.voices.remove(voice)
            self._restore_expression(voice)
            if voice.motion.owned:
                voice.leave(t_s, self.owned, frozenset(), 0.0)
                self._leaving.append(voice)
        self._leaving = [one for one in self._leaving if not one.has_left(t_s)]
        self._apply_events(t_s)
        self.owned.layers = {}
        self.replaces_gaze = isinstance(self.look, tuple)
        if not (self.voices or self._fade or self._leaving):
            self.moves = False
            return self._rest
        flat = list(self._rest_flat)
        if self._fade is not None:
            self._fade.add_to(flat, t_s)
        for voice in self.voices:
            if not voice.motion.owned:
                voice.add_to(flat, t_s)
        for voice in sorted(
            (one for one in (*self._leaving, *self.voices) if one.motion.owned),
            key=lambda one: one.number,
        ):
            own = list(self._rest_flat)
            voice.add_to(own, t_s)
            for i, value in enumerate(own):
                if i in voice.motion.owned:
                    self.owned.layers.setdefault(i, []).append((value, voice.weight(i, t_s)))
                    self.replaces_gaze |= i < _HEAD
                elif not voice.ends:
                    flat[i] += value - self._rest_flat[i]
        return PoseOffset.from_flat(tuple(flat))

    def _apply_events(self, t_s: float) -> None:
        """Set the gaze point and the expression of the tracks' present positions."""
        self.look = KEEP
        for voice in self.voices:
            looks, expressions, _ = voice.motion.events
            if looks and (at := voice.motion.event_at(0, voice.position_s(t_s))) >= 0:
                self.look = looks[at][1]
            if expressions and self._expressions is not None:
                at = voice.motion.event_at(1, voice.position_s(t_s))
                newest, before = self._expressed.get(
                    voice.number, (-1, (self._expressions.name, self._expressions.strength))
                )
                if at >= 0 and at != newest:
                    self._expressed[voice.number] = at, before
                    self._express(expressions[at][1])

    def _restore_expression(self, voice: Voice) -> None:
        """Return to the expression before a track that has changed it."""
        if voice.number in self._expressed:
            self._express(self._expressed.pop(voice.number)[1])

    def _express(self, expression: tuple[str, float]) -> None:
        if self._expressions is not None:
            self._expressions.express(*expression)


def _blend(s: Share, time_s: float) -> tuple[Share, Share, Share]:
    """Return a blend 0..1 at a share of a time, or at several, with its rate and acceleration."""
    return (
        s**3 * (10.0 + s * (6.0 * s - 15.0)),
        30.0 * (s * (1.0 - s)) ** 2 / time_s,
        60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / time_s**2,
    )
