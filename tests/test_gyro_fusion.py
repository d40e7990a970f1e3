"""The camera's orientation by gyro and joints together, and what it is worth to perception."""

from math import degrees, exp, pi, radians, sin

import cv2
import numpy as np
import pytest
from oak_packets import R_CAMERA_IMU, at_rest, readings
from seeing.moving_room import CLOSE, frames, pan, rotation, shake
from seeing.row_02_camera_motion import judged

from gazerig.drivers.camera.oak.gyro import Gyro
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import CameraTurn
from gazerig.drivers.vision.motion.params import MotionParams
from gazerig.gaze.angles import compose
from gazerig.robot.perception.face_fit import rotation_by
from gazerig.robot.perception.gyro_fusion import GyroFusion, rotation_vector
from gazerig.robot.perception.motion_source import MotionSource

HZ = 30.0
OPTICAL = ((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0))


def rows(R):
    a, b, c = np.asarray(R).tolist()
    return tuple(a), tuple(b), tuple(c)


def apart_deg(A, B):
    return degrees(float(np.linalg.norm(rotation_vector(rows(np.array(A).T @ np.array(B))))))


class Base:
    """A camera on a table that is bumped, as measured by its gyro.

    angle_deg: rotation vector (deg) of the camera, in its axes at the start, at a time; small
    """

    def __init__(self, angle_deg, seconds, seed=0, rest_s=2.0, bias=(0.5, -0.3, 0.2)):
        self.angle_deg, self.rest_s = angle_deg, rest_s
        t = np.arange(round(seconds * 200)) / 200.0
        angles = np.radians([angle_deg(s) for s in t])
        rng = np.random.default_rng(seed)
        self.gyro = Gyro(np.array(R_CAMERA_IMU))
        found = at_rest(rng, rest_s, bias)
        found += readings(rng, np.gradient(angles, 1 / 200.0, axis=0), bias, rest_s)
        self._waiting = found

    def turn(self, t_s) -> CameraTurn:
        while self._waiting and self._waiting[0][0] <= t_s + self.rest_s + 0.01:
            self.gyro.add(*self._waiting.pop(0))
        found = self.gyro.orientation_at(t_s + self.rest_s)
        assert found is not None
        return found

    def truth(self, t_s):
        return compose(OPTICAL, rotation_by(tuple(np.radians(self.angle_deg(t_s)))))


def shaken(t):
    """Shake as a table does: .6 deg at 6 Hz, from one second on."""
    return (0.6 * sin(2 * pi * 6.0 * (t - 1.0)) * (t > 1.0), 0.0, 0.0)


def bumped(t):
    """Tilt by 3 deg at a blow, and swing back within .4 s."""
    since = max(0.0, t - 1.0)
    return (3.0 * sin(2 * pi * 3.0 * since) * exp(-since / 0.2), 0.0, 0.0)


def errors(base, seconds, joints=lambda t: OPTICAL, report=lambda line: None):
    """Return how far the orientation is off, by the joints alone and with the gyro, deg."""
    fusion, alone, both = GyroFusion(report), [], []
    for k in range(round(seconds * HZ)):
        t, R = k / HZ, joints(k / HZ)
        found = fusion.orientation(t, R, base.turn(t))
        alone.append(apart_deg(R, base.truth(t)))
        both.append(apart_deg(found, base.truth(t)))
    return np.array(alone), np.array(both)


@pytest.mark.parametrize(("motion", "most_deg"), [(shaken, 0.06), (bumped, 0.25)])
def test_e99_blow_to_the_base_that_the_joints_do_not_feel_is_known(motion, most_deg):
    alone, both = errors(Base(motion, 5.0), 5.0)
    assert alone.max() > 0.55
    assert both.max() < most_deg and both.max() < 0.15 * alone.max()


def test_base_that_stays_tilted_is_the_joints_again_after_some_seconds():
    fusion, base = GyroFusion(lambda line: None), Base(lambda t: (4.0 * (t > 1.0), 0.0, 0.0), 8.0)
    off = []
    for k in range(round(8.0 * HZ)):
        off.append(apart_deg(fusion.orientation(k / HZ, OPTICAL, base.turn(k / HZ)), OPTICAL))
    assert off[round(1.2 * HZ)] > 3.0
    assert off[round(6.0 * HZ)] < 0.1


def test_joints_that_tell_late_and_in_steps_are_corrected():
    def swinging(t):
        return (0.0, 12.0 * (1.0 - np.cos(2 * pi * 0.5 * t)), 0.0)  # a neck, up to 38 deg/s

    def late(t):  # 20 ms late, in steps of .35 deg
        angle = round(swinging(max(0.0, t - 0.02))[1] / 0.35) * 0.35
        return compose(OPTICAL, rotation_by((0.0, radians(angle), 0.0)))

    alone, both = errors(Base(swinging, 6.0), 6.0, late)
    assert np.sqrt((alone**2).mean()) > 0.5
    assert np.sqrt((both**2).mean()) < 0.6 * np.sqrt((alone**2).mean())


def test_gyro_that_turns_while_the_joints_stand_is_told_once_and_left_out():
    told: list[str] = []
    fusion, base = GyroFusion(told.append), Base(lambda t: (0.0, 90.0 * t, 0.0), 10.0)
    found = [fusion.orientation(k / HZ, OPTICAL, base.turn(k / HZ)) for k in range(300)]
    assert len(told) == 1 and "does not turn with the joints" in told[0]
    assert found[-1] is OPTICAL
    assert max(apart_deg(R, OPTICAL) for R in found) <= 15.0


def test_gap_another_epoch_and_time_that_runs_back_begin_with_the_joints():
    fusion = GyroFusion(lambda line: None)
    half = rows(rotation_by((0.05, 0.0, 0.0)))
    whole = rows(rotation_by((0.1, 0.0, 0.0)))
    for later_s, epoch in ((0.6, 1), (1 / HZ, 2), (0.0, 1), (-1.0, 1)):
        fusion.orientation(5.0, OPTICAL, CameraTurn(1, half))
        assert fusion.orientation(5.0 + later_s, OPTICAL, CameraTurn(epoch, whole)) == OPTICAL
    fusion.orientation(5.0, OPTICAL, CameraTurn(1, half))
    assert fusion.orientation(5.0 + 1 / HZ, OPTICAL, CameraTurn(1, whole)) != OPTICAL


def test_rotation_vectors_there_and_back():
    for vector in ((0.0, 0.0, 0.0), (1e-9, 0.0, 0.0), (0.3, -1.2, 0.5), (0.0, 2.9, 0.0)):
        assert rotation_vector(rotation_by(vector)) == pytest.approx(vector, abs=1e-9)


WIDTH, HEIGHT = 640, 400


def gyro_of(motion, seconds):
    """Return the gyro's rotation of a moved camera at a time."""
    rng, bias = np.random.default_rng(3), (0.5, -0.3, 0.2)
    R = [rotation(motion(k / 200.0)) for k in range(round(200 * seconds) + 8)]
    steps = [cv2.Rodrigues(a.T @ b)[0].ravel() for a, b in zip(R[:-1], R[1:], strict=True)]
    later = readings(rng, 200.0 * np.array(steps, dtype=np.float64), bias, 2.0025)
    waiting, gyro = [*at_rest(rng, 2.0, bias), *later], Gyro(np.array(R_CAMERA_IMU))

    def turn(t_s: float) -> CameraTurn | None:
        while waiting and waiting[0][0] <= t_s + 2.015:
            gyro.add(*waiting.pop(0))
        return gyro.orientation_at(t_s + 2.0)

    return turn


@pytest.mark.parametrize("motion", [shake, pan])
def test_e94_things_are_told_from_a_moved_camera_even_if_somebody_fills_the_image(motion):
    score = judged(frames(motion, 0.8, CLOSE), turn_of=gyro_of(motion, 0.8))
    figures = score.figures("close")
    assert figures["close: false things a picture"] <= 0.05
    assert figures["close: recall"] >= 0.95


def test_turn_of_the_gyro_goes_before_that_of_the_joints():
    class Joints:
        """Say that the camera turned though it stood."""

        def rotation_between(self, now_s, before_s):
            raise AssertionError("the joints were asked")

    source = MotionSource(MotionParams(), None, radians(69.0), Joints())  # type: ignore[arg-type]
    image = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    unit = CameraTurn(1, rows(np.eye(3)))
    for k in range(3):
        source(Shot(k / HZ, k + 1, image, turn=unit))
    with pytest.raises(AssertionError, match="joints were asked"):
        source(Shot(3 / HZ, 4, image, turn=CameraTurn(2, rows(np.eye(3)))))
