"""The bus of a run: the rig's serial ports with a guardian, emulated servos, or ideal ones."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from gazerig.config.rig import BusConfig, Rig
from gazerig.drivers.bus.multi_bus import BusShare, MultiBus
from gazerig.drivers.bus.servo_models import SERVOS
from gazerig.drivers.errors import PluginError, SetupError
from gazerig.drivers.plugins import BUS, BusPlugin, describe_error, find, is_ours, load
from gazerig.drivers.serial.list_ports import check_exists, check_owner, serial_ports
from gazerig.drivers.serial.port import BusPort, port_at_path
from gazerig.drivers.types import ServoBus, ServoConfig
from gazerig.robot.guardian.guardian import GuardedBus, Guardian
from gazerig.robot.guardian.release_plan import ReleasePlan
from gazerig.robot.model.clock import Clock
from gazerig.robot.run.emulated import emulated_lines, servo_index, start_step
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.rig_limits import bus_names, joints_on, servo_configs
from gazerig.sim_mock.device import Device
from gazerig.sim_mock.devices import build
from gazerig.sim_mock.faults.grammar import bus_and_command
from gazerig.sim_mock.ideal.bus import IdealBus
from gazerig.sim_mock.in_process_port import InProcessPort


class RunBus(NamedTuple):
    """The bus of the rig.

    true_steps: true positions of the servos by joint, None if unknown in this process
    sent_bytes_digest: returns the SHA-256 of all bytes sent, None if they are not counted
    close: ends the processes started for it
    inject_fault: executes a fault command of the emulated servos, None for real or ideal ones
    """

    bus: ServoBus
    true_steps: Callable[[], dict[str, float]] | None = None
    sent_bytes_digest: Callable[[], str | None] = lambda: None
    close: Callable[[], None] = lambda: None
    inject_fault: Callable[[str], str] | None = None


def run_bus(rig: Rig, options: RunOptions, clock: Clock) -> RunBus:
    """Return the real ports, ideal servos, or emulated devices in this process.

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
        measured = [rig.joints[name].model_facts.measures_position for name in rig.names]
        starts = [start_step(rig, name) for name in rig.names]
        return ideal_run_bus(rig, IdealBus(servo_configs(rig), starts, measured, clock.now_s))
    devices = {name: build(line, clock.now_s) for name, line in emulated_lines(rig).items()}
    return in_process_run_bus(rig, devices, None if options.fast else clock.sleep_until)


def ideal_run_bus(rig: Rig, ideal: IdealBus) -> RunBus:
    """Return ideal servos of a rig, with their true positions."""
    names = rig.names
    return RunBus(ideal, lambda: dict(zip(names, ideal.positions_steps(), strict=True)))


def in_process_run_bus(
    rig: Rig,
    devices: Mapping[str, Device],
    sleep_until: Callable[[float], None] | None = None,
) -> RunBus:
    """Return emulated devices in this process, by the name of their bus.

    sleep_until: Waits for late answers, as at a real port; without it no call waits.
    """
    sent = hashlib.sha256() if sleep_until is None else None  # a rerun has other bytes in real time
    tap = None if sent is None else sent.update
    ports = {
        name: InProcessPort(device, tap, sleep_until=sleep_until)
        for name, device in devices.items()
    }
    places = tuple((name, rig.joints[name].bus, servo_index(rig, name)) for name in rig.names)

    def true_steps() -> dict[str, float]:
        steps = {bus: device.positions_steps() for bus, device in devices.items()}
        return {name: steps[bus][place] for name, bus, place in places}

    def inject_fault(text: str) -> str:
        bus, command = bus_and_command(text, ports)
        return ports[bus].command(command)

    digest = sent.hexdigest if sent else lambda: None
    return RunBus(rig_bus(rig, ports), true_steps, digest, inject_fault=inject_fault)


def bus_ports(rig: Rig, given: str | None) -> dict[str, str]:
    """Return the serial port of every bus: the rig's, or the given one.

    given: a port for the unnamed or only bus; NAME=PORT for another one; several are separated by
        commas

    Raises:
        SetupError: it names an unknown bus.
    """
    ports = {name: rig.bus_named(name).port for name in bus_names(rig)}
    for part in given.split(",") if given is not None else ():
        name, equals, port = part.rpartition("=")
        if not equals and "" not in ports and len(ports) == 1:
            (name,) = ports
        if name not in ports or not port:
            named = ", ".join(f"{name}=PORT" if name else "PORT" for name in ports)
            raise SetupError(f"--port {given}: no such bus in this rig; expected {named}")
        ports[name] = port
    return ports


def rig_bus(
    rig: Rig, ports: Mapping[str, BusPort], guardian: Guardian | None = None,
    guarded: Sequence[str] = (),
) -> ServoBus:  # fmt: skip
    """Return the bus of a rig; nothing is opened.

    Args:
        rig: the rig.
        ports: Ports by the name of the bus.
        guardian: Switches torque off if this program dies.
        guarded: Names of the buses whose plans the guardian has, in their order.

    Raises:
        SetupError: a package cannot create its bus.
    """
    configs, shares = servo_configs(rig), list[BusShare]()
    for name in bus_names(rig):
        places = tuple(rig.names.index(joint) for joint in joints_on(rig, name))
        own = tuple(configs[i] for i in places)
        label, bus = _make_bus(name, rig.bus_named(name), ports[name], own)
        if guardian is not None and name in guarded:
            bus = GuardedBus(bus, own, guardian, guarded.index(name))
        shares.append(BusShare(label, bus, places))
    is_single = len(shares) == 1 and shares[0].name in bus_names(rig)
    return shares[0].bus if is_single else MultiBus(shares, configs)


def _make_bus(
    name: str, config: BusConfig, port: BusPort, servos: tuple[ServoConfig, ...]
) -> tuple[str, ServoBus]:
    make = load(BUS, config.kind, BusPlugin).make
    if is_ours(BUS, config.kind):
        return name, make(port, servos, config.section)
    label = find(BUS, config.kind).label
    try:
        return label, make(port, servos, config.section)
    except SetupError:
        raise
    except Exception as error:
        raise PluginError(f"{label} cannot be created: {describe_error(error)}") from error


def guarded_rig_bus(rig: Rig, paths: Mapping[str, str]) -> ServoBus:
    """Return the bus of a rig on serial ports, guarded.

    If a program that switches torque on through it dies or hangs, a guardian process, started as
    the bus is opened, switches torque off. A servo's own watchdog would only stop its motion and
    keep the torque. Nothing is opened here.

    Args:
        rig: the rig.
        paths: Paths of the serial ports, by the name of the bus.
    """
    plans = release_plans(rig, paths)
    guardian = Guardian(tuple(plans.values())) if plans else None
    beat = guardian.beat_on_traffic if guardian is not None else None
    ports = {name: port_at_path(paths[name], on_traffic=beat) for name in bus_names(rig)}
    return rig_bus(rig, ports, guardian, tuple(plans))


def release_plans(rig: Rig, paths: Mapping[str, str]) -> dict[str, ReleasePlan]:
    """Return the plans to switch the servos' torque off, by the name of their bus.

    A bus of another package that releases its own servos has no plan.
    """
    return {
        name: release_plan(rig, name, paths[name])
        for name in bus_names(rig)
        if is_ours(BUS, kind := rig.bus_named(name).kind)
        or load(BUS, kind, BusPlugin).release is not None
    }


def release_plan(rig: Rig, name: str, path: str) -> ReleasePlan:
    """Return the plan to switch off the torque of one bus at the path of its serial port."""
    config, joints = rig.bus_named(name), joints_on(rig, name)
    return ReleasePlan(
        config.kind,
        path,
        tuple(rig.joints[joint].id for joint in joints),
        config.section,
        SERVOS[rig.joints[joints[0]].model].family,
    )
