"""Rooms and people in MuJoCo: what is there, how much it is, and that a hand can push the head."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from world_rigs import load_rig, mujoco_or_skip
from world_scripts import WORLDS, shipped_world

mujoco = mujoco_or_skip()

from gazerig.features.world.figure import SEGMENTS, Figures  # noqa: E402
from gazerig.features.world.figure_model import PeoplePlacer, add_people  # noqa: E402
from gazerig.features.world.model import world_model  # noqa: E402
from gazerig.features.world.room import ROOMS  # noqa: E402
from gazerig.features.world.room_model import add_room  # noqa: E402
from gazerig.features.world.room_paint import PICTURES, texture  # noqa: E402
from gazerig.features.world.run.run_world import rig_in_world  # noqa: E402

_BETWEEN_M = 0.03
"""Shapes that collide are a little larger than what is seen; hands may touch."""


@cache
def built(name: str) -> tuple[Any, Figures]:
    figures = Figures(shipped_world(name), 1)
    spec = mujoco.MjSpec()
    add_room(spec, figures.script)
    add_people(spec, figures)
    return spec.compile(), figures


def owner(model: Any, geom: int) -> str:
    return str(model.body(int(model.geom_bodyid[geom])).name)


@pytest.mark.parametrize("name", WORLDS)
def test_a_room_is_made_of_few_pieces_and_a_person_of_few_triangles(name: str) -> None:
    model, figures = built(name)
    pieces = [i for i in range(model.ngeom) if owner(model, i) == "room"]
    assert 20 <= len(pieces) <= 60
    people = len(figures.script.people)
    assert model.nmeshface <= 15_500 * people
    for who in figures.script.people:
        for segment in SEGMENTS:
            assert model.body_mocapid[model.body(f"{who}/{segment}").id] >= 0


@pytest.mark.parametrize("name", WORLDS)
def test_people_stay_out_of_the_furniture_and_of_each_other(name: str) -> None:
    model, figures = built(name)
    data = mujoco.MjData(model)
    people = PeoplePlacer(model, figures)
    owners = [owner(model, i) for i in range(model.ngeom)]
    solid = [i for i in range(model.ngeom) if model.geom_contype[i] and "/" in owners[i]]
    room = [i for i in range(model.ngeom) if owners[i] == "room"]
    whose = np.array([one.split("/")[0] for one in owners])
    bound = model.geom_rbound
    half_m = 3.4 if figures.script.room == "hall" else 2.6
    for t_s in np.arange(0.3, figures.script.round_s, 1.31).tolist():
        people.place(data, t_s)
        mujoco.mj_kinematics(model, data)
        seen = [i for i in solid if abs(data.geom_xpos[i, 1]) < half_m]
        for k, one in enumerate(seen):
            others = np.array([*room, *seen[:k]])
            others = others[whose[others] != whose[one]]
            apart = np.linalg.norm(data.geom_xpos[others] - data.geom_xpos[one], axis=1)
            for other in others[apart < bound[one] + bound[others]].tolist():
                found = mujoco.mj_geomDistance(model, data, one, other, 0.1, None)
                names = owners[one], owners[other], t_s
                assert found > -_BETWEEN_M or "hand" in names[0] + names[1], names


def test_a_hand_that_pushes_the_head_turns_the_neck() -> None:
    figures = Figures(shipped_world("crowd"), 1)
    model = world_model(figures, [rig_in_world(load_rig("desk"), looks=False)]).mj
    data, people = mujoco.MjData(model), PeoplePlacer(model, figures)
    pitch = int(model.jnt_qposadr[model.joint("rig_neck_pitch").id])
    # A neck that is held softly.
    for joint in range(model.njnt):
        model.jnt_stiffness[joint] = 3.0
        model.dof_damping[model.jnt_dofadr[joint]] = 0.05
    (push,) = [one for one in figures.timelines["tim"] if one.act.do == "push"]
    angles = []
    for ms in range(round(1000.0 * (push.end_s - push.start_s)) + 600):
        if ms % 4 == 0:
            people.place(data, push.start_s - 0.1 + ms / 1000.0)
        mujoco.mj_step(model, data)
        angles.append(float(np.degrees(data.qpos[pitch])))
    pushed = int(np.argmax(angles))
    assert angles[pushed] > 4.0, "the head gives way to the back"
    assert pushed > 500 and abs(angles[-1]) < 3.0


def test_pictures_on_walls_have_something_to_see() -> None:
    for name in PICTURES:
        image = texture(name)
        assert image.dtype == np.uint8 and image.shape[2] == 3
        assert image.reshape(-1, 3).std(axis=0).max() > 1.0, name
    assert set(ROOMS) == {"living-room", "gym", "hall"}
