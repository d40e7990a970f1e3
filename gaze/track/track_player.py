"""Player of tracks, one at a time, without jumps at a start, an end or an interruption.

A track begins from rest and returns to rest. When another one replaces it, or it ends early, its
offset returns to rest on a fifth-order polynomial that begins with the present offset, speed and
acceleration, and the next track is added to that.
"""

from typing import NamedTuple

import numpy as np

from gazerig.gaze.minimum_jerk import Quintic
from gazerig.gaze.track.pose_offset import PoseOffset
from gazerig.gaze.track.track import POSE_CHANNELS, rest_value
from gazerig.gaze.track.track_motion import TrackMotion
from gazerig.gaze.types import Floats


class PlayedTrack(NamedTuple):
    """A track with its speed and sizes of play.

    speed: factor on its original speed; sizes: factor of every channel
    """

    name: str
    motion: TrackMotion
    speed: float
    sizes: tuple[float, ...]

    @property
    def duration_s(self) -> float:
        """Return the time from its start until everything is at rest again."""
        return self.motion.duration_s / self.speed


class OffsetState(NamedTuple):
    """Offset, speed and acceleration: (channels,) each, relative to rest."""

    value: Floats
    speed: Floats
    acceleration: Floats


class TrackPlayer:
    """Player of the present track.

    moves: whether ``step`` may return another offset than last time

    Args:
        joints: number of joints that gaze does not move.
    """

    def __init__(self, joints: int) -> None:
        self._rest_flat = (*map(rest_value, POSE_CHANNELS), *(0.0,) * joints)
        self._rest = PoseOffset.from_flat(self._rest_flat)
        self.reset()

    def reset(self) -> None:
        """Rest immediately, for a head whose joints are hand-guided or switched off."""
        self._played: PlayedTrack | None = None
        self._begins_s = 0.0
        self._fades: list[tuple[int, Quintic]] = []
        self._fades_from_s = self._faded_s = 0.0
        self.moves = True

    @property
    def playing(self) -> str:
        """Return the name of the present track, "" without one."""
        return self._played.name if self._played is not None else ""

    def play(self, played: PlayedTrack | None, t_s: float, fade_s: float, wait_s: float) -> None:
        """Begin a track, or none; the present one returns to rest meanwhile.

        Args:
            played: the next track; None: no track.
            t_s: present time, seconds.
            fade_s: time in which the present track returns to rest.
            wait_s: time until the next begins.
        """
        states = zip(*self.state(t_s), strict=True)
        self._fades = [
            (i, Quintic((float(p), float(v), float(a)), 0.0, fade_s))
            for i, (p, v, a) in enumerate(states)
            if p or v or a
        ]
        self._fades_from_s, self._faded_s = t_s, t_s + fade_s
        self._played, self._begins_s = played, t_s + wait_s
        self.moves = True

    def state(self, t_s: float) -> OffsetState:
        """Return the offset at a time, with its speed and acceleration."""
        total = [np.zeros(len(self._rest_flat)) for _ in range(3)]
        for i, fade in self._fades:
            for column, number in zip(total, fade.state_at(t_s - self._fades_from_s), strict=True):
                column[i] += number
        if self._played is not None:
            _, motion, speed, sizes = self._played
            found = motion.state_at(max(0.0, t_s - self._begins_s) * speed)
            size = np.array(sizes)
            rates = size, size * speed, size * speed * speed
            for column, now, rate in zip(total, found, rates, strict=True):
                column += np.array(now) * rate
        return OffsetState(*total)

    def step(self, t_s: float) -> PoseOffset:
        """Return the offset at a time; at rest it is always the same object."""
        if self._fades and t_s >= self._faded_s:
            self._fades = []
        if self._played is not None and t_s >= self._begins_s + self._played.duration_s:
            self._played = None
        if self._played is None and not self._fades:
            self.moves = False
            return self._rest
        flat = list(self._rest_flat)
        for i, fade in self._fades:
            flat[i] += fade.position(t_s - self._fades_from_s)
        if self._played is not None:
            _, motion, speed, sizes = self._played
            motion.add_to(flat, max(0.0, t_s - self._begins_s) * speed, sizes)
        return PoseOffset.from_flat(tuple(flat))
