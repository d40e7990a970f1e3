"""The control table of every emulated model as bytes: access, ranges, indirect windows."""

import pytest

from gazerig.drivers.dynamixel.control_table import MODELS, indirect_blocks, registers_of
from gazerig.sim_mock.dynamixel.memory import ACCESS, DATA_LENGTH, DATA_RANGE, DynamixelMemory
from gazerig.sim_mock.dynamixel.servo import DynamixelServo
from gazerig.sim_mock.smart_servo.physics import ServoSpec

EVERY = pytest.mark.parametrize("model", MODELS.values(), ids=lambda m: m.name)


def raw(value: int, size: int) -> bytes:
    return value.to_bytes(size, "little", signed=value < 0)


@EVERY
def test_every_register_starts_with_its_initial_value(model):
    memory = DynamixelMemory(model, 53)
    for register in registers_of(model):
        if register.initial is not None:
            assert memory.get(register.name) == register.initial, register.name


@EVERY
def test_every_register_keeps_to_its_access_range_and_size(model):
    memory = DynamixelMemory(model, 53)
    for register in registers_of(model):
        at, size = register.address, register.size
        if register.access == "r":
            assert memory.fields(at, bytes(size)) == ACCESS, register.name
            continue
        if register.high is not None and register.high + 1 < 1 << 8 * size - register.signed:
            assert memory.fields(at, raw(register.high, size)) == ((register, register.high),)
            assert memory.fields(at, raw(register.high + 1, size)) == DATA_RANGE, register.name
        if register.low:
            assert memory.fields(at, raw(register.low - 1, size)) == DATA_RANGE, register.name
        if size > 1:
            assert memory.fields(at, bytes(size - 1)) == DATA_LENGTH, register.name


@EVERY
def test_what_no_register_covers_can_neither_be_read_nor_written(model):
    memory = DynamixelMemory(model, 53)
    known = {a for r in registers_of(model) for a in range(r.address, r.address + r.size)}
    for address in set(range(148)) - known:
        assert memory.read(address, 1) is None
        assert memory.fields(address, b"\0") == ACCESS
    last = 661 if model.family == "x430" else 251
    assert memory.read(last, 1) == b"\0"
    assert memory.read(last, 2) is None


@EVERY
@pytest.mark.parametrize("firmware", [45, 52, 53])
def test_every_window_shows_and_takes_other_bytes(model, firmware):
    servo = DynamixelServo(ServoSpec(1, model.name, 1234, firmware), 0)
    for block in indirect_blocks(model, firmware):
        first, data = block.address_base, block.data_base
        for i in range(4):
            assert servo.write(first + 2 * i, raw(132 + i, 2)) == 0
        assert servo.write(first + 8, raw(65, 2)) == 0
        assert servo.read(data, 4) == raw(1234, 4)
        assert (servo.write(data + 4, b"\1"), servo.read(65, 1)) == (0, b"\1")
        assert servo.write(65, b"\0") == 0
        assert servo.write(data, b"\0") == ACCESS
        for outside in (0, 63, block.target_high + 1):
            assert servo.write(first, raw(outside, 2)) == DATA_RANGE
    # Where another firmware has its data there is nothing.
    if model.family == "x330":
        assert (servo.read(228, 1) is None) == (firmware < 53)
        assert servo.write(213, b"\1") == (0 if firmware < 53 else ACCESS)


@EVERY
def test_the_eeprom_is_locked_under_torque_and_nothing_changes(model):
    servo = DynamixelServo(ServoSpec(1, model.name), 0)
    assert servo.write(64, b"\1") == 0
    before = bytes(servo.memory.bytes[:64])
    for register in registers_of(model):
        if register.address < 64 and register.access == "rw":
            value = register.low or 0
            assert servo.write(register.address, raw(value, register.size)) == ACCESS
    assert bytes(servo.memory.bytes[:64]) == before
