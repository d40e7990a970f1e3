"""Four models of looks at a face: the measured walk and the three it is compared with.

MarkovWalk     the measured walk over eight parts (Nakamoto & Tsuruno 3.2)
SimpleCycle    face centre, right eye, left eye, again (4.4.2)
FaceTracking   the face centre, always (4.4.3)
RandomAngles   eyes to random angles at random intervals (4.4.4)

Time and random generator are arguments of all; ``enter`` is called for a new face, then ``step``
every tick.
"""

from collections.abc import Sequence
from math import exp, radians
from typing import NamedTuple, Protocol

import numpy as np

from gazerig.gaze.angles import (
    add,
    angle_between,
    direction,
    norm,
    rotate,
    rotate_back,
    rotation,
    scale,
    sub,
    yaw_pitch,
)
from gazerig.gaze.scanpath.dwell import Draw
from gazerig.gaze.types import PARTS, Angles2, Face, Floats, Vec3


class ScanpathStep(NamedTuple):
    """One fixation on a face: the point, its part if it is one, whether it is new."""

    p_world_m: Vec3
    part: str | None
    has_moved: bool


class ScanpathModel(Protocol):
    """The interface of the scanpath models."""

    def enter(self, nearest: str | None = None) -> None:
        """Start on a face; ``nearest``: its part nearest to the gaze, None if unknown."""
        ...

    @property
    def until_s(self) -> float | None:
        """Return the end of the present look, if known."""
        ...

    def step(self, face: Face, p_world_head_m: Vec3, t_s: float, settled: bool) -> ScanpathStep:
        """Return the next fixation; ``settled``: the gaze has arrived at the last one."""
        ...


SHORTEST_S = 0.145
"""Shortest rest on a part, from landing to departure; longer ones are distributed above it. Also
shortest rest after a saccade that catches up with the part."""
_SPOT_WIDTH_M = 0.06
"""Standard deviation of looks about an observer's preferred spot."""
_SPEECH_MOUTH = 6.0
"""Factor on looks at the mouth of a person who speaks."""
_LEAST_SHIFT_RAD = radians(1.5)
"""Smallest angle between two parts for which the gaze shifts; the fovea covers less."""


def spot_factor(spot_m: float, up_m: float) -> float:
    """Return the factor on the looks at a part at a height of the face, for an observer's spot."""
    return exp(up_m * spot_m / (_SPOT_WIDTH_M * _SPOT_WIDTH_M))


class MarkovWalk:
    """First-order Markov chain over the parts, with a dwell time drawn at each arrival.

    A part that is drawn again is a refixation: the gaze stays for another dwell.

    Args:
        parts: their order in matrix and dwells.
        matrix: transition probabilities, rows from.
        dwells: dwell law of each part.
        start: index of the first part.
        rng: random generator.
        spot_m: height of the observer's preferred spot above that of most people, who enters a face
            at the nearest part, looks at a mouth that speaks and merges parts of a far face; None:
            the walk unchanged.
    """

    def __init__(
        self,
        parts: Sequence[str],
        matrix: Floats,
        dwells: Sequence[Draw],
        start: int,
        rng: np.random.Generator,
        spot_m: float | None = None,
    ) -> None:
        self._parts = tuple(parts)
        self._columns = tuple(PARTS.index(part) for part in parts)
        self._rows: list[list[float]] = np.asarray(matrix, dtype=float).tolist()
        self._dwells = tuple(dwells)
        self._start = start
        self._spot_m = spot_m
        self._rng = rng
        self.enter()

    def enter(self, nearest: str | None = None) -> None:
        """Start at the first part, or at the nearest one if that is selected and known."""
        known = nearest is not None and self._spot_m is not None
        self._part = self._parts.index(str(nearest)) if known else self._start
        self.until_s: float | None = None

    def continue_walk(self, before: "MarkovWalk") -> None:
        """Continue the part and the dwell of another walk."""
        self._part, self.until_s = self._parts.index(before._parts[before._part]), before.until_s

    def step(self, face: Face, p_world_head_m: Vec3, t_s: float, settled: bool) -> ScanpathStep:
        """Return the step: the dwell starts on arrival; after it another part is drawn."""
        before, until_s = self._part, self.until_s
        if until_s is None:
            if settled:
                self.until_s = t_s + self.dwell_s(before)
        elif not settled and self._spot_m is not None:
            self.until_s = max(until_s, t_s + SHORTEST_S)
        elif t_s >= until_s:
            self._walk(until_s, t_s, face, p_world_head_m)
        point = face.parts_world_m[self._columns[self._part]]
        return ScanpathStep(point, self._parts[self._part], self._part != before)

    def next_part(self, part: int, factors: Sequence[float] | None = None) -> int:
        """Draw the part that follows ``part``, both as indices in the order given.

        factors: factor on the probability of each part; the part does not change if all become 0
        """
        row = self._rows[part]
        if factors is not None:
            row = [one * factor for one, factor in zip(row, factors, strict=True)]
        total = sum(row)
        if total == 0.0:
            return part
        draw, last = total * self._rng.random(), part
        for following, one in enumerate(row):
            if one > 0.0:
                draw, last = draw - one, following
                if draw < 0.0:
                    break
        return last  # the sum may be slightly below the draw because of rounding

    def dwell_s(self, part: int) -> float:
        """Draw a dwell time of a part."""
        return self._dwells[part](self._rng)

    def _factors(self, face: Face, p_world_head_m: Vec3) -> list[float] | None:
        """Return the factor on the probability of each part, for this observer and face."""
        if self._spot_m is None:
            return None
        here = self._columns[self._part]
        way = sub(face.parts_world_m[here], p_world_head_m)
        factors = []
        for part, column in zip(self._parts, self._columns, strict=True):
            place = face.parts_world_m[column]
            up = rotate_back(face.R_world_face, sub(place, face.p_world_m))[2]
            factor = spot_factor(self._spot_m, up)
            if part == "M" and face.speaks:
                factor *= _SPEECH_MOUTH
            if column != here:
                factor *= angle_between(sub(place, p_world_head_m), way) >= _LEAST_SHIFT_RAD
            factors.append(factor)
        return factors

    def _walk(self, until_s: float, t_s: float, face: Face, p_world_head_m: Vec3) -> None:
        factors = self._factors(face, p_world_head_m)
        while t_s >= until_s:
            following = self.next_part(self._part, factors)
            if following != self._part:
                self._part = following
                self.until_s = None
                return
            until_s += self.dwell_s(self._part)
        self.until_s = until_s


_CYCLE = (("N", 0.45942), ("RE", 0.40821), ("LE", 0.40821))
"""Parts and dwells of the simple model, seconds (4.4.2)."""


class SimpleCycle:
    """A fixed cycle of parts, each fixated for its own time after arrival."""

    def __init__(self, rate_scale: float) -> None:
        self._rate_scale = rate_scale
        self.enter()

    def enter(self, nearest: str | None = None) -> None:
        """Start at the first part."""
        self._at = 0
        self.until_s: float | None = None

    def step(self, face: Face, p_world_head_m: Vec3, t_s: float, settled: bool) -> ScanpathStep:
        """Return the step: the duration starts on arrival."""
        moved = self.until_s is not None and t_s >= self.until_s
        if moved:
            self._at, self.until_s = (self._at + 1) % len(_CYCLE), None
        part, dwell_s = _CYCLE[self._at]
        if self.until_s is None and settled and not moved:
            self.until_s = t_s + dwell_s / self._rate_scale
        return ScanpathStep(face.parts_world_m[PARTS.index(part)], part, moved)


class FaceTracking:
    """Always the face centre, which in the paper is the tip of the nose (4.4.2)."""

    until_s: float | None = None

    def enter(self, nearest: str | None = None) -> None:
        """Do nothing: this model has no state."""

    def step(self, face: Face, p_world_head_m: Vec3, t_s: float, settled: bool) -> ScanpathStep:
        """Return the centre."""
        return ScanpathStep(face.p_world_m, "N", False)


_ANGLE_RAD, _LONGEST_S = radians(20.0), 3.0
"""Largest yaw and pitch, and longest interval of the random model."""


class RandomAngles:
    """Eyes to random angles at random intervals, independent of the face.

    Angles are uniform within +-20 deg in yaw and in pitch about the direction from the head to the
    face, which is the head's goal. Intervals run from jump to jump; the paper prints them as
    0-3.0 ms, which is shorter than one of its frames, so seconds must be meant.
    """

    def __init__(self, rate_scale: float, rng: np.random.Generator) -> None:
        self._longest_s = _LONGEST_S / rate_scale
        self._rng = rng
        self.enter()

    def enter(self, nearest: str | None = None) -> None:
        """Start with angles drawn immediately."""
        self._offset_rad: Angles2 = self._angles()
        self.until_s: float | None = None

    def step(self, face: Face, p_world_head_m: Vec3, t_s: float, settled: bool) -> ScanpathStep:
        """Return the step; new angles are drawn when the interval is over."""
        until_s = t_s + self._interval_s() if self.until_s is None else self.until_s
        moved = t_s >= until_s
        while t_s >= until_s:
            self._offset_rad = self._angles()
            until_s += self._interval_s()
        self.until_s = until_s
        to_face = sub(face.p_world_m, p_world_head_m)
        way = rotate(rotation((*yaw_pitch(to_face), 0.0)), direction(self._offset_rad))
        return ScanpathStep(add(p_world_head_m, scale(way, norm(to_face))), None, moved)

    def _angles(self) -> Angles2:
        yaw, pitch = self._rng.uniform(-_ANGLE_RAD, _ANGLE_RAD, 2).tolist()
        return yaw, pitch

    def _interval_s(self) -> float:
        return self._longest_s * (1.0 - self._rng.random())  # never 0
