"""Motion detection in images, compensated for the camera's turn by the head's pose."""

from gazerig.drivers.camera.shared_slots import PoseBuffer
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import MovingBlob
from gazerig.drivers.vision.motion.params import MotionParams
from gazerig.robot.model.frames import LensParams
from gazerig.robot.model.intrinsics import intrinsics_of_lens


class MotionSource:
    """Finds what moves from one frame to the next.

    Args:
        params: parameters of the detection.
        lens: lens for frames without their own lens.
        field_rad: horizontal field of view for the same frames.
        turns: rotation of a camera that turns with the head; None: it is not measured, and only the
            image shows whether the camera is still.
    """

    def __init__(
        self,
        params: MotionParams,
        lens: LensParams | None,
        field_rad: float,
        turns: PoseBuffer | None,
    ) -> None:
        self._lens, self._field_rad, self._turns = lens, field_rad, turns
        self._detector = None
        if params.enabled:
            # Imported here, with OpenCV, because the control loop's process does not detect motion
            # itself.
            from gazerig.drivers.vision.motion.detector import MotionDetector

            self._detector = MotionDetector(params)

    def __call__(self, shot: Shot) -> tuple[MovingBlob, ...]:
        """Find motion since the previous frame; return nothing while it is not enabled."""
        if self._detector is None:
            return ()
        height, width = shot.image.shape[:2]
        lens = intrinsics_of_lens(self._lens, self._field_rad, width, height, shot.lens)
        before_s, turned = self._detector.before_s, None
        if self._turns is not None and before_s is not None:
            turned = self._turns.rotation_between(shot.captured_s, before_s)
        return self._detector.find(shot.image, shot.captured_s, lens, turned, shot.depth_m)
