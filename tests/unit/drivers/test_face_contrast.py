"""Dark and pale images get contrast before a network sees them; others are left as they are."""

import numpy as np
import pytest
from reviewed import assert_reviewed
from seeing.material import noisy, portrait
from seeing.row_05_finding_and_placing import after_frames

from gazerig.drivers.types import DetectedFace, ImageArray
from gazerig.drivers.vision.face.detector import face_detector
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.drivers.vision.face.preprocess import (
    FoundFace,
    crop_square,
    grey_range,
    improve_contrast,
    new_faces,
    to_squares,
    whole_image,
)

PHOTO = portrait("astronaut").image[40:240, 100:340]


def paled(share: float) -> ImageArray:
    """Return the photo as through fog, with the noise of a sensor."""
    pale = (255.0 - (255.0 - PHOTO) * share).astype(np.uint8)
    return noisy(pale, 2.0, np.random.default_rng(0))


def test_an_image_with_contrast_is_left_as_it_is():
    assert improve_contrast(PHOTO) is PHOTO


@pytest.mark.parametrize("image", [paled(0.15), (0.12 * PHOTO).astype(np.uint8)])
def test_a_pale_or_dark_one_gets_the_contrast_of_others(image):
    dark, bright = grey_range(improve_contrast(image)[..., 1])
    assert dark < 25.0 and 150.0 < bright < 256.0


def test_a_wall_stays_a_wall():
    """Noise is raised by no more than the gain, and smoothed."""
    wall = noisy(np.full((120, 160, 3), 200, np.uint8), 2.0, np.random.default_rng(1))
    assert improve_contrast(wall).std() < 8.0 * wall.std()
    assert after_frames(face_detector(FaceDetectorParams()), wall) == 0


def test_every_pixel_of_prepared_images_is_as_it_was_reviewed():
    boxes = np.array([(-3.0, 5.5, 21.0, 29.5), (10.2, 3.1, 50.4, 43.3), (0.0, 0.0, 120.0, 120.0)])
    crops = [crop_square(PHOTO, box, 8) for box in to_squares(boxes + (0.0, 0.0, 0.0, 4.0))]
    tiles = whole_image(PHOTO, 12).cut(PHOTO)[1], improve_contrast(paled(0.4))[::40, ::40]
    rows = [array.ravel().tolist() for crop in crops for array in crop]
    assert_reviewed("prepared", [*rows, *(tile.ravel().tolist() for tile in tiles)])


def test_a_pale_face_is_found():
    assert after_frames(face_detector(FaceDetectorParams()), paled(0.15)) == 1


def test_a_face_that_is_searched_elsewhere_next_is_still_the_same():
    face = DetectedFace((100.0, 50.0, 40.0, 40.0), np.zeros((5, 2)), 0.9)
    found = [FoundFace(np.array([x, 50.0, x + 40.0, 90.0]), face, True) for x in (100.0, 130.0)]
    assert len(new_faces(found, [])) == 1
