"""Score of an action planner that boxes: guards in time, false guards, attacks into open guards.

Judged by ``Target.plan`` tick by tick, against what truly happened: the events "punch" of a scene,
each with the time at which the fist arrives, and "attack", while the opponent's guard is open.
Times in seconds from the beginning of a round.
"""

from collections.abc import Iterable
from statistics import median
from typing import NamedTuple, Protocol

from gazerig.robot.control.tick import Tick

_LATE_S = 0.3
"""A guard that begins so soon after a punch is late, not false."""
_COUNTER_S = 0.6
"""An attack that begins so soon after the end of a punch answers it."""


class Bout(Protocol):
    """An event of a boxing match; due_s: when the fist of a punch arrives."""

    @property
    def name(self) -> str:
        """Return "punch", "attack" or something else."""
        ...

    @property
    def start_s(self) -> float:
        """Return its beginning."""
        ...

    @property
    def end_s(self) -> float:
        """Return its end."""
        ...

    @property
    def due_s(self) -> float | None:
        """Return by when it must be answered, None: by its end."""
        ...


class _Attack(NamedTuple):
    start_s: float
    looked: bool


class PlannerScore:
    """Scores a planner, tick by tick; the first tick is the beginning of a round."""

    def __init__(self, events: Iterable[Bout], round_s: float) -> None:
        events = tuple(events)
        self._punches = tuple(event for event in events if event.name == "punch")
        self._openings = tuple(event for event in events if event.name == "attack")
        self._round_s = round_s
        self._first_s: float | None = None
        self._last_s = 0.0
        self._action = ""
        self._guards: list[tuple[float, float]] = []
        self._attacks: list[_Attack] = []

    def update(self, tick: Tick) -> None:
        """Count one tick."""
        if self._first_s is None:
            self._first_s = tick.t_s
        self._last_s = now_s = tick.t_s - self._first_s
        before, self._action = self._action, tick.target.plan.partition(":")[0]
        if self._action == "guard":
            start_s = self._guards.pop()[0] if before == "guard" else now_s
            self._guards.append((start_s, now_s))
        elif self._action == "attack":
            start_s, looked = self._attacks.pop() if before == "attack" else (now_s, False)
            looked = looked or tick.target.kind == "attack_target"
            self._attacks.append(_Attack(start_s, looked))

    def figures(self) -> dict[str, float | int | None]:
        """Return the score; an empty dict if nothing was planned.

        guards_in_time, punches: how many punches met a guard when the fist arrived, of how many
        lead_ms: median time by which those guards began before that
        false_guards_per_min: guards against no punch
        attacks, open, counters: attacks begun, of those into an open guard, and after a punch
        looked_at: attacks in which the place was looked at
        """
        if not self._guards and not self._attacks:
            return {}
        answered = [self._lead_s(punch, start) for start, punch in self._rounds(self._punches)]
        leads = [lead for lead in answered if lead is not None]
        false = sum(not self._during(at_s, self._punches, 0.0, _LATE_S) for at_s, _ in self._guards)
        opens = sum(self._during(one.start_s, self._openings, 0.1, 0.0) for one in self._attacks)
        counters = sum(
            self._during(one.start_s, self._punches, 0.0, _COUNTER_S) for one in self._attacks
        )
        return {
            "punches": len(answered),
            "guards_in_time": len(leads),
            "lead_ms": round(1e3 * median(leads), 1) if leads else None,
            "false_guards_per_min": round(60.0 * false / max(self._last_s, 1e-9), 2),
            "attacks": len(self._attacks),
            "open": opens,
            "counters": counters,
            "looked_at": sum(one.looked for one in self._attacks),
        }

    def _rounds(self, events: tuple[Bout, ...]) -> list[tuple[float, Bout]]:
        """Return the beginning of the round and the event, for all events that are over."""
        rounds = range(int(self._last_s // self._round_s) + 1)
        starts = [self._round_s * number for number in rounds]
        return [(s, e) for s in starts for e in events if s + e.end_s <= self._last_s]

    def _lead_s(self, punch: Bout, round_start_s: float) -> float | None:
        """Return by how much a guard came before the fist, None where none did."""
        due_s = round_start_s + (punch.end_s if punch.due_s is None else punch.due_s)
        # A tick before it is over is as good as its end.
        in_force = [start for start, end in self._guards if start <= due_s <= end + 0.05]
        return due_s - max(in_force) if in_force else None

    def _during(
        self, at_s: float, events: tuple[Bout, ...], before_s: float, after_s: float
    ) -> bool:
        """Return whether a time is within an event, or near one."""
        phase_s = at_s % self._round_s
        return any(e.start_s - before_s <= phase_s <= e.end_s + after_s for e in events)
