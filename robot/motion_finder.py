"""What moves in a picture, the camera's own turn taken out by where the head was."""

import numpy as np

from drivers.camera_look import Motion
from drivers.camera_poses import PoseRing
from drivers.motion_detector import MotionDetector
from drivers.motion_params import MotionParams
from drivers.picture_source import Shot
from drivers.types import MovingBlob
from gaze.types import Floats
from robot.frames import LensParams
from robot.intrinsics import intrinsics_of_lens


def motion_finder(
    params: MotionParams, lens: LensParams | None, field_rad: float, turns: PoseRing | None
) -> Motion:
    """Give a function that finds what moves from one picture to the next.

    lens, field_rad: for pictures that do not bring their own lens
    turns: how a camera that turns with the head was turned when; None: it stands still
    """
    detector = MotionDetector(params)

    def find(shot: Shot) -> tuple[MovingBlob, ...]:
        height, width = shot.picture.shape[:2]
        own = shot.lens if lens is None else None
        seen_through = own or intrinsics_of_lens(lens, field_rad, width, height)
        before_s = detector.before_s
        turned: Floats | None = np.eye(3)
        if turns is not None:
            turned = None if before_s is None else turns.turned(shot.captured_s, before_s)
        return detector.find(shot.picture, shot.captured_s, seen_through, turned, shot.depth_m)

    return find
