"""Motion of the camera is not taken for motion in the scene; the films are row 2 of seeing."""

from seeing.moving_room import Pose, frames
from seeing.row_02_camera_motion import judged


def test_a_slow_drift_is_the_cameras():
    assert judged(frames(lambda t_s: Pose(yaw_deg=2.0 * t_s), 1.0, ())).false == 0
