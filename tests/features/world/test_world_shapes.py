"""The page's shapes of a world: all of its geoms in place, its people, and no rig."""

import pickle
from collections.abc import Sequence
from functools import cache

import numpy as np
import pytest

from gazerig.config.load import shipped_path
from gazerig.features.world.room import HOME
from gazerig.features.world.run.run_world import world_scene
from gazerig.features.world.shapes import SpecShapes
from gazerig.robot.dashboard.feed.world_shapes import WorldPart
from gazerig.robot.description.mesh import Painted, TexturedMesh

pytestmark = pytest.mark.usefixtures("mujoco")
WORLDS = sorted(
    path.stem for path in shipped_path("worlds", "living-room", HOME).parent.glob("*.yaml")
)
HEAD_TRIANGLES = 31_000  # of the expressive rig's
MOST_TRIANGLES, MOST_BYTES = 150_000, 3_000_000


@cache
def shapes(world: str) -> SpecShapes:
    return SpecShapes(world_scene(world, 0).figures)


@cache
def parts_of(world: str) -> Sequence[WorldPart]:
    return shapes(world).parts()


def triangles(part: WorldPart) -> int:
    return len(part.shape.mesh.faces if isinstance(part.shape, Painted) else part.shape.faces)


@pytest.mark.parametrize("world", WORLDS)
def test_a_shipped_world_is_small_enough_for_a_browser(world):
    from gazerig.robot.dashboard.view.world_view import part_glb, room_glbs

    found = shapes(world)
    assert len(pickle.dumps(found)) < 20_000
    parts = parts_of(world)
    assert sum(map(triangles, parts)) + HEAD_TRIANGLES < MOST_TRIANGLES
    room = room_glbs(parts)
    people = [part_glb(part) for part in parts if part.moves]
    assert sum(map(len, (*room, *people))) < 0.85 * MOST_BYTES and len(room) < 20
    # The rig has a plinth, and the walls permit a view from outside.
    assert any(np.ptp(_vertices(part)[:, 2]) > 0.05 for part in parts if not part.moves)


def _vertices(part: WorldPart) -> np.ndarray:
    return part.shape.vertices if isinstance(part.shape, TexturedMesh) else part.shape.mesh.vertices


def test_everybody_is_where_mujoco_has_them(mujoco):
    from gazerig.features.world.figure_model import PeoplePlacer
    from gazerig.features.world.model import world_spec

    found = pickle.loads(pickle.dumps(shapes("conversation")))
    figures, model = found.figures, world_spec(found.figures, None).compile()
    data = mujoco.MjData(model)
    assert [part.name for part in found.parts() if part.moves] == list(figures.names)
    for world_s in (0.0, 12.34, 100.0):
        PeoplePlacer(model, figures).place(data, world_s)
        mujoco.mj_kinematics(model, data)
        poses = found.poses(world_s)
        assert tuple(poses) == figures.names
        for name, (turn, p_world_m) in poses.items():
            body = model.body(name).id
            assert np.allclose(turn, data.xquat[body], atol=1e-9), name
            assert np.allclose(p_world_m, data.xpos[body], atol=1e-9), name
