"""The buses of a rig: which joints are on which, and one bus made of them all."""

from collections.abc import Mapping

from config.schema import Rig
from drivers.dynamixel.bus import DynamixelBus
from drivers.errors import SetupError
from drivers.feetech.bus import FeetechBus
from drivers.maestro.bus import MaestroBus
from drivers.mixed_bus import MixedBus, Share
from drivers.serial_port import BusPort
from drivers.types import ServoBus, ServoSetup
from robot.body import setups
from robot.rig_angles import park_rad


def bus_names(rig: Rig) -> tuple[str, ...]:
    """Give the names of the buses that joints are on, "" for the one without a name first."""
    used = {joint.bus for joint in rig.joints.values()}
    return tuple(name for name in ("", *rig.buses) if name in used)


def joints_on(rig: Rig, name: str) -> tuple[str, ...]:
    """Give the joints of one bus, in the order of all joints."""
    return tuple(joint for joint in rig.names if rig.joints[joint].bus == name)


def ports_of(rig: Rig, given: str | None) -> dict[str, str]:
    """Give the serial port of every bus: the rig's, or that given instead.

    given: a port for the bus without a name, or for the only one; NAME=PORT for another, and
        several with commas between

    Raises:
        drivers.errors.SetupError: it names a bus that is not there.
    """
    ports = {name: rig.bus_named(name).port for name in bus_names(rig)}
    for one in given.split(",") if given is not None else ():
        name, equals, port = one.rpartition("=")
        if not equals and "" not in ports and len(ports) == 1:
            (name,) = ports
        if name not in ports or not port:
            named = ", ".join(f"{name}=PORT" if name else "PORT" for name in ports)
            raise SetupError(f"--port {given}: no such bus in this rig; it can be {named}")
        ports[name] = port
    return ports


def rig_setups(rig: Rig) -> tuple[ServoSetup, ...]:
    """Give what buses must know of a rig's servos, in the order of its joints."""
    return setups(rig.joints, park_rad(rig))


def rig_bus(rig: Rig, ports: Mapping[str, BusPort]) -> ServoBus:
    """Make the bus of a rig; nothing is opened.

    ports: by the name of the bus
    """
    shares = [_share(rig, name, ports[name]) for name in bus_names(rig)]
    return shares[0].bus if len(shares) == 1 else MixedBus(shares)


def _share(rig: Rig, name: str, port: BusPort) -> Share:
    every = dict(zip(rig.names, rig_setups(rig), strict=True))
    mine = joints_on(rig, name)
    own = [every[joint] for joint in mine]
    places = tuple(rig.names.index(joint) for joint in mine)
    config = rig.bus_named(name)
    if config.kind == "feetech":
        return Share(name, FeetechBus(port, own, config.feetech), places)
    if config.kind == "maestro":
        return Share(name, MaestroBus(port, own, config.maestro), places)
    return Share(name, DynamixelBus(port, own, config.dynamixel), places)
