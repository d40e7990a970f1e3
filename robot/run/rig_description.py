"""Description of a rig from its YAML."""

from gazerig.config.rig import Rig
from gazerig.robot.description.build import RigShape, describe
from gazerig.robot.description.links import Description
from gazerig.robot.description.statics import NECK_JOINTS, Statics, moving_bodies
from gazerig.robot.loop.sag import SagCompensation
from gazerig.robot.model.types import order_joints
from gazerig.robot.run.rig_limits import lid_ends


def description_of(rig: Rig) -> Description:
    """Return the links, joints, shapes and looks of a rig."""
    return describe(shape_of(rig))


def shape_of(rig: Rig) -> RigShape:
    """Return the shape from which a rig's description is built."""
    return RigShape(
        rig.name,
        rig.geometry,
        rig.joints,
        lid_ends(rig),
        rig.couplings,
        rig.camera,
        rig.mass,
        (rig.webcam.width_px, rig.webcam.height_px),
    )


def statics_of(rig: Rig, *, of_neck: bool = False) -> Statics:
    """Return the torques that a rig's servos hold at rest.

    Args:
        rig: the rig.
        of_neck: only for the joints of the neck, with all others at 0, which is faster.
    """
    joints = {n: one for n, one in rig.joints.items() if not of_neck or n in NECK_JOINTS}
    pairs = [one for one in rig.couplings.values() if {*one.joints} <= {*joints}]
    return Statics(moving_bodies(description_of(rig), joints), joints, pairs)


def sag_compensation(rig: Rig) -> SagCompensation | None:
    """Return what makes up for the sag of a rig's neck; None without a neck."""
    if not any(name in rig.joints for name in NECK_JOINTS):
        return None
    return SagCompensation(statics_of(rig, of_neck=True), order_joints(rig.joints))
