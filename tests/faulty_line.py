"""Servos on an emulated line that faults are asked of by text."""

import struct

from fastcrc.crc16 import umts

from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.dynamixel.packets import status
from gazerig.sim_mock.in_process_port import InProcessPort

IDS = (1, 2, 3)
READ_ONE = (2, struct.pack("<HH", 132, 4))
READ_ALL = struct.pack("<HH", 132, 4) + bytes(IDS)


def instruction(servo_id, code, params=b""):
    packet = b"\xff\xff\xfd\x00" + struct.pack("<BHB", servo_id, len(params) + 3, code) + params
    return packet + struct.pack("<H", umts(packet))


def good(servo_id):
    """Return the status of an unspoilt read of the position."""
    return status(servo_id, 0, struct.pack("<i", 2000 + servo_id))


class World:
    """Three servos, a port, and a clock that waiting moves on."""

    def __init__(self, sleeps=True, **options):
        self.now_s = 0.0
        chain = build_dynamixel(
            [(i, "xl330-m077", 2000 + i) for i in IDS], lambda: self.now_s, **options
        )
        self.port = InProcessPort(chain, sleep_until=self.sleep_until if sleeps else None)
        self.port.setBaudRate(1_000_000)
        self.faults = self.port.faults

    def sleep_until(self, t_s):
        self.now_s = max(self.now_s, t_s)

    def ask(self, servo_id, code, params=b"", timeout_s=0.1):
        """Send one instruction and give all that arrives in time."""
        self.port.write(instruction(servo_id, code, params))
        return self.port.read_until(2000, self.now_s + timeout_s)

    def one(self, servo_id=2):
        return self.ask(servo_id, *READ_ONE)

    def plain(self):
        return self.ask(0xFE, 0x82, READ_ALL)

    def fast(self):
        return self.ask(0xFE, 0x8A, READ_ALL)
