"""Several standing people: each is looked at for a time that follows from salience."""

from collections.abc import Sequence
from dataclasses import replace
from math import atan2, cos, dist, pi, sin

import numpy as np
from fakes.scenes import EmptyScene

from gazerig.config.schema import load_rig
from gazerig.drivers.types import Camera
from gazerig.gaze.types import Vec3
from gazerig.robot.app.assemble import Substitutes, assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import Tick, run
from gazerig.sim_mock.cameras.detections import SceneCamera, SceneCameraParams
from gazerig.sim_mock.scenes.faces_scene import HEAD_M
from gazerig.sim_mock.scenes.scene import ScenePerson

_SETTLED_S = 2.0
UNLIKE_M = (2.4, 1.0, 3.2, 0.75, 1.8, 1.35)
"""How far people are away from the left to the right."""

WANTED = {
    "six alike: least share over fair share": (0.6, 1.0),
    "six alike: most share over fair share": (1.0, 1.5),
    "six alike: longest time without a look, s": (0.0, 15.0),
    "four alike: least share over fair share": (0.6, 1.0),
    "four alike: longest time without a look, s": (0.0, 15.0),
    "six unlike: correlation of share and salience": (0.8, 1.0),
    "six unlike: least share over that of salience": (0.5, 1.2),
    "six unlike: longest time without a look, s": (0.0, 15.0),
    "six alike: looks a second": (0.2, 1.0),
    "six alike: time on faces, %": (75.0, 100.0),
}


class StillPeople(EmptyScene):
    """People on an arc before the robot, who look at it and hardly move."""

    name = "still-people"
    round_s = 3600.0

    def __init__(self, away_m: Sequence[float]) -> None:
        aside = np.radians(np.linspace(22.0, -22.0, len(away_m)))
        self.away_m = tuple(away_m)
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
        return SceneCamera(SceneCameraParams(), scene, own._mount, own._head_pose, rng, own._locate)

    rig = load_rig("desk")
    rig = replace(rig, loop=replace(rig.loop, rate_hz=50.0))
    options = RunOptions(mock=True, fast=True, seed=seed, scene="visitor", bus="ideal")
    made = assemble(rig, options, Substitutes(camera=before))
    ticks: list[Tick] = []
    made.robot.start(made.clock)
    run(made.robot, made.clock, made.loop, lambda s: "end" if s > seconds else None, ticks.append)
    places = [person.p_world_face_m for person in scene.people(0.0)]
    return np.array([_person(tick.target.kind, tick.target.p_world_m, places) for tick in ticks])


def _person(kind: str, place: Vec3, places: Sequence[Vec3]) -> int:
    if kind != "face":
        return -1
    return int(np.argmin([_apart(place, one) for one in places]))


def _apart(a: Vec3, b: Vec3) -> float:
    """Return how far two places are apart as seen from the head, the distance counting little."""
    rel = [np.subtract(one, HEAD_M) for one in (a, b)]
    return dist(*[one / np.linalg.norm(one) for one in rel])


def gaps_s(looks: np.ndarray, people: int) -> list[float]:
    """Return for each person the longest time without a look, the run's ends included."""
    out = []
    for k in range(people):
        on = np.concatenate(([-1], np.flatnonzero(looks == k), [len(looks)]))
        out.append(float(np.diff(on).max()) / 50.0)
    return out


def figures(name: str, away_m: Sequence[float], seconds: float, seeds: int) -> dict[str, float]:
    """Return the figures of people at these distances; names begin with ``name``."""
    scene, n = StillPeople(away_m), len(away_m)
    runs = [looked_at(scene, seconds, seed)[round(50 * _SETTLED_S) :] for seed in range(seeds)]
    counts = np.mean([np.bincount(one[one >= 0], minlength=n) for one in runs], axis=0)
    share = counts / counts.sum()
    # As `nearness` has it: with the root of the distance.
    salience = np.array(away_m) ** -0.5
    fair = salience / salience.sum()
    looks = np.mean([np.count_nonzero(np.diff(one[one >= 0])) / len(one) for one in runs])
    found = {
        "least share over fair share": share.min() * n,
        "most share over fair share": share.max() * n,
        "longest time without a look, s": max(max(gaps_s(one, n)) for one in runs),
        "looks a second": 50.0 * float(looks),
        "time on faces, %": 100.0 * float(np.mean([(one >= 0).mean() for one in runs])),
    }
    if len(set(away_m)) > 1:
        found["correlation of share and salience"] = float(np.corrcoef(share, salience)[0, 1])
        found["least share over that of salience"] = float((share / fair).min())
    return {f"{name}: {key}": float(value) for key, value in found.items()}


def measure(full: bool) -> dict[str, float]:
    """Return the figures; full: over a minute and four seeds."""
    seconds, seeds = (62.0, 4) if full else (32.0, 1)
    return {
        **figures("six alike", [1.6] * 6, seconds, seeds),
        **figures("four alike", [1.2] * 4, seconds, seeds),
        **figures("six unlike", UNLIKE_M, seconds, seeds),
    }
