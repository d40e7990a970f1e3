"""Eyes are looked at where they have changed; what has not is placed by the crop alone."""

import cv2
import numpy as np
import pytest

from gazerig.drivers.types import ImageArray
from gazerig.drivers.vision.face.mesh import EyeLandmarkCache, EyePoints


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
