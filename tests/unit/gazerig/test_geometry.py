"""Geometry of a head without a head: where its eyes look, and the joint angles for a point."""

from math import degrees, nan

import numpy as np
import pytest

import gazerig


@pytest.mark.parametrize("rig", ["desk", "feetech", "maker"])
def test_inverse_and_forward_meet(rig):
    point = (1.2, 0.15, 0.2)
    solved = gazerig.inverse(rig, point)
    assert solved.reachable and solved.error_deg < 1.0
    assert solved.joints_rad.keys() == gazerig.load_rig(rig).joints.keys()
    pose = gazerig.forward(rig, solved.joints_rad)
    sight = np.add(pose.left_sight, pose.right_sight)
    to = np.subtract(point, pose.head_m)
    cosine = np.dot(sight, to) / np.linalg.norm(sight) / np.linalg.norm(to)
    assert degrees(np.arccos(min(1.0, cosine))) < 1.0


def test_a_point_behind_is_not_reachable():
    loaded = gazerig.load_rig("desk")
    solved = gazerig.inverse(loaded, (-1.0, 0.2, 0.3))
    assert not solved.reachable and solved.error_deg > 30.0
    with pytest.raises(gazerig.Refused, match="p_world_m"):
        gazerig.inverse(loaded, (nan, 0.0, 0.0))
    with pytest.raises(gazerig.Refused, match="no joint 'nose'; available: left_eye_pan"):
        gazerig.forward(loaded, {"nose": 0.1})
