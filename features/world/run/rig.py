"""A rig of a YAML file as part of a world with physics."""

from collections.abc import Mapping
from functools import partial
from math import radians
from typing import TYPE_CHECKING

from gazerig.config.rig import Rig
from gazerig.features.world.rig_in_world import (
    JointTransmission,
    PairTransmission,
    RigInWorld,
    ServoInWorld,
    Transmission,
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
    """Return a rig for a world.

    Args:
        rig: the rig.
        prefix: prefix of its names, for a second rig in the same world.
        p_m: position of its neck base in the world.
        yaw_rad: its turn to the left there.
        looks: whether to include its visible parts; the bare mechanism is built quickly.
    """
    stops = {name: _stop_rad(rig, name) for name in rig.names}
    servos = tuple(_servo(rig, name) for name in rig.names)
    return RigInWorld(
        partial(_body, rig, looks), stops, crooked_rad(rig), servos, prefix, p_m, yaw_rad
    )


def _body(rig: Rig, looks: bool) -> tuple[str, Mapping[str, bytes]]:
    """Return the body of a rig as MJCF, and the files that the MJCF names."""
    # Meshes and the texture writer: 30 MB that a control loop does not need.
    from gazerig.robot.app.rig_description import description_of
    from gazerig.robot.description.mjcf import mjcf

    xml, assets = mjcf(description_of(rig, looks=looks), looks=looks)
    return xml, assets


def world_ideal_bus(rig: Rig, world: "World", number: int = 0) -> "WorldIdealBus":
    """Return all servos of a rig in a world without bytes.

    Args:
        rig: the rig.
        world: the world of the rig.
        number: number of the rig in the world.
    """
    # Imports MuJoCo, which only runs in a world need.
    from gazerig.features.world.ideal_bus import WorldIdealBus

    measured = [rig.joints[name].facts.measured for name in rig.names]
    return WorldIdealBus(rig_setups(rig), world.ideal_shafts(number), measured, world.now_s)


def _stop_rad(rig: Rig, name: str) -> tuple[float, float]:
    joint = rig.joints[name]
    return radians(joint.min_deg - STOP_BEYOND_DEG), radians(joint.max_deg + STOP_BEYOND_DEG)


def _servo(rig: Rig, name: str) -> ServoInWorld:
    joint = rig.joints[name]
    joints: tuple[str, ...] = (name,)
    transmission: Transmission = JointTransmission(joint.made())
    for first, second, coupling in pairs_of(rig.couplings):
        if name in (first, second):
            joints = first, second
            transmission = PairTransmission(coupling, joints.index(name), joint.made())
    return ServoInWorld(name, joint.bus, joint.id, joints, transmission, joint.facts.steps_per_turn)
