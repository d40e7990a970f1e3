"""Emulated smart servos on a clock that is set by hand, and packets made apart from them."""

import struct
from collections.abc import Callable
from typing import Any

from fastcrc.crc16 import umts

from gazerig.drivers.dynamixel import control_table
from gazerig.drivers.feetech import memory_table
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.feetech.chain import build_feetech

PING, READ, WRITE, REBOOT, SYNC_READ, SYNC_WRITE = 1, 2, 3, 8, 0x82, 0x83
ALL = 0xFE


def joined(params):
    """Return parameters, bytes or numbers of one byte each, as bytes."""
    return b"".join(p if isinstance(p, bytes) else bytes((p,)) for p in params)


class Bench:
    """A chain of one make of servos and its clock.

    words: bytes of an address or a length in a packet; pong: of the answer to a ping
    registers: the driver's table, by name
    """

    model: str
    words: int
    pong: int
    registers: dict
    build: Callable[..., Any]
    instruction: Callable[..., bytes]
    packets: Callable[[bytes], list]
    living: tuple[int, int]
    """Address and length of all registers that change by themselves."""

    def __init__(self, *specs, **options):
        self.now_s = 0.0
        self.chain = self.build(specs or [(1, self.model, 2048.0)], lambda: self.now_s, **options)

    def span(self, address, length):
        """Return address and length as in a packet."""
        return address.to_bytes(self.words, "little") + length.to_bytes(self.words, "little")

    def span_of(self, name):
        """Return the driver's address of a register, as in a packet."""
        register = self.registers[name]
        return self.span(register.address, register.size)

    def head_of(self, name):
        """Return a register's address as in a packet."""
        return self.span_of(name)[: self.words]

    def ask(self, servo_id, code, *params, baud=None):
        """Send an instruction; gives the statuses."""
        return self.packets(self.chain.receive(self.instruction(servo_id, code, *params), baud))

    def write(self, servo_id, address, value, size=1):
        """Write a register; gives the error byte, -1 for silence."""
        head = address.to_bytes(self.words, "little")
        raw = value.to_bytes(size, "little", signed=value < 0)
        said = self.ask(servo_id, WRITE, head, raw)
        if not said:
            return -1
        [(answered, error, data)] = said
        assert (answered, data) == (servo_id, b"")
        return error

    def read(self, servo_id, address, size=1, sign=None):
        """Read a register; ``sign``: the bit of its sign, for a sign and a magnitude."""
        [(answered, _, data)] = self.ask(servo_id, READ, self.span(address, size))
        assert (answered, len(data)) == (servo_id, size)
        raw = int.from_bytes(data, "little")
        return raw if sign is None or raw < 1 << sign else (1 << sign) - raw

    def put(self, name, value, servo_id=1):
        """Write a register by the name that the driver has for it."""
        register = self.registers[name]
        return self.write(servo_id, register.address, value, register.size)

    def get(self, name, servo_id=1):
        """Read a register by the name that the driver has for it."""
        [(_, _, data)] = self.ask(servo_id, READ, self.span_of(name))
        return self.registers[name].decode(data)

    def everything(self):
        """Return all that a control loop may read, as bytes."""
        return self.ask(1, READ, self.span(*self.living))

    def position(self, servo_id=1):
        return self.get("present_position", servo_id)

    def error(self, servo_id=1):
        """Return the error byte of a ping."""
        [(_, error, _)] = self.ask(servo_id, PING)
        return error

    def wait(self, seconds, steps=1):
        """Let time pass in n reads."""
        begin = self.now_s
        for k in range(1, steps + 1):
            self.now_s = begin + seconds * k / steps
            self.chain.positions_steps()

    def enable_torque(self, servo_id=1, goal=None):
        """Switch the torque on with a goal, the present place where None."""
        self.put("goal_position", self.position(servo_id) if goal is None else goal, servo_id)
        assert self.put("torque_enable", 1, servo_id) == 0


class DynamixelBench(Bench):
    model, words = "xl330-m288", 2
    pong, living = 14, (100, 47)
    registers = control_table.REGISTERS
    build = staticmethod(build_dynamixel)

    @staticmethod
    def instruction(servo_id, code, *params):
        """Build an instruction; nothing in it may need stuffing."""
        given = joined(params)
        head = b"\xff\xff\xfd\x00" + struct.pack("<BHB", servo_id, len(given) + 3, code)
        return head + given + struct.pack("<H", umts(head + given))

    @staticmethod
    def packets(data):
        """Return the statuses as (id, error, parameters); every byte must belong to one."""
        out = []
        while data:
            assert data[:4] + data[7:8] == b"\xff\xff\xfd\x00\x55"
            end = 7 + int.from_bytes(data[5:7], "little")
            assert umts(data[: end - 2]) == int.from_bytes(data[end - 2 : end], "little")
            params = data[9 : end - 2].replace(b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")
            out.append((data[4], data[8], params))
            data = data[end:]
        return out


class FeetechBench(Bench):
    model, words = "sts3215", 1
    pong, living = 6, (40, 40)
    registers = memory_table.REGISTERS
    build = staticmethod(build_feetech)

    @staticmethod
    def instruction(servo_id, code, *params):
        """Build an instruction."""
        given = joined(params)
        body = bytes((servo_id, len(given) + 2, code)) + given
        return b"\xff\xff" + body + bytes((255 - sum(body) % 256,))

    @staticmethod
    def packets(data):
        """Return the statuses as (id, error, parameters); every byte must belong to one."""
        out = []
        while data:
            assert data[:2] == b"\xff\xff"
            end = 4 + data[3]
            assert sum(data[2:end]) % 256 == 255
            out.append((data[2], data[4], data[5 : end - 1]))
            data = data[end:]
        return out


MAKES = (DynamixelBench, FeetechBench)
