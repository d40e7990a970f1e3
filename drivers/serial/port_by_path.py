"""The port of a bus by its path, whatever kind of port that is."""

from collections.abc import Callable

from gazerig.drivers.serial.port import BlockingPort, BusPort
from gazerig.drivers.serial.port_owner import is_i2c


def port_of(
    path: str, exclusive: bool = True, on_traffic: Callable[[], None] | None = None
) -> BusPort:
    """Return a port by its path: an I2C bus of the kernel, or else a serial port."""
    if is_i2c(path):
        from gazerig.drivers.i2c.port import I2cPort  # Linux alone has such buses

        return I2cPort(path, exclusive, on_traffic)
    return BlockingPort(path, exclusive, on_traffic)
