"""The joints of the shipped desk rig, in the order of its joint angles."""

from gazerig.config.schema import load_rig
from gazerig.robot.model.types import order_joints

GAZE_JOINTS = order_joints(load_rig("desk").joints)

LIDS = {"left_upper_lid": (-0.4, 0.4), "right_upper_lid": (-0.4, 0.4)}
"""Ends of the upper lids in radians, for tests of a geometry alone."""
