"""I2C transfers as bytes, in the format of NXP's SC18IM700.

All servo ports carry bytes, and these bytes carry I2C: to a bridge on a serial line, to an emulated
one, and to gazerig.drivers.i2c.port, which executes them on the kernel's buses. A transfer is S,
the address with its direction bit, a count, for a write that number of bytes, and P. R, a register
and P read a register of the bridge; register 0A contains the result of the last transfer. Source:
NXP, SC18IM700 data sheet, rev. 2 (10 August 2007).
"""

START, STOP = ord("S"), ord("P")
READ_STATUS = b"R\x0aP"
OK, NO_ACKNOWLEDGE, TIMED_OUT = 0xF0, 0xF1, 0xF8
STUCK = "bus stuck"
FAILURES = {
    **dict.fromkeys((NO_ACKNOWLEDGE, 0xF2, 0xF3), "not acknowledged"),
    TIMED_OUT: STUCK,
}
"""Status byte -> error."""


def write(address: int, register: int, data: bytes) -> bytes:
    """Build a write of some registers."""
    return bytes((START, address << 1, len(data) + 1, register)) + data + bytes((STOP,))


def read(address: int, register: int, length: int) -> bytes:
    """Build a read of some registers."""
    return bytes((START, address << 1, 1, register, START, address << 1 | 1, length, STOP))
