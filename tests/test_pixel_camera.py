"""The camera that draws: true geometry, faces that the real detector finds, and honest times."""

from collections.abc import Callable
from math import radians
from typing import Any

import numpy as np
import pytest
from fakes.scenes import EmptyScene
from present import present

from gazerig.drivers.camera.pinhole import intrinsics_of_view
from gazerig.drivers.types import DetectedFace, ImageArray
from gazerig.drivers.vision.face.mtcnn import MtcnnDetector
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.gaze.angles import angle_between, rotation
from gazerig.gaze.types import Angles3, Mat3, Vec3
from gazerig.robot.model.face_geometry import LANDMARKS_FACE_M
from gazerig.robot.model.frames import CameraMount, CameraParams
from gazerig.robot.model.intrinsics import project
from gazerig.robot.model.scene_view import PinholeView
from gazerig.robot.perception.face_pose import face_pose
from gazerig.sim_mock.cameras.canvas import Canvas, TexturedQuad
from gazerig.sim_mock.cameras.draw_person import (
    PERSON_COLOURS,
    draw_body,
    draw_head,
    draw_person,
    draw_room,
    draw_thing,
)
from gazerig.sim_mock.cameras.optics import blur_along
from gazerig.sim_mock.cameras.rendered import PixelCamera, PixelCameraParams, draw_scene
from gazerig.sim_mock.scenes.scene import ScenePerson, Thing

WIDTH, HEIGHT = 640, 400
LENS = intrinsics_of_view(radians(69.0), WIDTH, HEIGHT)
MOUNT = CameraMount(CameraParams(position_mm=(0.0, 0.0, 0.0)))
AHEAD = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@pytest.fixture(scope="module")
def mtcnn() -> MtcnnDetector:
    return MtcnnDetector(FaceDetectorParams())


class Nobody:
    """A detector that finds nothing."""

    def find(self, picture: ImageArray) -> tuple[DetectedFace, ...]:
        return ()


class Still(EmptyScene):
    """A scene in which nothing moves but by a given function of the time."""

    def __init__(
        self, *people: Vec3, things: tuple[Thing, ...] = (), v: Vec3 = (0.0, 0.0, 0.0)
    ) -> None:
        self._people, self._things, self._v = people, things, v

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        places = [tuple(a + t_s * b for a, b in zip(p, self._v, strict=True)) for p in self._people]
        return tuple(ScenePerson(p, (float(np.arctan2(-p[1], -p[0])), 0.0), None) for p in places)  # type: ignore[arg-type]

    def things(self, t_s: float) -> tuple[Thing, ...]:
        return self._things


def canvas_at(head_rad: Angles3 = (0.0, 0.0, 0.0), p_m: Vec3 = (0.0, 0.0, 0.0)) -> Canvas:
    R, p = MOUNT.pose(rotation(head_rad), p_m)
    return Canvas(PinholeView(0.0, LENS, (WIDTH, HEIGHT), R, p))


def level(_: float) -> tuple[Mat3, Vec3]:
    return AHEAD, (0.0, 0.0, 0.0)


def camera(
    scene: Still,
    detector: MtcnnDetector | Nobody,
    head: Callable[[float], tuple[Mat3, Vec3]] = level,
    seed: int = 0,
    **params: Any,
) -> PixelCamera:
    rng = np.random.default_rng(seed)
    return PixelCamera(PixelCameraParams(**params), scene, MOUNT, head, detector, rng)


@pytest.mark.parametrize("yaw_deg", [-40.0, 0.0, 25.0])
def test_a_point_of_the_world_is_drawn_where_a_camera_sees_it(yaw_deg: float) -> None:
    canvas = canvas_at((radians(yaw_deg), radians(5.0), radians(-8.0)), (0.1, -0.2, 0.3))
    c, s = np.cos(radians(yaw_deg)), np.sin(radians(yaw_deg))
    middle = np.array((0.1 + 2.0 * c, -0.2 + 2.0 * s, 0.4))
    red = np.zeros((9, 9, 3), np.uint8)
    red[:] = (0, 0, 255)
    right, down = np.array((s, -c, 0.0)) * 0.2, np.array((0.0, 0.0, -0.2))
    corner = middle - 0.5 * (right + down)
    canvas.draw_quad(TexturedQuad(tuple(corner), tuple(right), tuple(down), red))
    y, x = np.nonzero(canvas.image[:, :, 2] > 127)
    expected = project(canvas.to_camera(middle), LENS)[0]
    assert (x.mean(), y.mean()) == pytest.approx(tuple(expected), abs=0.6)
    seen_m = canvas.depth_m[round(expected[1]), round(expected[0])]
    assert seen_m == pytest.approx(canvas.to_camera(middle)[0, 2], abs=0.01)
    assert np.isinf(canvas.depth_m[0, 0])


def test_whoever_is_behind_or_in_the_lens_is_not_drawn() -> None:
    canvas = canvas_at()
    for x in (-1.0, -0.05, 0.0, 0.02):
        draw_person(canvas, ScenePerson((x, 0.0, 0.0), (0.0, 0.0), None), 0)
    draw_thing(canvas, Thing(1, "thing", (-1.0, 0.0, 0.0), 0.1))
    assert np.isfinite(canvas.depth_m).mean() < 0.5  # at most a shoulder
    empty = canvas_at()
    draw_person(empty, ScenePerson((-1.0, 0.0, 0.0), (0.0, 0.0), None), 0)
    assert not empty.image.any()


def test_the_nearer_covers_the_farther() -> None:
    canvas = canvas_at()
    near, far = Thing(1, "thing", (1.0, 0.0, 0.0), 0.1), Thing(2, "thing", (2.0, 0.0, 0.0), 0.3)
    draw_scene(canvas, Still(things=(near, far)), 0.0)
    assert canvas.depth_m[200, 320] == pytest.approx(1.0, abs=0.01)
    assert canvas.depth_m[200 - 55, 320] == pytest.approx(2.0, abs=0.02)


def face_drawn(away_m: float, roll_deg: float, who: int) -> tuple[ImageArray, Canvas, np.ndarray]:
    """Draw a face that looks at the camera, rolled, before the room; with its true landmarks."""
    canvas = canvas_at()
    draw_room(canvas)
    place = (away_m, 0.05 * away_m, 0.03)
    R = np.array(rotation((np.pi, 0.0, radians(roll_deg))))
    draw_body(canvas, place, PERSON_COLOURS[who], who)
    draw_head(canvas, place, R, PERSON_COLOURS[who])
    noise = np.random.default_rng(0).normal(0.0, 3.0, canvas.image.shape)
    picture = np.clip(canvas.image + noise, 0.0, 255.0).astype(np.uint8)
    return picture, canvas, project(canvas.to_camera(LANDMARKS_FACE_M @ R.T + place), LENS)


@pytest.mark.parametrize("roll_deg", [-20.0, 0.0, 20.0])
def test_a_real_detector_finds_drawn_faces_where_they_are(
    mtcnn: MtcnnDetector, roll_deg: float
) -> None:
    """At ten distances: landmarks within a part of the distance between the eyes."""
    errors, directions = [], []
    for number, away_m in enumerate(np.geomspace(0.45, 2.2, 10).tolist()):
        picture, canvas, true = face_drawn(away_m, roll_deg, number % len(PERSON_COLOURS))
        found = mtcnn.find(picture)
        assert len(found) == 1, away_m
        eyes_px = np.linalg.norm(true[1] - true[0])
        errors.append(np.linalg.norm(found[0].landmarks_px - true, axis=1).mean() / eyes_px)
        pose = face_pose(found[0].landmarks_px, LENS)
        assert pose is not None
        nose = canvas.to_camera((away_m, 0.05 * away_m, 0.03))[0]
        directions.append(angle_between(pose.p_camera_m, tuple(nose)))
        assert np.linalg.norm(pose.p_camera_m) == pytest.approx(np.linalg.norm(nose), rel=0.12)
    assert np.mean(errors) < 0.07 and max(errors) < 0.12
    assert np.degrees(np.mean(directions)) < 0.4


def test_pictures_come_late_at_their_rate_and_a_late_look_skips_some() -> None:
    made = camera(Still(), Nobody(), width_px=64, height_px=40, latency_ms=60.0, rate_hz=30.0)
    arrivals = {}
    for now_s in np.arange(5.0, 6.0, 0.005).tolist():
        found = made.latest(now_s)
        if found is not None and found.number not in arrivals:
            arrivals[found.number] = now_s - found.captured_s
    assert len(arrivals) in (28, 29)
    assert min(arrivals.values()) >= 0.06 - 1e-9 and max(arrivals.values()) < 0.066
    made.latest(7.0)
    late = made.latest(7.1)
    assert late is not None and late.number > 55
    assert made.events() == ()


def test_the_same_dice_give_the_same_bytes() -> None:
    """Noise is drawn once a camera and in order; other dice give another picture."""

    def shot(seed: int) -> bytes:
        found = camera(Still((1.0, 0.0, 0.0)), Nobody(), seed=seed, latency_ms=0.0).latest(0.0)
        assert found is not None and found.image is not None
        return found.image.tobytes()

    assert shot(1) == shot(1) != shot(2)


def test_depth_has_the_noise_of_stereo_and_holes_at_edges() -> None:
    scene = Still((1.0, 0.0, 0.0))
    found = camera(scene, Nobody(), latency_ms=0.0, depth=True).latest(0.0)
    assert found is not None and found.depth_m is not None
    depth = found.depth_m
    assert depth.dtype == np.float32 and depth.shape == (HEIGHT, WIDTH)
    holes = np.isnan(depth)
    assert 0.002 < holes.mean() < 0.2
    face, wall = depth[185:215, 305:335], depth[60:100, 60:200]
    assert np.nanmedian(face) == pytest.approx(1.02, abs=0.02) and not np.isnan(face).any()
    assert np.nanstd(wall - np.nanmedian(wall)) > 3.0 * np.nanstd(face - np.nanmedian(face))
    assert camera(scene, Nobody(), latency_ms=0.0).latest(0.0).depth_m is None  # type: ignore[union-attr]


def test_a_turn_during_the_exposure_smears_along_the_turn() -> None:
    dot = np.zeros((41, 41, 3), np.uint8)
    dot[20, 20] = 200
    long = blur_along(dot, (8.0, 0.0)).astype(float)[:, :, 0]
    y, x = np.nonzero(long > 5.0)
    assert set(y.tolist()) == {20} and np.ptp(x) in (7, 8)

    def sharpness(turn_deg_s: float) -> float:
        def head(t_s: float) -> tuple[Mat3, Vec3]:
            return rotation((radians(turn_deg_s) * t_s, 0.0, 0.0)), (0.0, 0.0, 0.0)

        made = camera(Still(), Nobody(), head, latency_ms=0.0, noise_grey=0.0, exposure_ms=10.0)
        for now_s in np.arange(0.0, 0.04, 0.005).tolist():
            found = made.latest(now_s)
        image = present(present(found).image)
        return float(np.abs(np.diff(image[60:300].astype(float), axis=1)).mean())

    assert sharpness(200.0) < 0.6 * sharpness(0.0)
