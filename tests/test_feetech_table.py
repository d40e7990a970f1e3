"""The STS control table: its shape, and numbers with signs."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gazerig.drivers.feetech.memory_table import (
    REGISTERS,
    TABLE_END,
    acceleration_units,
    from_sign_magnitude,
    name_errors,
    speed_units,
    to_sign_magnitude,
)


def test_registers_do_not_overlap_and_end_where_the_table_does():
    at = 0
    for register in REGISTERS.values():
        assert register.address >= at
        at = register.address + register.size
    assert at == TABLE_END


def test_signs_by_hand():
    assert to_sign_magnitude(-5, 15) == 0x8005
    assert to_sign_magnitude(5, 15) == 5
    assert from_sign_magnitude(0x8005, 15) == -5
    assert from_sign_magnitude(0x400 | 300, 10) == -300
    assert from_sign_magnitude(0x8000, 15) == 0
    assert REGISTERS["position_offset"].encode(-1) == bytes((1, 8))


@given(st.sampled_from([r for r in REGISTERS.values() if r.sign is not None]), st.data())
def test_signed_registers_there_and_back(register, data):
    most = (1 << register.sign) - 1
    value = data.draw(st.integers(-most, most))
    assert register.decode(register.encode(value)) == value
    for beyond in (most + 1, -most - 1):
        with pytest.raises(ValueError, match="does not fit"):
            register.encode(beyond)


def test_what_does_not_fit_is_refused():
    for value in (-1, 256):
        with pytest.raises(ValueError, match="acceleration: .* does not fit into 1 byte"):
            REGISTERS["acceleration"].encode(value)


def test_names_of_errors():
    assert name_errors(0x21) == ("input voltage", "overload")
    assert name_errors(0x40) == ("error bit 0x40",)
    assert name_errors(0) == ()


def test_a_limit_is_never_written_as_none():
    assert [speed_units(v) for v in (0.0, 0.4, 3000.9, 1e9)] == [1, 1, 3000, 32767]
    assert [acceleration_units(a) for a in (None, 0.0, 250.0, 25_400.0, 25_401.0)] == [
        0,
        1,
        2,
        254,
        0,
    ]
