"""Detection of PCA9685 boards: registers are read one by one, none is written."""

from gazerig.drivers.errors import PortError, ServoMissing
from gazerig.drivers.hobby_board.release import TRIES
from gazerig.drivers.i2c.line import BUS_STUCK, NOT_ACKNOWLEDGED, I2cLine, read
from gazerig.drivers.pca9685.params import RESERVED, Pca9685Params
from gazerig.drivers.pca9685.registers import (
    BYTES,
    CHANNELS,
    EXTCLK,
    LED0,
    MODE1,
    PRESCALE,
    are_plausible,
)
from gazerig.drivers.serial.port import BusPort

ADDRESSES = tuple(address for address in range(0x40, 0x78) if address not in RESERVED)


def probe(port: BusPort, params: Pca9685Params) -> tuple[int, ...]:
    """Return the addresses of the boards on a bus; the port stays open.

    Raises:
        PortError: the port cannot be opened.
        BusLost: the port is lost.
    """
    if not port.setBaudRate(params.baud):
        raise PortError(f"{port.port_name} cannot run at {params.baud} bit/s: name its port")
    line = I2cLine(port, params.baud)
    found = []
    for address in ADDRESSES:
        if line.ask([(read(address, MODE1, 1), 1)]) is not None:
            registers = _registers(line, address)
            if registers is not None and are_plausible(*registers):
                found.append(address)
        elif line.failure != NOT_ACKNOWLEDGED:
            break  # no I2C bus, or one that is stuck
    return tuple(found)


def check_board(line: I2cLine, address: int) -> None:
    """Check that a PCA9685 answers at an address.

    Raises:
        ServoMissing: another chip answers, or none.
    """
    where = f"{line.port.port_name}: "
    tries = (_registers(line, address) for _ in range(TRIES))
    found = next((one for one in tries if one is not None), None)
    if found is None:
        fault = f"{where}no PCA9685 answers at {address:#x}"
        remedy = (
            "does the board have its logic supply (VCC, not only V+)? check SDA, SCL and ground; "
            "its jumpers set the address"
        )
        if line.failure == BUS_STUCK:
            fault = f"{where}the I2C bus is stuck, its data or clock line is held low"
            remedy = "switch the supply of its devices off and on, check SDA and SCL for a short"
        elif line.failure != NOT_ACKNOWLEDGED:
            fault = f"{where}no answer as an I2C bus ({line.failure})"
            remedy = (
                "a PCA9685 is reached over an I2C bus such as /dev/i2c-1: write it under bus.port"
            )
        raise ServoMissing(line.lateness.blame(fault, remedy, line.port.now_s()))
    if not are_plausible(*found):
        raise ServoMissing(
            f"{where}the chip at {address:#x} is not a PCA9685: another chip has this "
            "address; close a jumper and write the new one under bus.pca9685.address"
        )
    if found[0][MODE1] & EXTCLK:
        raise ServoMissing(
            f"{where}the board at {address:#x} was set to an external clock: switch its logic "
            "supply off and on"
        )


def _registers(line: I2cLine, address: int) -> tuple[bytes, bytes, int] | None:
    """Read all registers of a board one by one, which needs no particular setting."""
    single = [*range(LED0 + CHANNELS * BYTES), PRESCALE]
    found = line.ask([(read(address, register, 1), 1) for register in single])
    if found is None:
        return None
    flat = b"".join(found)
    return flat[:LED0], flat[LED0:-1], flat[-1]
