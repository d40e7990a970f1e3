"""Several standing people, seen by the whole robot: no one is left out."""

from collections.abc import Sequence
from dataclasses import replace
from math import atan2, cos, pi, sin

import numpy as np
import pytest
from attention_scene import NO_STAYS
from fakes.runs import play, simulated
from fakes.scenes import EmptyScene

from gazerig.config.schema import load_rig
from gazerig.drivers.types import Camera
from gazerig.gaze.attention.habituation import Habituation, HabituationParams
from gazerig.gaze.types import Vec3
from gazerig.robot.loop.tick import Tick
from gazerig.sim_mock.cameras.detections import SceneCamera
from gazerig.sim_mock.cameras.frame_times import FrameParams
from gazerig.sim_mock.scenes.faces_scene import HEAD_M
from gazerig.sim_mock.scenes.scene import ScenePerson

SETTLED = 100
"""Ticks of the first 2 s."""


class StillPeople(EmptyScene):
    """People on an arc before the robot, who look at it and hardly move."""

    name = "still-people"
    round_s = 3600.0

    def __init__(self, away_m: Sequence[float]) -> None:
        aside = np.radians(np.linspace(22.0, -22.0, len(away_m)))
        self._places = [(d * cos(a), d * sin(a), 0.16) for d, a in zip(away_m, aside, strict=True)]

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return all of them; each sways at a phase of its own."""
        return tuple(
            ScenePerson(
                (x + HEAD_M[0], y + 0.004 * sin(2 * pi * 0.2 * t_s + 1.7 * k), z),
                (atan2(-y, -x), 0.0),
                None,
            )
            for k, (x, y, z) in enumerate(self._places)
        )


def looked_at(scene: StillPeople, seconds: float, seed: int) -> np.ndarray:
    """Return the number of the person looked at in each tick, -1 for no person; 50 a second."""

    def before(own: Camera) -> Camera:
        assert isinstance(own, SceneCamera)
        rng = np.random.default_rng(seed)
        return SceneCamera(
            FrameParams(rate_hz=15.0), scene, own._mount, own._head_pose, rng, own._locate
        )

    rig = load_rig("desk")
    rig = replace(rig, loop=replace(rig.loop, rate_hz=50.0))
    made = simulated(rig, seed=seed, bus="ideal")
    made.robot.camera = before(made.robot.camera)
    ticks: list[Tick] = []
    play(made, seconds, ticks.append)
    places = [person.p_world_face_m for person in scene.people(0.0)]
    return np.array([_person(tick.target.kind, tick.target.p_world_m, places) for tick in ticks])


def _person(kind: str, place: Vec3, places: Sequence[Vec3]) -> int:
    if kind != "face":
        return -1
    first, *others = (one / np.linalg.norm(one) for one in np.subtract([place, *places], HEAD_M))
    return int(np.argmax(others @ first))


def gaps_s(looks: np.ndarray, people: int) -> list[float]:
    """Return for each person the longest time without a look, the run's ends included."""
    out = []
    for k in range(people):
        on = np.concatenate(([-1], np.flatnonzero(looks == k), [len(looks)]))
        out.append(float(np.diff(on).max()) / 50.0)
    return out


@pytest.mark.usefixtures("ideal_servos")
def test_e88_everybody_of_six_is_looked_at_again_and_again():
    looks = looked_at(StillPeople([1.6] * 6), 30.0, 0)[SETTLED:]
    share = np.bincount(looks[looks >= 0], minlength=6) / np.count_nonzero(looks >= 0)
    assert 6.0 * share.min() >= 0.6 and 6.0 * share.max() <= 1.5
    assert max(gaps_s(looks, 6)) < 15.0
    a_second = 50.0 * np.count_nonzero(np.diff(looks[looks >= 0])) / len(looks)
    assert 0.2 <= a_second <= 1.0 and np.mean(looks >= 0) >= 0.75


def sharing() -> Habituation:
    return Habituation(HabituationParams(), NO_STAYS)


def test_surpluses_grow_with_the_looks_and_are_those_over_the_one_looked_at_least():
    shared, three = sharing(), dict.fromkeys((1, 2, 3), 1.0)
    assert shared.surpluses(three, -1, 0.0) == {1: 0.0, 2: 0.0, 3: 0.0}
    assert shared.surpluses(three, 2, 0.5) == pytest.approx({1: 0.0, 2: 0.5, 3: 0.0})
    # A new person is behind no one; the heaviest of similar ones comes first.
    assert shared.surpluses({2: 0.5, 4: 1.0}, 4, 0.5)[4] == 0.0
    found = shared.surpluses({1: 1.0, 2: 0.5, 4: 1.0}, 1, 0.9)
    assert found[4] == 0.0 and found[1] == pytest.approx(0.4) and 0.45 < found[2] < 0.5


def test_a_look_at_a_body_of_half_the_weight_counts_twice():
    shared, two = sharing(), {1: 1.0, 2: 0.5}
    shared.surpluses(two, -1, 0.0)
    shared.surpluses(two, 1, 1.0)
    assert shared.surpluses(two, 2, 1.5)[1] == pytest.approx(0.0, abs=0.1)


def test_surpluses_are_bounded_fade_and_are_forgotten():
    shared, three = sharing(), dict.fromkeys((1, 2, 3), 1.0)
    for k in range(100):
        found = shared.surpluses(three, 1, 0.5 * k)
    assert found == {1: 8.0, 2: 0.0, 3: 0.0}
    assert 0.0 < shared.surpluses(three, -1, 60.0)[1] < 3.0
    shared.reset(60.0)
    assert shared.surpluses(three, -1, 60.0) == {1: 0.0, 2: 0.0, 3: 0.0}
