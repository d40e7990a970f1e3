"""The gyro of an OAK camera: turns, bias, axes, and messages about a useless one."""

import threading
from math import nan, radians

import cv2
import numpy as np
import pytest
from oak_packets import R_CAMERA_IMU, at_rest, calibrated, imu_message, packet, readings
from oak_stand_in import Message, Rig
from present import present

from gazerig.drivers.camera.oak.calibration import imu_to_camera, rotation_matrix
from gazerig.drivers.camera.oak.discovery import load_depthai
from gazerig.drivers.camera.oak.gyro import Gyro
from gazerig.drivers.types import CameraTurn

R_IMU = np.array(R_CAMERA_IMU)
BIAS_DEG_S = (0.7, -0.4, 0.2)


@pytest.fixture(scope="module")
def dai():
    return load_depthai()


def fed(found, gyro=None):
    """Return a gyro that has got readings."""
    gyro = gyro or Gyro(R_IMU)
    for t_s, rates in found:
        gyro.add(t_s, rates)
    return gyro


def vector_deg(R):
    """Return axis times angle of a rotation, degrees."""
    return np.degrees(cv2.Rodrigues(np.array(R))[0].ravel())


def moved(turn: CameraTurn, before: CameraTurn):
    found = turn.rotation_since(before)
    assert found is not None
    return vector_deg(found.T)


def swaying(seconds, seed=0):
    """Return a gyro after a rest of 2 s and a sway, and the true angles at times after it."""
    rng = np.random.default_rng(seed)
    k = np.arange(round(seconds * 200))
    yaw = radians(20.0) * np.sin(2 * np.pi * 0.9 * k / 200.0)  # up to 113 deg/s
    rates = np.zeros((len(k), 3))
    rates[:, 1] = np.gradient(yaw, 1 / 200.0)
    gyro = fed(at_rest(rng, 2.0, BIAS_DEG_S))
    return fed(readings(rng, rates, BIAS_DEG_S, 2.0), gyro), np.degrees(yaw)


def test_turn_is_measured_between_any_two_frames():
    for seed in range(5):
        gyro, yaw = swaying(3.0, seed)
        for a, b in ((210.3, 300.7), (400.5, 407.1), (420.0, 598.9)):
            times = 2.0 + np.array((a, b)) / 200.0
            before, now = (gyro.orientation_at(t) for t in times)
            true = np.interp((times - 2.0) * 200.0, np.arange(len(yaw)), yaw)
            off = moved(now, before) - (0.0, true[1] - true[0], 0.0)
            assert np.abs(off).max() < 0.04


def test_bias_is_that_of_the_rest_and_follows_the_temperature():
    rng = np.random.default_rng(1)
    gyro = Gyro(np.eye(3))
    assert not gyro.is_settled
    for hundredth in range(60):  # a minute at rest; half a degree a second warmer at its end
        warmer = 0.3 + hundredth / 120.0
        for t_s, rates in readings(rng, np.zeros((200, 3)), (warmer, 0, 0), float(hundredth)):
            gyro.add(t_s, rates)
    assert gyro.is_settled
    before, now = gyro.orientation_at(58.5), gyro.orientation_at(59.9)
    assert np.abs(moved(now, before)).max() < 0.1
    assert gyro.events() == ()


@pytest.mark.parametrize("hz", [0.2, 0.5, 2.0])
def test_slow_breathing_is_no_rest(hz):
    t = np.arange(200 * 30) / 200.0
    rates = np.zeros((len(t), 3))
    rates[:, 0] = radians(0.5) * 2 * np.pi * hz * np.cos(2 * np.pi * hz * t)  # half a degree
    gyro = fed(readings(np.random.default_rng(2), rates))
    assert not gyro.is_settled and gyro.orientation_at(29.9) is None
    (told,) = gyro.events()
    assert "has not been at rest for 20 s" in told


def test_axes_are_those_of_the_calibration(dai):
    found = imu_to_camera(dai, calibrated(dai))
    assert found is not None
    np.testing.assert_allclose(found, R_IMU, atol=1e-6)
    np.testing.assert_allclose(rotation_matrix((0.0, 0.0, 90.0)), R_IMU, atol=1e-9)
    vector = (12.0, -30.0, 140.0)
    np.testing.assert_allclose(
        rotation_matrix(vector), cv2.Rodrigues(np.radians(vector))[0], atol=1e-9
    )
    np.testing.assert_allclose(rotation_matrix((0.0, 0.0, 0.0)), np.eye(3), atol=1e-12)
    assert imu_to_camera(dai, calibrated(dai, imu=False)) is None


def test_gap_begins_another_epoch():
    rng = np.random.default_rng(3)
    gyro = fed(at_rest(rng, 2.0))
    first = gyro.orientation_at(1.99)
    fed([(t + 2.5, rates) for t, rates in at_rest(rng, 1.0)], gyro)
    second = gyro.orientation_at(3.4)
    assert first is not None and second is not None
    assert second.epoch == first.epoch + 1 and second.rotation_since(first) is None
    assert gyro.orientation_at(2.2) is None and gyro.events() == ()


def test_frame_a_little_younger_than_the_readings_is_known_an_older_one_not():
    gyro, _ = swaying(1.0)
    assert gyro.orientation_at(3.01) is not None
    assert gyro.orientation_at(3.06) is None
    assert gyro.orientation_at(0.1) is None  # more than two seconds before
    assert gyro.events() == ()


@pytest.mark.parametrize("value", [0.0, 0.02])
def test_e95_stuck_gyro_is_told_once(value):
    gyro = fed(at_rest(np.random.default_rng(5), 2.0))
    fed([(2.0 + k / 200.0, (value, 0.0, 0.0)) for k in range(400)], gyro)
    (told,) = gyro.events()
    assert "gyro is stuck: always the same reading" in told and "oak.gyro: false" in told
    assert gyro.orientation_at(3.9) is None and gyro.is_settled
    fed([(t + 4.0, rates) for t, rates in at_rest(np.random.default_rng(5), 2.0)], gyro)
    assert gyro.events() == () and gyro.orientation_at(5.9) is None


@pytest.mark.parametrize("rates", [(nan, 0.0, 0.0), (0.0, 70.0, 0.0), (float("inf"), 0.0, 0.0)])
def test_absurd_gyro_is_told_once(rates):
    gyro = fed(at_rest(np.random.default_rng(6), 2.0))
    fed([(2.0 + k / 200.0, rates) for k in range(400)], gyro)
    (told,) = gyro.events()
    assert "gyro returns impossible readings" in told
    assert gyro.orientation_at(3.9) is None


def test_one_absurd_reading_is_left_out():
    found = at_rest(np.random.default_rng(7), 3.0)
    found[500] = found[500][0], (nan, 1e6, 0.0)
    gyro = fed(found)
    assert gyro.events() == () and gyro.orientation_at(2.9) is not None
    assert np.abs(moved(gyro.orientation_at(2.9), gyro.orientation_at(2.3))).max() < 0.1


def test_gyro_that_falls_silent_or_never_speaks_is_told_once():
    gyro = fed(at_rest(np.random.default_rng(8), 2.0))
    for k in range(90):
        gyro.orientation_at(1.9 + k / 30.0)
    (told,) = gyro.events()
    assert "returns no readings" in told and gyro.orientation_at(2.0) is None
    mute = Gyro(R_IMU)
    for k in range(60):
        assert mute.orientation_at(100.0 + k / 30.0) is None
    assert len(mute.events()) == 1


def test_frames_carry_the_turn(dai):
    rates = np.zeros((600, 3))
    rates[400:, 1] = radians(30.0)  # to the right after 2 s of rest
    found = readings(np.random.default_rng(9), rates, BIAS_DEG_S, 8.0)
    rig = Rig(gyro=[imu_message(dai, [packet(dai, t_s, one)]) for t_s, one in found])
    source = rig.opened()
    rig.queue.fed += [Message(10.2, 100.2), Message(10.7, 100.7)]
    first, last = (
        present(present(source.take(lambda: 100.8, threading.Event())).turn) for _ in range(2)
    )
    assert source.events() == ()
    assert moved(last, first) == pytest.approx((0, 15.0, 0), abs=0.1)
