"""The joints of the shipped desk rig, in the order of its joint angles."""

GAZE_JOINTS = (
    "left_eye_pan",
    "left_eye_tilt",
    "right_eye_pan",
    "right_eye_tilt",
    "left_upper_lid",
    "right_upper_lid",
    "neck_yaw",
    "neck_pitch",
    "neck_roll",
)

LIDS = {"left_upper_lid": (-0.4, 0.4), "right_upper_lid": (-0.4, 0.4)}
"""Ends of the upper lids in radians, for tests of a geometry alone."""
