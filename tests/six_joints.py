"""Joints of a rig of six hobby servos: no neck, one linkage per axis for both eyes."""

SIX = (
    "eyes_pan", "eyes_tilt", "left_upper_lid", "right_upper_lid", "left_lower_lid",
    "right_lower_lid",
)  # fmt: skip
