"""Source of a drawn scene's frames, for the camera's own process.

The control loop only sends the pose of the head. The process draws the view from there and detects
faces and motion in it, so that neither can delay a tick.
"""

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

import numpy as np

from gazerig.drivers.camera.shared_slots import TimedPose
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import DetectedFace, ImageArray
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.frames import CameraMount
from gazerig.sim_mock.cameras.drawn_scene import DrawnScene
from gazerig.sim_mock.cameras.frame_times import FrameParams
from gazerig.sim_mock.scenes.scene import Scene

if TYPE_CHECKING:
    from gazerig.sim_mock.cameras.rendered import PixelCamera

_LOOK_S = 0.002

HeadPose = Callable[[float], tuple[Mat3, Vec3]]
"""Function that returns rotation and position [m] of the head in the world at a time [s]."""


class NewestHeadPose(Protocol):
    """Newest pose of the head in the camera's process."""

    @property
    def first_s(self) -> float:
        """Return the start time of the scene."""

    def newest(self) -> TimedPose | None:
        """Return the newest pose, None before the first."""


class DrawnSource:
    """Source of a scene's frames, drawn from the head's pose.

    Args:
        make: returns the drawing camera, given the head's pose.
        poses: Poses of the head.
    """

    def __init__(
        self,
        make: "Callable[[HeadPose], PixelCamera]",
        poses: NewestHeadPose,
    ) -> None:
        self._camera = make(self._head_pose)
        self._period_s = 1.0 / self._camera.rate_hz
        self._poses = poses
        self._now: TimedPose | None = None
        self._number = 0
        self._due_s = 0.0

    def open(self) -> None:
        """Start with the first frame."""
        self._camera.open()
        self._number = 0

    def take(self, now_s: Callable[[], float], stop: threading.Event) -> Shot | None:
        """Draw the next frame, from the newest pose; None if ``stop`` was set."""
        while not stop.is_set():
            newest, wait_s = self._poses.newest(), self._due_s - now_s()
            if newest is None or wait_s > 0.0:
                stop.wait(max(wait_s, _LOOK_S))
                continue
            self._now = newest
            if self._number == 0:
                self._camera.latest(self._poses.first_s)  # the time of the scene starts here
            found = self._camera.latest(newest.t_s)
            if found is None or found.number == self._number:
                stop.wait(_LOOK_S)
                continue
            self._due_s = now_s() + max(0.0, self._period_s - (now_s() - newest.t_s))
            self._number, image = found.number, found.image
            assert image is not None
            return Shot(found.captured_s, found.number, image)
        return None

    def events(self) -> tuple[str, ...]:
        """Return no events: a drawn camera has none."""
        return ()

    def close(self) -> None:
        """Free the renderer; safe to call twice."""
        self._camera.close()

    def _head_pose(self, t_s: float) -> tuple[Mat3, Vec3]:
        assert self._now is not None  # ``take`` waits for the first pose
        return self._now.R_world_head, self._now.p_world_head_m


def scene_pixels(
    scene: Scene, mount: CameraMount, field_deg: float, rng: np.random.Generator, head: HeadPose
) -> "PixelCamera":
    """Return the camera that draws a scene, for its own process.

    Args:
        scene: Scene in front of the camera.
        mount: Placement on the head.
        field_deg: Horizontal field of view.
        rng: Random numbers of the noise.
        head: returns the pose of the head.
    """
    from gazerig.sim_mock.cameras.rendered import PixelCamera

    params = FrameParams(horizontal_field_deg=field_deg, latency_ms=0.0)
    return PixelCamera(params, DrawnScene(scene), mount, head, NoFaces(), rng)


class NoFaces:
    """Detector that finds no faces: the camera's process detects them later."""

    def find(self, bgr: ImageArray) -> tuple[DetectedFace, ...]:
        """Return no faces."""
        return ()
