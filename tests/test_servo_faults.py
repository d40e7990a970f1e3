"""Faults of a bus of smart servos of every make, and the driver's reactions.

Requirements of each: a read takes a bounded time; no value is delivered that was not
true in its cycle (the rigs assert it in every tick); one bad servo does not blind the others.
Faults of only one make are in test_dynamixel_care and test_feetech_faults.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import pytest
import sts_rig
from copied import copied
from dynamixel_rig import WAYS
from dynamixel_rig import Rig as DynamixelRig
from feedback_rows import rows
from moving_bus import IDS, LONGEST_S, NAMES

from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.servo_bus.supervisor import AGAIN_AND_AGAIN

RIGS: dict[str, Callable[[], Any]] = {
    **{f"dynamixel {way}": partial(DynamixelRig, chosen) for way, chosen in WAYS.items()},
    "feetech": sts_rig.Rig,
}


@pytest.fixture(scope="module")
def started():
    return {name: make().start() for name, make in RIGS.items()}


@pytest.fixture(params=RIGS)
def rig(request, started):
    return copied(started[request.param])


@pytest.fixture(params=RIGS)
def make(request):
    return RIGS[request.param]


PASSING = [
    "drop 2 0",
    "drop 2 8",
    "drop 2 -1",
    "corrupt 2 20",
    "corrupt 2 160",
    "truncate 2 5",
    "delay 2 10",
    "delay 2 60",
    "wrong-id 2 3",
    "refuse 2 BITS",
    "short 2 2",
    "long 2 2",
    "lose 2",
    "stall 2 60",
]


@pytest.mark.parametrize("fault", PASSING)
def test_a_passing_fault_costs_little_and_passes(rig, fault):
    weak = rig.bus._family.weak_check
    fault = fault.replace("BITS", "32" if weak else "7")
    # A late or stalled one blocks the line for all servos meanwhile.
    late_ms = int(fault.split()[2]) if fault.split()[0] in ("delay", "stall") else 0
    for times in (1, 5):
        rig.command(f"{fault} count {times}")
        lost = 0
        for _ in range(30):
            heard = rig.heard()
            lost += not (heard[0] and heard[2] and heard[3])
        rig.until_all()
        # An answer under another's id spoils that other's, and too long a block the header; on a
        # line that was disturbed an answer that is not confirmed costs one more.
        two = fault in ("wrong-id 2 3", "long 2 2")
        assert lost <= times * (late_ms / 10.0 + 2.0 if late_ms else weak + two)
        assert rig.heard() == [True] * 4
    assert rig.longest_s < LONGEST_S
    assert rig.bus.faults() == ()


@pytest.mark.parametrize(
    "fault",
    ["noise before FFFF0102", "noise before FFFFFD00010200", "noise after FF", "fragment",
     "echo on", "delay 2 0.3", "stall 3 0.3"],
)  # fmt: skip
def test_what_is_harmless(rig, fault):
    rig.command(fault)
    assert [rig.heard() for _ in range(20)] == [[True] * 4] * 20
    assert rig.longest_s < LONGEST_S


@pytest.mark.parametrize("late_ms", [15, 80, 200])
def test_all_late_is_never_taken_for_fresh(rig, late_ms):
    for times in (1, 3, 12):
        rig.command(f"delay all {late_ms} count {times}")
        for _ in range(10):
            rig.tick()
        rig.until_all()
    assert rig.longest_s < 0.3


@pytest.mark.parametrize("policy", ["silence", "skip", "timeout"])
@pytest.mark.parametrize("missing", [(1,), (2, 3)])
def test_silent_servos_cost_only_themselves(rig, policy, missing):
    rig.command(f"set after-missing {policy}")
    for servo_id in missing:
        rig.command(f"lose {servo_id}")
    expected = [servo_id not in missing for servo_id in IDS]
    assert [rig.heard() for _ in range(50)] == [expected] * 50
    assert rig.longest_s < LONGEST_S
    lines = rig.bus.events()
    for i in missing:
        assert f"{NAMES[i - 1]} (servo {i}) does not answer: check servo power and cable" in lines
    rig.command("clear")
    assert rig.until_all() <= 60
    assert any("answers again after" in line for line in rig.bus.events())


@pytest.mark.parametrize(
    "away",
    [
        partial(DynamixelRig, servo_baud=1_000_000, baud=57_600),
        partial(sts_rig.Rig, baud=500_000),
    ],
    ids=["dynamixel", "feetech"],
)
def test_wrong_baud_rate(away):
    rig = away()
    rig.command("set wrong-baud garbage")
    with pytest.raises(ServoMissing, match="no servo answers: check servo power, cable and baud"):
        rig.bus.open()


def test_lost_writes_while_the_torque_comes_on_and_goes(make):
    rig = make()
    rig.bus.open()
    rig.command("lose-writes 2")
    rig.bus.enable_torque()
    rig.command("lose-writes 2")
    rig.bus.disable_torque()
    assert not any(servo.torque for servo in rig.chain.servos)


def test_two_servos_with_one_id(rig):
    rig.command("turn 2 300")
    rig.command("collide 2")
    rig.command("turn 2 -111")
    for _ in range(200):
        # Without the judgement of a tick: there are two values of servo 2.
        rig.now_s += 0.01
        began_s = rig.now_s
        readings = rows(rig.bus.read(rig.now_s))
        assert None not in (readings[0], readings[2], readings[3])
        assert rig.now_s - began_s < LONGEST_S
        rig.bus.write([2000] * 4)
    assert any(line.startswith("jaw (servo 2) answers, but") for line in rig.bus.events())


def test_a_brown_out_in_the_middle_of_a_long_way_ends_where_it_is(rig):
    for _ in range(3):
        rig.tick([2900] * 4)
    rig.command("brown-out 3")
    memory, seen = rig.chain[3].memory, []
    for _ in range(150):
        rig.now_s += 0.01
        at = rig.chain.positions_steps()[2]
        reading = rows(rig.bus.read(rig.now_s))[2]
        if reading is not None and reading.rearmed:
            assert abs(reading.position_steps - at) <= 2
            assert abs(memory.get("goal_position") - at) <= 2
            seen.append(at)
        rig.bus.write([2900] * 4)
    assert len(seen) == 1
    assert rig.bus.faults() == ()
    assert "neck (servo 3) restarted: set up again" in rig.bus.events()
    assert memory.get("torque_enable") == 1


def test_a_servo_that_keeps_restarting_stays_limp(rig):
    for _ in range(5):
        rig.command("brown-out 2")
        for _ in range(150):
            rig.tick()
    assert rig.bus.faults() == (f"jaw (servo 2): {AGAIN_AND_AGAIN}",)
    reading = rig.tick()[1]
    assert reading is None or (reading.torque, reading.fault) == (False, AGAIN_AND_AGAIN)
    assert not rig.chain[2].torque
    assert rig.chain[1].torque
    rig.bus.enable_torque()
    if isinstance(rig, sts_rig.Rig):
        assert rig.bus.faults() == ()
        assert rig.tick()[1].fault == ""
