"""Who listens on the emulated Dynamixel chain, and what it does where documents differ."""

import struct

import pytest
from dynamixel_vectors import PING, instruction, vector
from hypothesis import given, settings
from hypothesis import strategies as st
from servo_bench import DynamixelBench

from gazerig.sim_mock.dynamixel.packets import status
from gazerig.sim_mock.smart_servo.physics import Quirks, ServoSpec

# --- who listens


def test_a_secondary_id_obeys_and_never_answers():
    bench = DynamixelBench((1, "xl330-m288"), (2, "xl330-m288"))
    assert bench.write(2, 12, 1, 1) == 0
    assert bench.write(1, 65, 1, 1) == 0
    assert (bench.read(1, 65, 1), bench.read(2, 65, 1)) == (1, 1)
    sync = struct.pack("<HHBB", 65, 1, 1, 0)
    assert bench.chain.receive(instruction(0xFE, 0x83, sync)) == b""
    assert bench.read(2, 65, 1) == 0
    assert len(bench.chain.receive(PING)) == 14
    # EEPROM is not to be had by the secondary id.
    assert bench.write(1, 31, 60, 1) == 0
    assert (bench.read(1, 31, 1), bench.read(2, 31, 1)) == (60, 70)


def test_a_secondary_id_that_nobody_has_is_obeyed_in_silence():
    bench = DynamixelBench((2, "xl330-m288"))
    bench.write(2, 12, 77, 1)
    assert bench.write(77, 65, 1, 1) == -1
    assert bench.read(2, 65, 1) == 1
    bench.write(2, 12, 253, 1)
    assert bench.write(77, 65, 0, 1) == -1
    assert bench.read(2, 65, 1) == 1


def test_a_baud_rate_that_a_model_lacks_is_refused():
    with pytest.raises(ValueError, match="baud 4500000: xl330-m288 knows 9600, 57600"):
        DynamixelBench((1, "xl330-m288"), baud=4_500_000)


def test_a_broadcast_reset_of_everything_is_ignored_by_newer_firmware():
    bench = DynamixelBench((5, "xm430-w210", 2048, 41), (6, "xm430-w210", 2048, 42))
    bench.chain.receive(instruction(0xFE, 6, b"\xff"))
    assert bench.chain.ids() == (1, 6)


# --- where documents and devices differ


def test_a_wrong_crc_may_be_answered():
    bench = DynamixelBench((1, "xm430-w210"))
    bad = PING[:-1] + bytes([PING[-1] ^ 1])
    assert bench.chain.receive(bad) == b""
    bench.chain.choose("bad-crc", "reply")
    assert bench.chain.receive(bad) == status(1, 3, b"")
    assert len(bench.chain.receive(PING)) == 14


def test_a_packet_that_should_have_been_stuffed_may_be_dropped():
    raw = instruction(1, 3, struct.pack("<H", 224) + b"\xff\xff\xfd\x00")
    stuffed = instruction(1, 3, struct.pack("<H", 224) + b"\xff\xff\xfd\xfd\x00")
    bench = DynamixelBench((1, "xm430-w210"))
    assert bench.chain.receive(raw)[8] == 0
    bench.chain.choose("stuffing", "strict")
    assert bench.chain.receive(raw) == b""
    assert bench.chain.receive(stuffed)[8] == 0


def test_replies_know_their_servos_return_delay():
    bench = DynamixelBench((1, "xl330-m288"), (2, "xl330-m288"))
    bench.write(2, 9, 5, 1)
    wanted = struct.pack("<HH", 132, 4) + bytes((1, 2))
    (plain,) = bench.chain.exchange(instruction(0xFE, 0x82, wanted))
    (fast,) = bench.chain.exchange(instruction(0xFE, 0x8A, wanted))
    assert [piece.delay_s for piece in plain.pieces] == pytest.approx([500e-6, 10e-6])
    assert [piece.delay_s for piece in fast.pieces] == pytest.approx([500e-6])


@given(
    st.lists(st.sampled_from([1, 2, 3, 4, 9]), max_size=6),
    st.sampled_from([(132, 4), (126, 10), (64, 1), (40, 4), (64, 4)]),
    st.sampled_from([0, 1, 2]),
)
@settings(max_examples=40)
def test_both_ways_to_a_fast_reply_give_the_same_bytes(ids, span, level):
    specs = [(i, "xl330-m288", 100 * i) for i in (1, 2, 3)] + [(4, "xl330-m288", 400, 45)]
    answers = []
    for spoilt in (False, True):
        bench = DynamixelBench(*specs)
        bench.write(2, 68, level, 1)
        bench.chain[3].fail("overheating")
        if spoilt:
            bench.chain.faults.command("lose 3 for 0")
            bench.chain.faults.command("delay 1 5")
        wanted = struct.pack("<HH", *span) + bytes(ids)
        answers.append(bench.chain.receive(instruction(0xFE, 0x8A, wanted)))
    assert answers[0] == answers[1]


def test_backup_and_restore_of_the_control_table():
    bench = DynamixelBench((1, "xl330-m288"))
    store = vector("FF FF FD 00 01 08 00 20 01 43 54 52 4C 16 F5")
    restore = vector("FF FF FD 00 01 08 00 20 02 43 54 52 4C 9E F5")
    assert bench.chain.receive(restore)[8] == 1
    bench.write(1, 31, 55, 1)
    assert bench.chain.receive(store) == status(1, 0, b"")
    assert bench.read(1, 147, 1) == 1
    bench.write(1, 31, 66, 1)
    assert bench.chain.receive(restore) == status(1, 0, b"")
    bench.now_s = 0.5
    assert bench.read(1, 31, 1) == 55
    bench.enable_torque(1)
    assert bench.chain.receive(store)[8] == 1
    assert bench.chain.receive(instruction(1, 0x20, b"\x03CTRL"))[8] == 4
    assert bench.chain.receive(instruction(1, 0x20))[8] == 4


def test_a_restored_servo_answers_once_under_the_id_it_had():
    bench = DynamixelBench((5, "xl330-m288"))
    bench.chain.receive(instruction(5, 0x20, b"\x01CTRL"))
    bench.write(5, 7, 9, 1)
    assert bench.chain.receive(instruction(9, 0x20, b"\x02CTRL"))[4] == 9
    bench.now_s = 0.5
    (servo_id,) = bench.chain.ids()
    assert bench.read(servo_id, 7, 1) == servo_id


def test_some_models_reboot_without_a_status():
    spec = ServoSpec(1, "xl430-w250", quirks=Quirks(mute_reboot=True))
    bench = DynamixelBench(spec)
    assert bench.chain.receive(instruction(1, 8)) == b""
    assert bench.chain.receive(PING) == b""
    bench.now_s = 0.5
    assert len(bench.chain.receive(PING)) == 14
