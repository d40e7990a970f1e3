"""The gaze's responses to a scene's events, and their latencies (Mitake et al. 1 and 4).

The score uses the chosen target of every tick. So latencies include those of the camera, of
perception and of the choice, but not the duration of the saccade (50 ms and more).
An event is scored when it is over. World frame, metres, seconds.

For a hand that reaches in from outside the field of view, time starts when the angle between the
hand and straight ahead falls below half the camera's field. A head that is turned a little towards
the hand may see it earlier, one that is turned away later, by about 0.1 s for every 8 degrees.

The score of an action planner that boxes counts timely guards, false guards and attacks into open
guards. It uses ``Target.plan`` and the events of a scene: "punch", with the arrival time of the
fist, and "attack", while the opponent's guard is open.
"""

from collections.abc import Iterable
from math import dist
from statistics import median
from typing import Literal, NamedTuple

from gazerig.robot.loop.tick import Tick
from gazerig.sim_mock.scenes.scene import Event


class _EventOutcome(NamedTuple):
    """Outcome of one event.

    latency_s: "look": time from the event's start to the first look, None without one;
        "return": time of the gaze elsewhere, None if it was never drawn away
    """

    seen: bool
    latency_s: float | None
    looked_s: float
    event_s: float


class _EventObservation:
    """Observation of one event while it lasts."""

    def __init__(self) -> None:
        self._first_s: float | None = None
        self._on = False
        self._on_s = 0.0
        self._off_s = 0.0

    def update(self, on: bool, since_s: float, dt_s: float) -> None:
        """Count one tick, ``since_s`` after the event's start."""
        self._on = on
        if not on:
            self._off_s += dt_s
            return
        self._on_s += dt_s
        if self._first_s is None:
            self._first_s = since_s

    def outcome(self, response: Literal["look", "return"]) -> _EventOutcome:
        lasted_s = self._on_s + self._off_s
        if response == "return":
            away_s = self._off_s if self._off_s > 0.0 else None
            return _EventOutcome(self._on, away_s, self._on_s, lasted_s)
        return _EventOutcome(self._first_s is not None, self._first_s, self._on_s, lasted_s)


class BehaviourScore:
    """Scores a run, tick by tick."""

    def __init__(
        self,
        events: Iterable[Event],
        round_s: float,
    ) -> None:
        self._events = tuple(events)
        self._round_s = round_s
        self._observations: dict[int, _EventObservation] = {}
        self._outcomes: dict[str, list[_EventOutcome]] = {event.name: [] for event in self._events}
        self._first_s: float | None = None
        self._last_s = 0.0
        self._round = 0

    def update(self, tick: Tick) -> None:
        """Count one tick; the first one is the start of the scene."""
        if self._first_s is None:
            self._first_s = self._last_s = tick.t_s
        dt_s, self._last_s = tick.t_s - self._last_s, tick.t_s
        number, phase_s = divmod(tick.t_s - self._first_s, self._round_s)
        if number != self._round:
            self._round = int(number)
            for i in tuple(self._observations):
                self._close_event(i)
        for i, event in enumerate(self._events):
            if event.start_s <= phase_s < event.end_s:
                watch, target = self._observations.setdefault(i, _EventObservation()), tick.target
                away_m = dist(target.p_world_m, event.place_world_m)
                on = target.kind == event.kind and away_m <= event.within_m
                watch.update(on, phase_s - event.start_s, dt_s)
            elif i in self._observations:
                self._close_event(i)

    def _close_event(self, i: int) -> None:
        """Record the outcome of an event."""
        event = self._events[i]
        outcome = self._observations.pop(i).outcome(event.response)
        self._outcomes[event.name].append(outcome)

    def figures(self) -> dict[str, dict[str, float | int | None]]:
        """Return for each name the number of events, the number seen, and statistics.

        latency_s: median over the events seen (away: over those that drew the gaze away)
        share: fraction of the events' time in which the gaze was on the expected target
        """
        return {name: _outcome_figures(answers) for name, answers in self._outcomes.items()}


def _outcome_figures(outcomes: list[_EventOutcome]) -> dict[str, float | int | None]:
    latencies = [answer.latency_s for answer in outcomes if answer.latency_s is not None]
    lasted_s = sum(answer.event_s for answer in outcomes)
    return {
        "seen": sum(answer.seen for answer in outcomes),
        "of": len(outcomes),
        "latency_s": round(median(latencies), 4) if latencies else None,
        "share": round(sum(a.looked_s for a in outcomes) / lasted_s, 4) if lasted_s > 0.0 else None,
    }


_LATE_S = 0.3
"""Time after a punch within which a new guard is late, not false."""
_COUNTER_S = 0.6
"""Time after the end of a punch within which a new attack is a counter-attack."""


class _Attack(NamedTuple):
    start_s: float
    looked: bool


_Time = tuple[float, float, float]
"""Start and end of an event, and the latest time of an answer to it."""


class PlannerScore:
    """Scores a planner, tick by tick; the first tick is the start of a round."""

    def __init__(
        self,
        events: Iterable[Event],
        round_s: float,
    ) -> None:
        self._events, self._round_s = tuple(events), round_s
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

        guards_in_time, punches: number of punches that met a guard at arrival, and of all punches
        lead_ms: median time between the start of those guards and the arrival of the fist
        false_guards_per_min: guards without a punch
        attacks, open, counters: attacks begun; those into an open guard; those after a punch
        looked_at: attacks during which the gaze was on the attacked place
        """
        if not self._guards and not self._attacks:
            return {}
        # Lead of the guard over the fist, for all punches that are over.
        leads, punches = [], 0
        thrown, openings = self._event_times("punch"), self._event_times("attack")
        for _, end_s, due_s in thrown:
            if end_s > self._last_s:
                continue
            punches += 1
            # One tick before its end counts as its end.
            in_force = [at_s for at_s, end_s in self._guards if at_s <= due_s <= end_s + 0.05]
            if in_force:
                leads.append(due_s - max(in_force))
        false = sum(not _is_during(at_s, thrown, 0.0, _LATE_S) for at_s, _ in self._guards)
        opens = sum(_is_during(one.start_s, openings, 0.1, 0.0) for one in self._attacks)
        counters = sum(_is_during(one.start_s, thrown, 0.0, _COUNTER_S) for one in self._attacks)
        return {
            "punches": punches,
            "guards_in_time": len(leads),
            "lead_ms": round(1e3 * median(leads), 1) if leads else None,
            "false_guards_per_min": round(60.0 * false / max(self._last_s, 1e-9), 2),
            "attacks": len(self._attacks),
            "open": opens,
            "counters": counters,
            "looked_at": sum(one.looked for one in self._attacks),
        }

    def _event_times(self, name: str) -> list[_Time]:
        rounds = range(int(self._last_s // self._round_s) + 1)
        return [
            _time(event, self._round_s * number)
            for number in rounds
            for event in self._events
            if event.name == name
        ]


def _time(event: Event, after_s: float) -> _Time:
    due_s = event.end_s if event.due_s is None else event.due_s
    return after_s + event.start_s, after_s + event.end_s, after_s + due_s


def _is_during(at_s: float, times: Iterable[_Time], before_s: float, after_s: float) -> bool:
    return any(start - before_s <= at_s <= end + after_s for start, end, _ in times)
