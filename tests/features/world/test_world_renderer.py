"""Pictures of a world: where points land, and what is left out."""

from collections.abc import Iterator
from functools import cache
from math import radians
from typing import Any

import numpy as np
import pytest

from gazerig.drivers.camera.pinhole import Intrinsics, intrinsics_of_view
from gazerig.drivers.errors import SetupError
from gazerig.drivers.types import ImageArray
from gazerig.drivers.vision.face.mtcnn import MtcnnDetector
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.features.world.gl_context import import_mujoco
from gazerig.gaze.angles import compose, rotation, yaw_pitch
from gazerig.gaze.types import Floats, Mat3, Vec3
from gazerig.robot.description.links import IDENTITY, ORIGIN
from gazerig.robot.model.face_geometry import LANDMARKS_FACE_M
from gazerig.robot.model.intrinsics import project
from gazerig.robot.model.scene import PinholeView
from gazerig.sim_mock.scenes.script import PersonScript, SceneScript


@cache
def why_not() -> str:
    """Return why nothing can render here, "" where something can."""
    try:
        mujoco = import_mujoco()
        from gazerig.features.world.renderer import Renderer

        Renderer(mujoco.MjModel.from_xml_string("<mujoco/>"), 16, 16).close()
    except (ModuleNotFoundError, SetupError) as error:
        return str(error)
    return ""


@pytest.fixture(scope="session")
def renders() -> None:
    """Skip the test without a renderer."""
    if reason := why_not():
        pytest.skip(reason)


pytestmark = pytest.mark.usefixtures("renders")

SIZE = 320, 240
OPTICAL: Mat3 = ((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0))
LENS = Intrinsics(210.0, 222.0, 171.0, 104.0)
POINTS = np.random.default_rng(3).uniform((1.0, -0.6, -0.4), (2.0, 0.6, 0.4), (6, 3))
RADIUS_M = 0.015
POSES: list[tuple[Mat3, Vec3]] = [
    (compose(rotation((0.0, 0.0, 0.0)), OPTICAL), (0.0, 0.0, 0.0)),
    (compose(rotation((0.2, -0.1, 0.3)), OPTICAL), (-0.1, 0.05, 0.02)),
    (compose(rotation((-0.15, 0.12, -0.5)), OPTICAL), (0.1, 0.1, -0.1)),
]


@pytest.fixture(scope="module")
def balls(renders: None) -> Iterator[Any]:
    """White balls at known points in the dark."""
    from gazerig.features.world.renderer import RendererParams, WorldPicture

    bodies = "".join(
        f'<body mocap="true" pos="{x} {y} {z}"><geom type="sphere" size="{RADIUS_M}"'
        ' rgba="1 1 1 1"/></body>'
        for x, y, z in POINTS
    )
    model = import_mujoco().MjModel.from_xml_string(
        '<mujoco><visual><headlight ambient="1 1 1" diffuse="0 0 0" specular="0 0 0"/>'
        f"</visual><worldbody>{bodies}</worldbody></mujoco>"
    )

    def place(data: Any, t_s: float) -> None:
        data.mocap_pos[:] = POINTS

    picture = WorldPicture(model, place, RendererParams(shadow_px=0), (), IDENTITY, ORIGIN)
    yield picture
    picture.close()


def landed(seen: ImageArray, expected_px: Floats) -> Floats:
    """Return the centroid of the light within 8 pixels of each expected place."""
    light = seen.max(axis=2).astype(float)
    rows, columns = np.mgrid[0 : light.shape[0], 0 : light.shape[1]]
    found = []
    for x, y in expected_px:
        near = light * (np.hypot(columns - x, rows - y) < 8.0)
        found.append(((near * columns).sum(), (near * rows).sum()) / max(near.sum(), 1e-9))
    return np.array(found)


def visible(R: Mat3, p_m: Vec3) -> Floats:
    """Return pixels of the balls that are wholly in the frame and alone there."""
    pixels = project((POINTS - p_m) @ np.array(R), LENS)
    apart = np.hypot(*np.moveaxis(pixels[:, None] - pixels[None], -1, 0)) + 99.0 * np.eye(
        len(pixels)
    )
    inside = ((pixels > 8.0) & (pixels < np.array(SIZE) - 9.0)).all(axis=1) & (
        apart.min(axis=1) > 16
    )
    return np.asarray(pixels[inside])


@pytest.mark.parametrize("pose", POSES)
def test_a_point_lands_where_the_programs_own_lens_says(balls, pose):
    pixels = visible(*pose)
    assert len(pixels) >= 2
    seen = balls.draw(PinholeView(0.0, LENS, SIZE, *pose))
    assert np.abs(landed(seen, pixels) - pixels).max() < 0.5


# --- The default detector finds the faces of a world's people


SIZE_PX = 640, 400
FACE_LENS = intrinsics_of_view(radians(69.0), *SIZE_PX)


@pytest.fixture(scope="module")
def pictures(renders: None) -> list[tuple[ImageArray, Floats]]:
    """Return pictures of people of both looks, each with the true landmarks of the face, in px."""
    return [one for look in (0, 1) for one in pictures_of(look)]


def pictures_of(look: int) -> Iterator[tuple[ImageArray, Floats]]:
    from gazerig.features.world.figure import Figures
    from gazerig.features.world.figure_model import PeoplePlacer
    from gazerig.features.world.model import world_spec
    from gazerig.features.world.renderer import WorldPicture
    from gazerig.features.world.world_scene import WorldScene

    figures = Figures(SceneScript({"ann": PersonScript("front", look)}, round_s=12.0), 1)
    model: Any = world_spec(figures, None).compile()
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
        image = picture.draw(PinholeView(t_s, FACE_LENS, SIZE_PX, turned, (x, y, z)))
        marks = nose + figures.measures["ann"].head_scale * LANDMARKS_FACE_M @ R.T
        yield image, project((marks - (x, y, z)) @ np.array(turned), FACE_LENS)
    picture.close()


def test_faces_of_all_looks_are_found_where_they_are(pictures):
    detector = MtcnnDetector(FaceDetectorParams())
    off_px = []
    for image, true_px in pictures:
        (face,) = detector.find(image)
        off_px.append(np.asarray(face.landmarks_px) - true_px)
    assert np.sqrt((np.array(off_px) ** 2).sum(axis=2).mean()) < 5.0
