"""Transformation of detections from the camera's axes to the world."""

from gazerig.drivers.types import DetectionInCamera
from gazerig.gaze.angles import add, compose, rotate
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.perception.track import LocalisedDetection


def place_in_world(
    found: DetectionInCamera, R_world_camera: Mat3, p_world_m: Vec3
) -> LocalisedDetection:
    """Return a detection in the world, by the camera's pose at the exposure."""
    R, v, gaze = found.R_camera_face, found.v_camera_m_s, found.gaze_camera
    fastest, faster, upper = found.fastest_m, found.fastest_m_s, found.upper_m
    return LocalisedDetection(
        found.kind,
        add(p_world_m, rotate(R_world_camera, found.p_camera_m)),
        None if R is None else compose(R_world_camera, R),
        found.radius_m,
        found.spin_rad_s,
        found.confidence,
        found.face_length,
        found.depth_measured,
        found.across_sd_m,
        found.along_sd_m,
        None if v is None else rotate(R_world_camera, v),
        found.across_sd_m_s,
        found.along_sd_m_s,
        found.size_depth,
        found.mark,
        found.turn_sd_rad,
        None if gaze is None else rotate(R_world_camera, gaze),
        None if fastest is None else add(p_world_m, rotate(R_world_camera, fastest)),
        None if faster is None else rotate(R_world_camera, faster),
        found.signs,
        found.compact,
        found.thickness_m,
        found.from_side,
        None if upper is None else add(p_world_m, rotate(R_world_camera, upper)),
        found.clothing,
        found.box_m,
        found.lower_face,
    )
