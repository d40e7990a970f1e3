"""Which addresses of an I2C bus answer as a PCA9685 does: registers are read, none is written."""

from gazerig.drivers.errors import PortError
from gazerig.drivers.pca9685.board import Pca9685Board
from gazerig.drivers.pca9685.params import RESERVED, Pca9685Params
from gazerig.drivers.serial.port import BusPort

FIRST, LAST = 0x40, 0x77


def probe(port: BusPort, params: Pca9685Params) -> tuple[int, ...]:
    """Return the addresses of the boards on a bus; the port is left open.

    Raises:
        PortError: the port cannot be opened.
        BusLost: it went away.
    """
    if not port.setBaudRate(params.baud):
        raise PortError(f"{port.port_name} cannot run at {params.baud} bit/s: name its port")
    board = Pca9685Board(port, params)
    found = []
    for address in range(FIRST, LAST + 1):
        if address in RESERVED:
            continue
        if board.answers(address):
            found.append(address)
        elif board.line.why and board.line.why != "not acknowledged":
            break  # no I2C bus, or one that is stuck
    return tuple(found)
