"""The bus of one run: real ports, emulated servos (on a pseudo-terminal or here), or ideal ones.

The emulated servos are mounted in the rig's joints as its YAML defines.
"""

import hashlib
from collections.abc import Callable, Mapping
from math import radians
from typing import NamedTuple

from gazerig.config.rig import BusConfig, Rig
from gazerig.drivers.bus.servo_models import HOBBY_KINDS
from gazerig.drivers.camera.shared_slots import PoseBuffer
from gazerig.drivers.plugins import EmulatedJoint
from gazerig.drivers.serial.list_ports import check_exists, check_owner, serial_ports
from gazerig.drivers.types import ServoBus
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.coupling import pair_setups
from gazerig.robot.model.frames import CameraMount, PoseHistory
from gazerig.robot.run.bus_wiring import (
    bus_names,
    bus_ports,
    guarded_rig_bus,
    joints_on,
    rig_bus,
    servo_configs,
)
from gazerig.robot.run.joint_weights import Weight, joint_weights
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.rig_description import description_of
from gazerig.sim_mock.device import Device
from gazerig.sim_mock.devices import (
    DynamixelLine,
    Emulated,
    FeetechLine,
    MaestroLine,
    Pca9685Line,
    build,
    plugin_line,
)
from gazerig.sim_mock.hobby_servo import HobbySpec
from gazerig.sim_mock.ideal.bus import IdealBus
from gazerig.sim_mock.pty.client import PtyBuses
from gazerig.sim_mock.smart_servo.physics import Physics, ServoSpec

TrueSteps = Callable[[], Mapping[str, float]]
"""Function that returns the present true positions of the servos in steps, by joint."""


class RunBus(NamedTuple):
    """The bus of the rig.

    true_steps: true positions of the servos, None if unknown in this process
    sent_bytes_digest: returns the SHA-256 of all bytes sent, None if they are not counted
    close: ends the processes started for it
    inject_fault: executes a fault command of the emulated servos, None for real or ideal ones
    """

    bus: ServoBus
    true_steps: TrueSteps | None = None
    sent_bytes_digest: Callable[[], str | None] = lambda: None
    close: Callable[[], None] = lambda: None
    inject_fault: Callable[[str], str] | None = None


class CameraPoses(NamedTuple):
    """Placement of the camera, history of the head's pose, and its further receivers."""

    mount: CameraMount
    poses: PoseHistory
    turns: PoseBuffer | None


JOINT_PLAY_DEG = 0.25
"""Play between servo and joint, from stop to stop, as in the data sheets of the X430."""
_CROOKED_DEG = {"left_eye_pan": 6.0, "right_eye_pan": -4.0, "neck_yaw": -12.0, "neck_pitch": -8.0}
"""Start angles of emulated joints: slightly off, like those of a head moved by hand."""

STOP_BEYOND_DEG = 4.0
"""Distance of an emulated joint's mechanical stops beyond its configured range."""


_NECK_SERVO_NM = 1.0
"""Torque of a hobby servo of the neck: standard size, 10 kg cm; eyes and lids have small ones."""


def emulated_lines(rig: Rig) -> dict[str, Emulated]:
    """Return the emulated device of each bus, by the bus's name; servos in the order of joints."""
    return {name: _emulated_line(rig, name) for name in bus_names(rig)}


def ideal_bus(rig: Rig, now_s: Callable[[], float]) -> IdealBus:
    """Return all servos of a rig without bytes, at the start angles of the emulated ones."""
    measured = [rig.joints[name].model_facts.measures_position for name in rig.names]
    return IdealBus(
        servo_configs(rig), [_start_step(rig, name) for name in rig.names], measured, now_s
    )


def _emulated_servo(rig: Rig, name: str, weight: Weight) -> ServoSpec:
    """Return the smart servo of one joint with this weight on it; coupled servos carry none."""
    joint = rig.joints[name]
    start, (low, high) = _start_step(rig, name), _mechanical_stops(rig, name)
    turns = joint.shaft_turns()
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


def servo_index(rig: Rig, joint: str) -> int:
    """Return the index of a joint's servo in the true positions of its emulated device."""
    bus, servo_id = rig.joints[joint].bus, rig.joints[joint].id
    # A board lists all its channels, a chain only its servos.
    return servo_id if rig.bus_named(bus).kind in HOBBY_KINDS else joints_on(rig, bus).index(joint)


def _emulated_line(rig: Rig, name: str) -> Emulated:
    config, joints = rig.bus_named(name), joints_on(rig, name)
    if config.kind in CHAINS:
        weights = joint_weights(description_of(rig), rig.joints)
        specs = tuple(_emulated_servo(rig, one, weights[one]) for one in joints)
        return CHAINS[config.kind](specs, config.section.baud)
    if config.kind in BOARDS:
        return BOARDS[config.kind](config, tuple(_hobby_spec(rig, one) for one in joints))
    servos = tuple(
        EmulatedJoint(
            rig.joints[name].id,
            rig.joints[name].model,
            _start_step(rig, name),
            *_mechanical_stops(rig, name),
        )
        for name in joints
    )
    return plugin_line(config.kind, config.section, servos)


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


def _hobby_spec(rig: Rig, name: str) -> HobbySpec:
    joint = rig.joints[name]
    low, high = _mechanical_stops(rig, name)
    facts, spec = joint.model_facts, HobbySpec(joint.id)
    if joint.servo_speed_deg_s is not None:
        spec = spec._replace(speed_steps_s=joint.servo_speed_deg_s * facts.steps_per_turn / 360.0)
    if "neck" in name:
        spec = spec._replace(stall_torque_nm=_NECK_SERVO_NM)
    # The board's own range of the channel is as wide as that of such servos.
    return spec._replace(
        start_steps=_start_step(rig, name),
        stop_low_steps=low,
        stop_high_steps=high,
        min_steps=facts.lowest,
        max_steps=facts.highest,
    )


def start_angles_rad(rig: Rig) -> dict[str, float]:
    """Return the start angles of a rig's emulated joints."""
    return {
        # No farther than the mechanical stops of a joint with a small range.
        name: radians(min(max(_CROOKED_DEG.get(name, 0.0), joint.min_deg - STOP_BEYOND_DEG),
                          joint.max_deg + STOP_BEYOND_DEG))
        for name, joint in rig.joints.items()
    }  # fmt: skip


def _start_step(rig: Rig, name: str) -> int:
    crooked = start_angles_rad(rig)
    for pair in rig.couplings.values():
        first, second = pair.joints
        crooked[first], crooked[second] = pair.servo_rad((crooked[first], crooked[second]))
    return round(rig.joints[name].steps(crooked[name]))


def _mechanical_stops(rig: Rig, name: str) -> tuple[float, float]:
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


def run_bus(rig: Rig, options: RunOptions, clock: Clock) -> RunBus:
    """Return the real port, ideal servos, or an emulated bus here or on a pseudo-terminal.

    Without pseudo-terminals the bus is emulated in this process also in real time.

    Args:
        rig: The rig of the servos.
        options: Options of the run, which select the servos' replacement.
        clock: Clock of the run.
    """
    if not options.mock:
        paths, here = bus_ports(rig, options.port), serial_ports()
        for name, path in paths.items():
            check_exists(path)
            check_owner(path, rig.bus_named(name).kind, here)
        return RunBus(guarded_rig_bus(rig, paths))
    if options.bus == "ideal":
        return ideal_run_bus(rig, ideal_bus(rig, clock.now_s))
    lines = emulated_lines(rig)
    if not options.fast:
        buses = PtyBuses()
        paths = buses.start(lines)
        return RunBus(guarded_rig_bus(rig, paths), close=buses.stop, inject_fault=buses.command)
    return in_process_run_bus(rig, {name: build(line, clock.now_s) for name, line in lines.items()})


def ideal_run_bus(rig: Rig, ideal: IdealBus) -> RunBus:
    """Return ideal servos of a rig, with their true positions."""
    names = rig.names
    return RunBus(ideal, lambda: dict(zip(names, ideal.positions_steps(), strict=True)))


def in_process_run_bus(rig: Rig, devices: Mapping[str, Device]) -> RunBus:
    """Return emulated devices in this process, by the name of their bus, with a digest."""
    from gazerig.sim_mock.in_process_port import InProcessPort

    sent = hashlib.sha256()
    ports = {name: InProcessPort(device, sent.update) for name, device in devices.items()}
    return RunBus(rig_bus(rig, ports), _true_steps(rig, devices), sent.hexdigest)


def _true_steps(rig: Rig, devices: Mapping[str, Device]) -> TrueSteps:
    """Return the reader of the shafts of emulated devices; ``devices``: by bus name."""
    places = tuple((name, rig.joints[name].bus, servo_index(rig, name)) for name in rig.names)

    def now() -> dict[str, float]:
        steps = {bus: device.positions_steps() for bus, device in devices.items()}
        return {name: steps[bus][place] for name, bus, place in places}

    return now
