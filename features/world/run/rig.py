"""A rig of a YAML file as part of a world with physics."""

from collections.abc import Mapping
from functools import partial
from math import radians
from typing import TYPE_CHECKING

from gazerig.config.rig import Rig
from gazerig.features.world.rig_in_world import (
    Gearing,
    JointGearing,
    PairGearing,
    RigInWorld,
    ServoInWorld,
)
from gazerig.robot.app.bus_wiring import rig_setups
from gazerig.robot.app.emulation import STOP_BEYOND_DEG, crooked_rad
from gazerig.robot.model.coupling_params import pairs_of

if TYPE_CHECKING:
    from gazerig.features.world.ideal_bus import WorldIdealBus
    from gazerig.features.world.physics import World


def rig_in_world(
    rig: Rig,
    prefix: str = "",
    p_m: tuple[float, float, float] = (0.0, 0.0, 0.0),
    yaw_rad: float = 0.0,
    looks: bool = True,
) -> RigInWorld:
    """Return a rig as a world needs it.

    Args:
        rig: the rig.
        prefix: of its names, for a second one in the same world.
        p_m: place of its neck base in the world.
        yaw_rad: how far it is turned to the left there.
        looks: with what can be seen of it; without, the same mechanism is made in a moment.
    """
    stops = {name: _stop_rad(rig, name) for name in rig.names}
    servos = tuple(_servo(rig, name) for name in rig.names)
    return RigInWorld(
        partial(_body, rig, looks), stops, crooked_rad(rig), servos, prefix, p_m, yaw_rad
    )


def _body(rig: Rig, looks: bool) -> tuple[str, Mapping[str, bytes]]:
    """Return the body of a rig as MJCF, and the files that this names."""
    # Meshes and what writes their textures: 30 MB that a control loop does without.
    from gazerig.robot.app.rig_description import description_of
    from gazerig.robot.description.mjcf import mjcf

    xml, assets = mjcf(description_of(rig, looks=looks), looks=looks)
    return xml, assets


def world_ideal_bus(rig: Rig, world: "World", number: int = 0) -> "WorldIdealBus":
    """Return all servos of a rig in a world without bytes.

    Args:
        rig: the rig.
        world: in which it is.
        number: which one of the world's rigs it is.
    """
    # Imports MuJoCo, which only a run in a world has.
    from gazerig.features.world.ideal_bus import WorldIdealBus

    measured = [rig.joints[name].facts.measured for name in rig.names]
    return WorldIdealBus(rig_setups(rig), world.ideal_shafts(number), measured, world.now_s)


def _stop_rad(rig: Rig, name: str) -> tuple[float, float]:
    joint = rig.joints[name]
    return radians(joint.min_deg - STOP_BEYOND_DEG), radians(joint.max_deg + STOP_BEYOND_DEG)


def _servo(rig: Rig, name: str) -> ServoInWorld:
    joint = rig.joints[name]
    joints: tuple[str, ...] = (name,)
    gearing: Gearing = JointGearing(joint.made())
    for first, second, coupling in pairs_of(rig.couplings):
        if name in (first, second):
            joints = first, second
            gearing = PairGearing(coupling, joints.index(name), joint.made())
    return ServoInWorld(name, joint.bus, joint.id, joints, gearing, joint.facts.steps_per_turn)
