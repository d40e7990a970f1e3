"""Where on a face to look: a measured Markov walk over eight parts (Nakamoto & Tsuruno 3.2).

Draw the next part, move there, hold it for its dwell time, draw again. A part drawn
again is a refixation: the gaze stays for another dwell. The printed matrix has one
decimal, so its rows sum to 0.8-1.1 and are normalised; rows are "from", columns "to".
Dwell times have standard deviations above their means, so the paper's "mean +- SD"
reaches negative times; a log-normal law with the same mean and SD is drawn instead.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import exp, log, sqrt

import numpy as np

from gaze.types import PART_NAMES, PARTS, Face, Floats, Percept, Target


@dataclass(frozen=True)
class Walk:
    """A measured walk: the transition matrix as printed, and dwell statistics."""

    order: tuple[str, ...] = field(
        metadata={"unit": "", "says": "face parts in the order of rows and columns"}
    )
    matrix: tuple[tuple[float, ...], ...] = field(
        metadata={
            "low": 0.0,
            "high": 1.0,
            "unit": "",
            "says": "transition probabilities, rows from, columns to, as printed",
        }
    )
    dwell_mean_s: tuple[float, ...] = field(
        metadata={"low": 0.001, "high": 60.0, "unit": "s", "says": "mean dwell per part"}
    )
    dwell_sd_s: tuple[float, ...] = field(
        metadata={"low": 0.0, "high": 60.0, "unit": "s", "says": "its standard deviation"}
    )
    start: str = field(default="FR", metadata={"choices": PARTS, "unit": "", "says": "first part"})

    def __post_init__(self) -> None:
        """Check the shapes.

        Raises:
            ValueError: parts, rows, columns and dwell times do not fit together.
        """
        if sorted(self.order) != sorted(PARTS):
            raise ValueError(f"order must hold each of {', '.join(PARTS)} once")
        n = len(PARTS)
        if len(self.matrix) != n or any(len(row) != n for row in self.matrix):
            raise ValueError(f"matrix must be {n} rows of {n} numbers")
        if any(sum(row) <= 0.0 for row in self.matrix):
            raise ValueError("every row of matrix needs at least one positive number")
        if len(self.dwell_mean_s) != n or len(self.dwell_sd_s) != n:
            raise ValueError(f"dwell_mean_s and dwell_sd_s must hold {n} numbers each")


@dataclass(frozen=True)
class ScanpathParams:
    """How the walk is taken by this robot."""

    walk: str = field(
        default="nakamoto_tsuruno",
        metadata={"unit": "", "says": "name of a shipped walk or path of a YAML file"},
    )
    shortest_dwell_ms: float = field(
        default=120.0,
        metadata={
            "low": 0.0,
            "high": 2000.0,
            "unit": "ms",
            "says": "floor of a dwell: a servo cannot show shorter ones",
        },
    )
    tempo: float = field(
        default=1.0,
        metadata={
            "low": 0.1,
            "high": 10.0,
            "unit": "",
            "says": "dwell times are divided by it: 2 wanders twice as fast",
        },
    )


def normalised(matrix: Sequence[Sequence[float]]) -> Floats:
    """Give the matrix with every row summing to 1."""
    rows = np.asarray(matrix, dtype=float)
    out: Floats = rows / rows.sum(axis=1, keepdims=True)
    return out


class Scanpath:
    """The walk, driven by the time and by whether the gaze has arrived."""

    def __init__(self, params: ScanpathParams, walk: Walk, rng: np.random.Generator) -> None:
        """Take the measured walk and the dice."""
        self._params = params
        self._rng = rng
        self._order = walk.order
        self._cumulative: list[list[float]] = np.cumsum(normalised(walk.matrix), axis=1).tolist()
        self._log_normal = [
            _log_normal(mean, sd)
            for mean, sd in zip(walk.dwell_mean_s, walk.dwell_sd_s, strict=True)
        ]
        self._start = walk.order.index(walk.start)
        self._column = [PARTS.index(code) for code in walk.order]
        self.reset(0.0)

    def reset(self, t_s: float) -> None:
        """Forget the face; the next one is entered at the start part."""
        self._face: Face | None = None
        self._part = self._start
        self._until_s: float | None = None
        self._shift = 0

    def wander(self, target: Target, percept: Percept | None, t_s: float, settled: bool) -> Target:
        """Replace a face target by the part of it that is due; pass anything else on.

        settled: whether the gaze has arrived at the last target given
        """
        if target.kind != "face":
            self._face = None
            return target._replace(shift=target.shift + self._shift)
        face = self._find(target.id, percept)
        if face is None:
            return target._replace(shift=target.shift + self._shift)
        self._walk(t_s, settled)
        code = self._order[self._part]
        point = face.parts_world_m[self._column[self._part]]
        return target._replace(
            p_world_m=point,
            part=code,
            shift=target.shift + self._shift,
            why=f"{PART_NAMES[code]} of {target.why}",
        )

    def next_part(self, part: int) -> int:
        """Draw the part that follows ``part`` (indices in the walk's order)."""
        dice = self._rng.random()
        row = self._cumulative[part]
        for following, edge in enumerate(row):
            if dice < edge:
                return following
        return row.index(row[-1])  # rounding left the sum a hair below 1

    def dwell_s(self, part: int) -> float:
        """Draw a dwell time for a part (index in the walk's order)."""
        mu, sigma = self._log_normal[part]
        drawn = exp(mu + sigma * self._rng.standard_normal()) / self._params.tempo
        return max(drawn, self._params.shortest_dwell_ms / 1000.0)

    def _find(self, face_id: int, percept: Percept | None) -> Face | None:
        """Give the target's face, the last known one while it is out of sight."""
        if self._face is None or self._face.id != face_id:
            self._face = None
            self._part = self._start
            self._until_s = None
        if percept is not None:
            for face in percept.faces:
                if face.id == face_id:
                    self._face = face
        return self._face

    def _walk(self, t_s: float, settled: bool) -> None:
        """Start the dwell on arrival; after it draw until another part comes."""
        if self._until_s is None:
            if settled:
                self._until_s = t_s + self.dwell_s(self._part)
            return
        while t_s >= self._until_s:
            following = self.next_part(self._part)
            if following != self._part:
                self._part = following
                self._until_s = None
                self._shift += 1
                return
            self._until_s += self.dwell_s(self._part)


def _log_normal(mean: float, sd: float) -> tuple[float, float]:
    """Give mu and sigma of the log-normal law with a mean and standard deviation."""
    sigma2 = log(1.0 + (sd / mean) ** 2)
    return log(mean) - 0.5 * sigma2, sqrt(sigma2)
