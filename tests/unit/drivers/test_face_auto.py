"""Faces are found now and then and placed in every frame: far ones too, and none is invented."""

from collections.abc import Sequence
from functools import cache

import numpy as np
import pytest
from present import present
from reviewed import assert_reviewed
from seeing.material import (
    background,
    eyes_at,
    landmark_error,
    noisy,
    paste,
    portrait,
)

from gazerig.drivers.types import ImageArray, Pixels
from gazerig.drivers.vision.face.auto import AutoDetector, far_tiles
from gazerig.drivers.vision.face.params import FaceDetectorParams

WIDTH_PX, HEIGHT_PX, FIELD_DEG = 640, 400, 69.0


def auto(**changed: object) -> AutoDetector:
    return AutoDetector(FaceDetectorParams(**changed))  # type: ignore[arg-type]


@cache
def room(
    *people: tuple[str, float, float, float], seed: int = 0
) -> tuple[ImageArray, list[Pixels]]:
    """Put people (portrait, distance, x and y of the face) into a room: frame and landmarks."""
    frame = background(WIDTH_PX, HEIGHT_PX).copy()
    truth = [
        paste(frame, portrait(who), (x, y), eyes_at(far_m, WIDTH_PX, FIELD_DEG))
        for who, far_m, x, y in people
    ]
    return noisy(frame, 2.0, np.random.default_rng(seed)), truth


@pytest.mark.parametrize("far_m", [1.0, 2.5, 4.0, 5.5])
def test_a_face_is_found_in_the_first_frame_near_and_far(far_m):
    frame, (truth,) = room(("astronaut", far_m, 420.0, 150.0))
    (face,) = auto().find(frame)
    assert landmark_error(face, truth) < (0.06 if far_m < 4.0 else 0.15)


def test_a_face_that_moves_is_placed_in_every_frame():
    detector, errors = auto(), []
    for step in range(12):
        frame, (truth,) = room(("astronaut", 1.5, 200.0 + 6.0 * step, 180.0), seed=step)
        (face,) = detector.find(frame)
        errors.append(landmark_error(face, truth))
    assert np.mean(errors) < 0.05


def test_who_comes_later_is_found_near_at_the_next_search_and_far_when_their_tile_is_due():
    detector = auto()
    empty, _ = room()
    detector.find(empty)
    near, _ = room(("astronaut", 1.2, 300.0, 180.0))
    assert any(detector.find(near) for _ in range(2))
    far, (_, truth) = room(("astronaut", 1.2, 300.0, 180.0), ("hopper", 5.0, 560.0, 120.0))
    found = next(i for i in range(120) if len(detector.find(far)) == 2)
    assert found > 0
    assert landmark_error(detector.find(far)[1], truth) < 0.2


def test_who_has_left_is_gone_with_the_frame():
    detector = auto()
    frame, _ = room(("astronaut", 1.2, 300.0, 180.0))
    assert len(detector.find(frame)) == 1
    assert detector.find(room()[0]) == ()


def test_no_face_is_invented_in_an_empty_room():
    detector = auto()
    assert not any(detector.find(room(seed=seed % 7)[0]) for seed in range(30))


def test_a_face_in_a_dark_room_is_found_and_no_face_in_a_dark_empty_one():
    frame, (truth,) = room(("astronaut", 1.2, 300.0, 180.0))
    (face,) = auto().find(noisy((frame * 0.1).astype(np.uint8), 2.0, np.random.default_rng(1)))
    assert landmark_error(face, truth) < 0.1
    detector = auto()
    for seed in range(8):
        dark = (room()[0] * 0.1).astype(np.uint8)
        assert detector.find(noisy(dark, 2.0, np.random.default_rng(seed))) == ()


def test_every_number_of_faces_is_as_it_was_reviewed():
    detector, rows = auto(), list[Sequence[float]]()
    for step in range(6):
        near = "astronaut", 1.2, 300.0 + 4.0 * step, 180.0
        for face in detector.find(room(near, ("hopper", 5.0, 560.0, 120.0), seed=step)[0]):
            signs = present(face.signs)
            mouth = 1e3 * signs.mouth_opening_m, 1e3 * signs.mouth_sd_m
            rows.append((step, *face.box_px, *face.landmarks_px.flat, face.confidence, *mouth))
    sizes = (640, 400, 0.6), (1280, 720, 0.375), (320, 240, 1.0)
    assert_reviewed("faces", [*rows, *(tile for size in sizes for tile in far_tiles(*size))])


def test_an_open_mouth_is_measured_without_a_mesh():
    frame, (truth,) = room(("astronaut", 1.0, 300.0, 180.0))
    shut = present(auto().find(frame)[0].signs)
    x, y = truth[3:].mean(axis=0).astype(int)
    opening = frame.copy()
    opening[y - 1 : y + 2, x - 4 : x + 5] = 0
    opened = present(auto().find(opening)[0].signs)
    assert opened.mouth_opening_m > shut.mouth_opening_m + 2.0 * shut.mouth_sd_m
