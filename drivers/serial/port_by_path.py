"""Creation of a bus port from its path."""

from collections.abc import Callable

from gazerig.drivers.serial.port import BlockingPort, BusPort
from gazerig.drivers.serial.port_owner import is_i2c


def port_of(
    path: str, exclusive: bool = True, on_traffic: Callable[[], None] | None = None
) -> BusPort:
    """Return the port at a path: an I2C bus of the kernel, or a serial port."""
    if is_i2c(path):
        from gazerig.drivers.i2c.port import I2cPort  # only Linux has such buses

        return I2cPort(path, exclusive, on_traffic)
    return BlockingPort(path, exclusive, on_traffic)
