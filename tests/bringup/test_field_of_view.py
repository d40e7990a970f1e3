"""The field of view by a face at a known distance: right to the face's own size, and refused."""

from math import radians
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from gazerig.config.schema import load_rig
from gazerig.drivers.camera.pinhole import intrinsics_of_view
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import DetectedFace
from gazerig.features.bringup.calibration.camera_calibration import CameraCalibrationRefused
from gazerig.features.bringup.calibration.field_of_view import LEAST_FRAMES, estimate_field
from gazerig.features.bringup.cli.calibrate import camera as command
from gazerig.robot.cli.main import app
from gazerig.robot.model.face_geometry import LANDMARKS_FACE_M
from gazerig.robot.model.intrinsics import project

WIDTH, HEIGHT = 640, 480
# The face's axes (out of it, to its left, up) in the camera's, for one that faces the camera.
FACING = np.array([(0.0, 1.0, 0.0), (0.0, 0.0, -1.0), (-1.0, 0.0, 0.0)])


def landmarks(field_deg: float, far_m: float, size: float = 1.0, noise_px: float = 0.4):
    """Return what many frames show of a face that far away, under a lens of that field."""
    lens = intrinsics_of_view(radians(field_deg), WIDTH, HEIGHT)
    rng = np.random.default_rng(1)
    points_m = size * np.array(LANDMARKS_FACE_M) @ FACING.T + (0.03, -0.05, far_m)
    seen = project(points_m, lens)
    return [seen + rng.normal(0.0, noise_px, seen.shape) for _ in range(LEAST_FRAMES + 20)]


@pytest.mark.parametrize("field_deg", [55.0, 69.0, 84.0, 110.0])
@pytest.mark.parametrize("far_m", [0.6, 1.0])
def test_the_field_is_found_for_a_face_of_usual_size(field_deg, far_m):
    found = estimate_field(landmarks(field_deg, far_m), WIDTH, HEIGHT, far_m)
    assert found.horizontal_deg == pytest.approx(field_deg, abs=0.02 * field_deg)
    assert found.moved < 0.05 and found.frames == LEAST_FRAMES + 20


@pytest.mark.parametrize("size", [0.92, 1.08])
def test_faces_of_other_sizes_are_within_what_is_said(size):
    found = estimate_field(landmarks(84.0, 1.0, size), WIDTH, HEIGHT, 1.0)
    assert found.low_deg - 0.7 <= 84.0 <= found.high_deg + 0.7
    focal = [np.tan(radians(deg) / 2.0) for deg in (found.low_deg, found.horizontal_deg)]
    assert focal[1] / focal[0] == pytest.approx(1.08, abs=1e-6)


def test_too_few_frames_motion_and_impossible_lenses_are_refused():
    seen = landmarks(84.0, 1.0)
    with pytest.raises(CameraCalibrationRefused, match="60 are needed"):
        estimate_field(seen[:20], WIDTH, HEIGHT, 1.0)
    with pytest.raises(CameraCalibrationRefused, match="hold still at 1 m"):
        estimate_field(seen[:40] + landmarks(84.0, 1.4)[:40], WIDTH, HEIGHT, 1.0)
    with pytest.raises(CameraCalibrationRefused, match="no such lens"):
        estimate_field(seen, WIDTH, HEIGHT, 0.05)


class Sitter:
    """A webcam before which someone sits at one metre, under a lens of 84 deg."""

    def __init__(self, device: Any, params: Any) -> None:
        self.params, self.number = params, 0

    def open(self) -> None:
        pass

    def take(self, now_s: Any, stop: Any) -> Shot | None:
        if stop.wait(0.002):
            return None
        self.number += 1
        return Shot(now_s(), self.number, np.zeros((HEIGHT, WIDTH, 3), np.uint8))

    def events(self) -> tuple[str, ...]:
        return ()

    def close(self) -> None:
        pass


@pytest.fixture
def sitter(monkeypatch):
    seen = iter(landmarks(84.0, 1.0) * 1000)

    def find(image: Any) -> tuple[Any, ...]:
        return (DetectedFace((0.0, 0.0, 9.0, 9.0), next(seen), 0.99),)

    monkeypatch.setattr(command, "Webcam", Sitter)
    monkeypatch.setattr(command, "face_detector", lambda params: SimpleNamespace(find=find))


def test_the_command_writes_the_field_into_the_rig(sitter, tmp_path):
    rig = tmp_path / "mine.yaml"
    args = ["calibrate", "camera", "desk", "--face-at", "1.0", "--out", str(rig), "--yes"]
    done = CliRunner().invoke(app, args)
    assert done.exit_code == 0, done.output
    assert "as faces differ in size by 8 %" in " ".join(done.output.split())
    assert load_rig(str(rig)).camera.horizontal_field_deg == pytest.approx(84.0, abs=1.5)


@pytest.mark.parametrize("other", ["--oak", "--mock", "--what=lens"])
def test_what_a_face_cannot_measure_is_refused(other, tmp_path: Path):
    done = CliRunner().invoke(app, ["calibrate", "camera", "desk", "--face-at", "1.0", other])
    assert done.exit_code != 0
