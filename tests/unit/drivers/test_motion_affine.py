"""Slide, growth and spin of a moving patch, against known truth."""

from dataclasses import astuple
from typing import Any

import cv2
import numpy as np
import pytest
from reviewed import assert_reviewed

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import MovingBlob
from gazerig.drivers.vision.motion.detector import MotionDetector
from gazerig.drivers.vision.motion.params import MotionParams

WIDTH, HEIGHT, FOCAL, DT_S = 320, 240, 233.0, 1 / 30
LENS = Intrinsics(fx_px=FOCAL, fy_px=FOCAL, cx_px=(WIDTH - 1) / 2, cy_px=(HEIGHT - 1) / 2)


def textured(seed: int) -> np.ndarray:
    rng, out = np.random.default_rng(seed), np.zeros((400, 400))
    for sigma in (1.2, 4.0, 12.0):
        grain = cv2.GaussianBlur(rng.standard_normal((400, 400)), (0, 0), sigma)
        out += grain / grain.std()
    return np.clip(128 + 50 * out / out.std(), 0, 255)


GROUND, DISC = (textured(seed) for seed in (1, 2))


def seen(
    radius: float,
    slide: tuple[float, float],
    spin: float,
    loom: float,
    at: tuple[float, float] = (160.0, 120.0),
) -> list[MovingBlob]:
    """Move a textured disc over textured ground; give what was found of it, picture by picture.

    slide px/s, spin rad/s clockwise, loom 1/s; at: its middle halfway, px
    """
    count, rng = 6, np.random.default_rng(4)
    detector = MotionDetector(MotionParams())
    cover = cv2.circle(np.zeros((400, 400)), (200, 200), round(radius), 1.0, -1)
    out: list[Any] = []
    for k in range(count):
        t_s = (k - count / 2) * DT_S
        growth, angle = np.exp(loom * t_s), spin * t_s
        A = growth * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        centre = np.array(at) + np.array(slide) * t_s
        H = np.column_stack((A, centre - A @ (200.0, 200.0)))
        mask = cv2.warpAffine(cover, H, (WIDTH, HEIGHT))
        picture = (
            GROUND[:HEIGHT, :WIDTH] * (1 - mask) + cv2.warpAffine(DISC, H, (WIDTH, HEIGHT)) * mask
        )
        picture += rng.normal(0, 2, picture.shape)
        grey = np.clip(picture, 0, 255).astype(np.uint8)
        out += detector.find(grey, k * DT_S, LENS, np.eye(3))[:1]
    assert len(out) >= count - 3
    return out


CASES: Any = (
    (60, (60.0, 0.0), 0.0, 0.0),
    (20, (-200.0, 30.0), 0.0, 0.0),
    (40, (0.0, 0.0), 5.0, 0.0),
    (40, (-90.0, 40.0), -2.0, 1.5),
    (40, (100.0, 0.0), 0.0, 2.0, (5.0, 120.0)),
)


def test_every_number_of_a_thing_is_as_it_was_reviewed():
    blobs = [blob for case in CASES for blob in seen(*case)]
    rows = [[x for x in astuple(blob)[2:] if x is not None] for blob in blobs]
    assert_reviewed("motion", [np.hstack(row).tolist() for row in rows])


@pytest.mark.parametrize("radius", [60, 20])
@pytest.mark.parametrize("slide", [(60.0, 0.0), (120.0, -40.0), (-200.0, 30.0)])
def test_slide_within_5_per_cent(radius, slide):
    blobs = seen(radius, slide, 0.0, 0.0)
    speed = np.hypot(*slide)
    for blob in blobs:
        assert np.hypot(*np.subtract(blob.flow_px_s, slide)) < 0.05 * speed
        assert abs(blob.spin_rad_s) < 0.15 and abs(blob.loom_1_s) < 0.15
        assert blob.v_camera_m_s is not None
        z = blob.p_camera_m[2]
        assert blob.v_camera_m_s[:2] == pytest.approx(
            np.array(slide) * z / FOCAL, abs=0.06 * z * speed / FOCAL
        )


@pytest.mark.parametrize("radius", [60, 40, 20])
@pytest.mark.parametrize("spin", [2.0, -5.0, 10.0])
def test_spin_within_10_per_cent(radius, spin):
    blobs = seen(radius, (0.0, 0.0), spin, 0.0)
    assert np.median([blob.spin_rad_s for blob in blobs]) == pytest.approx(spin, rel=0.1)
    assert abs(np.median([blob.loom_1_s for blob in blobs])) < 0.2


@pytest.mark.parametrize("radius", [60, 40])
@pytest.mark.parametrize("loom", [0.5, 1.5, -1.0, 3.0])
def test_loom_within_10_per_cent(radius, loom):
    blobs = seen(radius, (0.0, 0.0), 0.0, loom)
    assert np.median([blob.loom_1_s for blob in blobs]) == pytest.approx(loom, rel=0.1)
    speeds = [blob.v_camera_m_s[2] for blob in blobs if blob.v_camera_m_s is not None]
    assert np.median(speeds) == pytest.approx(-2.0 * loom, rel=0.1)  # nearer: z shrinks
