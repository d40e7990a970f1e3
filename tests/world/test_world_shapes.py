"""The page's shapes of a world: all of its geoms in place, its people, and no rig."""

import pickle
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gazerig.config.load import shipped_path
from gazerig.config.schema import load_rig
from gazerig.features.world.rig_in_world import RigInWorld
from gazerig.features.world.room import HOME
from gazerig.features.world.run.run_world import rig_in_world, world_scene
from gazerig.features.world.shapes import SpecShapes, shapes_of
from gazerig.features.world.world_spec import WorldSpec
from gazerig.robot.dashboard.feed.world_shapes import WorldPart
from gazerig.robot.description.mesh import Painted
from gazerig.robot.description.texture import TexturedMesh

pytestmark = pytest.mark.usefixtures("mujoco")
WORLDS = sorted(
    path.stem for path in shipped_path("worlds", "living-room", HOME).parent.glob("*.yaml")
)
HEAD_TRIANGLES = 31_000  # of the expressive rig's
MOST_TRIANGLES, MOST_BYTES = 150_000, 3_000_000

MJCF = """<mujoco>
  <asset><material name="blue" rgba="0 0 1 1"/></asset>
  <worldbody>
    <geom name="floor" type="plane" size="2 2 .1" pos="0 0 -1" rgba=".5 .4 .3 1"/>
    <body pos="1 0 0"><geom type="sphere" size=".1" material="blue"/></body>
    <body pos="1 .5 0"><geom type="capsule" size=".05 .2" euler="90 0 0"/></body>
    <body pos="1 -.5 0"><geom type="cylinder" size=".05 .2"/><geom size=".3" group="3"/></body>
    <body pos="0 1 0"><geom type="box" size=".1 .2 .3"/><geom size=".4" rgba="1 1 1 0"/></body>
    <body pos="0 0 .1"><joint name="neck_yaw" axis="0 0 1"/><geom size=".5"/>
      <body><geom size=".6"/></body></body>
  </worldbody>
</mujoco>"""


@cache
def desk() -> RigInWorld:
    return rig_in_world(load_rig("desk"))


@cache
def shapes(world: str) -> SpecShapes:
    return shapes_of(WorldSpec(world_scene(world, 0).figures, (desk(),)))


@cache
def parts_of(world: str) -> Sequence[WorldPart]:
    return shapes(world).parts()


def triangles(part: WorldPart) -> int:
    return len(part.shape.mesh.faces if isinstance(part.shape, Painted) else part.shape.faces)


@pytest.mark.parametrize("world", WORLDS)
def test_a_shipped_world_is_small_enough_for_a_browser(world: str) -> None:
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


def test_everybody_is_where_mujoco_has_them(mujoco: Any) -> None:
    from gazerig.features.world.figure_model import PeoplePlacer

    found = pickle.loads(pickle.dumps(shapes("conversation")))
    figures, model = found.spec.figures, found.spec.compile().mj
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


def test_a_users_world_is_shown_without_the_rig_and_what_mujoco_hides(tmp_path: Path) -> None:
    (tmp_path / "mine.xml").write_text(MJCF)
    parts = shapes_of(WorldSpec(None, (desk(),), tmp_path / "mine.xml")).parts()
    sizes = np.array([np.ptp(_vertices(part), axis=0) for part in parts])
    wanted = ((4, 4, 0), (0.2, 0.2, 0.2), (0.1, 0.5, 0.1), (0.1, 0.1, 0.4), (0.2, 0.4, 0.6))
    assert sizes == pytest.approx(np.array(wanted), abs=0.002)
    middles = [np.mean([_vertices(p).min(axis=0), _vertices(p).max(axis=0)], axis=0) for p in parts]
    assert np.array(middles[1:]) == pytest.approx(
        np.array(((1, 0, 0), (1, 0.5, 0), (1, -0.5, 0), (0, 1, 0))), abs=0.01
    )
    ball = parts[1].shape
    assert isinstance(ball, Painted) and ball.colours[0].tolist() == [0.0, 0.0, 255.0]
    for part in parts:  # faces are turned outwards, for their backs are not drawn
        assert isinstance(part.shape, Painted)
        (vertices, faces), _, normals = part.shape
        assert normals is not None
        a, b, c = (vertices[faces[:, i]] for i in range(3))
        flat = np.cross(b - a, c - a)
        seen = np.linalg.norm(flat, axis=1) > 1e-9
        assert ((flat * normals[faces[:, 0]]).sum(axis=1)[seen] > 0.0).mean() > 0.95
