"""Opening of a jaw over time, as few keys that a servo can follow.

The keys are the turning points of the loudness and the closures of the lips. Between two keys a jaw
moves with minimum jerk: at most 15/8 of the mean speed and 10/sqrt(3) of distance per time squared
(Flash & Hogan 1985). A stroke that is too fast for the servo becomes smaller; closures stay closed,
because a mouth that is open on b, m or p is the first error that people notice.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import sqrt
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.gaze.mouth.loudness import FRAME_S, WINDOW_S
from gazerig.gaze.turning_points import turning_points
from gazerig.gaze.types import Floats

_PEAK_SPEED, _PEAK_ACCELERATION = 15.0 / 8.0, 10.0 / sqrt(3.0)
_LEAST_TURN = 0.1
_SMOOTH = np.hanning(7)[1:-1] / np.hanning(7).sum()
_SILENT, _SILENT_S = 0.03, 0.06
_DIP_SHARE, _DIP_FRAMES = 0.4, 15
_LEAST_GAP_S = 0.02
_LEAST_OPEN_S = 0.05
_P_CLOSED_S = 0.055
LONGEST_CLOSURE_S = 0.12
"""Lips part between an m and the next b; a person holds neither longer than this."""
_CLOSED_SHARE = {"b": 0.5, "m": 0.65}


@dataclass(frozen=True)
class MouthParams:
    """Motion while the head speaks."""

    # fmt: off
    level: Annotated[str, "level of the rig's table that opens the mouth; a rig without it plays only the sound"] = "mouth"
    # fmt: on


class JawLimits(NamedTuple):
    """Speed 1/s and acceleration 1/s2 of the opening that the jaw can reach."""

    speed: float
    acceleration: float

    def stroke(self, within_s: float) -> float:
        """Return the largest change of the opening within a time."""
        return min(
            self.speed * within_s / _PEAK_SPEED,
            self.acceleration * within_s**2 / _PEAK_ACCELERATION,
        )


class Closure(NamedTuple):
    """Time in which the lips are closed, seconds."""

    begin_s: float
    end_s: float


class MouthKey(NamedTuple):
    """Opening 0..1 at a time."""

    time_s: float
    opening: float


def phoneme_closures(spoken: Sequence[tuple[str, float]], end_s: float) -> tuple[Closure, ...]:
    """Return the closures of spoken phonemes.

    A p is reported at its release, which the closure precedes; b and m begin with it.

    Args:
        spoken: (name, begin in s): phonemes in the names of espeak-ng or IPA.
        end_s: End of the last one.
    """
    closures = []
    for (name, begin_s), (_, next_s) in pairwise([*spoken, ("", end_s)]):
        letter = name[:1].lower()
        if letter == "p":
            closures.append(Closure(max(0.0, begin_s - _P_CLOSED_S), begin_s))
        elif share := _CLOSED_SHARE.get(letter):
            closures.append(Closure(begin_s, begin_s + share * (next_s - begin_s)))
    joined: list[Closure] = []
    for begin_s, last_s in closures:
        if joined and begin_s - joined[-1].end_s < _LEAST_OPEN_S:
            begin_s = joined.pop().begin_s
        joined.append(Closure(max(begin_s, last_s - LONGEST_CLOSURE_S), last_s))
    return tuple(joined)


def estimated_closures(opening: Floats) -> tuple[Closure, ...]:
    """Return the times at which the sound lets one expect closed lips: short deep dips.

    Args:
        opening: (n,) openings by loudness, one per frame.
    """
    if not len(opening):
        return ()
    padded = np.pad(opening, _DIP_FRAMES, mode="edge")
    views = np.lib.stride_tricks.sliding_window_view(padded, _DIP_FRAMES + 1)
    before, after = views[: len(opening)].max(axis=1), views[-len(opening) :].max(axis=1)
    return _runs(opening < _DIP_SHARE * np.minimum(before, after), _LEAST_GAP_S)


def _runs(low: NDArray[np.bool_], least_s: float) -> tuple[Closure, ...]:
    """Return the times of consecutive true frames that last long enough."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], low.astype(np.int8), [0]))))
    return tuple(
        Closure(frame_s(begin), frame_s(end - 1))
        for begin, end in edges.reshape(-1, 2)
        if (end - begin) * FRAME_S >= least_s
    )


def frame_s(number: float) -> float:
    """Return the time of a frame."""
    return float(number) * FRAME_S + 0.5 * WINDOW_S


def mouth_keys(
    opening: Floats, closures: Iterable[Closure], limits: JawLimits
) -> tuple[MouthKey, ...]:
    """Return the keys of a mouth from shut to shut.

    Args:
        opening: (n,) openings by loudness, one per frame.
        closures: Times of closed lips.
        limits: What the jaw can follow.
    """
    if not len(opening):
        return ()
    shut = sorted((*closures, *_runs(opening < _SILENT, _SILENT_S)))
    opening = np.convolve(opening, _SMOOTH, mode="same")
    keys: list[tuple[float, float, bool]] = [(0.0, 0.0, True)]
    for i in turning_points(opening, _LEAST_TURN):
        at_s = frame_s(i)
        if not any(c.begin_s - _LEAST_GAP_S < at_s < c.end_s + _LEAST_GAP_S for c in shut):
            keys.append((at_s, float(opening[i]), False))
    for before, after in pairwise(shut):
        vowel = opening[round(before.end_s / FRAME_S) : round(after.begin_s / FRAME_S)]
        if len(vowel) * FRAME_S > 2 * _LEAST_GAP_S:
            middle_s = 0.5 * (before.end_s + after.begin_s)
            keys.append((middle_s, float(vowel.max()), False))
    for closure in shut:
        keys.append((max(_LEAST_GAP_S, closure.begin_s), 0.0, True))
        if closure.end_s - closure.begin_s >= _LEAST_GAP_S:
            keys.append((max(2 * _LEAST_GAP_S, closure.end_s), 0.0, True))
    keys.append((frame_s(len(opening)), 0.0, True))
    return _limit(_apart(sorted(keys)), limits)


def _apart(keys: list[tuple[float, float, bool]]) -> list[tuple[float, float, bool]]:
    """Return the keys without those that follow another one too closely; closures stay."""
    kept = keys[:1]
    for key in keys[1:]:
        while len(kept) > 1 and key[2] and not kept[-1][2] and key[0] - kept[-1][0] < _LEAST_GAP_S:
            kept.pop()
        if key[0] - kept[-1][0] >= _LEAST_GAP_S:
            kept.append(key)
    return kept


def _limit(keys: list[tuple[float, float, bool]], limits: JawLimits) -> tuple[MouthKey, ...]:
    """Return the keys with strokes that the jaw can follow: lower maxima, higher minima."""
    values = [value for _, value, _ in keys]
    strokes = [limits.stroke(b[0] - a[0]) for a, b in pairwise(keys)]
    for sign in (1.0, -1.0):
        for step, order in ((1, range(1, len(keys))), (-1, range(len(keys) - 2, -1, -1))):
            for i in order:
                other = i - step
                if not keys[i][2]:
                    farthest = sign * values[other] + strokes[min(i, other)]
                    values[i] = sign * min(sign * values[i], farthest)
    return tuple(MouthKey(key[0], value) for key, value in zip(keys, values, strict=True))
