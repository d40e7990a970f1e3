"""Scenes of several people, and a pinwheel that spins: what they hold, and what the gaze does."""

from collections import Counter
from dataclasses import replace
from math import dist

import numpy as np
import pytest
from test_behaviours import Lived, made_for

from gazerig.config.schema import load_rig
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.scene_files import load_scene
from gazerig.sim_mock.scenes.scene import Scene

pytestmark = pytest.mark.usefixtures("ideal_servos")

ARRIVES_S, LEAVES_S = 6.0, 55.0
"""Arrival and departure of the third person of three-people."""
PINWHEEL, SPIN_S = (0.75, 0.0, 0.06), (4.0, 7.0)
"""Place of the pinwheel of two-people, and when the wind first turns it."""


def watched(scene: Scene, lived: Lived, start_s: float, end_s: float) -> dict[str, float]:
    """Return the share of time for which each person and kind of thing is looked at."""
    found: Counter[str] = Counter()
    for t_s, tick in zip(lived.scene_s, lived.ticks, strict=True):
        if start_s <= t_s < end_s:
            name, people = tick.target.kind, scene.people(t_s)
            if name == "face":
                away = [dist(p.p_world_face_m, tick.target.p_world_m) for p in people]
                name = f"person {int(np.argmin(away))}"
            found[name] += 1
    total = sum(found.values())
    return {name: count / total for name, count in found.items()}


def test_e79_among_three_people_all_are_looked_at_and_keep_their_identities() -> None:
    scene = load_scene("three-people")
    lived = Lived(made_for("three-people", 0, 50.0), scene, 45.0)
    shares = watched(scene, lived, ARRIVES_S, min(45.0, LEAVES_S))
    assert min(shares[f"person {k}"] for k in range(3)) > 0.08
    assert sum(shares[f"person {k}"] for k in range(3)) > 0.8
    ids = {face.id for tick in lived.ticks if tick.percept for face in tick.percept.faces}
    assert len(ids) <= 4


def test_e80_what_spins_draws_the_gaze_by_its_spin() -> None:
    rig = load_rig("desk")
    rig = replace(rig, loop=replace(rig.loop, rate_hz=50.0))
    scene, (start_s, end_s) = load_scene("two-people"), SPIN_S
    made = assemble(rig, RunOptions(mock=True, fast=True, seed=0, scene="two-people"))
    lived = Lived(made, scene, end_s)
    on = [tick for tick in lived.within(start_s, end_s) if tick.target.kind == "pinwheel"]
    assert len(on) / 50.0 > 0.5
    first = on[0].target
    assert first.p_world_m == pytest.approx(PINWHEEL, abs=0.03)
    salience = first.saliences[0]
    assert salience.rotation > 0.2 and salience.onset > 0.2  # it has begun to spin
    assert salience.rotation > 3.0 * (salience.translation + salience.looming)
