"""The buses of a rig: their joints, and one bus that joins them."""

from collections.abc import Mapping

from gazerig.config.rig import Rig
from gazerig.drivers.bus.multi_bus import BusShare, MultiBus
from gazerig.drivers.bus.servo_models import SERVOS
from gazerig.drivers.errors import PluginError, SetupError
from gazerig.drivers.plugins import BUS, BusPlugin, describe_error, find, is_ours, load
from gazerig.drivers.serial.port import BusPort, port_at_path
from gazerig.drivers.types import ServoBus, ServoConfig
from gazerig.robot.guardian.guardian import GuardedBus, Guardian
from gazerig.robot.guardian.release_plan import ReleasePlan, pickle_params
from gazerig.robot.loop.body import servo_setups
from gazerig.robot.run.rig_limits import park_rad


def bus_names(rig: Rig) -> tuple[str, ...]:
    """Return the names of the buses with joints; the unnamed one, "", is the first."""
    used = {joint.bus for joint in rig.joints.values()}
    return tuple(name for name in ("", *rig.buses) if name in used)


def joints_on(rig: Rig, name: str) -> tuple[str, ...]:
    """Return the joints of one bus, in the order of all joints."""
    return tuple(joint for joint in rig.names if rig.joints[joint].bus == name)


def bus_ports(rig: Rig, given: str | None) -> dict[str, str]:
    """Return the serial port of every bus: the rig's, or the given one.

    given: a port for the unnamed or only bus; NAME=PORT for another one; several are separated by
        commas

    Raises:
        SetupError: it names an unknown bus.
    """
    ports = {name: rig.bus_named(name).port for name in bus_names(rig)}
    for one in given.split(",") if given is not None else ():
        name, equals, port = one.rpartition("=")
        if not equals and "" not in ports and len(ports) == 1:
            (name,) = ports
        if name not in ports or not port:
            named = ", ".join(f"{name}=PORT" if name else "PORT" for name in ports)
            raise SetupError(f"--port {given}: no such bus in this rig; expected {named}")
        ports[name] = port
    return ports


def servo_configs(rig: Rig) -> tuple[ServoConfig, ...]:
    """Return the configuration of a rig's servos for the buses, in the order of its joints."""
    gentle_deg_s = rig.guard.soft_start_speed_deg_s
    return servo_setups(rig.joints, park_rad(rig), gentle_deg_s, rig.couplings.values())


def rig_bus(rig: Rig, ports: Mapping[str, BusPort]) -> ServoBus:
    """Return the bus of a rig; nothing is opened.

    ports: ports by the name of the bus
    """
    return _join_buses(rig, [_bus_share(rig, name, ports[name]) for name in bus_names(rig)])


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
    guarded = list(plans)
    guardian = Guardian(tuple(plans.values())) if plans else None
    beat = guardian.beat_on_traffic if guardian is not None else None
    shares = []
    for name in bus_names(rig):
        share = _bus_share(rig, name, port_at_path(paths[name], on_traffic=beat))
        if guardian is not None and name in plans:
            own = [servo_configs(rig)[i] for i in share.servo_indices]
            bus = GuardedBus(share.bus, own, guardian, guarded.index(name))
            share = share._replace(bus=bus)
        shares.append(share)
    return _join_buses(rig, shares)


def release_plans(rig: Rig, paths: Mapping[str, str]) -> dict[str, ReleasePlan]:
    """Return the plans to switch the servos' torque off, by the name of their bus.

    A bus of another package that releases its own servos has no plan.

    Args:
        rig: the rig.
        paths: Paths of the serial ports, by the name of the bus.
    """
    return {
        name: release_plan(rig, name, paths[name])
        for name in bus_names(rig)
        if can_be_released(rig, name)
    }


def release_plan(rig: Rig, name: str, path: str) -> ReleasePlan:
    """Return the plan to switch off the torque of one bus.

    Args:
        rig: the rig.
        name: Name of the bus.
        path: Path of its serial port.
    """
    config, board = rig.bus_named(name), rig.bus_named(name).maestro
    ours = is_ours(BUS, config.kind)
    ids = tuple(rig.joints[joint].id for joint in joints_on(rig, name))
    return ReleasePlan(
        config.kind,
        path,
        config.section.baud,
        ids,
        board.crc,
        board.channels,
        config.pca9685.address,
        SERVOS[rig.joints[joints_on(rig, name)[0]].model].family,
        "" if ours else pickle_params(config.section),
    )


def can_be_released(rig: Rig, name: str) -> bool:
    """Return whether a guardian can switch off the servos of one bus.

    It can for all kinds of this package. Another package defines a plan, or that none is needed.
    """
    kind = rig.bus_named(name).kind
    return is_ours(BUS, kind) or load(BUS, kind, BusPlugin).release is not None


def _join_buses(rig: Rig, shares: list[BusShare]) -> ServoBus:
    """Return several buses as one; a single one of ours is returned unchanged."""
    is_single = len(shares) == 1 and is_ours(BUS, rig.bus_named(bus_names(rig)[0]).kind)
    return shares[0].bus if is_single else MultiBus(shares, servo_configs(rig))


def _bus_share(rig: Rig, name: str, port: BusPort) -> BusShare:
    every = dict(zip(rig.names, servo_configs(rig), strict=True))
    mine = joints_on(rig, name)
    own = [every[joint] for joint in mine]
    places = tuple(rig.names.index(joint) for joint in mine)
    config = rig.bus_named(name)
    part = load(BUS, config.kind, BusPlugin)
    if is_ours(BUS, config.kind):
        return BusShare(name, part.make(port, tuple(own), config.section), places)
    label = find(BUS, config.kind).label
    try:
        bus: ServoBus = part.make(port, tuple(own), config.section)
    except SetupError:
        raise
    except Exception as error:
        raise PluginError(f"{label} cannot be created: {describe_error(error)}") from error
    return BusShare(label, bus, places)
