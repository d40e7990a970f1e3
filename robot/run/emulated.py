"""Emulated servos of a rig, mounted in its joints as its YAML defines.

Inertia, friction, controller and motor are those of the emulated servos: from data sheets, or
assumed and marked [A] in gazerig.sim_mock.smart_servo.physics and gazerig.sim_mock.hobby_motor.
"""

from collections.abc import Callable, Collection, Mapping
from math import atan2, hypot, pi, radians
from typing import NamedTuple

import numpy as np

from gazerig.config.rig import BusConfig, Rig
from gazerig.drivers.bus.servo_models import HOBBY_KINDS
from gazerig.drivers.plugins import EmulatedJoint
from gazerig.gaze.angles import rotate
from gazerig.robot.description.build import in_parent_frame
from gazerig.robot.description.links import Description
from gazerig.robot.description.statics import moving_bodies
from gazerig.robot.model.coupling import pair_setups
from gazerig.robot.model.weight import weight_nm
from gazerig.robot.run.rig_description import description_of
from gazerig.robot.run.rig_limits import bus_names, joints_on
from gazerig.sim_mock.devices import (
    DynamixelLine,
    Emulated,
    FeetechLine,
    MaestroLine,
    Pca9685Line,
    plugin_line,
)
from gazerig.sim_mock.hobby_servo import HobbySpec
from gazerig.sim_mock.smart_servo.physics import (
    Physics,
    ServoSpec,
)

JOINT_PLAY_DEG = 0.25
"""Play between servo and joint, from stop to stop, as in the data sheets of the X430."""
_CROOKED_DEG = {"left_eye_pan": 6.0, "right_eye_pan": -4.0, "neck_yaw": -12.0, "neck_pitch": -8.0}
"""Start angles of emulated joints: slightly off, like those of a head moved by hand."""
STOP_BEYOND_DEG = 4.0
"""Distance of an emulated joint's mechanical stops beyond its configured range."""
_NECK_SERVO_NM = 1.0
"""Torque of a hobby servo of the neck: standard size, 10 kg cm; eyes and lids have small ones."""

CHAINS: dict[str, type[DynamixelLine] | type[FeetechLine]] = {
    "dynamixel": DynamixelLine,
    "feetech": FeetechLine,
}
"""Emulated smart servos by the kind of bus."""
BOARDS: dict[str, Callable[[BusConfig, tuple[HobbySpec, ...]], Emulated]] = {
    "maestro": lambda bus, servos: MaestroLine(bus.maestro.channels, bus.maestro.crc, servos),
    "pca9685": lambda bus, servos: Pca9685Line(
        (bus.pca9685.address,), bus.pca9685.oscillator_hz, servos
    ),
}
"""Emulated boards with their hobby servos by the kind of bus."""


def emulated_lines(rig: Rig) -> dict[str, Emulated]:
    """Return the emulated device of each bus, by the bus's name; servos in the order of joints."""
    lines: dict[str, Emulated] = {}
    for bus in bus_names(rig):
        config, joints = rig.bus_named(bus), joints_on(rig, bus)
        if config.kind in CHAINS:
            weights = joint_weights(description_of(rig), rig.joints)
            servos = tuple(_smart_servo(rig, name, weights[name]) for name in joints)
            lines[bus] = CHAINS[config.kind](servos, config.section.baud)
        elif config.kind in BOARDS:
            lines[bus] = BOARDS[config.kind](config, tuple(_hobby_spec(rig, n) for n in joints))
        else:
            others = tuple(
                EmulatedJoint(one.id, one.model, start_step(rig, name), *_stops(rig, name))
                for name, one in ((name, rig.joints[name]) for name in joints)
            )
            lines[bus] = plugin_line(config.kind, config.section, others)
    return lines


def servo_index(rig: Rig, joint: str) -> int:
    """Return the index of a joint's servo in the true positions of its emulated device."""
    bus, servo_id = rig.joints[joint].bus, rig.joints[joint].id
    # A board lists all its channels, a chain only its servos.
    return servo_id if rig.bus_named(bus).kind in HOBBY_KINDS else joints_on(rig, bus).index(joint)


def start_angles_rad(rig: Rig) -> dict[str, float]:
    """Return the start angles of a rig's emulated joints, at most at their mechanical stops."""
    return {
        name: radians(min(max(_CROOKED_DEG.get(name, 0.0), joint.min_deg - STOP_BEYOND_DEG),
                          joint.max_deg + STOP_BEYOND_DEG))
        for name, joint in rig.joints.items()
    }  # fmt: skip


def start_step(rig: Rig, name: str) -> int:
    """Return the start position of an emulated servo in steps."""
    crooked = start_angles_rad(rig)
    for pair in rig.couplings.values():
        first, second = pair.joints
        crooked[first], crooked[second] = pair.servo_rad((crooked[first], crooked[second]))
    return round(rig.joints[name].steps(crooked[name]))


def _stops(rig: Rig, name: str) -> tuple[float, float]:
    """Return the first and last step of the servo that its mechanics allow."""
    joint = rig.joints[name]
    for pair in rig.couplings.values():
        if name in pair.joints:
            own = pair_setups(pair, rig.joints, {})[name]
            beyond = joint.make_linkage().steepest * radians(STOP_BEYOND_DEG)
            return own.min_steps - beyond, own.max_steps + beyond
    ends = (joint.min_deg - STOP_BEYOND_DEG, joint.max_deg + STOP_BEYOND_DEG)
    low, high = sorted(joint.steps(radians(end)) for end in ends)
    return low, high


def _smart_servo(rig: Rig, name: str, weight: "Weight") -> ServoSpec:
    """Return the smart servo of one joint with this weight on it; coupled servos carry none."""
    joint = rig.joints[name]
    start, (low, high), turns = start_step(rig, name), _stops(rig, name), joint.shaft_turns()
    is_coupled = any(name in pair.joints for pair in rig.couplings.values())
    physics = Physics(
        load_kg_m2=weight.inertia_kg_m2 / turns**2,
        gravity_nm=0.0 if is_coupled else weight.nm / turns,
        upright_steps=joint.steps(weight.upright_rad),
        gravity_turns=1.0 / turns,
        stop_low_steps=low,
        stop_high_steps=high,
        play_deg=JOINT_PLAY_DEG * turns,
    )
    return ServoSpec(joint.id, joint.model, start, physics=physics)


def _hobby_spec(rig: Rig, name: str) -> HobbySpec:
    """Return the hobby servo of one joint; the board allows the whole range of such servos."""
    joint, (low, high) = rig.joints[name], _stops(rig, name)
    facts, spec = joint.model_facts, HobbySpec(joint.id)
    if joint.servo_speed_deg_s is not None:
        spec = spec._replace(speed_steps_s=joint.servo_speed_deg_s * facts.steps_per_turn / 360.0)
    if "neck" in name:
        spec = spec._replace(stall_torque_nm=_NECK_SERVO_NM)
    return spec._replace(
        start_steps=start_step(rig, name),
        stop_low_steps=low,
        stop_high_steps=high,
        min_steps=facts.lowest,
        max_steps=facts.highest,
    )


# --- weight and inertia at the joints, which the servos carry


class Weight(NamedTuple):
    """Weight on a joint with all others at 0: its torque is nm * sin(angle - upright_rad).

    inertia_kg_m2: inertia about the joint's axis
    """

    nm: float
    upright_rad: float
    inertia_kg_m2: float


def joint_weights(description: Description, joints: Collection[str]) -> dict[str, Weight]:
    """Return the weight at each of some joints of a rig with all others at 0."""
    nodes, inertias = moving_bodies(description, joints), _inertias(description, joints)
    level, found = weight_nm(nodes, {}), {}
    for name in joints:
        # About a fixed axis the torque is a sine of the angle.
        torque = level.get(name, 0.0)
        aside = weight_nm(nodes, {name: 0.5 * pi}).get(name, 0.0)
        found[name] = Weight(hypot(torque, aside), atan2(-torque, aside), inertias[name])
    return found


def _inertias(description: Description, joints: Collection[str]) -> Mapping[str, float]:
    """Return the inertia about the axis of each joint of the rig with all joints at 0."""
    poses = description.poses(description.angles((), ()))
    links = {link.name: link for link in description.links}
    found = dict.fromkeys(joints, 0.0)
    for link in description.links:
        if link.inertia is None:
            continue
        R, p = poses[link.name]
        own, at = in_parent_frame(link.inertia, np.array(R), p), link
        while True:  # along all joints that carry the link
            if at.joint is not None:
                R, p = poses[at.name]
                axis = np.array(rotate(R, at.joint.axis))
                across = np.cross(axis, np.subtract(own.com_m, p))
                moment = own.mass_kg * float(across @ across) + axis @ own.tensor_kg_m2 @ axis
                found[at.joint.follows or at.joint.name] += float(moment)
            if at.parent is None:
                break
            at = links[at.parent]
    return found
