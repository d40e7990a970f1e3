"""The servo driver under damaged and late bytes."""

import pytest
from fakes.dynamixels import IDS, Rig

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
