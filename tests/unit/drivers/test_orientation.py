"""A camera upside down, on its side, mirrored, of any and of changing size: the same directions."""

from collections.abc import Iterator
from math import radians

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gazerig.drivers.camera.capture_loop import FrameAnalyzer, is_off_frame
from gazerig.drivers.camera.orientation import FrameOrientation
from gazerig.drivers.camera.pinhole import Intrinsics, intrinsics_of_view
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import DetectedFace, ImageArray
from gazerig.robot.model.frames import LensParams
from gazerig.robot.model.intrinsics import intrinsics_of_lens, lens_fault, project, rays
from gazerig.robot.perception.frame_locator import FrameLocator

ALL = [FrameOrientation(r, m) for r in (0, 90, 180, 270) for m in (False, True)]
NAMES = [f"{o.rotation}{' mirrored' if o.mirrored else ''}" for o in ALL]
LENS = Intrinsics(500.0, 480.0, 310.0, 205.0, (0.1, -0.05, 0.004, -0.006, 0.01))
WIDTH, HEIGHT = 640, 400
Floats = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def axes(orientation: FrameOrientation) -> Floats:
    """Return what turns directions of the camera as mounted into those of upright frames."""
    a = radians(orientation.rotation)
    clockwise = np.array([(np.cos(a), -np.sin(a), 0), (np.sin(a), np.cos(a), 0), (0, 0, 1)])
    return np.asarray(clockwise @ np.diag([-1.0 if orientation.mirrored else 1.0, 1.0, 1.0]))


@pytest.mark.parametrize("orientation", ALL, ids=NAMES)
def test_pixels_depth_and_lens_go_where_the_image_goes(orientation):
    rng = np.random.default_rng(3)
    image = rng.integers(0, 255, (HEIGHT, WIDTH, 3), np.uint8)
    depth = rng.random((HEIGHT, WIDTH)).astype(np.float32)
    shot = orientation.turn_shot(Shot(1.0, 7, image, depth, LENS))
    assert (shot.captured_s, shot.number) == (1.0, 7)
    assert FrameOrientation().turn_shot(shot) is shot
    assert shot.depth_m is not None and shot.lens is not None
    for x, y in ((0, 0), (639, 0), (0, 399), (200, 31)):
        (u, v), *_ = orientation.turn_points(np.array([[x, y]]), WIDTH, HEIGHT).round().astype(int)
        assert np.array_equal(shot.image[v, u], image[y, x])
        assert shot.depth_m[v, u] == depth[y, x]
    # The same direction, seen through either lens, distortion and all.
    pixels = np.array([(10.0, 20.0), (600.0, 30.0), (320.5, 390.0)])
    there = orientation.turn_points(pixels, WIDTH, HEIGHT)
    assert rays(there, shot.lens) == pytest.approx(rays(pixels, LENS) @ axes(orientation).T)


class Spot:
    """Finds a face whose nose is at the brightest pixel."""

    def find(self, image: ImageArray) -> tuple[DetectedFace, ...]:
        """Find it."""
        y, x = np.unravel_index(int(image[..., 0].argmax()), image.shape[:2])
        half = image.shape[1] / 16
        marks = np.array([(-1, -1), (1, -1), (0, 0), (-0.8, 1), (0.8, 1)]) * half + (x, y)
        box = (float(x) - half, float(y) - half, 2 * half, 2 * half)
        return (DetectedFace(box, marks, 1.0),)


def spot_at(direction: Floats, width: int, height: int, field_rad: float) -> ImageArray:
    """Draw a spot in a direction."""
    lens = intrinsics_of_lens(None, field_rad, width, height)
    u, v = project(direction[None], lens)[0].round().astype(int)
    image = np.zeros((height, width, 3), np.uint8)
    image[v, u] = 255
    return image


CENTRES = """-0.4 40 in, -0.6 40 out, 99.4 40 in, 99.6 40 out, 50 -0.4 in, 50 -0.6 out, 50 79.4 in,
50 79.6 out, nan 0 in"""
"""Pixels have their centres at whole numbers: a frame of 100 x 80 reaches from -0.5."""


@pytest.mark.parametrize("centre", CENTRES.split(","))
def test_a_face_whose_centre_is_outside_is_off_the_frame(centre):
    *place, found = centre.split()
    marks = np.array([(-5, -5), (5, -5), (0, 0), (-4, 5), (4, 5)]) + np.array(place, float)
    assert is_off_frame(DetectedFace((0, 0, 1, 1), marks, 1.0), 100, 80) == (found == "out")


@pytest.mark.parametrize("orientation", ALL, ids=NAMES)
def test_e100_a_person_is_at_one_place_however_the_camera_is_mounted_and_whatever_its_size(
    orientation,
):
    """Sizes change from frame to frame, as a camera's may that another program sets."""
    direction, field_rad = np.array([0.2, -0.12, 1.0]), radians(69.0)
    sizes = [(640, 480), (1280, 960), (320, 240), (1920, 1080), (640, 480)]

    def images() -> Iterator[ImageArray]:
        for width, height in sizes:
            image = spot_at(direction, width, height, field_rad)
            # As the camera delivers it: the inverse.
            image = np.rot90(image, orientation.rotation // 90)
            yield np.ascontiguousarray(image[:, ::-1] if orientation.mirrored else image)

    analyzer = FrameAnalyzer(Spot(), None, FrameLocator(None, field_rad), orientation)
    for number, (image, (width, height)) in enumerate(zip(images(), sizes, strict=True), 1):
        found = analyzer.analyze(Shot(0.1 * number, number, image))
        assert found.located is not None and (found.width_px, found.height_px) == (width, height)
        x, y, z = found.located.faces[0].p_m
        assert (x / z, y / z) == pytest.approx((0.2, -0.12), abs=4.0 / width)


# ---- The lens model: pixels to directions and back, other sizes of picture, and what perception


BENT = Intrinsics(480.0, 482.0, 327.0, 190.0, (-0.25, 0.09, 0.002, -0.001, -0.01))
BENT_LENS = LensParams((640, 400), (480.0, 482.0), (327.0, 190.0), BENT.distortion)


@settings(max_examples=60)
@given(
    x=st.floats(0.0, 639.0),
    y=st.floats(0.0, 399.0),
    k1=st.floats(-0.28, 0.3),
    p=st.floats(-0.003, 0.003),
)
def test_a_pixel_comes_back_through_its_ray(x, y, k1, p):
    lens = Intrinsics(480.0, 482.0, 327.0, 190.0, (k1, 0.05, p, -p, 0.0))
    found = project(rays([(x, y)], lens) * 2.5, lens)
    assert found[0] == pytest.approx((x, y), abs=1e-4)


def test_points_are_projected_as_opencv_does():
    points = np.random.default_rng(0).uniform((-0.5, -0.3, 0.8), (0.5, 0.3, 2.0), (50, 3))
    theirs, _ = cv2.projectPoints(
        points, np.zeros(3), np.zeros(3), BENT.matrix, np.array(BENT.distortion)
    )
    assert np.allclose(project(points, BENT), theirs[:, 0], atol=1e-9)


def test_what_is_behind_the_camera_has_no_pixel():
    assert np.isnan(project([(0.1, 0.1, -1.0), (0.1, 0.1, 0.0)], BENT)).all()


@pytest.mark.parametrize("distortion", [(0.0,) * 4, (0.0, 0.0, 0.0, 0.0, float("nan"))])
def test_distortion_that_is_none_is_refused(distortion):
    with pytest.raises(ValueError, match="five finite numbers"):
        Intrinsics(1.0, 1.0, 0.0, 0.0, distortion)


def test_a_measured_lens_serves_every_picture_of_its_shape():
    view = radians(69.0)
    assert intrinsics_of_lens(BENT_LENS, view, 640, 400) == BENT
    assert intrinsics_of_lens(BENT_LENS, view, 1280, 800) == BENT.scaled(2.0, 2.0)
    assert intrinsics_of_lens(BENT_LENS, view, 640, 480) == intrinsics_of_view(view, 640, 480)
    assert intrinsics_of_lens(None, view, 640, 400) == intrinsics_of_view(view, 640, 400)
    assert lens_fault(BENT_LENS, 0, 0)
