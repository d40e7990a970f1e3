"""Rule for the start of a joint whose measured angle cannot be true.

A joint a little outside its range, such as a head that sags, moves inside slowly. One that is far
outside is more likely not where its servo reports it: it would be driven through the whole way.
"""

from collections.abc import Collection, Mapping
from math import degrees

from gazerig.drivers.bus.goal_limits import FAR_CAUSES, FAR_DEG
from gazerig.robot.model.coupling import CouplingParams
from gazerig.robot.model.joint import JointLimit, JointParams


def far_outside(angle_rad: float, limit: JointLimit) -> str:
    """Return where a joint is and why, if it is too far outside its range for torque; else ""."""
    angle, low, high = map(degrees, (angle_rad, limit.low_rad, limit.high_rad))
    beyond = max(low - angle, angle - high)
    if beyond <= FAR_DEG:
        return ""
    return f"is at {angle:.0f} deg, {beyond:.0f} deg outside its range {low:.4g}..{high:.4g} deg: {FAR_CAUSES}"


def find_far_outside(
    joints: Mapping[str, JointParams], pairs: Collection[CouplingParams], steps: Mapping[str, float]
) -> dict[str, str]:
    """Return the text of ``far_outside`` of each joint that must get no torque.

    Args:
        joints: The joints of a rig.
        pairs: Joints that two servos move together; both positions of a pair are needed.
        steps: Measured servo positions by joint.
    """
    angles = {name: joints[name].angle_rad(at) for name, at in steps.items()}
    for pair in pairs:
        shafts = angles.pop(pair.first, None), angles.pop(pair.second, None)
        if shafts[0] is not None and shafts[1] is not None:
            angles[pair.first], angles[pair.second] = pair.joint_rad((shafts[0], shafts[1]))
    texts = {name: far_outside(angle, joints[name].limit()) for name, angle in angles.items()}
    return {name: text for name, text in texts.items() if text}
