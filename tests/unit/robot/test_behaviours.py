"""The papers' scenes through the whole robot."""

from math import degrees, dist, inf, pi, sin
from statistics import median
from typing import NamedTuple

import numpy as np
import pytest
from fakes.runs import play
from slow_rigs import slowed

from gazerig.config.schema import load_rig
from gazerig.gaze.types import Target, Vec3
from gazerig.robot.loop.tick import Tick
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.run import Run
from gazerig.robot.run.surroundings import load_scene
from gazerig.sim_mock.cameras.detections import SceneCamera
from gazerig.sim_mock.cameras.frame_times import FrameParams
from gazerig.sim_mock.scenes.scene import Event, Scene, ScenePerson, Thing, there_and_back

pytestmark = pytest.mark.usefixtures("ideal_servos")


RATE_HZ = 50.0


class Figure(NamedTuple):
    """Outcome of the events of one name.

    latency_s: median over the events seen, None without one; of an event to "look" at: time from
        its start to the first look; of one to "return" from: time of the gaze elsewhere
    share: fraction of the events' time in which the gaze was on the expected target
    """

    seen: int
    of: int
    latency_s: float | None
    share: float


class Lived:
    """A scene as a robot lived through it: its ticks, and the scene's time of each."""

    def __init__(self, made: Run, scene: Scene, seconds: float) -> None:
        self.ticks: list[Tick] = []
        self.scene = scene
        play(made, seconds, self.ticks.append)
        self.scene_s = [tick.t_s - self.ticks[0].t_s for tick in self.ticks]

    def within(self, start_s: float, end_s: float) -> list[Tick]:
        first, end = np.searchsorted(self.scene_s, (start_s, end_s))
        return self.ticks[first:end]

    def figure(self, name: str) -> Figure:
        seen, latencies_s, looks = [], [], []
        for event in self.scene.events():
            if event.name != name:
                continue
            during = self.within(event.start_s, event.end_s)
            on = [_is_on(event, tick.target) for tick in during]
            looks += on
            is_back = event.response == "return"
            seen.append(on[-1] if is_back else any(on))
            if is_back and not all(on):
                latencies_s.append(on.count(False) / RATE_HZ)
            elif not is_back and any(on):
                first_s = during[on.index(True)].t_s - self.ticks[0].t_s
                latencies_s.append(first_s - event.start_s)
        latency_s = median(latencies_s) if latencies_s else None
        return Figure(sum(seen), len(seen), latency_s, float(np.mean(looks)))


def _is_on(event: Event, target: Target) -> bool:
    away_m = dist(target.p_world_m, event.place_world_m)
    return target.kind == event.kind and away_m <= event.within_m


def made_for(scene: str) -> Run:
    return Run(
        slowed(load_rig("desk"), RATE_HZ), RunOptions(mock=True, fast=True, seed=0, scene=scene)
    )


@pytest.fixture(scope="module")
def boxing() -> Lived:
    scene = load_scene("boxing")
    return Lived(made_for("boxing"), scene, scene.round_s + 0.05)


def latency(figure: Figure) -> float:
    assert figure.seen == figure.of and figure.of
    assert figure.latency_s is not None
    return figure.latency_s


def actions(lived: Lived, start_s: float, end_s: float) -> list[str]:
    """Return what the planner chose in that time, one entry for each change."""
    chosen = [each.target.plan.partition(":")[0] for each in lived.within(start_s, end_s)]
    return [one for one, before in zip(chosen, ["", *chosen], strict=False) if one != before]


def begun(lived: Lived, action: str) -> list[float]:
    """Return when the planner has begun an action."""
    plans = [each.target.plan.partition(":")[0] for each in lived.ticks]
    changes = zip(lived.scene_s, plans, ["", *plans], strict=False)
    return [t_s for t_s, plan, before in changes if plan == action != before]


def test_e46_a_a_punch_is_looked_at_and_guarded_against_in_time_and_nothing_else(boxing):
    figure = boxing.figure("punch")
    assert figure.of == 4
    assert latency(figure) <= 0.4
    events = boxing.scene.events()
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


def test_e46_b_the_place_to_be_hit_is_looked_at_before_the_blow(boxing):
    figure = boxing.figure("attack")
    assert figure.of == 3
    assert latency(figure) < 0.5
    events = boxing.scene.events()
    punches = [one for one in events if one.name == "punch"]
    openings = [one for one in events if one.name == "attack"]
    hit = set()
    for event in openings:
        during = boxing.within(event.start_s - 1.0, event.end_s + 0.6)
        attacks = [each.target for each in during if each.target.plan.startswith("attack")]
        assert attacks and attacks[-1].kind == "attack_target"
        face = boxing.scene.people(event.start_s)[0].p_world_face_m
        hit.add(attacks[-1].p_world_m[2] < face[2] - 0.1)
    assert hit == {True, False}  # at the chest and at the face's side
    blows_s = begun(boxing, "attack")
    into_open = [
        at_s for at_s in blows_s if any(o.start_s - 0.1 <= at_s <= o.end_s for o in openings)
    ]
    assert len(into_open) == 3
    for at_s in {*blows_s} - {*into_open}:  # counter-attacks
        assert any(p.start_s <= at_s <= p.end_s + 0.6 for p in punches)


def test_e46_the_face_otherwise_a_waved_hand_and_a_feint_for_a_moment_and_who_reaches_in(boxing):
    for event, of, share, within_s in (
        ("face", None, 0.6, 0.5),
        ("wave", 2, 0.0, 0.4),
        ("step", 3, 0.6, inf),
        ("return", None, 0.0, 1.0),
        ("reach", None, 0.0, 0.5),
    ):
        figure = boxing.figure(event)
        assert figure.seen == figure.of == (of or figure.of) > 0, event
        assert figure.share >= share, event
        assert within_s == inf or latency(figure) <= within_s, event
    for reach in (one for one in boxing.scene.events() if one.name == "reach"):
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
        made = made_for("boxing")
        own, dice = made.robot.camera, np.random.default_rng(0)
        assert isinstance(own, SceneCamera)
        made.robot.camera = SceneCamera(
            FrameParams(rate_hz=15.0), scene, own._mount, own._head_pose, dice
        )
        lived = Lived(made, scene, 17.0)
        figure = lived.figure("return")
        # A hand that comes down again may be no target any more when the reaction time is over.
        assert figure.seen in seen and figure.of == 5
        assert figure.latency_s is not None  # it was drawn away
        assert 0.1 < figure.latency_s <= 1.0
        for start_s in scene.starts_s:
            during = lived.within(start_s, start_s + 1.5)
            assert sum(each.target.kind == "hand" for each in during) / RATE_HZ <= 1.0


# ---- A pinwheel that spins


PINWHEEL, SPIN_S = (0.75, 0.0, 0.06), (4.0, 7.0)
"""Place of the pinwheel of two-people, and when the wind first turns it."""


def test_e80_what_spins_draws_the_gaze_by_its_spin():
    scene, (start_s, end_s) = load_scene("two-people"), SPIN_S
    lived = Lived(made_for("two-people"), scene, end_s)
    on = [tick for tick in lived.within(start_s, end_s) if tick.target.kind == "pinwheel"]
    assert len(on) / RATE_HZ > 0.5
    first = on[0].target
    assert first.p_world_m == pytest.approx(PINWHEEL, abs=0.03)
    salience = first.saliences[0]
    assert salience.rotation > 0.2 and salience.onset > 0.2  # it has begun to spin
    assert salience.rotation > 3.0 * (salience.translation + salience.looming)
