"""The default detector finds the faces of a world's people."""

from collections.abc import Iterator
from math import radians
from typing import Any

import numpy as np
import pytest
from rendering import renders as renders

from gazerig.drivers.camera.pinhole import intrinsics_of_view
from gazerig.drivers.types import ImageArray
from gazerig.drivers.vision.face.mtcnn import MtcnnDetector
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.gaze.angles import compose, rotation, yaw_pitch
from gazerig.gaze.types import Floats, Mat3
from gazerig.robot.model.face_geometry import LANDMARKS_FACE_M
from gazerig.robot.model.intrinsics import project
from gazerig.robot.model.scene_view import PinholeView
from gazerig.sim_mock.scenes.script import PersonScript, SceneScript

pytestmark = pytest.mark.usefixtures("renders")

OPTICAL: Mat3 = ((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0))
SIZE_PX = 640, 400
LENS = intrinsics_of_view(radians(69.0), *SIZE_PX)


@pytest.fixture(scope="module")
def pictures(renders: None) -> list[tuple[ImageArray, Floats]]:
    """Return pictures of people of both looks, each with the true landmarks of the face, in px."""
    return [one for look in (0, 1) for one in pictures_of(look)]


def pictures_of(look: int) -> Iterator[tuple[ImageArray, Floats]]:
    from gazerig.features.world.figure import Figures
    from gazerig.features.world.figure_model import PeoplePlacer
    from gazerig.features.world.model import world_model
    from gazerig.features.world.renderer import WorldPicture
    from gazerig.features.world.world_scene import WorldScene

    figures = Figures(SceneScript({"ann": PersonScript("front", look)}, round_s=12.0), 1)
    model: Any = world_model(figures, ()).mj
    picture = WorldPicture(model, PeoplePlacer(model, figures).place)
    for t_s, away_m, aside in (
        (2.0, 1.0, 0.3),
        (3.0, 1.0, -0.3),
        (4.0, 1.6, 0.3),
        (5.0, 1.6, -0.3),
    ):
        (person,) = WorldScene("one", figures).people(t_s)
        yaw, pitch = person.face_yaw_pitch_rad
        R, nose = np.array(rotation((yaw, pitch, 0.0))), np.array(person.p_world_face_m)
        sight = R @ (np.cos(aside), np.sin(aside), 0.1)
        x, y, z = (nose + away_m * sight).tolist()
        turned = compose(rotation((*yaw_pitch(tuple((-sight).tolist())), 0.0)), OPTICAL)
        image = picture.draw(PinholeView(t_s, LENS, SIZE_PX, turned, (x, y, z)))
        marks = nose + figures.measures["ann"].head_scale * LANDMARKS_FACE_M @ R.T
        yield image, project((marks - (x, y, z)) @ np.array(turned), LENS)
    picture.close()


def test_faces_of_all_looks_are_found_where_they_are(
    pictures: list[tuple[ImageArray, Floats]],
) -> None:
    detector = MtcnnDetector(FaceDetectorParams())
    off_px = []
    for image, true_px in pictures:
        (face,) = detector.find(image)
        off_px.append(np.asarray(face.landmarks_px) - true_px)
    assert np.sqrt((np.array(off_px) ** 2).sum(axis=2).mean()) < 5.0
