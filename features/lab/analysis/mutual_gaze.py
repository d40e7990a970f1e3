"""Mutual gaze of two heads: its share, its duration, and which head begins and ends it.

A head looks at the other while its measured gaze passes through the oval of the other's face, seen
from the front. Gaps and looks shorter than ``BRIDGED_S`` are ignored, as in the report.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.features.lab.analysis.gaze_on_face import gaze_point_on_face
from gazerig.gaze.angles import add, compose, rotate, scale
from gazerig.gaze.types import Floats, Mat3, Vec3
from gazerig.robot.control.tick import Tick, cyclopean_direction
from gazerig.robot.description.head_shape import measures_of
from gazerig.robot.model.face_geometry import PUPIL_DISTANCE_M

BRIDGED_S = 0.15
HALF_WIDE_M, HALF_HIGH_M = 0.085, 0.125
"""Oval of an adult's face around the nose; that of a head is proportional to its eye distance."""

Mask = NDArray[np.bool_]


class HeadPlacement(NamedTuple):
    """Pose of one head in the common world.

    Attributes:
        R: rotation of the frame of its neck base.
        p_m: position of its neck base.
    """

    R: Mat3
    p_m: Vec3

    @classmethod
    def from_numbers(cls, numbers: Sequence[float]) -> "HeadPlacement":
        """Return the placement that ``as_numbers`` returned as numbers."""
        a, b, c, d, e, f, g, h, i, j, k, m = numbers
        return cls(((d, e, f), (g, h, i), (j, k, m)), (a, b, c))

    @property
    def as_numbers(self) -> tuple[float, ...]:
        """Return the numbers stored in a recording: the position, then the rows of the rotation."""
        return (*self.p_m, *(number for row in self.R for number in row))


class MutualLooks(NamedTuple):
    """Looks of two heads at each other: times (n,) in seconds, and whether each looked (n,)."""

    t_s: Floats
    first_looks: Mask
    second_looks: Mask


class _LookingHead(NamedTuple):
    """Head at one time, in the common world; size: of its face, relative to an adult's."""

    eyes_m: Vec3
    gaze: Vec3
    R: Mat3
    nose_m: Vec3
    face_size: float


class MutualGazeTrace:
    """Whether each of two heads looks at the other, tick by tick of the first.

    Args:
        first: pose of the first head.
        second: pose of the other one.
    """

    def __init__(self, first: HeadPlacement, second: HeadPlacement) -> None:
        self._places = first, second
        self._newest: list[_LookingHead | None] = [None, None]
        self._rows: list[tuple[float, bool, bool]] = []

    def update(self, head_number: int, tick: Tick) -> None:
        """Add a tick of the first head (0) or of the other (1)."""
        place = self._places[head_number]
        pose = tick.pose
        middle = scale(add(pose.p_world_eye_left_m, pose.p_world_eye_right_m), 0.5)
        measures = measures_of(pose.p_world_eye_left_m, pose.p_world_eye_right_m)
        nose = add(pose.p_world_head_m, rotate(pose.R_world_head, measures.nose_m))
        self._newest[head_number] = _LookingHead(
            add(place.p_m, rotate(place.R, middle)),
            rotate(place.R, cyclopean_direction(tick)),
            compose(place.R, pose.R_world_head),
            add(place.p_m, rotate(place.R, nose)),
            measures.interocular_m / PUPIL_DISTANCE_M,
        )
        first, second = self._newest
        if head_number == 0 and first is not None and second is not None:
            looks = _looks_at(first, second), _looks_at(second, first)
            self._rows.append((tick.t_s, *looks))

    def looks(self) -> MutualLooks:
        """Return the looks of both heads, including short gaps and short looks."""
        t_s = np.array([row[0] for row in self._rows])
        first, second = (np.array([row[i] for row in self._rows], bool) for i in (1, 2))
        return MutualLooks(t_s, first, second)

    def figures(self) -> dict[str, object]:
        """Return the statistics of ``mutual_gaze`` so far."""
        return mutual_gaze(*self.looks())


def mutual_gaze(t_s: Floats, first: Mask, second: Mask) -> dict[str, object]:
    """Return statistics of the looks of two heads at each other.

    Args:
        t_s: (n,) times, seconds.
        first: (n,) whether the first head looks at the second.
        second: (n,) whether the second head looks at the first.

    Returns:
        Shares of the time of each head's looks and of mutual gaze; the share of mutual gaze that
        independent looks of the same durations would have (mean over shifts in time of the second
        head's looks); durations of mutual gazes (mean and median without those cut off by the
        start or the end); the number that the first head ended; and the time from a look to the
        other's answer. Argyle and Ingham (1972) measured .6, .6 and .3 for two people who talk,
        with mutual gazes of about 1.5 s; people prefer mutual gazes of 3.3 s (Binetti et al.,
        2016).
    """
    if len(t_s) < 2:
        return {"seconds": 0.0}
    first, second = bridge_gaps(t_s, first), bridge_gaps(t_s, second)
    both = first & second
    episodes = list(zip(*interval_edges(both), strict=True))
    whole = [(b, e) for b, e in episodes if b > 0 and e < len(t_s)]
    lengths = np.array([t_s[e] - t_s[b] for b, e in whole])
    by_first = sum(not first[e] for _, e in whole)
    found = []
    for one, other in ((first, second), (second, first)):
        for begin, end in zip(*interval_edges(one), strict=True):
            if begin == 0 or other[begin]:
                continue
            back = np.flatnonzero(other[begin:end])
            if len(back):
                found.append(float(t_s[begin + back[0]] - t_s[begin]))
    answers = np.array(found)
    return {
        "seconds": round(float(t_s[-1] - t_s[0]), 3),
        "first_looks": _share(first),
        "second_looks": _share(second),
        "both": _share(both),
        "both_by_chance": _chance_share(first, second),
        "mutual_gazes": len(episodes),
        "mean_s": _round_figure(lengths.mean()) if len(lengths) else None,
        "median_s": _round_figure(np.median(lengths)) if len(lengths) else None,
        "longest_s": _round_figure(max(t_s[e - 1] - t_s[b] for b, e in episodes))
        if episodes
        else None,
        "ended_by_first": by_first,
        "ended": len(whole),
        "answered_after_s": _round_figure(np.median(answers)) if len(answers) else None,
        "answers": len(answers),
    }


def _looks_at(one: _LookingHead, other: _LookingHead) -> bool:
    """Return whether a gaze passes through the oval of a face seen from the front."""
    point = gaze_point_on_face(one.eyes_m, one.gaze, other.nose_m, other.R)
    if point is None:
        return False
    y, z = point
    size = other.face_size
    return (y / (size * HALF_WIDE_M)) ** 2 + (z / (size * HALF_HIGH_M)) ** 2 <= 1.0


def interval_edges(mask: Mask) -> tuple[list[int], list[int]]:
    """Return the first index of each true interval, and the index after its last."""
    found = np.flatnonzero(np.diff(mask.astype(int), prepend=0, append=0)).reshape(-1, 2)
    return found[:, 0].tolist(), found[:, 1].tolist()


def bridge_gaps(t_s: Floats, mask: Mask) -> Mask:
    """Return looks with short gaps filled and then short looks removed."""
    out = mask.copy()
    for fill in (True, False):
        begins, ends = interval_edges(~out if fill else out)
        for begin, end in zip(begins, ends, strict=True):
            inner = begin > 0 and end < len(out)
            if inner and t_s[end] - t_s[begin] < BRIDGED_S:
                out[begin:end] = fill
    return out


def _chance_share(first: Mask, second: Mask, shifts: int = 50) -> float:
    """Return the mean share of mutual gaze over circular shifts in time of the second's looks."""
    steps = np.linspace(0, len(first), shifts + 2)[1:-1].astype(int)
    return _round_figure(np.mean([np.mean(first & np.roll(second, step)) for step in steps]))


def _share(mask: Mask) -> float:
    return _round_figure(np.mean(mask))


def _round_figure(value: object) -> float:
    return round(float(np.asarray(value)), 4)
