"""A simulated scene is drawn for people: every scene, from any pose, in another process too."""

import pickle
from math import radians

import numpy as np
import pytest

from gazerig.drivers.camera.pinhole import intrinsics_of_view
from gazerig.gaze.angles import rotation
from gazerig.gaze.types import Mat3
from gazerig.robot.app.scene_files import load_scene, scene_names
from gazerig.robot.dashboard.feed.camera_overlay import draw_heat
from gazerig.robot.dashboard.feed.gaze_trail import GazeTrail
from gazerig.robot.model.scene_view import PinholeView
from gazerig.sim_mock.scenes.scene import ScenePicture

SIZE_PX = (640, 400)
LENS = intrinsics_of_view(radians(69.0), *SIZE_PX)
EYE_M = (0.05, 0.0, 0.16)


def camera(yaw: float = 0.0, pitch: float = 0.0) -> Mat3:
    """The optical axes of a camera that looks along x, turned."""
    optical = np.array(((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0)))
    turned = np.array(rotation((yaw, pitch, 0.0))) @ optical
    (a, b, c), (d, e, f), (g, h, i) = turned.tolist()
    return ((a, b, c), (d, e, f), (g, h, i))


@pytest.mark.parametrize("name", scene_names())
def test_every_scene_can_be_sent_and_drawn_at_any_time(name: str) -> None:
    picture = pickle.loads(pickle.dumps(ScenePicture(load_scene(name))))
    drawn = [
        picture.draw(PinholeView(t_s, LENS, SIZE_PX, camera(), EYE_M)).image
        for t_s in (0.0, 5.0, 17.9)
    ]
    assert all(image.shape == (400, 640, 3) and image.dtype == np.uint8 for image in drawn)
    again = picture.draw(PinholeView(5.0, LENS, SIZE_PX, camera(), EYE_M)).image
    assert np.array_equal(again, drawn[1])


def test_the_picture_turns_with_the_camera() -> None:
    picture = ScenePicture(load_scene("visitor"))

    def middle(yaw: float) -> float:
        """The column of the centre of the visitor's blue shirt."""
        image = picture.draw(PinholeView(2.0, LENS, SIZE_PX, camera(yaw), EYE_M)).image.astype(int)
        shirt = (image[..., 0] > image[..., 2] + 40) & (np.arange(400) > 260)[:, None]
        return float(np.argwhere(shirt)[:, 1].mean())

    assert middle(0.15) > middle(0.0) + 40  # to the left turned: the visitor is farther right


def test_warmth_lies_where_the_gaze_has_been() -> None:
    trail = GazeTrail()
    for i in range(100):
        trail.add(0.01 * i, (1.0, 0.0, 0.2))
    assert 16 <= len(trail.points()) <= 20  # one every 50 ms
    image = np.full((400, 640, 3), 120, np.uint8)
    draw_heat(image, np.array([(320.0, 200.0)] * 40 + [(-50.0, 3000.0)]))
    assert np.abs(image[200, 320].astype(int) - 120).max() > 40
    assert (image[20:60, 20:60] == 120).all()
    trail.add(0.0, (0.0, 0.0, 0.0))
    assert len(trail.points()) == 1  # time went back: another run
