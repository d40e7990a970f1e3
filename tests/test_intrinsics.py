"""The lens model: pixels to directions and back, other sizes of picture, and what perception
makes of it."""

from math import radians

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gazerig.drivers.camera.pinhole import Intrinsics, intrinsics_of_view
from gazerig.robot.model.frames import LensParams
from gazerig.robot.model.intrinsics import intrinsics_of_lens, lens_fits, project, rays

BENT = Intrinsics(480.0, 482.0, 327.0, 190.0, (-0.25, 0.09, 0.002, -0.001, -0.01))
LENS = LensParams((640, 400), (480.0, 482.0), (327.0, 190.0), BENT.distortion)


@settings(max_examples=60)
@given(
    x=st.floats(0.0, 639.0),
    y=st.floats(0.0, 399.0),
    k1=st.floats(-0.28, 0.3),
    p=st.floats(-0.003, 0.003),
)
def test_a_pixel_comes_back_through_its_ray(x: float, y: float, k1: float, p: float) -> None:
    lens = Intrinsics(480.0, 482.0, 327.0, 190.0, (k1, 0.05, p, -p, 0.0))
    found = project(rays([(x, y)], lens) * 2.5, lens)
    assert found[0] == pytest.approx((x, y), abs=1e-4)


def test_points_are_projected_as_opencv_does() -> None:
    points = np.random.default_rng(0).uniform((-0.5, -0.3, 0.8), (0.5, 0.3, 2.0), (50, 3))
    theirs, _ = cv2.projectPoints(
        points, np.zeros(3), np.zeros(3), BENT.matrix, np.array(BENT.distortion)
    )
    assert np.allclose(project(points, BENT), theirs[:, 0], atol=1e-9)


def test_what_is_behind_the_camera_has_no_pixel() -> None:
    assert np.isnan(project([(0.1, 0.1, -1.0), (0.1, 0.1, 0.0)], BENT)).all()


@pytest.mark.parametrize("distortion", [(0.0,) * 4, (0.0, 0.0, 0.0, 0.0, float("nan"))])
def test_distortion_that_is_none_is_refused(distortion: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="five finite numbers"):
        Intrinsics(1.0, 1.0, 0.0, 0.0, distortion)  # type: ignore[arg-type]


def test_a_picture_of_half_the_size_shows_the_same_directions() -> None:
    half = BENT.scaled(0.5, 0.5)
    # The middle of a block of 2 x 2 pixels becomes the middle of one pixel.
    assert rays([(100.0, 60.0)], half)[0] == pytest.approx(rays([(200.5, 120.5)], BENT)[0])


def test_a_measured_lens_serves_every_picture_of_its_shape() -> None:
    view = radians(69.0)
    assert intrinsics_of_lens(LENS, view, 640, 400) == BENT
    assert intrinsics_of_lens(LENS, view, 1280, 800) == BENT.scaled(2.0, 2.0)
    assert intrinsics_of_lens(LENS, view, 640, 480) == intrinsics_of_view(view, 640, 480)
    assert intrinsics_of_lens(None, view, 640, 400) == intrinsics_of_view(view, 640, 400)
    assert not lens_fits(LENS, 0, 0)
