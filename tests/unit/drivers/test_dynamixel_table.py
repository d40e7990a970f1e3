"""The control table agrees with the vendor's own files and with itself."""

import math
import re
from pathlib import Path

import pytest
from dynamixel_easy_sdk.control_table import CONTROL_TABLE_PATH, ControlTable

from gazerig.drivers.dynamixel.control_table import (
    MODELS,
    STEPS_PER_TURN,
    VELOCITY_UNIT_STEPS_S,
)
from gazerig.sim_mock.dynamixel.servo import registers_of

RENAMED = {"secondary_shadow_id": "secondary_id", "present_load": "present_current"}

NOT_THE_VENDORS = {"startup_configuration"}
"""Register of the manual, from firmware 45 (X430) or 46 (X330) on, that no vendor file lists."""

UNITS_IN_TORQUE = {"xc330-t181", "xc330-t288"}
"""Models whose vendor files give the current as torque; the others as the register has it."""


def vendor_units(number: int) -> dict[str, tuple[float, str]]:
    """Read the unit section of the vendor's file."""
    lines = Path(CONTROL_TABLE_PATH / ControlTable.getModelName(number)).read_text().splitlines()
    start = lines.index("[unit info]") + 2
    rows = (line.split("\t") for line in lines[start : lines.index("[control table]")] if line)
    return {row[0]: (float(row[1]), row[2]) for row in rows}


def vendor_table(number: int) -> dict[str, tuple[int, int]]:
    """Read the vendor's table with our spelling of the names."""
    table = {}
    for name, item in ControlTable.getControlTable(number).items():
        key = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")
        table[RENAMED.get(key, key)] = (item.address, item.size)
    return table


@pytest.mark.parametrize("model", MODELS.values(), ids=lambda m: m.name)
def test_numbers_addresses_and_sizes_are_the_vendors(model):
    vendor = vendor_table(model.number)
    ours = {r.name: (r.address, r.size) for r in registers_of(model)}
    both = ours.keys() & vendor.keys()
    assert {name: ours[name] for name in both} == {name: vendor[name] for name in both}
    assert ours.keys() - vendor.keys() == NOT_THE_VENDORS
    stem = ControlTable.getModelName(model.number).removesuffix(".model")
    assert stem.replace("_", "-") == model.name


@pytest.mark.parametrize("model", MODELS.values(), ids=lambda m: m.name)
def test_units_and_turns_are_the_vendors(model):
    units = vendor_units(model.number)
    rad_s = VELOCITY_UNIT_STEPS_S / STEPS_PER_TURN * 2.0 * math.pi
    # The vendor's file rounds 0.229 rev/min to 0.02396912 rad/s, 0.05 % less.
    assert units["Present Velocity"] == (pytest.approx(rad_s, rel=6e-4), "rad/s")
    assert units["Goal Velocity"] == units["Present Velocity"]
    if model.current_limit is None:
        assert "Present Current" not in units
    elif model.name in UNITS_IN_TORQUE:
        # Nm for a unit, called N/m there: stall torque over stall current, to a third.
        nm = model.stall_torque_nm / model.stall_current_a * model.current_unit_ma / 1000.0
        assert units["Present Current"] == (pytest.approx(nm, rel=0.35), "N/m")
    else:
        assert units["Present Current"] == (1.0, "raw")
