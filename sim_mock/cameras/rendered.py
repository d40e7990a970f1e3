"""A camera that renders the emulated head's view and runs the real detectors on it.

gazerig.sim_mock.cameras.detections simulates a detector's output; here the real detectors work on
pixels. Frames arrive after a latency, at the camera's rate, with noise. Not modelled: distortion of
the lens, blur of a turning head, distances.
"""

from collections.abc import Callable

import cv2
import numpy as np

from gazerig.drivers.camera.capture_loop import Locate, Motion
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import Detections, FaceDetector, ImageArray
from gazerig.drivers.vision.clothing import add_clothing
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.frames import CameraMount
from gazerig.robot.model.scene import PinholeView, SceneView
from gazerig.sim_mock.cameras.frame_times import Begin, FrameParams, FrameTimes

_NOISE_GREY = 3.0
"""Standard deviation of the read-out noise, grey values."""


class PixelCamera:
    """A gazerig.drivers.types.Camera that renders; frames are computed on demand.

    Args:
        params: resolution, rate and latency of the camera.
        view: draws what is in front of it.
        mount: pose of the camera on the head.
        head_pose: true rotation (3, 3) and position [m] of the head in the world at a time [s].
        detector: finds the faces.
        rng: random numbers of the noise.
        find_motion: finds motion, in addition to the faces.
        locate: converts detections from pixels to the camera's axes; None: no conversion.
        lens: lens of the camera, for frames of its size; None: by its field of view.
        begin: returns the start of the scene; None: at the first call of ``latest``.
    """

    def __init__(
        self,
        params: FrameParams,
        view: SceneView,
        mount: CameraMount,
        head_pose: Callable[[float], tuple[Mat3, Vec3]],
        detector: FaceDetector,
        rng: np.random.Generator,
        find_motion: Motion | None = None,
        locate: Locate | None = None,
        lens: Intrinsics | None = None,
        begin: Begin | None = None,
    ) -> None:
        self._params = params
        self._view = view
        self._mount = mount
        self._head_pose = head_pose
        self._detector = detector
        self._find_motion = find_motion
        self._locate = locate
        self._times = FrameTimes(params, begin)
        self._size_px = params.width_px, params.height_px
        self.lens = lens or params.lens
        self._rng = rng
        # Fresh noise would cost more than the drawing; pieces of one stock look the same.
        self._values = 3 * params.width_px * params.height_px
        self._noise = rng.standard_normal(2 * self._values, np.float32) * np.float32(_NOISE_GREY)

    def open(self) -> None:
        """Start; the first frame is taken at the first call of ``latest``."""
        self._times.restart()

    def latest(self, now_s: float) -> Detections | None:
        """Return the newest detections that have arrived by ``now_s``."""
        R, p_m = self._mount.pose(*self._head_pose(now_s))
        scene_s = self._times.next_frame_s(now_s)
        if scene_s is not None:
            image, number = self._expose(scene_s, R, p_m), self._times.number
            shot = Shot(now_s, number, image, lens=self.lens)
            blobs = () if self._find_motion is None else self._find_motion(shot)
            faces, _ = add_clothing(image, self._detector.find(image))
            found = Detections(now_s, number, *self._size_px, faces, blobs, image)
            self._times.send(found.locate_in_camera(self._locate))
        return self._times.arrived(now_s)

    def _expose(self, scene_s: float, R: Mat3, p_m: Vec3) -> ImageArray:
        light = self._view.draw(PinholeView(scene_s, self.lens, self._size_px, R, p_m))
        start = self._rng.integers(self._values)
        noise = self._noise[start : start + self._values].reshape(light.shape)
        image = np.asarray(cv2.add(light, noise, dtype=cv2.CV_8U), np.uint8)
        image.setflags(write=False)  # like the frames of real cameras
        return image

    def events(self) -> tuple[str, ...]:
        """Return the detector's events since the last call; the camera itself has none."""
        events = getattr(self._detector, "events", None)
        return events() if events is not None else ()

    def close(self) -> None:
        """Stop, and free the view."""
        self._view.close()
