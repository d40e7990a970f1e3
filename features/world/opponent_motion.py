"""Motion of a boxer whose leading fist a person moves: limits, weight in the pose, and events.

The run's process computes the motion in steps of 10 ms, a little ahead of the time, and writes it
where every process can read it. One second after the last order the script regains control.
"""

import mmap
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gazerig.features.world.time_profiles import smooth_rise
from gazerig.gaze.types import Floats, Vec3

STEP_S, AHEAD = 0.01, 5
"""Period of the rows, and how many are written ahead, so that no reader has to extrapolate."""
HOLD_S, TAKE_S = 1.0, 0.6
"""An order holds for ``HOLD_S``; hand-over between script and person takes ``TAKE_S``."""
MAX_M_S, MAX_M_S2, _RATE_HZ = 3.0, 40.0, 16.0
"""Limits of the fist: a scripted punch has 2.6 m/s."""
BODY_M_S, _BODY_RATE_HZ, _BODY_FROM_M, _BODY_TO_M = 0.8, 4.0, (-0.15, -0.5), (0.4, 0.5)
_KEPT = 1024
"""Number of rows that readers can read: 10 s."""


class OpponentRow(NamedTuple):
    """One step: its number, the weight of the person in the pose, the fist, the body's shift."""

    number: float
    share: float
    fist_m: Floats
    body_m: Floats


class OpponentMotion:
    """The motion of a fist to ordered points, with limits of speed and acceleration; pure.

    Attributes:
        spans_s: times in which a person moved it, (start, end).
    """

    def __init__(self, home_m: Vec3) -> None:
        self.spans_s: list[tuple[float, float]] = []
        self._home = np.array(home_m)
        self._target, self._ordered_s = self._home, -np.inf
        self._share, self._fist, self._speed = 0.0, self._home, np.zeros(3)
        self._body, self._body_speed = np.zeros(2), np.zeros(2)

    @property
    def is_at_rest(self) -> bool:
        """Return whether the script alone moves the boxer."""
        return self._share == 0.0

    def set_target(self, p_m: Vec3, t_s: float) -> None:
        """Move the fist to a point from now on."""
        self._target, self._ordered_s = np.array(p_m), t_s

    def step(self, number: int) -> OpponentRow:
        """Move by one step; return the row of this number."""
        t_s = number * STEP_S
        held = t_s - self._ordered_s <= HOLD_S
        if self.is_at_rest and held:
            self.spans_s.append((t_s, t_s))
            self._fist, self._speed = self._home, np.zeros(3)
            self._body, self._body_speed = np.zeros(2), np.zeros(2)
        self._fist, self._speed = _follow_target(
            self._fist, self._speed, self._target if held else self._home, _RATE_HZ, MAX_M_S
        )
        aside = np.clip((self._fist - self._home)[:2], _BODY_FROM_M, _BODY_TO_M)
        self._body, self._body_speed = _follow_target(
            self._body, self._body_speed, aside, _BODY_RATE_HZ, BODY_M_S
        )
        change = STEP_S / TAKE_S if held else -STEP_S / TAKE_S
        self._share = float(np.clip(self._share + change, 0.0, 1.0))
        if self.spans_s:
            self.spans_s[-1] = (self.spans_s[-1][0], t_s)
        return OpponentRow(
            number, float(smooth_rise(np.array(self._share))), self._fist, self._body
        )


def _follow_target(
    p: Floats, v: Floats, target: Floats, rate_hz: float, most_m_s: float
) -> tuple[Floats, Floats]:
    """Return position and speed one step later: critically damped, within the limits."""
    push = _limit_speed(rate_hz * (rate_hz * (target - p) - 2.0 * v), MAX_M_S2)
    v = _limit_speed(v + STEP_S * push, most_m_s)
    return p + STEP_S * v, v


def _limit_speed(v: Floats, most: float) -> Floats:
    return np.asarray(v * (most / max(most, float(np.linalg.norm(v)))))


class OpponentTrack:
    """Rows of a motion that several processes read and one process writes.

    Args:
        file: file of the rows, created by the first process; None: only in this process.
    """

    def __init__(self, file: Path | None) -> None:
        columns = 7
        size = 1 + _KEPT * columns
        if file is None:
            numbers: Floats = np.zeros(size)
        else:
            with os.fdopen(os.open(file, os.O_RDWR | os.O_CREAT, 0o600), "r+b") as opened:
                opened.truncate(8 * size)
                numbers = np.frombuffer(mmap.mmap(opened.fileno(), 0), np.float64)
        self._newest, self._rows = numbers[:1], numbers[1:].reshape(_KEPT, columns)

    def write(self, row: OpponentRow) -> None:
        """Write the next row."""
        at = self._rows[int(row.number) % _KEPT]
        at[1], at[2:5], at[5:] = row.share, row.fist_m, row.body_m
        at[0] = row.number
        self._newest[0] = row.number

    def rows(self, t_s: float) -> tuple[OpponentRow, OpponentRow, float] | None:
        """Return the rows before and after a time and the fraction between them.

        None: only the script moves the boxer. Without newer rows, the last row is used.
        """
        newest = int(self._newest[0])
        if newest == 0:
            return None
        number = min(int(t_s / STEP_S), newest)
        before = self._row(number)
        if before is None:
            return None
        after = self._row(number + 1) or before
        if before.share == after.share == 0.0:
            return None
        return before, after, min(1.0, t_s / STEP_S - number)

    def row_after(self, row: OpponentRow) -> list[OpponentRow]:
        """Return a row and the later rows that are already written."""
        after = (self._row(int(row.number) + n) for n in range(1, AHEAD + 1))
        return [row, *(one for one in after if one is not None)]

    def _row(self, number: int) -> OpponentRow | None:
        row = self._rows[number % _KEPT].copy()
        if row[0] != number:
            return None
        return OpponentRow(number, float(row[1]), row[2:5], row[5:])


class Opponent:
    """Boxer of a script under a person's control.

    Args:
        home: returns the position of the leading fist in guard.
        track: receives the motion.
    """

    def __init__(self, home: Callable[[], Vec3], track: Callable[[], OpponentTrack]) -> None:
        self._home, self._track = home, track
        self._motion: OpponentMotion | None = None
        self._next = 0

    @property
    def spans_s(self) -> Sequence[tuple[float, float]]:
        """Return the times in which a person moved it."""
        return () if self._motion is None else self._motion.spans_s

    def move(self, p_m: Vec3, t_s: float) -> None:
        """Move the fist to a point; t_s: time of the scene."""
        if self._motion is None:
            self._motion = OpponentMotion(self._home())
        if self._motion.is_at_rest:
            self._next = int(t_s / STEP_S) + 2
        self._motion.set_target(p_m, t_s)
        self.update(t_s)

    def update(self, t_s: float) -> None:
        """Write the rows up to a little after a time, if a person moves the boxer."""
        while self._motion and self._next and self._next <= int(t_s / STEP_S) + AHEAD:
            self._track().write(self._motion.step(self._next))
            self._next = 0 if self._motion.is_at_rest else self._next + 1
