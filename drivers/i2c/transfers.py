"""I2C transfers as bytes, in the format of NXP's SC18IM700 (data sheet, rev. 2, 10 August 2007).

All servo ports carry bytes, and these bytes carry I2C: to a bridge on a serial line, to an emulated
one, and to gazerig.drivers.i2c.port, which executes them on the kernel's buses. A transfer is S,
the address with its direction bit, a count, for a write that number of bytes, and P. R, a register
and P read a register of the bridge; register 0A contains the result of the last transfer.
"""

START, STOP = ord("S"), ord("P")
READ_STATUS = b"R\x0aP"
OK, NO_ACKNOWLEDGE = 0xF0, 0xF1


def write(address: int, register: int, data: bytes) -> bytes:
    """Build a write of some registers."""
    return bytes((START, address << 1, len(data) + 1, register)) + data + bytes((STOP,))


def read(address: int, register: int, length: int) -> bytes:
    """Build a read of some registers."""
    return bytes((START, address << 1, 1, register, START, address << 1 | 1, length, STOP))
