"""Description of a rig from its YAML, with the user's own meshes."""

from collections.abc import Iterable
from dataclasses import replace

from gazerig.config.rig import Rig
from gazerig.config.schema import unknown_text
from gazerig.drivers.errors import SetupError
from gazerig.robot.description.build import RigShape, describe
from gazerig.robot.description.links import Description
from gazerig.robot.description.own_meshes import own_visual
from gazerig.robot.description.statics import NECK_JOINTS, Statics, moving_bodies
from gazerig.robot.loop.sag import SagCompensation
from gazerig.robot.model.types import order_joints
from gazerig.robot.run.rig_limits import lid_ends


def description_of(rig: Rig, *, looks: bool = True) -> Description:
    """Return the links, joints, shapes and looks of a rig.

    Args:
        rig: the rig.
        looks: Whether to read the meshes of its own.

    Raises:
        SetupError: one of its meshes cannot be used.
    """
    return describe(shape_of(rig if looks else replace(rig, meshes={})))


def shape_of(rig: Rig, *, without_lost_meshes: bool = False) -> RigShape:
    """Return the shape from which a rig's description is built.

    Args:
        rig: the rig.
        without_lost_meshes: Whether to omit unusable meshes, as those of a recorded rig may be
            missing.

    Raises:
        SetupError: a mesh of its own cannot be used.
    """
    shape = RigShape(
        rig.name,
        rig.geometry,
        rig.joints,
        lid_ends(rig),
        rig.couplings,
        rig.camera,
        rig.mass,
        (rig.webcam.width_px, rig.webcam.height_px),
    )
    if not rig.meshes:
        return shape
    faults = dict(mesh_faults(rig))
    if faults and not without_lost_meshes:
        key, fault = next(iter(faults.items()))
        raise SetupError(f"{key}: {fault}")
    lost = {key.split(".")[1] for key in faults}
    return shape._replace(
        meshes=tuple(
            (name, own_visual(name, params))
            for name, params in rig.meshes.items()
            if name not in lost
        )
    )


def statics_of(rig: Rig, *, of_neck: bool = False) -> Statics:
    """Return the torques that a rig's servos hold at rest.

    Args:
        rig: the rig.
        of_neck: only for the joints of the neck, with all others at 0, which is faster.
    """
    joints = {n: one for n, one in rig.joints.items() if not of_neck or n in NECK_JOINTS}
    pairs = [one for one in rig.couplings.values() if {*one.joints} <= {*joints}]
    return Statics(moving_bodies(description_of(rig, looks=False), joints), joints, pairs)


def sag_compensation(rig: Rig) -> SagCompensation | None:
    """Return what makes up for the sag of a rig's neck; None without a neck."""
    if not any(name in rig.joints for name in NECK_JOINTS):
        return None
    return SagCompensation(statics_of(rig, of_neck=True), order_joints(rig.joints))


def mesh_faults(rig: Rig) -> Iterable[tuple[str, str]]:
    """Find meshes of a rig that cannot be shown: their key in its file, and the fault."""
    if not rig.meshes:
        return
    made = describe(shape_of(replace(rig, meshes={})))
    links = [link.name for link in made.links]
    for name, params in rig.meshes.items():
        if name not in links:
            yield f"meshes.{name}", unknown_text("link", name, links)
            continue
        try:
            own_visual(name, params)
        except SetupError as error:
            yield f"meshes.{name}.file", str(error)
