"""Field of view of a camera from a face at a known distance, without a board.

The size of a face in the image depends on its distance and the focal length. The ratio between the
distance for an assumed field of view and the true distance gives the true field. People's faces
differ in size by 8 %, which limits the accuracy for any number of frames; the printed board gives
0.2 %.
"""

from collections.abc import Sequence
from math import atan, degrees, isfinite, radians
from statistics import median, quantiles
from typing import NamedTuple

from gazerig.drivers.camera.params import ASSUMED_FIELD_DEG
from gazerig.drivers.camera.pinhole import intrinsics_of_view
from gazerig.drivers.types import Pixels
from gazerig.features.bringup.calibration.camera_calibration import CameraCalibrationRefused
from gazerig.gaze.angles import norm
from gazerig.robot.perception.face_pose import face_pose

SIZE_SPREAD = 0.08
"""Relative standard deviation of the size of faces."""
LEAST_FRAMES = 60
_ROUNDS = 4  # perspective changes with the focal length, a little
_MOST_MOVED = 0.15
_LEAST_DEG, _MOST_DEG = 20.0, 140.0


class FaceFieldOfView(NamedTuple):
    """Estimated field of view.

    horizontal_deg: the best value; low_deg, high_deg: values for a face 8 % larger and smaller
    frames: number of frames with a used face; moved: relative variation of its size
    """

    horizontal_deg: float
    low_deg: float
    high_deg: float
    frames: int
    moved: float


def estimate_field(
    landmarks_px: Sequence[Pixels], width_px: int, height_px: int, distance_m: float
) -> FaceFieldOfView:
    """Return the field of view from a face at a known distance.

    Args:
        landmarks_px: (5, 2) landmarks of the face in each frame, in the order of ``DetectedFace``.
        width_px: width of the frames.
        height_px: height of the frames.
        distance_m: distance from the lens to the tip of the nose.

    Raises:
        CameraCalibrationRefused: too few frames, the face moved, or no lens has such a field.
    """
    field_rad = radians(ASSUMED_FIELD_DEG)
    for _ in range(_ROUNDS):
        lens = intrinsics_of_view(field_rad, width_px, height_px)
        poses = [face_pose(points, lens) for points in landmarks_px]
        far_m = [norm(pose.p_camera_m) for pose in poses if pose is not None]
        far_m = [one for one in far_m if isfinite(one) and one > 0.0]
        if len(far_m) < LEAST_FRAMES:
            raise CameraCalibrationRefused(
                f"a face from its front in {len(far_m)} frames, {LEAST_FRAMES} are needed: look at "
                "the lens"
            )
        focal_px = lens.fx_px * distance_m / median(far_m)
        field_rad = 2.0 * atan(0.5 * width_px / focal_px)
    low, _, high = quantiles(far_m, n=4)
    moved = (high - low) / median(far_m)
    if moved > _MOST_MOVED:
        raise CameraCalibrationRefused(
            f"the face's size varied by {100.0 * moved:.0f} %: hold still at {distance_m:g} m"
        )
    fields = [
        degrees(2.0 * atan(0.5 * width_px / (focal_px * share)))
        for share in (1.0, 1.0 + SIZE_SPREAD, 1.0 - SIZE_SPREAD)
    ]
    if not _LEAST_DEG <= fields[0] <= _MOST_DEG:
        raise CameraCalibrationRefused(
            f"a field of view of {fields[0]:.0f} deg: no such lens; is the face {distance_m:g} m away?"
        )
    return FaceFieldOfView(fields[0], fields[1], fields[2], len(far_m), moved)
