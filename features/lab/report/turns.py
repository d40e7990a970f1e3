"""Gaze around the turns that a voice agent reports: looks away by role, begin and end, latencies.

A look away is more than 6 deg from the partner's face, as Dembinsky et al. 2024 are counted here,
and clear of the face, which is larger if it is near.
Long turns are judged as speaking or listening, exchanges of short ones as dialogue.
"""

from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from gazerig.features.lab.report.gaze_trace import GazeTrace
from gazerig.features.lab.report.statistics import MeasuredValue, mean, rate
from gazerig.gaze.types import Floats

Role = Literal["speaking", "listening", "dialogue"]

AVERTED_DEG = 6.0
CLEAR_DEG = 1.0
_, _, _THINKS, _SPEAKS, _INTERRUPTED = range(5)
_BRIDGED_S = 0.1
"""Shorter looks, and shorter times between two, do not count."""
_EXCHANGE_S = 10.0
"""A shorter turn is part of a dialogue."""
_LONG_S = 3.5
"""A shorter turn has neither begin nor end to judge."""
_BEGINS_S, _ENDS_S = 0.3, 0.05
"""Time after the begin, and before the end of a turn, at which the gaze is judged."""
_BLOCK_S = 20.0


class Turn(NamedTuple):
    """A turn: its state, its first row and the one after its last, and its length."""

    state: int
    first: int
    end: int
    length_s: float


class TurnLooks:
    """Looks away of a run with turns.

    Attributes:
        averted: (n,) Whether the gaze is averted.
        known: (n,) Whether the partner is visible; only such times are judged.
        turns: Turns in the order of time.
        looks: (n, 2) First row of each look away, and the one after its last.
    """

    def __init__(self, run: GazeTrace) -> None:
        self.t_s, self.state = run.column("t"), run.column("turn")
        self.off_deg = off = run.column("off_partner")
        far = np.nan_to_num(np.hypot(off[:, 0], off[:, 1])) > np.maximum(
            AVERTED_DEG, np.nan_to_num(run.column("face_edge")) + CLEAR_DEG
        )
        self.known = ~np.isnan(off[:, 0])
        self.averted = _bridge(self.t_s, _bridge(self.t_s, far, True), False)
        cuts = [
            0,
            *(np.flatnonzero(np.diff(run.column("turn_number"))) + 1).tolist(),
            len(run.column("turn_number")),
        ]
        self.turns = [
            Turn(int(self.state[a]), a, b, float(self.t_s[b - 1] - self.t_s[a]))
            for a, b in zip(cuts, cuts[1:], strict=False)
        ]
        self.looks = _true_rows(self.averted)

    def blocks(self, role: Role) -> Floats:
        """Return (n, 3) seconds averted, seconds and looks away of stretches of a role."""
        t, begins = self.t_s, self.looks[:, 0]
        rows = []
        for first, end in self._stretches(role):
            count = max(1, round(float(t[end - 1] - t[first]) / _BLOCK_S))
            cuts = np.linspace(first, end, count + 1).astype(int).tolist()
            for a, b in zip(cuts, cuts[1:], strict=False):
                known = self.known[a:b]
                step_s = np.diff(t[a : b + 1], append=t[b - 1])[: b - a]
                seen_s = float(step_s[known].sum())
                away_s = float(step_s[known & self.averted[a:b]].sum())
                rows.append((away_s, seen_s, float(((begins >= a) & (begins < b)).sum())))
        return np.array([row for row in rows if row[1] > 0.0]).reshape(-1, 3)

    def aside(self, role: Role) -> Floats:
        """Return whether each look away goes aside, that begins in a role and not in a thought."""
        rows = []
        for first, end in self._stretches(role):
            begins = (self.looks[:, 0] >= first) & (self.looks[:, 0] < end)
            for a, b in self.looks[begins & (self.state[first] != _THINKS)]:
                off = np.abs(self.off_deg[a:b])
                yaw, pitch = off[np.nanargmax(np.hypot(*off.T))]
                rows.append(float(yaw > pitch))
        return np.array(rows)

    def begins(self) -> Floats:
        """Return for each long turn of speech whether it begins averted."""
        at = [self._row_after(one.first, _BEGINS_S) for one in self._long()]
        return np.array([float(self.averted[row]) for row in at if self.known[row]])

    def ends(self) -> Floats:
        """Return whether each long, uninterrupted turn of speech ends on the face."""
        found = []
        for one, after in zip(self.turns, self.turns[1:], strict=False):
            if one in self._long() and after.state != _INTERRUPTED:
                last = self._row_after(one.end - 1, -_ENDS_S)
                if self.known[last]:
                    found.append(float(not self.averted[last]))
        return np.array(found)

    def _long(self) -> list[Turn]:
        return [one for one in self.turns if one.state == _SPEAKS and one.length_s >= _LONG_S]

    def _row_after(self, row: int, later_s: float) -> int:
        return int(np.searchsorted(self.t_s, self.t_s[row] + later_s))

    def _stretches(self, role: Role) -> list[tuple[int, int]]:
        """Return the rows of a role: thinking between short turns belongs to their dialogue."""
        found = []
        for k, one in enumerate(self.turns):
            near = self.turns[max(0, k - 1) : k + 2]
            short = one.length_s < _EXCHANGE_S
            mine: Role | None = "speaking" if one.state == _SPEAKS else "listening"
            if one.state == _THINKS:
                others = [turn.length_s for turn in near if turn is not one]
                mine = "dialogue" if max(others, default=0.0) < _EXCHANGE_S else None
            elif not one.state:
                mine = None
            elif short:
                mine = "dialogue"
            if mine == role:
                found.append((one.first, one.end))
        return found


def measures(run: GazeTrace) -> list[MeasuredValue]:
    """Return the measures of a run; none if no turn was reported."""
    if not run.column("turn").any():
        return []
    looks, found = TurnLooks(run), list[MeasuredValue]()
    for role in get_args(Role):
        blocks = looks.blocks(role)
        away = blocks[:, [2, 1]] * (60.0, 1.0)
        found += [
            MeasuredValue(f"averted_{role}", blocks[:, :2], rate),
            MeasuredValue(f"aversions_{role}", away, rate),
            MeasuredValue(f"aside_{role}", looks.aside(role), mean),
        ]
    return [
        *found,
        MeasuredValue("turn_begins", looks.begins(), mean),
        MeasuredValue("turn_ends", looks.ends(), mean),
    ]


def _true_rows(mask: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return (n, 2) the first row of each run of true values, and the one after its last."""
    return np.flatnonzero(np.diff(mask.astype(int), prepend=0, append=0)).reshape(-1, 2)


def _bridge(t_s: Floats, mask: NDArray[np.bool_], value: bool) -> NDArray[np.bool_]:
    """Return a mask in which short times with a value have the other one."""
    out = mask.copy()
    for first, end in _true_rows(mask == value):
        inside = first > 0 and end < len(t_s)
        if inside and t_s[end] - t_s[first] < _BRIDGED_S:
            out[first:end] = not value
    return out
