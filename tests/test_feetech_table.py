"""The STS control table: its shape, and numbers with signs."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gazerig.drivers.feetech.memory_table import (
    BAUD_RATES,
    MODELS,
    REGISTERS,
    TABLE_END,
    acceleration_units,
    from_sign_magnitude,
    name_errors,
    registers_of,
    speed_units,
    to_sign_magnitude,
)


def test_registers_do_not_overlap_and_end_where_the_table_does():
    at = 0
    for register in REGISTERS.values():
        assert register.address >= at
        at = register.address + register.size
    assert at == TABLE_END


def test_addresses_as_in_the_makers_table():
    addresses = {
        "model_number": 3, "id": 5, "baud_rate": 6, "min_position_limit": 9, "phase": 18,
        "position_p_gain": 21, "position_d_gain": 22, "position_i_gain": 23,
        "position_offset": 31, "operating_mode": 33, "torque_enable": 40, "acceleration": 41,
        "goal_position": 42, "goal_speed": 46, "torque_limit": 48, "lock": 55,
        "present_position": 56, "present_load": 60, "status": 65, "present_current": 69,
    }  # fmt: skip
    assert {name: REGISTERS[name].address for name in addresses} == addresses
    assert BAUD_RATES.index(1_000_000) == 0 and BAUD_RATES.index(115_200) == 4


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_factory_values_are_in_range(model):
    registers = {r.name: r for r in registers_of(model)}
    assert registers["model_number"].initial == 777
    assert registers["max_voltage_limit"].initial == model.max_voltage
    for r in registers.values():
        if r.initial is not None and r.low is not None and r.high is not None:
            assert r.low <= r.initial <= r.high, r.name


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


@given(st.sampled_from([10, 11, 15]), st.integers(0, 0xFFFF))
def test_any_bits_are_some_number(bit, raw):
    assert abs(from_sign_magnitude(raw, bit)) < 1 << bit


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
