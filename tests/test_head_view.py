"""The page's head is the rig's description: its links, where its joints put them."""

from collections.abc import Iterator
from dataclasses import replace
from math import degrees

import numpy as np
import pytest
import viser
from gaze_targets import joints_at
from shown_page import SNAPSHOT as SHOT
from viser import transforms

from gazerig.config.schema import load_rig
from gazerig.robot.app.gaze_models import rig_kinematics
from gazerig.robot.app.rig_description import shape_of
from gazerig.robot.dashboard.view.head_view import HeadView


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    made = viser.ViserServer(port=0, verbose=False)
    yield made
    made.stop()


def test_the_head_is_where_its_joints_put_it(server: viser.ViserServer) -> None:
    """Every link is in its parent by the kinematics, at any angles of a shipped rig."""
    rig = load_rig("desk")
    kinematics, view = rig_kinematics(rig), HeadView(server.scene)
    view.shape = shape_of(rig)
    angles = tuple((0.3 * np.sin(np.arange(len(kinematics.names)))).tolist())
    pose = kinematics.forward(joints_at(*angles))
    view.show(replace(SHOT, joints=kinematics.names, measured_rad=angles))
    for link, p_world_m in (
        ("head", pose.p_world_head_m),
        ("left_eye", pose.p_world_eye_left_m),
        ("right_eye", pose.p_world_eye_right_m),
    ):
        where = _in_world(view, link)
        assert where.translation() == pytest.approx(p_world_m, abs=2e-4)
    yaw, pitch = pose.eye_left_rad
    in_head = (np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch))
    ahead = _in_world(view, "left_eye").rotation().apply(np.array((1.0, 0.0, 0.0)))
    assert ahead == pytest.approx(np.array(pose.R_world_head) @ in_head, abs=2e-3)


def _in_world(view: HeadView, link: str) -> transforms.SE3:
    """Return the pose of a link in the scene, through its frames."""
    path = view.links[link].frame.name
    found = transforms.SE3.identity()
    for one in view.links.values():
        if path == one.frame.name or path.startswith(one.frame.name + "/"):
            turn = transforms.SO3(np.array(one.frame.wxyz))
            found = found @ transforms.SE3.from_rotation_and_translation(
                turn, np.array(one.frame.position)
            )
    return found


def _turned_deg(view: HeadView, link: str) -> float:
    """Return how far a part of the face is turned about its axis across the head, upwards."""
    _, y, _ = transforms.SO3(np.array(view.links[link].frame.wxyz)).log()
    return -degrees(y)


def test_a_rig_without_brows_and_jaw_shows_expressions_drawn_only(
    server: viser.ViserServer,
) -> None:
    view = HeadView(server.scene)
    view.show(SHOT)
    assert _turned_deg(view, "left_brow_link") == _turned_deg(view, "jaw_link") == 0.0
    both = ("surprised", "happy")  # a track comes before the expression beneath it
    angles = []
    for k in range(1, 21):
        view.show(replace(SHOT, t_s=SHOT.t_s + 0.05 * k, expressed=both))
        angles.append(_turned_deg(view, "left_brow_link"))
    assert angles[-1] == pytest.approx(18.0, abs=0.1)
    assert np.all(np.diff(angles) >= 0.0) and max(np.diff([0.0, *angles])) < 6.0  # without a jump
    assert _turned_deg(view, "right_brow_link") == angles[-1]
    assert _turned_deg(view, "jaw_link") == pytest.approx(-12.0, abs=0.1)
    view.show(replace(SHOT, t_s=SHOT.t_s + 3.0, expressed=("", "neutral")))
    assert _turned_deg(view, "left_brow_link") == pytest.approx(0.0, abs=0.01)
