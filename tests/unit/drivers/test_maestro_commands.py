"""Every command's bytes, the board's units, and what answers mean."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gazerig.drivers.maestro.board import (
    GET_ERRORS,
    GET_POSITION,
    SET_ACCELERATION,
    SET_SPEED,
    SET_TARGET,
    MaestroParams,
    accel_units,
    crc7,
    name_errors,
    speed_units,
)

COMPACT = MaestroParams()


@pytest.mark.parametrize(
    ("packet", "expected"),
    [
        (COMPACT.number(SET_TARGET, 0, 6000), "84 00 70 2E"),
        (COMPACT.targets({3: 0, 4: 6000}), "84 03 00 00 84 04 70 2E"),
        (COMPACT.number(SET_SPEED, 5, 140), "87 05 0C 01"),
        (COMPACT.number(SET_ACCELERATION, 5, 255), "89 05 7F 01"),
        (COMPACT.command(GET_POSITION, 7), "90 07"),
        (COMPACT.command(GET_ERRORS), "A1"),
        (MaestroParams(crc=True).number(SET_TARGET, 0, 6000), "84 00 70 2E 2B"),
    ],
)
def test_commands(packet, expected):
    assert packet == bytes.fromhex(expected)


def test_the_check_byte():
    assert crc7(bytes.fromhex("83 01")) == 0x17


def test_error_names():
    assert name_errors(0) == ()
    assert name_errors(0b1_0011_0000) == (
        "serial protocol error",
        "serial timeout",
        "script program counter error",
    )


@pytest.mark.parametrize("number", [-1, 16384])
def test_what_does_not_fit_is_refused(number):
    with pytest.raises(ValueError, match="data bytes"):
        COMPACT.number(SET_TARGET, 0, number)


@given(
    st.builds(MaestroParams, st.booleans(), st.sampled_from([6, 12, 18, 24])),
    st.dictionaries(st.integers(0, 23), st.integers(0, 16383), min_size=1),
)
def test_only_command_bytes_have_the_highest_bit(codec, goals):
    packet = codec.targets(goals)
    assert packet[0] >= 0x80
    assert {byte for byte in packet if byte >= 0x80} == {0x84}


# --- units


def test_units():
    # The manual's example: 140 is 35 us in 10 ms.
    assert [speed_units(x) for x in (14_000.0, 14_001.0, 0.1, 2e6)] == [140, 141, 1, 0]
    assert [accel_units(x) for x in (None, 5000.0, 5001.0, 4e5)] == [0, 4, 5, 0]
    with pytest.raises(ValueError):
        speed_units(float("nan"))


@given(st.floats(1.0, 1.6e6), st.floats(1.0, 318_000.0))
def test_a_limit_is_never_below_what_is_needed_nor_a_whole_unit_above(speed, accel):
    assert speed - 1e-3 <= speed_units(speed) * 100.0 <= max(100.0, speed + 100.0)
    assert accel - 1e-3 <= accel_units(accel) * 1250.0 <= max(1250.0, accel + 1250.0)
