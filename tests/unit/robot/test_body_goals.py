"""Goals of a body's joints as positions of its servos."""

import pytest
from stand_in import StandIn

from gazerig.robot.loop.body import Body
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.types import GAZE_JOINTS

IDS = tuple(range(1, 10))
POINTS = ((-30.0, 1700.0), (0.0, 2048.0), (30.0, 2300.0))


def test_straight_and_measured_linkages_of_one_body_keep_their_own_angles():
    bent, straight = {"transmission_points": POINTS}, {"sign": -1, "ratio": 1.5}
    joints = {
        name: JointParams(
            i, "xl330-m077", -30.0, 30.0, 600.0, 45_000.0, **(bent if i % 3 == 1 else straight)
        )
        for i, name in zip(IDS, GAZE_JOINTS, strict=False)
    }
    sent = []

    class Bus(StandIn):
        def write(self, goals):
            sent.append(goals)

    body = Body(Bus(), joints)
    angles = tuple([0.05 * i - 0.2 for i in IDS])
    body.write(angles)
    ordered = [joints[name] for name in body.names]
    assert sent == [[round(joint.steps(a)) for joint, a in zip(ordered, angles, strict=True)]]
    back = body.angles(sent[0])
    assert back == tuple([j.angle_rad(s) for j, s in zip(ordered, sent[0], strict=True)])
    for wrong in (angles[1:], (*angles, 0.0)):
        with pytest.raises(ValueError, match="9 joints"):
            body.write(wrong)
    with pytest.raises(ValueError, match="NaN"):
        body.write((float("nan"), *angles[1:]))
