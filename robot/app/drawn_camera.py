"""A drawn scene seen as through a real camera: drawn and looked at in the camera's own process.

The control loop only says where the head is. The process draws what is seen from there and looks
for faces and motion in it, so that neither can delay a tick.
"""

import threading
from collections.abc import Callable
from functools import partial

import numpy as np

from gazerig.config.schema import Rig
from gazerig.drivers.camera.frame_analysis import Locate, Motion
from gazerig.drivers.camera.pose_buffer import PoseBuffer
from gazerig.drivers.camera.pose_slot import PoseSlot
from gazerig.drivers.camera.process import CameraProcess
from gazerig.drivers.camera.source import FrameSource, Shot
from gazerig.drivers.camera.worker import CameraParts
from gazerig.drivers.types import DetectedFace, Detections, FaceDetector, ImageArray, MovingBlob
from gazerig.drivers.vision.motion.params import MotionParams
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.frames import CameraMount, LensParams
from gazerig.robot.perception.motion_source import MotionSource
from gazerig.sim_mock.scenes.scene import Scene

_LOOK_S = 0.002


class PlannedPlaces:
    """What the scene's planner names in the newest frame; shared by source and motion finder."""

    def __init__(self) -> None:
        self.blobs: tuple[MovingBlob, ...] = ()


class DrawnSource:
    """Frames of a scene, drawn from where the head is.

    Args:
        scene: what is before the camera.
        mount: where it sits on the head.
        field_deg: its horizontal field of view.
        poses: where the head is; the scene begins with the first.
        planned: takes what the scene's planner names.
        rng: for the noise of the frames.
    """

    def __init__(
        self,
        scene: Scene,
        mount: CameraMount,
        field_deg: float,
        poses: PoseSlot,
        planned: PlannedPlaces,
        rng: np.random.Generator,
    ) -> None:
        from gazerig.sim_mock.cameras.rendered import PixelCamera, PixelCameraParams

        params = PixelCameraParams(horizontal_field_deg=field_deg, latency_ms=0.0)
        self._period_s = 1.0 / params.rate_hz
        self._camera = PixelCamera(params, scene, mount, self._head, _NoFaces(), rng)
        self._poses, self._planned = poses, planned
        self._number = 0
        self._due_s = 0.0

    def open(self) -> None:
        """Begin with the first frame."""
        self._camera.open()
        self._number = 0

    def take(self, now_s: Callable[[], float], stop: threading.Event) -> Shot | None:
        """Draw the next frame, as of the newest pose; None where ``stop`` was set."""
        while not stop.is_set():
            newest, wait_s = self._poses.newest(), self._due_s - now_s()
            if newest is None or wait_s > 0.0:
                stop.wait(max(wait_s, _LOOK_S))
                continue
            if self._number == 0:
                self._camera.latest(self._poses.first_s)  # the scene's own time begins here
            found = self._camera.latest(newest.t_s)
            if found is None or found.number == self._number:
                stop.wait(_LOOK_S)
                continue
            self._due_s = now_s() + max(0.0, self._period_s - (now_s() - newest.t_s))
            return self._shot(found)
        return None

    def events(self) -> tuple[str, ...]:
        """Return nothing: nothing can happen to a drawn camera."""
        return ()

    def close(self) -> None:
        """Stop; there is nothing to free."""

    def _head(self, t_s: float) -> tuple[Mat3, Vec3]:
        newest = self._poses.newest()
        assert newest is not None  # ``take`` waits for the first
        return newest.R_world_head, newest.p_world_head_m

    def _shot(self, found: Detections) -> Shot:
        image = found.image
        assert image is not None
        self._number, self._planned.blobs = found.number, tuple(found.blobs)
        return Shot(found.captured_s, found.number, image, found.depth_m)


class _NoFaces:
    """Finds none: the process looks for faces afterwards, as in every camera's frames."""

    def find(self, bgr: ImageArray) -> tuple[DetectedFace, ...]:
        """Return none."""
        return ()


class MotionBesidePlans(MotionSource):
    """What moves in the frames, and the places that the scene's planner names."""

    def __init__(
        self,
        planned: PlannedPlaces,
        params: MotionParams,
        lens: LensParams | None,
        field_rad: float,
        turns: PoseBuffer | None,
    ) -> None:
        super().__init__(params, lens, field_rad, turns)
        self._planned = planned

    def __call__(self, shot: Shot) -> tuple[MovingBlob, ...]:
        """Find what has moved since the frame before; planned places come along."""
        return (*super().__call__(shot), *self._planned.blobs)


class DrawnCamera:
    """A camera in a drawn scene, which is told at each look where the head is.

    Args:
        process: draws and looks.
        poses: takes where the head is.
        where: returns rotation and place of the head in the world at a time.
    """

    def __init__(
        self, process: CameraProcess, poses: PoseSlot, where: Callable[[float], tuple[Mat3, Vec3]]
    ) -> None:
        self.process = process
        self._poses, self._where = poses, where

    @property
    def frames(self) -> int:
        """Return the count of frames since ``open``."""
        return self.process.frames

    @property
    def frames_with_face(self) -> int:
        """Return the count of those in which a face was found."""
        return self.process.frames_with_face

    def open(self) -> None:
        """Start the process; raises as it does."""
        self.process.open()

    def latest(self, now_s: float) -> Detections | None:
        """Return what the newest frame showed, None before the first."""
        self._poses.record(now_s, *self._where(now_s))
        return self.process.latest(now_s)

    def events(self) -> tuple[str, ...]:
        """Return what has happened since the last call, one line each."""
        return self.process.events()

    def close(self) -> None:
        """End the process; safe to call twice."""
        self.process.close()


def drawn_camera(
    rig: Rig,
    scene: Scene,
    mount: CameraMount,
    where: Callable[[float], tuple[Mat3, Vec3]],
    rng: np.random.Generator,
    clock: Clock,
    detector: Callable[[], FaceDetector],
    motion: Callable[[PlannedPlaces], Callable[[], Motion]],
    locate: Locate,
) -> DrawnCamera:
    """Return a camera on a drawn scene in real time.

    Args:
        rig: how wide it sees, and how a lost camera is recovered.
        scene: what is before it.
        mount: where it sits on the head.
        where: rotation and place of the head in the world at a time.
        rng: for the noise.
        clock: the host's.
        detector: makes what finds faces.
        motion: returns what makes the motion finder that lets planned places pass.
        locate: locates what is found in the camera's axes.
    """
    poses, planned = PoseSlot(), PlannedPlaces()
    source: Callable[[], FrameSource] = partial(
        DrawnSource, scene, mount, rig.camera.horizontal_field_deg, poses, planned, rng
    )
    parts = CameraParts(source, detector, motion(planned), locate)
    return DrawnCamera(CameraProcess(parts, clock.now_s, rig.camera_recovery), poses, where)
