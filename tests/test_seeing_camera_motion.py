"""Motion of the camera is not taken for motion in the scene; the films are row 2 of seeing."""

from seeing.moving_room import FIELD_RAD, Pose, frames, still
from seeing.row_02_camera_motion import FILMS, judged

from gazerig.drivers.camera.source import Shot
from gazerig.drivers.vision.motion.params import MotionParams
from gazerig.robot.perception.motion_source import MotionSource


def test_a_slow_drift_is_the_cameras() -> None:
    assert judged(frames(lambda t_s: Pose(yaw_deg=2.0 * t_s), 1.0, ())).false == 0


def test_whether_the_camera_moved_is_forgotten_with_the_scene() -> None:
    """Two sources, one of which was shaken before: from the next scene on they are equal."""
    shaken, fresh = (MotionSource(MotionParams(), None, FIELD_RAD, None) for _ in range(2))
    for one in frames(FILMS["shake"][0], 0.3):
        shaken(Shot(one.t_s, 1, one.image))
    for source in (shaken, fresh):
        source.retune(MotionParams(enabled=False), None, FIELD_RAD)
        source.retune(MotionParams(), None, FIELD_RAD)
    for k, one in enumerate(frames(still, 0.3)):
        a, b = (source(Shot(10.0 + one.t_s, k, one.image)) for source in (shaken, fresh))
        assert [blob.box_px for blob in a] == [blob.box_px for blob in b]
