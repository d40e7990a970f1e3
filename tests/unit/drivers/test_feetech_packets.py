"""Packets and table of the STS servos: vectors from the rule, and spoilt answers."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gazerig.drivers.dynamixel import control_table
from gazerig.drivers.feetech.family import FEETECH
from gazerig.drivers.feetech.memory_table import (
    REGISTERS,
    acceleration_units,
)
from gazerig.drivers.feetech.protocol import answer_frame, checksum, instruction, parse_statuses
from gazerig.drivers.servo_bus.family import PING, GoalWrite, Status

VECTORS = [
    (instruction(1, PING), "FF FF 01 02 01 FB"),
    (FEETECH.read(1, 56, 2), "FF FF 01 04 02 38 02 BE"),
    (FEETECH.write(1, "goal_position", 2048), "FF FF 01 05 03 2A 00 08 C4"),
    (FEETECH.request((1, 2, 3), 56, 15), "FF FF FE 07 82 38 0F 01 02 03 2B"),
    (FEETECH.sync_write((1, 2), "torque_enable", (1, 1)), "FF FF FE 08 83 28 01 01 01 02 01 48"),
    (GoalWrite(FEETECH, (1, 2)).packet((2048, 1000), (3000, 500)),
     "FF FF FE 12 83 2A 06 01 00 08 00 00 B8 0B 02 E8 03 00 00 F4 01 8E"),
]  # fmt: skip


@pytest.mark.parametrize(("packet", "expected"), VECTORS, ids=[v[1] for v in VECTORS])
def test_vectors(packet, expected):
    assert packet == bytes.fromhex(expected)


def status(servo_id, params, error=0):
    body = bytes((servo_id, len(params) + 2, error)) + params
    return b"\xff\xff" + body + bytes((checksum(body),))


ids, params = st.integers(0, 253), st.binary(max_size=40)


@given(st.lists(st.tuples(ids, params, st.integers(0, 255)), max_size=5), st.binary(max_size=3))
def test_statuses_come_out_as_they_went_in(sent, noise):
    noise = noise.replace(b"\xff", b"\x00")
    raw = noise + b"".join(status(i, p, e) for i, p, e in sent)
    found = [s for s in parse_statuses(raw) if s.intact]
    wanted = [Status(i, e, p, True) for i, p, e in sent]
    # Data may look like a status inside or across others by chance: such are not believed.
    assert all(s in wanted for s in found)
    plain = not any(b"\xff" in p for _, p, _ in sent)
    if plain and all(checksum(status(i, p, e)[2:-1]) != 0xFF and e != 0xFF for i, p, e in sent):
        assert found == wanted


@given(st.integers(0, 20), st.binary(min_size=15, max_size=15), st.binary(min_size=15, max_size=15))
def test_a_lost_byte_is_never_made_up_by_the_next_header(at, first, second):
    """The next header's FF as checksum would be right once in 256 times."""
    whole = status(1, first)
    raw = whole[:at] + whole[at + 1 :] + status(2, second)
    believed = [s for s in parse_statuses(raw) if s.intact and s.id == 1 and len(s.params) == 15]
    assert all(s.params == first for s in believed)


def test_a_lost_byte_whose_sum_fits_the_next_header():
    # 01 11 00, fifteen bytes with a sum of ..EE: the checksum is FF without the lost byte.
    data = bytes((0xEE, *[0] * 13))
    raw = b"\xff\xff\x01\x11\x00" + data + b"\x00" + status(2, bytes(15))
    assert checksum(raw[2:20]) == raw[20] == 0xFF
    assert [s.intact for s in parse_statuses(raw)] == [False, False]


@given(st.binary(max_size=200))
def test_noise_never_raises(raw):
    parse_statuses(raw)


@given(st.lists(st.binary(min_size=4, max_size=253), min_size=1, max_size=9))
def test_checksums_of_many_are_right_where_each_is(bodies):
    is_intact = answer_frame((1,), 10, False).is_intact
    right = tuple(body + bytes([checksum(body)]) for body in bodies)
    assert is_intact(right, ())
    for k, part in enumerate(right):
        damaged = part[:-1] + bytes([part[-1] ^ 0x10])
        assert not is_intact((*right[:k], damaged, *right[k + 1 :]), ())


@pytest.mark.parametrize("stray", [b"\xff", b"\xff\xff", b"\x00\xff"])
def test_a_stray_ff_before_an_answer_makes_it_no_other_servos(stray):
    """FF FF FF 01 ...: the header is the last two of them, and 255 is no servo."""
    (found,) = parse_statuses(stray + b"\xff\xff\x01\x02\x00\xfc")
    assert found.id == 1 and found.intact


# --- the table


@given(st.sampled_from([r for r in REGISTERS.values() if r.sign is not None]), st.data())
def test_signed_registers_there_and_back(register, data):
    most = (1 << register.sign) - 1
    value = data.draw(st.integers(-most, most))
    assert register.decode(register.encode(value)) == value
    for beyond in (most + 1, -most - 1):
        with pytest.raises(ValueError, match="does not fit"):
            register.encode(beyond)


def test_values_of_registers_by_hand():
    assert REGISTERS["position_offset"].encode(-1) == bytes((1, 8))
    assert REGISTERS["present_load"].decode(bytes((0x2C, 0x05))) == -300
    pwm = control_table.REGISTERS["goal_pwm"]
    assert [pwm.decode(pwm.encode(value)) for value in (-32768, 32767)] == [-32768, 32767]
    for value in (-32769, 32768):
        with pytest.raises(ValueError, match="does not fit"):
            pwm.encode(value)
    for value in (-1, 256):
        with pytest.raises(ValueError, match=r"acceleration: .* does not fit into 1 byte"):
            REGISTERS["acceleration"].encode(value)


def test_names_of_errors_and_limits_that_are_never_none():
    assert FEETECH.name_errors(0x21) == ("input voltage", "overload")
    assert FEETECH.name_errors(0x40) == ("error bit 0x40",)
    assert [FEETECH.speed_units(v) for v in (0.0, 0.4, 3000.9, 1e9)] == [1, 1, 3000, 32767]
    accelerations = (None, 0.0, 250.0, 25_400.0, 25_401.0)
    assert [acceleration_units(a) for a in accelerations] == [0, 1, 2, 254, 0]
