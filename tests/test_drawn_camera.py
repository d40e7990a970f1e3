"""A drawn scene in real time: the camera's process draws and detects, the loop sends the pose."""

import threading
from functools import partial

import numpy as np

from gazerig.config.schema import load_rig
from gazerig.drivers.camera.shared_slots import PoseBuffer
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.camera.worker import CameraWorker
from gazerig.robot.model.frames import CameraMount
from gazerig.robot.run.cameras import DrawnSource, scene_pixels
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.run import Run
from gazerig.robot.run.surroundings import load_scene

LEVEL = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
LEFT = ((0.8, -0.6, 0.0), (0.6, 0.8, 0.0), (0.0, 0.0, 1.0))


def test_the_newest_pose_is_read_whole() -> None:
    poses = PoseBuffer()
    assert poses.newest() is None and poses.first_s == 0.0
    poses.record(2.0, LEVEL, (0.0, 0.0, 0.1))
    poses.record(2.5, LEFT, (0.1, 0.2, 0.3))
    assert poses.newest() == (2.5, LEFT, (0.1, 0.2, 0.3)) and poses.first_s == 2.0


def source(scene: str, poses: PoseBuffer) -> DrawnSource:
    mount = CameraMount(load_rig("desk").camera)
    make = partial(scene_pixels, load_scene(scene), mount, 69.0, np.random.default_rng(3))
    return DrawnSource(make, poses)


def taken(frames: DrawnSource, poses: PoseBuffer, t_s: float) -> Shot:
    poses.record(t_s, LEVEL, (0.0, 0.0, 0.1))
    frames._due_s = 0.0
    shot = frames.take(lambda: t_s, threading.Event())
    assert shot is not None
    return shot


def test_frames_are_drawn_as_of_the_pose_that_was_told() -> None:
    poses = PoseBuffer()
    frames = source("face-to-face", poses)
    frames.open()
    first = taken(frames, poses, 100.0)
    second = taken(frames, poses, 100.2)
    assert (first.captured_s, second.captured_s) == (100.0, 100.2)
    assert second.number > first.number and first.image.shape == (400, 640, 3)
    poses.record(100.4, LEFT, (0.0, 0.0, 0.1))
    frames._due_s = 0.0
    aside = frames.take(lambda: 100.4, threading.Event())
    assert aside is not None
    apart = [np.abs(one.image.astype(int) - first.image).mean() for one in (second, aside)]
    assert apart[1] > 3.0 * apart[0]


def test_only_a_drawn_scene_in_real_time_has_a_process() -> None:
    rig = load_rig("desk")
    made = Run(rig, RunOptions(mock=True, pixels=True, scene="visitor", bus="ideal"))
    try:
        assert isinstance(made.robot.camera, CameraWorker)
    finally:
        made.close()
