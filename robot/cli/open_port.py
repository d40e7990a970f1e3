"""One bus of a rig, opened as a port for questions and orders to single servos."""

import contextlib
from collections.abc import Iterator

from gazerig.config.schema import Rig
from gazerig.drivers.errors import PortError
from gazerig.drivers.serial.port import BusPort
from gazerig.robot.cli.ports import Wires
from gazerig.robot.cli.progress import to_open
from gazerig.robot.guardian.guardian import Guardian


@contextlib.contextmanager
def opened(rig: Rig, wire: Wires, bus: str, guardian: Guardian | None = None) -> Iterator[BusPort]:
    """Open the port of the bus of this name at its speed; nothing is sent.

    guardian: is shown a sign of life with all that is sent

    Raises:
        PortError: it is absent, busy, not permitted, or has no such speed.
    """
    config = rig.bus_named(bus)
    with to_open(wire.paths[bus], guardian.beat if guardian is not None else None) as port:
        if not port.setBaudRate(config.baud):
            raise PortError(f"{port.port_name} cannot run at {config.baud} bit/s: choose another")
        yield port
