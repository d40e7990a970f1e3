"""Packets of the driver: byte-exact instructions, and statuses out of any heap of bytes."""

import struct

from hypothesis import given
from hypothesis import strategies as st

from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.dynamixel.protocol import (
    instruction,
    parse_statuses,
)
from gazerig.drivers.servo_bus.family import GoalWrite
from gazerig.sim_mock.dynamixel.packets import status


def vector(text: str) -> bytes:
    return bytes.fromhex(text.replace(" ", ""))


EVERYDAY = vector("FF FF FD 00 01 0F 00 55 00 FF FF FD FD FF FF FF 00 08 00 00 49 F0")


def test_instructions_are_the_protocols():
    assert instruction(1, 1) == vector("FF FF FD 00 01 03 00 01 19 4E")
    assert instruction(0xFE, 1) == vector("FF FF FD 00 FE 03 00 01 31 42")
    assert instruction(1, 2, struct.pack("<HH", 132, 4)) == vector(
        "FF FF FD 00 01 07 00 02 84 00 04 00 1D 15"
    )
    assert instruction(1, 3, struct.pack("<Hi", 116, 512)) == vector(
        "FF FF FD 00 01 09 00 03 74 00 00 02 00 00 CA 89"
    )
    assert instruction(1, 8) == vector("FF FF FD 00 01 03 00 08 2F 4E")
    assert DYNAMIXEL.request((1, 2), 132, 4) == vector(
        "FF FF FD 00 FE 09 00 82 84 00 04 00 01 02 CE FA"
    )
    assert DYNAMIXEL.request((3, 7, 4), 132, 4, is_fast=True) == vector(
        "FF FF FD 00 FE 0A 00 8A 84 00 04 00 03 07 04 20 F2"
    )
    assert GoalWrite(DYNAMIXEL, (1, 2)).packet((150, 170), (0, 0)) == vector(
        "FF FF FD 00 FE 11 00 83 74 00 04 00 01 96 00 00 00 02 AA 00 00 00 82 87"
    )


def test_what_looks_like_a_header_is_stuffed():
    assert instruction(1, 3, b"\x68\x00\xff\xff\xfd\x00") == vector(
        "FF FF FD 00 01 0A 00 03 68 00 FF FF FD FD 00 E2 7A"
    )


def test_the_everyday_stuffed_status_is_understood():
    (found,) = parse_statuses(EVERYDAY)
    assert (found.id, found.error, found.intact) == (1, 0, True)
    assert struct.unpack("<hii", found.params) == (-1, -3, 2048)


def test_echo_and_noise_are_passed_over():
    request = DYNAMIXEL.request((1,), 126, 10)
    found = parse_statuses(request + b"\xff\xff\xfd" + EVERYDAY + b"\x00")
    assert [(s.id, s.intact) for s in found] == [(1, True)]


def test_a_damaged_length_hides_only_its_own_status():
    bad = bytearray(status(1, 0, bytes(10)))
    bad[5] = 200
    found = parse_statuses(bytes(bad) + status(2, 0, bytes(10)))
    assert [s.id for s in found if s.intact] == [2]


@given(st.lists(st.tuples(st.integers(0, 252), st.integers(0, 255), st.binary(max_size=12))))
def test_every_status_comes_back_as_it_was(rows):
    raw = b"".join(status(i, error, params) for i, error, params in rows)
    assert [(s.id, s.error, s.params, s.intact) for s in parse_statuses(raw)] == [
        (*r, True) for r in rows
    ]
