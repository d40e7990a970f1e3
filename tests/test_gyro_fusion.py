"""The camera's orientation by gyro and joints together, and what it is worth to perception."""

from math import degrees, exp, pi, radians, sin

import cv2
import numpy as np
import pytest
from desk import GAZE_JOINTS, LIDS
from fakes.cameras import QuietCamera
from oak_packets import R_CAMERA_IMU, at_rest, readings
from seeing.moving_room import CLOSE, Board, frames, pan, rotation, shake
from seeing.row_02_camera_motion import judged

import gazerig
from gazerig.drivers.camera import recording_format as fmt
from gazerig.drivers.camera.oak.gyro import Gyro
from gazerig.drivers.camera.pinhole import intrinsics_of_view
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import CameraTurn, DetectedFace, Detections
from gazerig.drivers.vision.motion.params import MotionParams
from gazerig.gaze.angles import compose
from gazerig.robot.model.face_geometry import LANDMARKS_FACE_M
from gazerig.robot.model.frames import CameraMount, CameraParams, PoseHistory
from gazerig.robot.model.intrinsics import project
from gazerig.robot.model.kinematics import GeometryParams, Kinematics
from gazerig.robot.model.tracker_params import TrackerParams
from gazerig.robot.perception.face_fit import rotation_by
from gazerig.robot.perception.gyro_fusion import GyroFusion, rotation_vector
from gazerig.robot.perception.motion_source import MotionSource
from gazerig.robot.perception.perception import Perception
from gazerig.robot.perception.tracker import Tracker

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


def test_bias_that_is_left_costs_little():
    base = Base(lambda t: (0.05 * t, 0.0, 0.0), 20.0)  # .05 deg/s that is no motion
    fusion = GyroFusion(lambda line: None)
    found = [fusion.orientation(k / HZ, OPTICAL, base.turn(k / HZ)) for k in range(600)]
    assert apart_deg(found[-1], OPTICAL) < 0.07


def test_gyro_that_turns_while_the_joints_stand_is_told_once_and_left_out():
    told: list[str] = []
    fusion, base = GyroFusion(told.append), Base(lambda t: (0.0, 90.0 * t, 0.0), 10.0)
    found = [fusion.orientation(k / HZ, OPTICAL, base.turn(k / HZ)) for k in range(300)]
    assert len(told) == 1 and "does not turn with the joints" in told[0]
    assert found[-1] is OPTICAL
    assert max(apart_deg(R, OPTICAL) for R in found) <= 15.0


def test_gyro_is_tried_again_after_a_minute_and_told_no_second_time():
    told: list[str] = []
    fusion = GyroFusion(told.append)
    for k in range(round(200 * HZ)):
        t = k / HZ
        turning = t < 5.0 or t > 150.0  # carried about, at rest, carried again
        turn = CameraTurn(1, rows(rotation_by((0.0, 0.2 * k * turning, 0.0))))
        R = fusion.orientation(t, OPTICAL, turn)
        if 70.0 < t < 149.0:
            assert R is not OPTICAL and apart_deg(R, OPTICAL) < 1.0
    assert len(told) == 1


def test_camera_that_is_placed_anew_is_there_at_once():
    mount = CameraMount(CameraParams(position_mm=(20.0, 0.0, 45.0)))
    fusion, base = GyroFusion(lambda line: None), Base(shaken, 3.0)
    perception = Perception(mount, 69.0, Tracker(TrackerParams()), gyro=fusion)
    poses = PoseHistory(KINEMATICS)
    poses.remember(0.0, (0.0, 0.0, 0.0))
    places = []
    for k in range(1, 70):
        if k == 60:
            mount.retune(CameraParams(position_mm=(20.0, 0.0, 45.0), yaw_deg=10.0))
            perception.retune(69.0, None, None)
        t = k / HZ
        found = Detections(t, k, WIDTH, HEIGHT, turn=base.turn(t))
        perception.see(found, poses)
        places.append(fusion._before[2])  # type: ignore[index]
    assert apart_deg(places[58], places[59]) == pytest.approx(10.0, abs=1.5)


def test_without_a_gyro_nothing_changes():
    fusion = GyroFusion(lambda line: None)
    for k in range(3):
        assert fusion.orientation(k / HZ, OPTICAL, None) is OPTICAL


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
LENS = intrinsics_of_view(radians(69.0), WIDTH, HEIGHT)
KINEMATICS = Kinematics(GeometryParams(70.0, 38.0, 55.0), GAZE_JOINTS, LIDS)


def wander_deg(gyro):
    """Return how far a still face 2 m away seems to move while the table shakes."""
    base = Base(shaken, 4.0)
    mount = CameraMount(CameraParams(position_mm=(20.0, 0.0, 45.0)))
    fusion = GyroFusion(lambda line: None)
    perception = Perception(mount, 69.0, Tracker(TrackerParams()), gyro=fusion)
    poses = PoseHistory(KINEMATICS)
    poses.remember(0.0, (0.0, 0.0, 0.0))
    frontal = np.array([(0.0, 1.0, 0.0), (0.0, 0.0, -1.0), (-1.0, 0.0, 0.0)])
    places = []
    for k in range(1, 120):
        t = k / HZ
        R = rotation_by(tuple(np.radians(shaken(t))))
        seen = (LANDMARKS_FACE_M @ frontal.T + (0.2, 0.1, 2.0)) @ np.array(R)
        points = project(seen, LENS)
        (x, y), (right, bottom) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
        face = DetectedFace((x, y, right - x, bottom - y), points, 0.9)
        turn = base.turn(t)
        found = Detections(t, k, WIDTH, HEIGHT, (face,), turn=turn if gyro else None)
        percept = perception.see(found, poses)
        assert percept is not None
        x_m, _, z_m = percept.faces[0].p_world_m
        places.append(degrees(z_m / x_m))
    return float(np.std(places[30:]))


def test_still_face_stays_where_it_is_while_the_table_shakes():
    without, with_gyro = wander_deg(False), wander_deg(True)
    assert without > 0.2
    assert with_gyro < 0.15 * without


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


HALF_OF_THE_IMAGE = (Board((0.0, 0.2, 0.9), (0.55, 0.8), 4, True, 0.5, 0.4),)


@pytest.mark.parametrize("motion", [shake, pan])
def test_e94_things_are_told_from_a_moved_camera_even_if_somebody_fills_the_image(motion):
    score = judged(frames(motion, 0.8, CLOSE), turn_of=gyro_of(motion, 0.8))
    figures = score.figures("close")
    assert figures["close: false things a picture"] <= 0.05
    assert figures["close: recall"] >= 0.95


@pytest.mark.parametrize("motion", [shake, pan])
def test_e94_what_the_gyro_adds_where_somebody_fills_half_of_the_image(motion):
    seen = list(frames(motion, 0.8, HALF_OF_THE_IMAGE))
    with_gyro, without = judged(seen, turn_of=gyro_of(motion, 0.8)), judged(seen)
    assert with_gyro.false <= 0.05 * with_gyro.pictures
    assert without.false >= 0.3 * without.pictures


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


class Spinning(QuietCamera):
    """A camera of a program whose gyro turns while the head is still."""

    def latest(self, now_s: float) -> Detections:
        number = int(now_s * HZ)
        turn = CameraTurn(1, rows(rotation_by((0.0, number * 0.1, 0.0))))
        return Detections(number / HZ, number, WIDTH, HEIGHT, turn=turn)


def test_wrong_gyro_is_told_once_in_a_run_which_goes_on():
    with gazerig.open("desk", fast=True, camera=Spinning()) as head:
        head.step(2.0)
        texts = [event.text for event in head.events(timeout_s=0)]
    assert sum("does not turn with the joints" in text for text in texts) == 1


def test_recording_keeps_the_turn():
    turn = CameraTurn(7, rows(rotation_by((0.1, -0.2, 0.3))))
    shot = Shot(1.0, 1, np.zeros((4, 6, 3), np.uint8), turn=turn)
    messages = dict(fmt.encode_shot(shot, None))
    found = fmt.decode_turn(messages[fmt.TURN])
    assert found.epoch == 7 and np.allclose(found.R_start_camera, turn.R_start_camera)
    for wrong in (b"{}", b'{"epoch": 1, "R": [1, 0]}', b'{"epoch": 1, "R": [1,0,0,0,1,0,0,0,2]}'):
        with pytest.raises(fmt.BadMessage):
            fmt.decode_turn(wrong)
