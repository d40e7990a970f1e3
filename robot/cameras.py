"""The camera that was asked for: a scene, a film, a recording, a webcam or an OAK-D."""

from collections.abc import Callable
from functools import partial
from math import radians

import numpy as np

from config.schema import Rig
from drivers.camera_look import Motion
from drivers.camera_poses import PoseRing
from drivers.camera_process import CameraParts, CameraProcess
from drivers.camera_replay import CameraReplay
from drivers.face_detector import face_detector
from drivers.motion_detector import MotionDetector, turned_between
from drivers.oak_camera import OakSource
from drivers.picture_source import PictureSource
from drivers.types import Camera, MovingBlob
from drivers.video_file import VideoFile
from drivers.webcam import Webcam
from gaze.types import Mat3, Vec3
from robot.choice import Choice
from robot.clock import Clock
from robot.frames import CameraMount, CameraParams
from robot.intrinsics import Intrinsics
from robot.motion_finder import motion_finder
from sim_mock.film_camera import FilmCamera
from sim_mock.pixel_camera import Exposure, PixelCamera, PixelCameraParams
from sim_mock.scene import Scene
from sim_mock.scene_camera import SceneCamera, SceneCameraParams

HeadPose = Callable[[float], tuple[Mat3, Vec3]]
"""Gives R_world_head and p_world_head_m at a time."""


def scene_camera(
    rig: Rig,
    choice: Choice,
    scene: Scene,
    mount: CameraMount,
    where: HeadPose,
    rng: np.random.Generator,
) -> Camera:
    """Make a camera on a simulated scene: drawn and looked at, or what a detector would find."""
    field_deg = rig.camera.horizontal_field_deg
    if not choice.pixels:
        params = SceneCameraParams(horizontal_field_deg=field_deg)
        return SceneCamera(params, scene, mount, where, rng)
    drawn = PixelCameraParams(horizontal_field_deg=field_deg)
    motion = _motion_of_drawn(rig, mount) if rig.motion.enabled else None
    return PixelCamera(drawn, scene, mount, where, face_detector(rig.detector), rng, motion)


def real_camera(
    rig: Rig, choice: Choice, clock: Clock, placed: CameraParams, turns: PoseRing | None
) -> Camera:
    """Make the camera of a film, a recording, a webcam or an OAK-D.

    placed: where it sits, which may be standing still though the rig's does not
    turns: how the camera was turned when; None where it stands still

    Raises:
        drivers.errors.SetupError: a film, recording or model file cannot be used.
    """
    detector = partial(face_detector, rig.detector)
    field_rad = radians(placed.horizontal_field_deg)
    motion: Callable[[], Motion] | None = None
    if rig.motion.enabled:
        motion = partial(motion_finder, rig.motion, placed.lens, field_rad, turns)
    if choice.fast:
        film = _film(choice)
        found = motion() if motion is not None else None
        return FilmCamera(film, detector(), choice.film_delay_s, motion=found)
    parts = CameraParts(_source(rig, choice), detector, motion)
    return CameraProcess(parts, clock.now_s, rig.camera_care)


def _film(choice: Choice) -> VideoFile | CameraReplay:
    return CameraReplay(choice.replay) if choice.replay is not None else VideoFile(_path(choice))


def _source(rig: Rig, choice: Choice) -> Callable[[], PictureSource]:
    """Give how to make the source, for the process that will use it."""
    if choice.replay is not None:
        return partial(CameraReplay, choice.replay)
    if choice.video is not None:
        return partial(VideoFile, choice.video)
    if choice.oak:
        return partial(OakSource, rig.oak)
    return partial(Webcam.of, choice.camera or 0, rig.webcam)


def _path(choice: Choice) -> str:
    return str(choice.video)


def _motion_of_drawn(
    rig: Rig, mount: CameraMount
) -> Callable[[Exposure, Intrinsics], tuple[MovingBlob, ...]]:
    """Find what moves in drawn pictures; they know how the camera was turned."""
    detector = MotionDetector(rig.motion)
    before: list[Mat3] = []

    def find(shot: Exposure, lens: Intrinsics) -> tuple[MovingBlob, ...]:
        turned = (
            turned_between(np.array(shot.R_world_camera), np.array(before[0])) if before else None
        )
        before[:] = [shot.R_world_camera]
        return detector.find(shot.picture, shot.captured_s, lens, turned, shot.depth_m)

    return find
