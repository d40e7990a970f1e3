"""A camera that renders the emulated head's view and runs the real detectors on it.

gazerig.sim_mock.cameras.detections simulates a detector's output; here the real detectors work on
pixels. Frames arrive after a latency, at the camera's rate, with noise, and blurred by the camera's
turn during the exposure; a depth frame has the noise of stereo and holes at edges.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.capture_loop import Locate
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import Detections, FaceDetector, ImageArray, MovingBlob
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.frames import CameraMount
from gazerig.robot.model.scene_view import PinholeView, SceneView
from gazerig.sim_mock.cameras.frame_times import FrameParams, FrameTimes
from gazerig.sim_mock.cameras.optics import (
    Sensor,
    SensorParams,
    blur_along,
    smear_px,
    through_lens,
)


class Exposure(NamedTuple):
    """One exposed frame and the true rotation of its camera.

    image: (h, w, 3) BGR; depth_m: (h, w) metres along the axis, NaN in holes, None without depth
    """

    captured_s: float
    image: ImageArray
    depth_m: NDArray[np.float32] | None
    R_world_camera: Mat3


FindMotion = Callable[[Exposure, Intrinsics], tuple[MovingBlob, ...]]
"""Finds motion since the previous exposure."""


@dataclass(frozen=True)
class PixelCameraParams(SensorParams, FrameParams):
    """Quality of the camera."""

    depth: Annotated[bool, "whether distances are measured too"] = False


class PixelCamera:
    """A gazerig.drivers.types.Camera that renders; frames are computed on demand.

    Args:
        params: resolution, rate and noise of the camera.
        view: draws what is in front of it.
        mount: pose of the camera on the head.
        head_pose: true rotation (3, 3) and position [m] of the head in the world at a time [s].
        detector: finds the faces.
        rng: random numbers of the noise.
        find_motion: finds motion, in addition to the faces.
        locate: converts detections from pixels to the camera's axes; None: no conversion.
        lens: lens of the camera, for frames of its size; None: by its field of view.
        begins_s: start of the scene; None: at the first call of ``latest``.
    """

    def __init__(
        self,
        params: PixelCameraParams,
        view: SceneView,
        mount: CameraMount,
        head_pose: Callable[[float], tuple[Mat3, Vec3]],
        detector: FaceDetector,
        rng: np.random.Generator,
        find_motion: FindMotion | None = None,
        locate: Locate | None = None,
        lens: Intrinsics | None = None,
        begins_s: float | None = None,
    ) -> None:
        self._params = params
        self._view = view
        self._mount = mount
        self._head_pose = head_pose
        self._detector = detector
        self._find_motion = find_motion
        self._locate = locate
        self._times = FrameTimes(params, begins_s)
        self._size_px = params.width_px, params.height_px
        self.lens = lens or params.lens
        self._sensor = Sensor(params, rng)
        self._before: tuple[float, Mat3] | None = None

    def open(self) -> None:
        """Start; the first frame is taken at the first call of ``latest``."""
        self._times.restart()
        self._before = None

    @property
    def rate_hz(self) -> float:
        """Return the frames per second."""
        return self._params.rate_hz

    def latest(self, now_s: float) -> Detections | None:
        """Return the newest detections that have arrived by ``now_s``."""
        R, p_m = self._mount.pose(*self._head_pose(now_s))
        scene_s = self._times.next_frame_s(now_s)
        if scene_s is not None:
            shot = self._expose(now_s, scene_s, R, p_m)
            blobs = self._find_motion(shot, self.lens) if self._find_motion is not None else ()
            faces = self._detector.find(shot.image)
            found = Detections(
                now_s, self._times.number, *self._size_px, faces, blobs, image=shot.image,
                depth_m=shot.depth_m,
            )  # fmt: skip
            self._times.send(found.locate_in_camera(self._locate))
        self._before = now_s, R
        return self._times.arrived(now_s)

    def _expose(self, now_s: float, scene_s: float, R: Mat3, p_m: Vec3) -> Exposure:
        before_s, R_before = self._before or (now_s, R)
        seen_by = PinholeView(scene_s, self.lens, self._size_px, R, p_m)
        seen = through_lens(self._view, seen_by, depth=self._params.depth)
        share = self._params.exposure_ms / 1e3 / max(now_s - before_s, 1e-9)
        way_px = smear_px(R, R_before, share, self.lens)
        image = self._sensor.image(blur_along(seen.image, way_px))
        image.setflags(write=False)  # like the frames of real cameras
        depth = None if seen.depth_m is None else self._sensor.stereo(seen.depth_m)
        return Exposure(now_s, image, depth, R)

    def events(self) -> tuple[str, ...]:
        """Return the detector's events since the last call; the camera itself has none."""
        events = getattr(self._detector, "events", None)
        return events() if events is not None else ()

    def close(self) -> None:
        """Stop, and free the view."""
        self._view.close()
