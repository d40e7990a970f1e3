"""Scanpath on a face: a Markov walk over eight parts, or one of three simpler models.

The measured walk is that of Nakamoto & Tsuruno 3.2. Its printed matrix has one decimal, so the rows
sum to 0.8-1.1 and are normalised; rows are "from", columns "to". Only the point of a face target is
replaced here; the head turns to the face's centre and not to each part (3.5).

A matrix describes an average observer; three effects change it. Each observer has a preferred spot
on faces, from the brows to the mouth, that stays for months (Peterson & Eckstein 2013; Mehoudar et
al. 2014); most people's is just below the eyes. If looks have a normal distribution about it,
another spot multiplies the looks at a part by exp(part . shift / width^2). Speech draws looks to
the mouth (Buchan et al. 2007). Parts that are seen too close together for a shift, on a far face,
are one look.
"""

from dataclasses import dataclass
from math import inf
from typing import Annotated, Literal

import numpy as np
from msgspec.structs import replace
from numpy.typing import ArrayLike

from gazerig.gaze.angles import add, angle_between, sub
from gazerig.gaze.scanpath.dwell import Draw, lognormal_dwell, rest_dwell
from gazerig.gaze.scanpath.models import (
    SHORTEST_S,
    FaceTracking,
    MarkovWalk,
    RandomAngles,
    ScanpathModel,
    ScanpathStep,
    SimpleCycle,
)
from gazerig.gaze.types import PART_NAMES, PARTS, Face, Floats, Percept, Target, Vec3
from gazerig.params import Bounds, Choices

# A measured and rounded row may differ from a sum of 1 by this much.
_ROUNDING = 0.005


@dataclass(frozen=True)
class Walk:
    """Statistics of a measured scanpath: transition matrix as printed, and dwell times."""

    # fmt: off
    order: Annotated[tuple[str, ...], "face parts in the order of rows and columns"]
    matrix: Annotated[tuple[tuple[float, ...], ...], Bounds(0, 1), "transition probabilities, rows from, columns to, as printed"]
    dwell_mean_s: Annotated[tuple[float, ...], Bounds(0.001, 60), "mean dwell per part"]
    dwell_sd_s: Annotated[tuple[float, ...], Bounds(0, 60), "standard deviation of the dwell per part"]
    start: Annotated[str, Choices(*PARTS), "first part"] = "FR"
    # fmt: on

    def __post_init__(self) -> None:
        """Check the shapes.

        Raises:
            ValueError: parts, rows, columns and dwell times do not fit together.
        """
        if sorted(self.order) != sorted(PARTS):
            raise ValueError(f"order must contain each of {', '.join(PARTS)} once")
        n = len(PARTS)
        if len(self.matrix) != n or any(len(row) != n for row in self.matrix):
            raise ValueError(f"matrix must be {n} rows of {n} numbers")
        if any(sum(row) <= 0.0 for row in self.matrix):
            raise ValueError("every row of matrix needs at least one positive number")
        if len(self.dwell_mean_s) != n or len(self.dwell_sd_s) != n:
            raise ValueError(f"dwell_mean_s and dwell_sd_s must contain {n} numbers each")

    @property
    def row_sums(self) -> tuple[float, ...]:
        """Return the sum of every row before normalisation."""
        return tuple(sum(row) for row in self.matrix)


def row_sums_note(walk: Walk) -> str | None:
    """Return one line on the rows that do not sum to 1 and are normalised; None if all do."""
    sums = zip(walk.order, walk.row_sums, strict=True)
    off = [f"{part} {total:.3g}" for part, total in sums if abs(total - 1.0) > _ROUNDING]
    if not off:
        return None
    return f"the walk's rows do not all sum to 1 ({', '.join(off)}); they are normalised"


@dataclass(frozen=True)
class ScanpathParams:
    """Choice and parameters of the scanpath model."""

    # fmt: off
    model: Annotated[Literal["markov", "simple", "face_tracking", "random"],
        "model of the scan path: the measured Markov walk, or one of the three baselines it is compared with"] = "markov"
    transition_matrix: Annotated[str, "name of a shipped transition matrix or path of a YAML file"] = "people"
    law: Annotated[Literal["people", "literal"],
        "people: an observer who enters a face at the nearest eye or the nose, has a preferred spot, looks at the mouth that speaks, rests "
        "for .145 s or more, and takes parts of a far face as one; literal: the walk as printed"] = "people"
    spot_height_mm: Annotated[float, Bounds(-100, 100),
        "height of the observer's preferred spot on a face above that of most people, which is just below the eyes"] = 0.0
    rate_scale: Annotated[float, Bounds(0.1, 10), "dwell times are divided by this: with 2 the gaze wanders twice as fast"] = 1.0
    # fmt: on


def normalise(matrix: ArrayLike) -> Floats:
    """Return an (n, n) matrix with every row summing to 1."""
    rows = np.asarray(matrix, dtype=float)
    out: Floats = rows / rows.sum(axis=1, keepdims=True)
    return out


def merge_refixations(matrix: ArrayLike) -> Floats:
    """Return the chain of visits: the same walk with its self-transitions merged.

    matrix: (n, n); a part that is never left for another keeps its row
    """
    rows = np.asarray(matrix, dtype=float)
    away = rows * (1.0 - np.eye(len(rows)))
    return normalise(np.where(away.sum(axis=1, keepdims=True) > 0.0, away, rows))


def _replace_target(
    target: Target, face: Face | None, look: ScanpathStep | None, shift: int
) -> Target:
    if face is None or look is None:
        return replace(target, shift=target.shift + shift) if shift else target
    what = PART_NAMES[look.part] if look.part is not None else "random angles about"
    # The gaze waits for a lost face at its extrapolated position, with its parts.
    moved = sub(target.p_world_m, face.p_world_m)
    return replace(
        target,
        p_world_m=add(look.p_world_m, moved),
        part=look.part,
        shift=target.shift + shift,
        why=f"{what} of {target.why}" if look.part is not None else f"{what} {target.why}",
        centre_world_m=target.p_world_m,
    )


class Scanpath:
    """Scanpath: replaces a face as target by the point of the face to fixate.

    rests_until_s: end of the gaze's rest on a part of a face; inf while it is moving there, -inf if
        no end is drawn or the target is not a face
    """

    def __init__(self, params: ScanpathParams, walk: Walk, rng: np.random.Generator) -> None:
        self._rng = rng
        self.looks = _model(params, walk, rng)
        self.reset(0.0)

    def retune(self, params: ScanpathParams, walk: Walk) -> None:
        """Change the model, walk or rate; a walk continues, another model begins anew."""
        before, self.looks = self.looks, _model(params, walk, self._rng)
        if isinstance(before, MarkovWalk) and isinstance(self.looks, MarkovWalk):
            self.looks.continue_walk(before)
        else:
            self._shift += 1

    def reset(self, t_s: float) -> None:
        """Forget the face; the next one is entered again."""
        self._face: Face | None = None
        self._searched: Percept | None = None
        self._shift = 0
        self.rests_until_s = -inf
        self.looks.enter()

    def wander(
        self,
        target: Target,
        percept: Percept | None,
        t_s: float,
        settled: bool,
        p_world_head_m: Vec3 = (0.0, 0.0, 0.2),
        gaze_world_m: Vec3 | None = None,
    ) -> Target:
        """Replace a face target by its point that is due; return other targets unchanged.

        settled: whether the gaze has arrived at the last target
        gaze_world_m: the present gaze point; None if unknown
        """
        if target.kind != "face":
            self._face = face = None
        else:
            face, entered = self._find(target.id, percept)
            if face is not None and entered:
                self.looks.enter(_nearest(face, p_world_head_m, gaze_world_m))
                settled = False  # it arrived at the former target
        look = None
        if face is not None:
            look = self.looks.step(face, p_world_head_m, t_s, settled)
            self._shift += look.has_moved
        self.rests_until_s = self._until_s(look, settled)
        return _replace_target(target, face, look, self._shift)

    def _until_s(self, look: ScanpathStep | None, settled: bool) -> float:
        if look is None:
            return -inf
        if self.looks.until_s is not None:
            return self.looks.until_s
        return -inf if settled and not look.has_moved else inf

    def _find(self, face_id: int, percept: Percept | None) -> tuple[Face | None, bool]:
        """Return the face (its last known state while it is not visible), and whether it is new.

        The face is None for a visible person who has turned it away.
        """
        known = self._face
        if known is not None and known.id != face_id:
            known = None
        if known is not None and percept is self._searched:
            return known, False
        self._searched = percept
        seen = () if percept is None else percept.faces
        turned_away = percept is not None and face_id in percept.bodies.ids
        missed = None if turned_away else known
        self._face = next((face for face in seen if face.id == face_id), missed)
        return self._face, known is None and self._face is not None


ENTRY_PARTS = ("RE", "LE", "N")
"""Parts at which people enter a face: the first look lands near its middle (Hsiao & Cottrell 2008).

From chin and sides the walk would go on to the mouth, also of a silent person.
"""


def _nearest(face: Face, p_world_head_m: Vec3, gaze_world_m: Vec3 | None) -> str | None:
    """Return the eye or nose of a face nearest to the gaze point, None if that is unknown."""
    if gaze_world_m is None:
        return None
    gaze = sub(gaze_world_m, p_world_head_m)
    angle = {
        part: angle_between(gaze, sub(face.parts_world_m[PARTS.index(part)], p_world_head_m))
        for part in ENTRY_PARTS
    }
    return min(angle, key=lambda part: angle[part])


def _model(params: ScanpathParams, walk: Walk, rng: np.random.Generator) -> ScanpathModel:
    match params.model:
        case "simple":
            return SimpleCycle(params.rate_scale)
        case "face_tracking":
            return FaceTracking()
        case "random":
            return RandomAngles(params.rate_scale, rng)
    return markov_walk(params, walk, rng)


def markov_walk(params: ScanpathParams, walk: Walk, rng: np.random.Generator) -> MarkovWalk:
    """Return the walk of an observer, or as printed."""
    matrix, dwells = steps_and_dwells(params, walk)
    spot_m = params.spot_height_mm / 1e3 if params.law == "people" else None
    start = walk.order.index(walk.start)
    return MarkovWalk(walk.order, matrix, dwells, start, rng, spot_m)


def steps_and_dwells(params: ScanpathParams, walk: Walk) -> tuple[Floats, list[Draw]]:
    """Return the matrix of the steps that are drawn and the dwell law of each part.

    Parts are in the walk's order; the matrix is normalised, rows from. The diagonal, the same part
    again, is another dwell (Nakamoto & Tsuruno 3.2.1); people's dwell is that of the whole visit.
    """
    mean_s = (np.array(walk.dwell_mean_s) / params.rate_scale).tolist()
    sd_s = (np.array(walk.dwell_sd_s) / params.rate_scale).tolist()
    pairs = zip(mean_s, sd_s, strict=True)
    if params.law == "literal":
        return normalise(walk.matrix), [lognormal_dwell(mean, sd) for mean, sd in pairs]
    rests = [rest_dwell(mean, sd, SHORTEST_S) for mean, sd in pairs]
    return merge_refixations(walk.matrix), rests
