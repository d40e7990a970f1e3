"""Latency of joints: the time from a command to its measured motion, estimated while they move."""

from collections.abc import Sequence
from math import radians
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.gaze.types import Floats
from gazerig.robot.model.types import JointAngles, JointState

_BATCH, _EVERY = 256, 4
"""Ticks that are evaluated together, and those between two readings that are used."""
_STEP_S = 0.008
_LAGS_S = np.arange(16) * _STEP_S
_FRESH_S = 0.05
_MOVES_RAD = radians(0.2)
_ENOUGH = radians(1.0) ** 2 * 2000.0
"""Integral of the squared speed from which a latency counts: e.g. 100 deg/s for .2 s."""
_KEPT = 50.0
"""Multiple of it at which older motion loses half its weight."""


class _Batch(NamedTuple):
    """Ticks with (n, joints) readings, and (m, joints) commands at (m,) times, some of them before.

    weight: time that a reading stands for, 0 if it does not count
    moves: (joints,) whether a joint moves at all
    """

    times_s: Floats
    commands: Floats
    read_s: Floats
    places: Floats
    weight: Floats
    speeds: Floats
    moves: NDArray[np.bool_]


class JointLatency:
    """The latency of every joint: the shift between commands and measured angles that fits best.

    The fit is that of least variance of the difference, so that constant errors (play, weight) do
    not change it. Its sums are kept for a grid of shifts.

    Args:
        buses: Name of each joint's bus.
    """

    def __init__(self, buses: Sequence[str]) -> None:
        self._rows: list[tuple[float, JointAngles, JointState]] = []
        self._evaluated = 0
        self._batch: _Batch | None = None
        self._waiting: list[int] = []
        count = len(buses)
        self._weight, self._moved = np.zeros(count), np.zeros(count)
        # Sum and sum of squares of the difference, by shift and joint.
        self._sums = np.zeros((2, len(_LAGS_S), count))
        self._same_bus = np.array([[one == other for other in buses] for one in buses])

    def add(self, t_s: float, command_rad: JointAngles, joints: JointState) -> None:
        """Record a tick: the joints, which were read first, and the command sent to them.

        A reading without the state of the torque counts for nothing. A tick evaluates one joint at
        most.
        """
        if not (joints.torque and joints.measured):
            return
        self._rows.append((t_s, command_rad, joints))
        if self._waiting and self._batch is not None:
            self._fit(self._waiting.pop(), self._batch)
        elif len(self._rows) - self._evaluated >= _BATCH:
            self._batch = _batch(self._rows, max(self._evaluated, 1))
            self._waiting = np.flatnonzero(self._batch.moves).tolist()
            oldest_s = t_s - _LAGS_S[-1] - _FRESH_S
            self._rows = [row for row in self._rows if row[0] >= oldest_s]
            self._evaluated = len(self._rows)

    def interrupt(self) -> None:
        """Forget the last ticks, as the joints do not follow commands now."""
        self._rows.clear()
        self._evaluated = 0

    def _fit(self, j: int, batch: "_Batch") -> None:
        """Add a joint's part of a batch to its sums."""
        weight = batch.weight[:, j]
        at_s = batch.read_s[:, j, None] - _LAGS_S
        shifted = np.interp(at_s.ravel(), batch.times_s, batch.commands[:, j])
        error = shifted.reshape(at_s.shape) - batch.places[:, j, None]
        self._sums[:, :, j] += weight @ error, weight @ error**2
        self._weight[j] += weight.sum()
        self._moved[j] += weight @ batch.speeds[:, j] ** 2
        if self._moved[j] > _KEPT * _ENOUGH:
            for sums in (self._weight, self._moved, self._sums):
                sums[..., j] *= 0.5

    def estimates_s(self, default_s: float) -> tuple[float, ...]:
        """Return the latency of every joint, to the millisecond.

        It is the joint's own; until it has moved enough, that of all joints of its bus; until they
        have, the default.
        """
        variance = self._sums[1] - self._sums[0] ** 2 / np.maximum(self._weight, 1e-9)
        found = [default_s] * len(self._weight)
        for group in (self._same_bus, np.eye(len(found))):
            for j in np.flatnonzero(self._moved @ group > _ENOUGH).tolist():
                found[j] = _lowest_s(variance @ group[:, j])
        return tuple([round(one, 3) for one in found])


def _batch(rows: Sequence[tuple[float, JointAngles, JointState]], first: int) -> _Batch:
    """Return the ticks from a number on, with the commands of all."""
    used = slice(first, None, _EVERY)
    states = [joints for _, _, joints in rows[used]]
    times_s = np.array([t_s for t_s, _, _ in rows])
    commands = np.array([command for _, command, _ in rows])
    read_s = np.array([one.measured_s for one in states])
    places = np.array([one.position_rad for one in states])
    valid = np.array([one.torque for one in states]) & np.array([one.measured for one in states])
    valid &= np.isfinite(places) & (times_s[used, None] - read_s < _FRESH_S)
    valid &= read_s - _LAGS_S[-1] >= times_s[0]
    period_s = np.diff(times_s, prepend=-1.0)[used, None]
    return _Batch(
        times_s,
        commands,
        np.where(valid, read_s, times_s[0]),
        np.where(valid, places, 0.0),
        np.where(valid, _EVERY * period_s, 0.0),
        np.diff(commands, axis=0, prepend=0.0)[used] / np.maximum(period_s, 1e-6),
        valid.any(axis=0) & (np.ptp(commands, axis=0) > _MOVES_RAD),
    )


def _lowest_s(variance: Floats) -> float:
    """Return the shift of least variance, between the shifts of the grid."""
    i = min(max(int(variance.argmin()), 1), len(variance) - 2)
    before, least, after = variance[i - 1 : i + 2]
    bend = before - 2.0 * least + after
    beside = 0.5 * (before - after) / bend if bend > 0.0 else 0.0
    return float(np.clip(_LAGS_S[i] + _STEP_S * beside, 0.0, _LAGS_S[-1]))
