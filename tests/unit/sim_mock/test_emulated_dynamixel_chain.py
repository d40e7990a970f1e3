"""The emulated chain against byte-exact packets and the written rules of the protocol."""

from typing import Any

import pytest
from servo_bench import DynamixelBench

from gazerig.drivers.dynamixel.control_table import MODELS
from gazerig.sim_mock.dynamixel.packets import status
from gazerig.sim_mock.dynamixel.servo import (
    ACCESS,
    DATA_LENGTH,
    DATA_RANGE,
    DynamixelMemory,
    registers_of,
)


def vector(text: str) -> bytes:
    return bytes.fromhex(text.replace(" ", ""))


PING = vector("FF FF FD 00 01 03 00 01 19 4E")


ONE = [(1, "xm430-w210", 166, 38)]
TWO = [(2, "xm430-w210", 2079, 38), *ONE]
THREE = [(3, "xm430-w210", 166), (7, "xm430-w210", 2079), (4, "xm430-w210", 1023)]
DONE = "FF FF FD 00 01 04 00 55 00 A1 0C"

MANUALS: dict[str, tuple[Any, ...]] = {
    "ping": (ONE, PING.hex(), "FF FF FD 00 01 07 00 55 00 06 04 26 65 5D"),
    "ping to all": (
        TWO,
        "FF FF FD 00 FE 03 00 01 31 42",
        "FF FF FD 00 01 07 00 55 00 06 04 26 65 5D FF FF FD 00 02 07 00 55 00 06 04 26 6F 6D",
    ),
    "read": (
        ONE,
        "FF FF FD 00 01 07 00 02 84 00 04 00 1D 15",
        "FF FF FD 00 01 08 00 55 00 A6 00 00 00 8C C0",
    ),
    "write": (ONE, "FF FF FD 00 01 09 00 03 74 00 00 02 00 00 CA 89", DONE),
    "reboot": (ONE, "FF FF FD 00 01 03 00 08 2F 4E", DONE),
    "sync read": (
        TWO,
        "FF FF FD 00 FE 09 00 82 84 00 04 00 01 02 CE FA",
        "FF FF FD 00 01 08 00 55 00 A6 00 00 00 8C C0"
        "FF FF FD 00 02 08 00 55 00 1F 08 00 00 BA BE",
    ),
    "sync write": (
        TWO, "FF FF FD 00 FE 11 00 83 74 00 04 00 01 96 00 00 00 02 AA 00 00 00 82 87", ""
    ),
    "fast sync read": (
        THREE,
        "FF FF FD 00 FE 0A 00 8A 84 00 04 00 03 07 04 20 F2",
        "FF FF FD 00 FE 19 00 55 00 03 A6 00 00 00 84 08 00 07 1F 08 00 00 16 CA"
        "00 04 FF 03 00 00 D1 9E",
    ),
    "bulk read": (
        TWO,
        "FF FF FD 00 FE 0D 00 92 01 90 00 02 00 02 92 00 01 00 1A 05",
        (status(1, 0, b"\x78\x00") + status(2, 0, b"\x1e")).hex(),
    ),
    "bulk write": (
        TWO, "FF FF FD 00 FE 10 00 93 01 20 00 02 00 A0 00 02 1F 00 01 00 50 B7 68", ""
    ),
}  # fmt: skip
"""Examples of the manual: servos, what is sent, what is answered."""

WRITTEN = {
    "write": [(1, 116, 4, 512)],
    "sync write": [(1, 116, 4, 150), (2, 116, 4, 170)],
    "bulk write": [(1, 32, 2, 160), (2, 31, 1, 80)],
}
"""Id, address, size and value of what these have written."""


@pytest.mark.parametrize("name", MANUALS)
def test_examples_of_the_manual_to_the_byte(name):
    servos, sent, answered = MANUALS[name]
    bench = DynamixelBench(*servos)
    for servo_id, address, size, value in WRITTEN.get(name, ()):
        bench.write(servo_id, address, value - 1, size)  # the manual's are as delivered
    assert bench.chain.receive(vector(sent)).hex(" ") == vector(answered).hex(" ")
    for servo_id, address, size, value in WRITTEN.get(name, ()):
        assert bench.read(servo_id, address, size) == value


def test_stuffed_write_is_unstuffed():
    bench = DynamixelBench((1, "xm430-w210"))
    bench.write(1, 11, 1, 1)
    packet = vector("FF FF FD 00 01 0A 00 03 68 00 FF FF FD FD 00 E2 7A")
    # The value 0x00FDFFFF is out of range for Goal Velocity, and is refused as such.
    assert bench.chain.receive(packet)[8] == 6


# --- bus watchdog


def test_any_packet_feeds_the_watchdog():
    bench = DynamixelBench((1, "xl330-m288", 1000), (2, "xl330-m288"))
    bench.enable_torque(1)
    bench.write(1, 98, 1, 1)
    for _ in range(20):
        bench.now_s += 0.019
        bench.read(2, 65, 1)
    assert bench.read(1, 98, 1) == 1
    bench.now_s += 0.021
    assert bench.read(1, 98, 1) == 255


# The control table of every emulated model as bytes: access and ranges


EVERY = pytest.mark.parametrize("model", MODELS.values(), ids=lambda m: m.name)


def raw(value: int, size: int) -> bytes:
    return value.to_bytes(size, "little", signed=value < 0)


@EVERY
def test_every_register_keeps_to_its_access_range_and_size(model):
    memory = DynamixelMemory(model)
    for register in registers_of(model):
        at, size = register.address, register.size
        if register.access == "r":
            assert memory.fields(at, bytes(size)) == ACCESS, register.name
            continue
        if register.high is not None and register.high + 1 < 1 << 8 * size - register.signed:
            assert memory.fields(at, raw(register.high, size)) == [(register, register.high)]
            assert memory.fields(at, raw(register.high + 1, size)) == DATA_RANGE, register.name
        if register.low:
            assert memory.fields(at, raw(register.low - 1, size)) == DATA_RANGE, register.name
        if size > 1:
            assert memory.fields(at, bytes(size - 1)) == DATA_LENGTH, register.name
