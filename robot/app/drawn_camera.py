"""A drawn scene seen as through a real camera: drawn and looked at in the camera's own process.

The control loop only says where the head is. The process draws what is seen from there and looks
for faces and motion in it, so that neither can delay a tick. For a program's own detector, which
only that program has, it is a thread.
"""

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

import numpy as np

from gazerig.drivers.camera.pose_slot import PoseAt, PoseSlot
from gazerig.drivers.camera.process import CameraProcess
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.camera.thread import CameraThread
from gazerig.drivers.types import DetectedFace, Detections, ImageArray
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.frames import CameraMount
from gazerig.sim_mock.scenes.scene import Scene

if TYPE_CHECKING:
    from gazerig.sim_mock.cameras.rendered import PixelCamera

_LOOK_S = 0.002

HeadPose = Callable[[float], tuple[Mat3, Vec3]]
"""Returns rotation and place [m] of the head in the world at a time [s]."""


class NewestHead(Protocol):
    """Where the head is now, as the camera's process knows it."""

    @property
    def first_s(self) -> float:
        """Return the time at which the scene begins."""
        ...

    def newest(self) -> PoseAt | None:
        """Return the newest pose, None before the first."""
        ...


class DrawnSource:
    """Frames of a scene, drawn from where the head is.

    Args:
        make: returns the camera that draws, on a head whose pose it is given.
        poses: where the head is.
    """

    def __init__(
        self,
        make: "Callable[[HeadPose], PixelCamera]",
        poses: NewestHead,
    ) -> None:
        self._camera = make(self._head)
        self._period_s = 1.0 / self._camera.rate_hz
        self._poses = poses
        self._now: PoseAt | None = None
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
            self._now = newest
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
        """Free what draws; safe to call twice."""
        self._camera.close()

    def _head(self, t_s: float) -> tuple[Mat3, Vec3]:
        assert self._now is not None  # ``take`` waits for the first
        return self._now.R_world_head, self._now.p_world_head_m

    def _shot(self, found: Detections) -> Shot:
        image = found.image
        assert image is not None
        self._number = found.number
        return Shot(found.captured_s, found.number, image, found.depth_m)


def scene_pixels(
    scene: Scene, mount: CameraMount, field_deg: float, rng: np.random.Generator, head: HeadPose
) -> "PixelCamera":
    """Return the camera that draws a scene, for its own process.

    Args:
        scene: what is before the camera.
        mount: where it sits on the head.
        field_deg: its horizontal field of view.
        rng: for the noise of the frames.
        head: where the head is.
    """
    from gazerig.sim_mock.cameras.rendered import PixelCamera, PixelCameraParams

    params = PixelCameraParams(horizontal_field_deg=field_deg, latency_ms=0.0)
    return PixelCamera(params, scene, mount, head, NoFaces(), rng)


class NoFaces:
    """Finds none: the process looks for faces afterwards, as in every camera's frames."""

    def find(self, bgr: ImageArray) -> tuple[DetectedFace, ...]:
        """Return none."""
        return ()


class DrawnCamera:
    """A camera in a drawn scene, which is told at each look where the head is.

    Args:
        process: draws and looks; or a thread that does.
        poses: takes where the head is.
        where: returns rotation and place of the head in the world at a time.
    """

    def __init__(
        self, process: CameraProcess | CameraThread, poses: PoseSlot, where: HeadPose
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
