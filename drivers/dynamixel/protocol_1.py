"""Dynamixel Protocol 1.0: detection of servos that are set to it.

Servos of other manufacturers use it too. Source of the packets: ROBOTIS e-Manual, Protocol 1.0.
"""

from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.registers import REPLY_S

_PING = b"\xff\xff\xfe\x02\x01\xfe"


def ping_protocol_1(port: BusPort) -> tuple[int, ...]:
    """Ping all servos in Protocol 1.0; return the ids that answer."""
    port.drain()
    port.write(_PING)
    return protocol_1_ids(port.read_until(1 << 12, port.now_s() + REPLY_S))


def protocol_1_ids(raw: bytes) -> tuple[int, ...]:
    """Return the ids of Protocol 1.0 ping answers: FF FF id 02 error checksum."""
    ids = []
    at = raw.find(b"\xff\xff")
    while 0 <= at <= len(raw) - 6:
        servo_id, length, error, checksum = raw[at + 2 : at + 6]
        good = length == 2 and servo_id <= 253 and raw[at : at + 6] != _PING
        if good and checksum == ~(servo_id + length + error) & 0xFF:
            ids.append(servo_id)
        at = raw.find(b"\xff\xff", at + 1)
    return tuple(ids)
