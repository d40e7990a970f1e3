"""The papers' scenes through the whole robot."""

from collections.abc import Iterable
from dataclasses import replace
from math import degrees, dist, inf, pi, sin
from statistics import median
from typing import Any, Literal, NamedTuple

import numpy as np
import pytest
from fakes.runs import play

from gazerig.config.schema import load_rig
from gazerig.gaze.types import Vec3
from gazerig.robot.loop.tick import Tick
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.run import Run
from gazerig.robot.run.surroundings import load_scene
from gazerig.sim_mock.cameras.detections import SceneCamera
from gazerig.sim_mock.cameras.frame_times import FrameParams
from gazerig.sim_mock.scenes.scene import Event, Scene, ScenePerson, Thing, there_and_back


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


pytestmark = pytest.mark.usefixtures("ideal_servos")

FACE: Vec3 = (1.0, 0.0, 0.2)
HAND: Vec3 = (0.7, 0.2, 0.1)


class Lived:
    """A scene as a robot lived through it: its ticks, and the scene's time of each."""

    def __init__(self, made: Run, scene: Scene, seconds: float) -> None:
        self.score = BehaviourScore(scene.events(), scene.round_s)
        self.scene_s: list[float] = []
        self.ticks: list[Tick] = []
        self._scene = scene
        play(made, seconds, self._watch)

    def _watch(self, new: Tick) -> None:
        self.ticks.append(new)
        self.scene_s.append(new.t_s - self.ticks[0].t_s)
        self.score.update(new)

    def within(self, start_s: float, end_s: float) -> list[Tick]:
        pairs = zip(self.scene_s, self.ticks, strict=True)
        return [each for t_s, each in pairs if start_s <= t_s < end_s]


def made_for(scene: str, seed: int = 0, rate_hz: float = 200.0) -> Run:
    rig = load_rig("desk")
    rig = replace(rig, loop=replace(rig.loop, rate_hz=rate_hz))
    return Run(rig, RunOptions(mock=True, fast=True, seed=seed, scene=scene))


@pytest.fixture(scope="module")
def boxing() -> Lived:
    scene = load_scene("boxing")
    return Lived(made_for("boxing", 0, 50.0), scene, scene.round_s + 0.05)


def latency(figure: dict[str, float | int | None]) -> float:
    assert figure["seen"] == figure["of"] and figure["of"]
    assert isinstance(figure["latency_s"], float)
    return figure["latency_s"]


def actions(lived: Lived, start_s: float, end_s: float) -> list[str]:
    """Return what the planner chose in that time, one entry for each change."""
    chosen = [each.target.plan.partition(":")[0] for each in lived.within(start_s, end_s)]
    return [one for one, before in zip(chosen, ["", *chosen], strict=False) if one != before]


def begun(lived: Lived, action: str) -> list[float]:
    """Return when the planner has begun an action."""
    plans = [each.target.plan.partition(":")[0] for each in lived.ticks]
    changes = zip(lived.scene_s, plans, ["", *plans], strict=False)
    return [t_s for t_s, plan, before in changes if plan == action != before]


def test_e46_a_a_punch_is_looked_at_and_guarded_against_in_time_and_nothing_else(boxing: Lived):
    figure = boxing.score.figures()["punch"]
    assert figure["of"] == 4
    assert latency(figure) <= 0.4
    events = boxing._scene.events()
    punches = [one for one in events if one.name == "punch"]
    for event in punches:
        arrives_s = event.start_s + 0.25
        assert actions(boxing, event.start_s, arrives_s)[-1] == "guard"
        at_contact = boxing.within(arrives_s, arrives_s + 0.02)[0].target
        assert at_contact.kind == "hand"
        assert "guard: hand" in at_contact.plan and "arrives in" in at_contact.plan
    guards = begun(boxing, "guard")
    arrivals = [one.end_s if one.due_s is None else one.due_s for one in punches]
    leads_s = [at_s - max(one for one in guards if one <= at_s) for at_s in arrivals]
    assert len(leads_s) == 4 and max(leads_s) < 0.6 and np.median(leads_s) > 0.03
    # A guard that is late is not false.
    assert all(any(p.start_s <= at_s <= p.end_s + 0.3 for p in punches) for at_s in guards)
    for event in events:
        if event.name in ("wave", "return", "reach", "step"):
            assert actions(boxing, event.start_s, event.end_s) == ["wait"], event


def test_e46_b_the_place_to_be_hit_is_looked_at_before_the_blow(boxing: Lived):
    figure = boxing.score.figures()["attack"]
    assert figure["of"] == 3
    assert latency(figure) < 0.5
    events = boxing._scene.events()
    punches = [one for one in events if one.name == "punch"]
    openings = [one for one in events if one.name == "attack"]
    hit = set()
    for event in openings:
        during = boxing.within(event.start_s - 1.0, event.end_s + 0.6)
        attacks = [each.target for each in during if each.target.plan.startswith("attack")]
        assert attacks and attacks[-1].kind == "attack_target"
        face = boxing._scene.people(event.start_s)[0].p_world_face_m
        hit.add(attacks[-1].p_world_m[2] < face[2] - 0.1)
    assert hit == {True, False}  # at the chest and at the face's side
    blows_s = begun(boxing, "attack")
    into_open = [
        at_s for at_s in blows_s if any(o.start_s - 0.1 <= at_s <= o.end_s for o in openings)
    ]
    assert len(into_open) == 3
    for at_s in {*blows_s} - {*into_open}:  # counter-attacks
        assert any(p.start_s <= at_s <= p.end_s + 0.6 for p in punches)


def test_e46_the_face_otherwise_a_waved_hand_and_a_feint_for_a_moment_and_who_reaches_in(
    boxing: Lived,
):
    for event, of, share, within_s in (
        ("face", None, 0.6, 0.5),
        ("wave", 2, 0.0, 0.4),
        ("step", 3, 0.6, inf),
        ("return", None, 0.0, 1.0),
        ("reach", None, 0.0, 0.5),
    ):
        figure: Any = boxing.score.figures()[event]
        assert figure["seen"] == figure["of"] == (of or figure["of"]) > 0, event
        assert figure["share"] >= share, event
        assert within_s == inf or latency(figure) <= within_s, event
    for reach in (one for one in boxing._scene.events() if one.name == "reach"):
        side = 1.0 if reach.place_world_m[1] > 0.0 else -1.0
        before, *_, last = boxing.within(reach.start_s, reach.end_s)
        assert side * degrees(last.pose.head_rad[0] - before.pose.head_rad[0]) > 1.5


class Distracted:
    """A still person, and next to it a raised hand that moves for 0.3 s now and then."""

    name = "distracted"
    round_s = 20.0
    behaviours: tuple[str, ...] = ("wait",)
    starts_s = (3.0, 6.0, 9.0, 12.0, 15.0)

    def __init__(self, way_m: Vec3) -> None:
        self._way_m = way_m

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        return (ScenePerson((1.0, 0.01 * sin(t_s), 0.22), (pi, 0.0), None),)

    def things(self, t_s: float) -> tuple[Thing, ...]:
        moved = sum(there_and_back(t_s - start_s, 0.15, 0.0, 0.15) for start_s in self.starts_s)
        x, y, z = (a + moved * b for a, b in zip((0.8, 0.2, 0.2), self._way_m, strict=True))
        return (Thing(0, "hand", (x, y, z), 0.06),)

    def events(self) -> tuple[Event, ...]:
        return tuple(
            Event("return", "return", "face", s, s + 1.5, (1.0, 0.0, 0.22), 0.5)
            for s in self.starts_s
        )


def test_e48_back_on_the_face_within_a_second_of_a_distraction():
    for way_m, seen in (((0.0, 0.2, 0.0), (5,)), ((0.0, 0.0, 0.15), (3, 4, 5))):
        scene = Distracted(way_m)
        made = made_for("boxing", rate_hz=50.0)
        own, dice = made.robot.camera, np.random.default_rng(0)
        assert isinstance(own, SceneCamera)
        made.robot.camera = SceneCamera(
            FrameParams(rate_hz=15.0), scene, own._mount, own._head_pose, dice
        )
        lived = Lived(made, scene, 17.0)
        figure = lived.score.figures()["return"]
        # A hand that comes down again may be no target any more when the reaction time is over.
        assert figure["seen"] in seen and figure["of"] == 5
        assert isinstance(figure["latency_s"], float)  # it was drawn away
        assert 0.1 < figure["latency_s"] <= 1.0
        for start_s in scene.starts_s:
            during = lived.within(start_s, start_s + 1.5)
            assert sum(each.target.kind == "hand" for each in during) / 50.0 <= 1.0


# ---- A pinwheel that spins


PINWHEEL, SPIN_S = (0.75, 0.0, 0.06), (4.0, 7.0)
"""Place of the pinwheel of two-people, and when the wind first turns it."""


def test_e80_what_spins_draws_the_gaze_by_its_spin():
    scene, (start_s, end_s) = load_scene("two-people"), SPIN_S
    lived = Lived(made_for("two-people", 0, 50.0), scene, end_s)
    on = [tick for tick in lived.within(start_s, end_s) if tick.target.kind == "pinwheel"]
    assert len(on) / 50.0 > 0.5
    first = on[0].target
    assert first.p_world_m == pytest.approx(PINWHEEL, abs=0.03)
    salience = first.saliences[0]
    assert salience.rotation > 0.2 and salience.onset > 0.2  # it has begun to spin
    assert salience.rotation > 3.0 * (salience.translation + salience.looming)
