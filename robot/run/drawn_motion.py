"""Motion detection in drawn frames of a simulated scene."""

import numpy as np

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import MovingBlob
from gazerig.drivers.vision.motion.detector import MotionDetector, relative_rotation
from gazerig.drivers.vision.motion.params import MotionParams
from gazerig.gaze.types import Mat3
from gazerig.sim_mock.cameras.rendered import Exposure


class SyntheticMotionDetector:
    """Motion detector of drawn frames, whose rotation of the camera is known."""

    def __init__(self, params: MotionParams) -> None:
        self._enabled = params.enabled
        self._detector = MotionDetector(params)
        self._before: Mat3 | None = None

    def __call__(self, shot: Exposure, lens: Intrinsics) -> tuple[MovingBlob, ...]:
        """Find motion since the previous frame; empty if disabled."""
        before, self._before = self._before, shot.R_world_camera
        if not self._enabled:
            return ()
        turned = (
            relative_rotation(np.array(shot.R_world_camera), np.array(before))
            if before is not None and self._detector.before_s is not None
            else None
        )
        return self._detector.find(shot.image, shot.captured_s, lens, turned)
