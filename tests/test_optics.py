"""Lens and sensor of a simulated camera, on pictures that are known: nothing is rendered."""

import numpy as np
import pytest

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.intrinsics import project
from gazerig.robot.model.scene_view import PinholeView, Rendered
from gazerig.sim_mock.cameras.optics import (
    CameraMotion,
    OpticsParams,
    Sensor,
    SensorParams,
    expose,
    ideal_size_px,
    through_lens,
)

LEVEL: Mat3 = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
HERE: Vec3 = (0.0, 0.0, 0.0)
STILL = CameraMotion(LEVEL, HERE, LEVEL, HERE, 0.0)
SIZE = 160, 120
LENS = Intrinsics(120.0, 124.0, 82.0, 57.0)


class Dots:
    """White dots of 3 x 3 pixels in known directions, and the commands."""

    def __init__(self, *directions: Vec3) -> None:
        self.directions = np.array(directions)
        self.times: list[float] = []

    def draw(
        self, seen_by: PinholeView, *, depth: bool = False, rows: tuple[int, int] | None = None
    ) -> Rendered:
        t_s, lens, size_px, R, _ = seen_by
        self.times.append(t_s)
        image = np.zeros((size_px[1], size_px[0], 3), np.uint8)
        for x, y in np.rint(project(self.directions @ np.array(R), lens)).astype(int):
            image[y - 1 : y + 2, x - 1 : x + 2] = 255
        wanted = slice(*(rows or (None,)))
        metres = np.full(image.shape[:2], 2.0, np.float32)
        return Rendered(image[wanted], metres[wanted] if depth else None)

    def close(self) -> None:
        pass


@pytest.mark.parametrize("k1", [-0.3, 0.15])
def test_what_a_lens_bends_lands_where_the_programs_model_of_it_says(k1: float) -> None:
    lens = Intrinsics(120.0, 124.0, 82.0, 57.0, (k1, 0.05, 0.001, -0.002, 0.0))
    for direction in ((0.0, 0.0, 1.0), (0.4, -0.3, 1.0), (-0.55, 0.3, 1.0)):
        seen = through_lens(Dots(direction), PinholeView(0.0, lens, SIZE, LEVEL, HERE), depth=True)
        light = seen.image[..., 0].astype(float)
        rows, columns = np.mgrid[0 : SIZE[1], 0 : SIZE[0]]
        place = (light * columns).sum() / light.sum(), (light * rows).sum() / light.sum()
        assert place == pytest.approx(project([direction], lens)[0].tolist(), abs=0.75)
        assert seen.depth_m is not None
        assert (seen.depth_m == 2.0).all()
    wide = ideal_size_px(lens, SIZE)
    assert (wide[0] > SIZE[0]) == (k1 < 0.0)
    assert ideal_size_px(LENS, SIZE) == SIZE


def test_an_exposure_is_spread_evenly_about_its_middle() -> None:
    view = Dots((0.0, 0.0, 1.0))
    expose(view, OpticsParams(exposure_ms=8.0, sub_exposures=4), 5.0, LENS, SIZE, STILL)
    assert np.subtract(view.times, 5.0) == pytest.approx([-3e-3, -1e-3, 1e-3, 3e-3])


def test_rows_are_read_from_the_first_to_the_last() -> None:
    view = Dots((0.0, 0.0, 1.0))
    params = OpticsParams(exposure_ms=0.0, read_out_ms=10.0, bands=5)
    seen = expose(view, params, 5.0, LENS, SIZE, STILL, depth=True)
    assert np.subtract(view.times, 5.0) == pytest.approx([-4e-3, -2e-3, 0.0, 2e-3, 4e-3])
    assert seen.image.shape == (120, 160, 3)
    assert seen.depth_m is not None
    assert seen.depth_m.shape == (120, 160)
    whole = Dots((0.0, 0.0, 1.0)).draw(PinholeView(0.0, LENS, SIZE, LEVEL, HERE))
    assert (seen.image == whole.image).all()


def test_a_blurred_lens_spreads_light_and_loses_none() -> None:
    view = Dots((0.0, 0.0, 1.0))
    sharp = expose(view, OpticsParams(), 0.0, LENS, SIZE, STILL).image.astype(float)
    soft = expose(view, OpticsParams(blur_px=1.5), 0.0, LENS, SIZE, STILL).image.astype(float)
    assert soft.max() < 0.7 * sharp.max()
    assert soft.sum() == pytest.approx(sharp.sum(), rel=0.05)


def read(grey: int, **params: float) -> np.ndarray:
    """Return what a sensor makes of an even grey."""
    sensor = Sensor(SensorParams(**params), np.random.default_rng(1))
    return sensor.image(np.full((64, 64, 3), grey, np.uint8)).astype(float)


def test_gain_and_gamma_change_the_light_and_white_stays_white() -> None:
    assert read(100, noise_grey=0.0).mean() == 100.0
    assert read(100, noise_grey=0.0, gain=1.5).mean() == 150.0
    assert read(200, noise_grey=0.0, gain=1.5).min() == 255.0
    assert read(128, noise_grey=0.0, gamma=2.0).mean() == pytest.approx(
        255 * (128 / 255) ** 2, abs=1
    )


def test_the_noise_of_light_grows_with_the_root_of_the_light() -> None:
    assert read(120).std() == pytest.approx(3.0, rel=0.08)
    dark, bright = (read(g, noise_grey=1.0, shot_noise_grey=8.0).std() for g in (40, 160))
    assert dark == pytest.approx(np.hypot(1.0, 8.0 * (40 / 255) ** 0.5), rel=0.08)
    assert bright == pytest.approx(np.hypot(1.0, 8.0 * (160 / 255) ** 0.5), rel=0.08)
