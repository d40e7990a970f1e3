"""Speed and torque of a servo at its joint, after gear, rods or coupling."""

from collections.abc import Mapping
from math import pi

from gazerig.robot.model.coupling_params import CoupledPair, CouplingParams, pairs_of
from gazerig.robot.model.joint import JointParams


def joint_torques_nm(
    joints: Mapping[str, JointParams], couplings: Mapping[str, CouplingParams]
) -> dict[str, float]:
    """Return the highest torque at every joint, standing still, at its servos' rated voltage.

    Of a pair that two servos move together each joint gets what both do for it alone.
    """
    own = {
        name: (joint.facts.stall_torque_nm * (joint.torque_limit or 1.0)) * _turns(joint)
        for name, joint in joints.items()
    }
    found = dict(own)
    for pair in pairs_of(couplings):
        if pair.first in joints and pair.second in joints:
            found |= _pair_nm(pair, own)
    return found


def _pair_nm(pair: CoupledPair, own: Mapping[str, float]) -> dict[str, float]:
    names = pair.first, pair.second
    rates = pair.coupling.rates((0.0, 0.0))
    return {
        joint: sum(abs(rates[k][j]) * own[names[k]] for k in (0, 1))
        for j, joint in enumerate(names)
    }


def _turns(joint: JointParams) -> float:
    """Return the turns of the servo for one of the joint, where they are the most."""
    return joint.made().steepest * 2.0 * pi / joint.facts.steps_per_turn
