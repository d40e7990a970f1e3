"""People of a world keep out of its furniture and of each other."""

from typing import Any

import numpy as np
import pytest
from world_scripts import WORLDS, shipped_world

from gazerig.features.world.figure import Figures

_BETWEEN_M = 0.03
"""Shapes that collide are a little larger than what is seen; hands may touch."""


def owner(model: Any, geom: int) -> str:
    return str(model.body(int(model.geom_bodyid[geom])).name)


@pytest.mark.parametrize("name", WORLDS)
def test_people_stay_out_of_the_furniture_and_of_each_other(mujoco: Any, name: str) -> None:
    from gazerig.features.world.figure_model import PeoplePlacer, add_people
    from gazerig.features.world.room_model import add_room

    figures = Figures(shipped_world(name), 1)
    spec = mujoco.MjSpec()
    add_room(spec, figures.script)
    add_people(spec, figures)
    model = spec.compile()
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
