"""Every command's bytes, and what answers mean."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gazerig.drivers.maestro.commands import (
    MaestroCodec,
    crc7,
    decode_words,
    name_errors,
    seven_bit_bytes,
)

COMPACT = MaestroCodec()

CALLS = (
    (lambda s: s.target(0, 6000), "84 00 70 2E"),
    (lambda s: s.target(2, 0), "84 02 00 00"),
    (lambda s: s.targets({3: 0, 4: 6000}), "9F 02 03 00 00 70 2E"),
    (lambda s: s.speed(5, 140), "87 05 0C 01"),
    (lambda s: s.acceleration(5, 4), "89 05 04 00"),
    (lambda s: s.acceleration(5, 255), "89 05 7F 01"),
    (lambda s: s.position(7), "90 07"),
    (lambda s: s.moving(), "93"),
    (lambda s: s.errors(), "A1"),
    (lambda s: s.go_home(), "A2"),
    (lambda s: s.stop_script(), "A4"),
    (lambda s: s.script_status(), "AE"),
)


@pytest.mark.parametrize(("call", "expected"), CALLS, ids=[text for _, text in CALLS])
def test_commands(call, expected):
    assert call(COMPACT) == bytes.fromhex(expected)


def test_the_check_byte():
    assert crc7(bytes.fromhex("83 01")) == 0x17
    assert crc7(bytes.fromhex("84 00 70 2E")) == 0x2B
    assert MaestroCodec(crc=True).target(0, 6000) == bytes.fromhex("84 00 70 2E 2B")


def test_neighbours_share_a_command_where_the_board_has_it():
    goals = {4: 6000, 1: 4000, 0: 4001, 6: 5000}
    assert COMPACT.targets(goals) == (
        bytes.fromhex("9F 02 00 21 1F 20 1F") + COMPACT.target(4, 6000) + COMPACT.target(6, 5000)
    )
    micro = MaestroCodec(channels=6)
    assert micro.targets({0: 4001, 1: 4000}) == micro.target(0, 4001) + micro.target(1, 4000)


def test_positions_are_two_full_bytes_low_byte_first():
    assert decode_words(bytes.fromhex("70 17 FF 1F 00 00")) == (6000, 8191, 0)


def test_error_names():
    assert name_errors(0) == ()
    assert name_errors(0x10) == ("serial protocol error",)
    assert name_errors(0b1_0110_0001) == (
        "serial signal error",
        "serial timeout",
        "script stack error",
        "script program counter error",
    )
    assert name_errors(0x0200) == ("unknown error",)


@pytest.mark.parametrize("number", [-1, 16384])
def test_what_does_not_fit_is_refused(number):
    with pytest.raises(ValueError, match="does not fit"):
        seven_bit_bytes(number)
    with pytest.raises(ValueError, match="data bytes"):
        COMPACT.command(0x90, 128)


@given(
    st.builds(
        MaestroCodec,
        st.booleans(),
        st.sampled_from([6, 12, 18, 24]),
    ),
    st.dictionaries(st.integers(0, 23), st.integers(0, 16383), min_size=1),
)
def test_only_command_bytes_have_the_highest_bit(speech, goals):
    packet = speech.targets(goals)
    heads = {0x84, 0x9F}
    assert packet[0] in heads
    assert {byte for byte in packet if byte >= 0x80} <= heads
