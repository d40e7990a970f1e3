"""The camera that draws: true geometry, faces that the real detector finds, and honest times."""

import pickle
from collections.abc import Callable
from dataclasses import dataclass
from math import radians
from typing import Any

import numpy as np
import pytest
from fakes.scenes import EmptyScene
from present import present
from reviewed import assert_reviewed

from gazerig.config.shipped_files import shipped_names
from gazerig.drivers.camera.pinhole import intrinsics_of_view
from gazerig.drivers.types import DetectedFace, ImageArray
from gazerig.drivers.vision.face.mtcnn import MtcnnDetector
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.gaze.angles import angle_between, rotation
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.face_geometry import LANDMARKS_FACE_M
from gazerig.robot.model.frames import CameraMount, CameraParams
from gazerig.robot.model.intrinsics import project
from gazerig.robot.model.scene import PinholeView
from gazerig.robot.perception.face_pose import face_pose
from gazerig.robot.run.surroundings import load_scene
from gazerig.sim_mock.cameras.drawn_scene import DrawnScene
from gazerig.sim_mock.cameras.frame_times import FrameParams
from gazerig.sim_mock.cameras.rendered import PixelCamera
from gazerig.sim_mock.scenes.scene import ScenePerson, Thing

SIZE = WIDTH, HEIGHT = 640, 400
LENS = intrinsics_of_view(radians(69.0), WIDTH, HEIGHT)
MOUNT = CameraMount(CameraParams(position_mm=(0.0, 0.0, 0.0)))
ORIGIN: Vec3 = (0.0, 0.0, 0.0)
LEVEL: Mat3 = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Nobody:
    """A detector that finds nothing."""

    def find(self, picture: ImageArray) -> tuple[DetectedFace, ...]:
        return ()


@dataclass
class Still(EmptyScene):
    """A scene in which nothing moves."""

    seen: tuple[ScenePerson, ...] = ()
    moving: tuple[Thing, ...] = ()

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        return self.seen

    def things(self, t_s: float) -> tuple[Thing, ...]:
        return self.moving


def person(place: Vec3, yaw_rad: float = np.pi) -> ScenePerson:
    return ScenePerson(place, (yaw_rad, 0.0), None)


def seen_from(yaw_deg: float = 0.0, pitch_deg: float = 0.0, p_m: Vec3 = ORIGIN) -> PinholeView:
    turned = rotation((radians(yaw_deg), radians(pitch_deg), 0.0))
    return PinholeView(0.0, LENS, SIZE, *MOUNT.pose(turned, p_m))


def drawn(scene: EmptyScene, *view: Any) -> ImageArray:
    return DrawnScene(scene).draw(seen_from(*view))


def test_every_pixel_of_drawn_people_and_things_is_as_it_was_reviewed():
    raised = person((1.1, 0.1, 0.05))._replace(hand=(0.9, 0.25, 0.0))
    ball, palm = (
        Thing(1, "thing", (0.9, -0.1, 0.1), 0.06, 0.0, 0.5),
        Thing(2, "hand", (0.8, 0.0, -0.2), 0.06),
    )
    scene = Still((raised, person((1.5, -0.4, 0.1), 2.5)), (ball, palm))
    views = (0.0, 0.0, ORIGIN), (-20.0, 8.0, (0.1, -0.2, 0.1))
    pictures = [drawn(scene, *view)[60:340:14, 120:520:10].reshape(20, -1) for view in views]
    assert_reviewed("drawn", np.vstack(pictures).tolist())


def test_whoever_is_behind_or_in_the_lens_is_not_drawn():
    empty = drawn(Still())
    for x in (-1.0, -0.05, 0.0):
        thing = Thing(1, "thing", (x, 0.0, 0.0), 0.02)
        scene = Still((person((x, 0.0, 0.0)),), (thing,))
        assert (drawn(scene) == empty).all()


@pytest.fixture(scope="module")
def mtcnn() -> MtcnnDetector:
    return MtcnnDetector(FaceDetectorParams())


@pytest.mark.parametrize("turn_deg", [-25.0, 0.0, 20.0])
def test_a_real_detector_finds_drawn_faces_where_they_are(mtcnn, turn_deg):
    """At eight distances: landmarks within a part of the distance between the eyes."""
    errors, directions, noise = [], [], np.random.default_rng(0)
    view = seen_from()
    for number, away_m in enumerate(np.geomspace(0.45, 2.2, 8).tolist()):
        place = (away_m, 0.05 * away_m, 0.03)
        yaw = np.pi + radians(turn_deg)
        others = [person((-5.0, 0.0, 0.0))] * (number % 4)  # the looks go by number
        picture = drawn(Still((*others, person(place, yaw))))
        found: tuple[DetectedFace, ...] = ()
        for _ in range(2):  # one of 100 pictures of a face at 1.4 m has none
            noisy = np.clip(picture + noise.normal(0.0, 3.0, picture.shape), 0, 255)
            found = found or mtcnn.find(noisy.astype(np.uint8))
        assert len(found) == 1, away_m
        landmarks = LANDMARKS_FACE_M @ np.array(rotation((yaw, 0.0, 0.0))).T + place
        true = project(landmarks @ np.array(view.R), LENS)
        eyes_px = LENS.fx_px * 0.063 / away_m
        errors.append(np.linalg.norm(found[0].landmarks_px - true, axis=1).mean() / eyes_px)
        pose = present(face_pose(found[0].landmarks_px, LENS))
        nose = np.array(place) @ np.array(view.R)
        directions.append(angle_between(pose.p_camera_m, tuple(nose)))
        assert np.linalg.norm(pose.p_camera_m) == pytest.approx(np.linalg.norm(nose), rel=0.15)
    assert np.mean(errors) < 0.08 and max(errors) < 0.15
    assert np.degrees(np.mean(directions)) < 0.5


@pytest.mark.parametrize("name", shipped_names("scenes"))
def test_every_scene_can_be_sent_and_drawn(name):
    scene = DrawnScene(load_scene(name))
    sent = pickle.loads(pickle.dumps(scene))
    for t_s in (0.0, 17.9):
        view = seen_from(0.0, 0.0, (0.05, 0.0, 0.16))._replace(t_s=t_s)
        assert np.array_equal(scene.draw(view), sent.draw(view))


def level(_: float) -> tuple[Mat3, Vec3]:
    return LEVEL, ORIGIN


def camera(
    scene: EmptyScene,
    head: Callable[[float], tuple[Mat3, Vec3]] = level,
    seed: int = 0,
    **params: Any,
) -> PixelCamera:
    rng = np.random.default_rng(seed)
    view = DrawnScene(scene)
    return PixelCamera(FrameParams(**params), view, MOUNT, head, Nobody(), rng)


def test_pictures_come_late_at_their_rate_and_a_late_look_skips_some():
    made = camera(Still(), width_px=64, height_px=40, latency_ms=60.0, rate_hz=30.0)
    arrivals = {}
    for now_s in np.arange(5.0, 6.0, 0.005).tolist():
        found = made.latest(now_s)
        if found is not None and found.number not in arrivals:
            arrivals[found.number] = now_s - found.captured_s
    assert len(arrivals) in (28, 29)
    assert min(arrivals.values()) >= 0.06 - 1e-9 and max(arrivals.values()) < 0.066
    made.latest(7.0)
    assert present(made.latest(7.1)).number > 55


def test_the_same_dice_give_the_same_bytes():
    """Noise is drawn once a camera and in order; other dice give another picture."""

    def shot(seed: int) -> bytes:
        scene = Still((person((1.0, 0.0, 0.0)),))
        image = present(camera(scene, seed=seed, latency_ms=0.0).latest(0.0)).image
        return bytes(present(image).tobytes())

    assert shot(1) == shot(1) != shot(2)
