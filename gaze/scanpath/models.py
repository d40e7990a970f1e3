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
    def dwell(self) -> tuple[str | None, float | None]:
        """Return the present part, None without one, and the end of that look, if known."""
        ...

    def continue_walk(self, before: "ScanpathModel") -> bool:
        """Continue the fixation of another model; return whether this model can."""
        ...

    def step(self, face: Face, p_world_head_m: Vec3, t_s: float, settled: bool) -> ScanpathStep:
        """Return the next fixation; ``settled``: the gaze has arrived at the last one."""
        ...


class Observer(NamedTuple):
    """Properties of one observer that affect looks at a face, in addition to the walk.

    shift_m: preferred spot on a face, to its left of and above that of most people
    width_m: standard deviation of looks about it; 0: the spot has no effect
    speech_mouth_ratio: factor on looks at the mouth of a person who speaks
    least_shift_rad: smallest angle between two parts for which the gaze shifts
    """

    shift_m: tuple[float, float] = (0.0, 0.0)
    width_m: float = 0.0
    speech_mouth_ratio: float = 1.0
    least_shift_rad: float = 0.0

    def spot_factor(self, left_m: float, up_m: float) -> float:
        """Return the factor on the looks at a part at a place of the face."""
        if self.width_m == 0.0:
            return 1.0
        along = left_m * self.shift_m[0] + up_m * self.shift_m[1]
        return exp(along / (self.width_m * self.width_m))


ANYONE = Observer()
"""An observer who uses the walk unchanged."""


class MarkovWalk:
    """First-order Markov chain over the parts, with a dwell time drawn at each arrival.

    A part that is drawn again is a refixation: the gaze stays for another dwell.
    """

    def __init__(
        self,
        parts: Sequence[str],
        matrix: Floats,
        dwells: Sequence[Draw],
        start: int,
        rng: np.random.Generator,
        enters_nearest: bool = False,
        observer: Observer = ANYONE,
    ) -> None:
        self._parts = tuple(parts)
        self._columns = tuple(PARTS.index(part) for part in parts)
        self._rows: list[list[float]] = np.asarray(matrix, dtype=float).tolist()
        self._dwells = tuple(dwells)
        self._start = start
        self._enters_nearest = enters_nearest
        self._observer = observer
        self._rng = rng
        self.enter()

    def enter(self, nearest: str | None = None) -> None:
        """Start at the first part, or at the nearest one if that is selected and known."""
        known = nearest is not None and self._enters_nearest
        self._part = self._parts.index(str(nearest)) if known else self._start
        self._face: Face | None = None
        self._until_s: float | None = None

    @property
    def dwell(self) -> tuple[str | None, float | None]:
        """Return the present part and the end of its dwell, None before the gaze has arrived."""
        return self._parts[self._part], self._until_s

    def continue_walk(self, before: ScanpathModel) -> bool:
        """Continue the part fixated and its dwell; return whether it is one of this model's."""
        part, until_s = before.dwell
        if part not in self._parts:
            return False
        self._part, self._until_s, self._face = self._parts.index(part), until_s, None
        return True

    def step(self, face: Face, p_world_head_m: Vec3, t_s: float, settled: bool) -> ScanpathStep:
        """Return the step: the dwell starts on arrival; after it another part is drawn."""
        before, until_s = self._part, self._until_s
        if until_s is None:
            if settled:
                self._until_s = t_s + self.dwell_s(before)
        elif t_s >= until_s:
            self._walk(until_s, t_s, face, p_world_head_m)
        moved = self._part != before
        if moved or face is not self._face:
            point = face.parts_world_m[self._columns[self._part]]
            self._step = ScanpathStep(point, self._parts[self._part], moved)
            self._face = None if moved else face
        return self._step

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

    def _factors(self, face: Face, p_world_head_m: Vec3) -> list[float]:
        """Return the factor on the probability of each part, for this observer and face."""
        observer, here = self._observer, self._columns[self._part]
        way = sub(face.parts_world_m[here], p_world_head_m)
        factors = []
        for part, column in zip(self._parts, self._columns, strict=True):
            place = face.parts_world_m[column]
            _, left, up = rotate_back(face.R_world_face, sub(place, face.p_world_m))
            factor = observer.spot_factor(left, up)
            if part == "M" and face.speaks:
                factor *= observer.speech_mouth_ratio
            if column != here and observer.least_shift_rad > 0.0:
                apart = angle_between(sub(place, p_world_head_m), way)
                factor *= apart >= observer.least_shift_rad
            factors.append(factor)
        return factors

    def _walk(self, until_s: float, t_s: float, face: Face, p_world_head_m: Vec3) -> None:
        factors = self._factors(face, p_world_head_m)
        while t_s >= until_s:
            following = self.next_part(self._part, factors)
            if following != self._part:
                self._part = following
                self._until_s = None
                return
            until_s += self.dwell_s(self._part)
        self._until_s = until_s


class SimpleCycle:
    """A fixed cycle of parts, each fixated for its own time after arrival."""

    def __init__(self, parts: Sequence[str], dwell_s: Sequence[float]) -> None:
        self._parts = tuple(parts)
        self._columns = tuple(PARTS.index(part) for part in parts)
        self._dwell_s = tuple(dwell_s)
        self.enter()

    def enter(self, nearest: str | None = None) -> None:
        """Start at the first part."""
        self._at = 0
        self._until_s: float | None = None

    @property
    def dwell(self) -> tuple[str | None, float | None]:
        """Return the present part and the end of its time, None before the gaze has arrived."""
        return self._parts[self._at], self._until_s

    def continue_walk(self, before: ScanpathModel) -> bool:
        """Continue the part fixated and its dwell; return whether it is one of this model's."""
        part, until_s = before.dwell
        if part not in self._parts:
            return False
        self._at, self._until_s = self._parts.index(part), until_s
        return True

    def step(self, face: Face, p_world_head_m: Vec3, t_s: float, settled: bool) -> ScanpathStep:
        """Return the step: the duration starts on arrival."""
        moved = False
        if self._until_s is None:
            if settled:
                self._until_s = t_s + self._dwell_s[self._at]
        elif t_s >= self._until_s:
            self._at = (self._at + 1) % len(self._parts)
            self._until_s = None
            moved = True
        return ScanpathStep(
            face.parts_world_m[self._columns[self._at]], self._parts[self._at], moved
        )


class FaceTracking:
    """Always the face centre, which in the paper is the tip of the nose (4.4.2)."""

    def enter(self, nearest: str | None = None) -> None:
        """Do nothing: this model has no state."""

    @property
    def dwell(self) -> tuple[str | None, float | None]:
        """Return the nose, with no end."""
        return "N", None

    def continue_walk(self, before: ScanpathModel) -> bool:
        """Return whether the nose was the last part."""
        return before.dwell[0] == "N"

    def step(self, face: Face, p_world_head_m: Vec3, t_s: float, settled: bool) -> ScanpathStep:
        """Return the centre."""
        return ScanpathStep(face.p_world_m, "N", False)


class RandomAngles:
    """Eyes to random angles at random intervals, independent of the face.

    Angles are uniform within +-angle_deg in yaw and in pitch about the direction from the head to
    the face, which is the head's goal. Intervals run from jump to jump; the paper prints them as
    0-3.0 ms, which is shorter than one of its frames, so seconds must be meant.
    """

    def __init__(self, angle_deg: float, longest_s: float, rng: np.random.Generator) -> None:
        self._angle_rad = radians(angle_deg)
        self._longest_s = longest_s
        self._rng = rng
        self.enter()

    def enter(self, nearest: str | None = None) -> None:
        """Start with angles drawn immediately."""
        self._offset_rad: Angles2 = self._angles()
        self._until_s: float | None = None

    @property
    def dwell(self) -> tuple[str | None, float | None]:
        """Return no part, and the end of the interval."""
        return None, self._until_s

    def continue_walk(self, before: ScanpathModel) -> bool:
        """Continue angles and interval of another such model, clipped to this one's limits."""
        if not isinstance(before, RandomAngles):
            return False
        most, (yaw, pitch) = self._angle_rad, before._offset_rad
        self._offset_rad = (min(max(yaw, -most), most), min(max(pitch, -most), most))
        self._until_s = before._until_s
        return True

    def step(self, face: Face, p_world_head_m: Vec3, t_s: float, settled: bool) -> ScanpathStep:
        """Return the step; new angles are drawn when the interval is over."""
        if self._until_s is None:
            self._until_s = t_s + self._interval_s()
        moved = t_s >= self._until_s
        while t_s >= self._until_s:
            self._offset_rad = self._angles()
            self._until_s += self._interval_s()
        to_face = sub(face.p_world_m, p_world_head_m)
        way = rotate(rotation((*yaw_pitch(to_face), 0.0)), direction(self._offset_rad))
        return ScanpathStep(add(p_world_head_m, scale(way, norm(to_face))), None, moved)

    def _angles(self) -> Angles2:
        yaw, pitch = self._rng.uniform(-self._angle_rad, self._angle_rad, 2).tolist()
        return yaw, pitch

    def _interval_s(self) -> float:
        return self._longest_s * (1.0 - self._rng.random())  # never 0
