"""Worlds are compiled with every shipped rig in them, at its angles, and from a user's MJCF."""

from pathlib import Path
from typing import Any

import pytest
from described_rigs import SHIPPED
from world_rigs import NOBODY

from gazerig.config.schema import load_rig
from gazerig.drivers.errors import SetupError
from gazerig.features.world.run.run_world import rig_in_world

pytestmark = pytest.mark.usefixtures("mujoco")


def model_with(name: str, path: Path | None = None) -> Any:
    """Return a world with a rig in it, of a file or empty."""
    from gazerig.features.world.model import world_model

    return world_model(NOBODY, rig_in_world(load_rig(name), looks=False), path)


@pytest.mark.parametrize("name", SHIPPED)
def test_every_shipped_rig_stands_in_a_world_at_its_first_angles(name):
    """Joints of a world are the rig's, one shaft a servo."""
    from gazerig.features.world.physics import World

    world = World(model_with(name), lambda: 0.0)
    placed = world.model.rig
    assert set(placed.qpos) == set(load_rig(name).names) == set(placed.tendon)
    assert world.joints_rad() == rig_in_world(load_rig(name), looks=False).start_rad


def _world_file(folder: Path, inside: str) -> Path:
    path = folder / "own.xml"
    path.write_text(f"<mujoco><worldbody>{inside}</worldbody></mujoco>")
    return path


def test_a_users_world_carries_the_head_at_its_site(mujoco, tmp_path):
    """The site is the place of the neck base."""
    path = _world_file(tmp_path, '<site name="gazerig" pos="1 2 3"/>')
    model = model_with("desk", path)
    data = mujoco.MjData(model.mj)
    mujoco.mj_forward(model.mj, data)
    assert data.body("rig_neck_pitch_link").xpos == pytest.approx((1.0, 2.0, 3.07))


def test_a_users_world_without_a_place_for_the_head_is_refused(tmp_path):
    """The message has the file and the line to add."""
    path = _world_file(tmp_path, '<geom size="1"/>')
    with pytest.raises(SetupError, match=r'own\.xml: no place.*<site name="gazerig"'):
        model_with("desk", path)


@pytest.mark.parametrize(
    ("text", "why"),
    (
        ("", "read"),
        (
            '<mujoco><asset><mesh name="m" file="gone.stl"/></asset><worldbody>'
            '<site name="gazerig"/></worldbody></mujoco>',
            "build",
        ),
    ),
)
def test_a_users_world_that_cannot_be_used_is_one_line(tmp_path, text, why):
    """MuJoCo's own message follows."""
    path = tmp_path / "own.xml"
    path.write_text(text)
    with pytest.raises(SetupError, match=rf"own\.xml: MuJoCo cannot {why}") as found:
        model_with("minimal", path)
    assert len(str(found.value).splitlines()) == 1
