"""The control table agrees with the vendor's own files and with itself."""

import re

import pytest
from dynamixel_easy_sdk.control_table import ControlTable

from drivers.dynamixel_table import (
    MODELS,
    REGISTERS,
    indirect_blocks,
    name_errors,
    registers_of,
)

RENAMED = {"secondary_shadow_id": "secondary_id", "present_load": "present_current"}


def vendor_table(number: int) -> dict[str, tuple[int, int]]:
    """Read the vendor's table with our spelling of the names."""
    table = {}
    for name, item in ControlTable.getControlTable(number).items():
        key = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")
        table[RENAMED.get(key, key)] = (item.address, item.size)
    return table


@pytest.mark.parametrize("model", MODELS.values(), ids=lambda m: m.name)
def test_addresses_and_sizes_are_the_vendors(model):
    vendor = vendor_table(model.number)
    ours = {r.name: (r.address, r.size) for r in registers_of(model)}
    both = ours.keys() & vendor.keys()
    assert {name: ours[name] for name in both} == {name: vendor[name] for name in both}
    assert len(both) > 40


@pytest.mark.parametrize("model", MODELS.values(), ids=lambda m: m.name)
def test_nothing_of_the_vendors_table_is_left_out(model):
    known = {r.name for r in registers_of(model)}
    left = {
        name
        for name in vendor_table(model.number)
        if not name.startswith(("indirect_", "external_port"))
    }
    assert left - known == set()


@pytest.mark.parametrize("model", MODELS.values(), ids=lambda m: m.name)
def test_model_numbers_are_the_vendors(model):
    stem = ControlTable.getModelName(model.number).removesuffix(".model")
    assert stem.replace("_", "-") == model.name


@pytest.mark.parametrize("model", MODELS.values(), ids=lambda m: m.name)
def test_registers_do_not_overlap_and_start_within_their_range(model):
    end = 0
    for register in registers_of(model):
        assert register.address >= end, register.name
        end = register.address + register.size
        if register.access == "rw" and register.initial is not None:
            low = register.initial if register.low is None else register.low
            high = register.initial if register.high is None else register.high
            assert low <= register.initial <= high, register.name


def test_indirect_data_moved_with_the_firmware():
    small, large = MODELS["xl330-m288"], MODELS["xm430-w350"]
    assert vendor_table(small.number)["indirect_data_1"] == (224, 1)
    assert [block.data_base for block in indirect_blocks(small, 53)] == [224]
    assert [block.data_base for block in indirect_blocks(small, 52)] == [208]
    assert [block.data_base for block in indirect_blocks(large, 48)] == [224, 634]


def test_the_eeprom_ends_where_the_torque_switch_begins():
    assert REGISTERS["shutdown"].area == "eeprom"
    assert REGISTERS["torque_enable"].area == "ram"


def test_a_model_without_current_sensor_has_no_current_registers():
    names = {r.name for r in registers_of(MODELS["xl430-w250"])}
    assert not names & {"current_limit", "goal_current", "pwm_slope"}
    assert MODELS["xl430-w250"].current_unit_ma == 0.0


def test_error_bits_are_named_even_where_unknown():
    assert name_errors(0x21) == ("input voltage", "overload")
    assert name_errors(0x02) == ("error bit 1",)
    assert name_errors(0) == ()
