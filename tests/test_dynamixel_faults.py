"""The servo driver under faults of bytes, servos or the whole line."""

from typing import Any

import pytest
from fakes.dynamixels import IDS, Rig

from gazerig.drivers.errors import BusLost, ServoFault, ServoMissing

GROUP_READS = (0x82, 0x8A)


@pytest.fixture(params=[True, False], ids=["fast", "plain"])
def rig(request):
    return Rig(request.param).open()


def flipped(raw, at):
    return raw[:at] + bytes([raw[at] ^ 0x10]) + raw[at + 1 :]


def once(spoilt):
    """Spoil one answer of many bytes, then no more."""
    left = [1]
    return lambda code, raw: spoilt(raw) if len(raw) > 30 and left and left.pop() else raw


def data_of(raw, servo_id, fast):
    """Return the offset of the first byte of a servo's data in an answer of three."""
    size, head = ((len(raw) - 8) // 3, 8 + 2) if fast else (len(raw) // 3, 9)
    return head + size * IDS.index(servo_id)


# --- bytes


@pytest.mark.parametrize("victim", IDS)
def test_a_damaged_answer_costs_only_its_servo_and_only_once(rig, victim):
    fast = rig.bus._plan.create_group_read is not None
    rig.port.spoil = once(lambda raw: flipped(raw, data_of(raw, victim, fast)))
    expected = [None if i == victim else 2000 + i for i in IDS]
    assert rig.places() == expected
    rig.port.spoil = None
    assert rig.places() == [2001, 2002, 2003]
    assert rig.errors() == {"corrupt": 1}


def test_a_servo_that_only_garbles_leaves_the_group_until_it_is_well(rig):
    fast = rig.bus._plan.create_group_read is not None

    def garble(code, raw):
        asked = rig.sent[-1][12:-2]
        if 2 not in asked:
            return raw
        return flipped(raw, len(raw) - 3 if len(asked) == 1 else data_of(raw, 2, fast))

    rig.port.spoil = garble
    for _ in range(3):
        assert rig.places() == [2001, None, 2003]
    # Now out of the group: queried alone immediately, then the others have the whole line.
    rig.sent.clear()
    for _ in range(2):
        assert rig.places() == [2001, None, 2003]
    assert [packet[12:-2] for packet in rig.sent] == [b"\x01\x03", b"\x02", b"\x01\x03"]
    rig.port.spoil = None
    rig.now_s += 0.1
    assert rig.places() == [2001, 2002, 2003]


@pytest.mark.parametrize("fast", [True, False])
@pytest.mark.parametrize("more", [b"\xff\xff\xfd\x00\xfe", None])
def test_bytes_behind_a_whole_answer_do_not_spoil_the_next_one(fast, more):
    rig = Rig(fast).open()
    rig.bus.enable_torque()
    for _ in range(5):
        rig.tick([2000] * 3)
    asked = []

    def spoil(code, raw):
        if code in GROUP_READS:
            asked.append(code)
        # Noise, or the whole answer once more, after every other answer.
        return raw + (raw if more is None else more) if len(asked) % 2 else raw

    rig.port.spoil = spoil
    for k in range(60):
        truth = [round(at) for at in rig.chain.positions_steps()]
        readings = rig.tick([2000 + 5 * k] * 3, dt_s=0.0)
        assert [r.position_steps for r in readings] == truth
        rig.now_s += 0.005
    assert "timeout" not in rig.errors()


def test_a_late_answer_is_never_taken_for_a_fresh_one(rig):
    """All answers come two exchanges late while the joints move."""
    rig.bus.enable_torque()
    held: list[bytes] = []

    def late(code, raw):
        if code not in GROUP_READS:
            return raw
        held.append(raw)
        return held.pop(0) if len(held) > 2 else b""

    rig.port.spoil = late
    for k in range(60):
        truth = [round(x) for x in rig.chain.positions_steps()]
        for reading in rig.tick([1200 + 30 * k] * 3, dt_s=0.0):
            assert reading is None or reading.position_steps in truth
        rig.now_s += 0.005
    rig.port.spoil = None
    for _ in range(8):
        rig.now_s += 0.02
        last = rig.tick(dt_s=0.0)
    assert [r.position_steps for r in last] == [round(x) for x in rig.chain.positions_steps()]


# --- servos


def test_an_alert_that_was_there_before_opening_is_named():
    rig = Rig()
    rig.chain[3].fail("overheating")
    rig.open()
    for _ in range(3):
        rig.tick()
    assert rig.bus.faults() == ("servo 3: overheating",)


@pytest.mark.parametrize(
    ("spoil", "error", "told"),
    [
        (lambda chain: chain[3].fail("overload"), ServoFault, "servo 3: overload: let it cool"),
        (lambda chain: chain[2].restart(), ServoMissing, "servo 2 does not answer"),
    ],
    ids=["latched", "silent"],
)
def test_engaging_such_a_servo_names_it_and_leaves_all_without_torque(spoil, error, told):
    rig = Rig().open()
    spoil(rig.chain)
    with pytest.raises(error, match=told):
        rig.bus.enable_torque()
    assert not any(servo.torque for servo in rig.chain.servos)


@pytest.mark.parametrize("turn", [4096, -4096])
def test_a_position_that_wraps_as_the_torque_comes_on_is_found(turn):
    rig = Rig().open()
    servo = rig.chain[2]

    def wrap(code, raw):
        if servo.torque and 0 < servo.shaft.x < 4000:
            servo.shaft.x += turn
        return raw

    rig.port.spoil = wrap
    with pytest.raises(ServoFault, match=f"servo 2: position jumped from 2002 to {2002 + turn}"):
        rig.bus.enable_torque()
    assert not any(s.torque for s in rig.chain.servos)


def test_torque_does_not_come_on_before_the_goal_is_known_to_be_kept():
    rig = Rig().open()
    rig.chain[1].shaft.place(2400)
    real = rig.chain[1].write
    refused = []

    def deaf_to_goals(address, data):
        if address == 116:
            refused.append(data)
            return 6
        return real(address, data)

    rig.chain[1].write = deaf_to_goals
    with pytest.raises(ServoMissing, match="goal_position is not accepted .servo 1: 2400."):
        rig.bus.enable_torque()
    assert len(refused) == 3
    assert rig.chain[1].shaft.x == 2400


# --- the bus


@pytest.mark.parametrize("fast", [True, False])
def test_a_bus_without_any_answer_is_given_up_in_the_end(fast):
    rig = Rig(fast, give_up_s=1.6).open()
    rig.bus.enable_torque()
    rig.bus.events()
    rig.port.spoil = lambda code, raw: b""
    start_s = rig.now_s
    with pytest.raises(BusLost, match="no servo has answered for 1.6 s"):
        for _ in range(1000):
            assert rig.tick() == (None, None, None)
    assert 1.6 <= rig.now_s - start_s <= 1.63
    assert rig.bus.events() == ("no servo answers: check servo power and cable",)


def test_release_survives_a_dead_bus(rig):
    rig.bus.enable_torque()
    rig.port.spoil = lambda code, raw: b""
    rig.bus.disable_torque()
    assert not any(servo.torque for servo in rig.chain.servos)


def test_release_repeats_until_the_torque_is_off(rig):
    rig.bus.enable_torque()
    stubborn = rig.chain[2]
    ignored: list[Any] = []
    real = stubborn.write

    def hard_of_hearing(address, data):
        if address == 64 and len(ignored) < 3:
            ignored.append(data)
            return 0
        return real(address, data)

    stubborn.write = hard_of_hearing
    rig.bus.disable_torque()
    assert len(ignored) == 3
    assert not stubborn.torque


def test_release_counts_a_servo_that_keeps_its_torque(rig):
    rig.bus.enable_torque()
    rig.chain[2].write = lambda address, data: 0
    rig.bus.disable_torque()
    assert rig.errors() == {"refused": 1}


def test_release_and_close_before_open_do_nothing():
    rig = Rig()
    rig.bus.disable_torque()
    rig.bus.close()
    assert rig.sent == []
