"""Faults of every kind of bus while a head moves on it, and their ends."""

from dataclasses import replace
from functools import cache

import pytest
from copied import copied
from fault_machine import Case, Machine, pair_of
from mixed_rig import mixed_rig
from struck_rigs import CASES, RIGS, VOLTS, quick, rig_of

import gazerig.robot.app.run_bus as run_bus
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.rig_limits import limits

LEFT = {
    "dynamixel": {
        "overload {i}", "overheat {i}", "shock {i}", "voltage {i} 3.0", "voltage all 3.0",
        "voltage {i} 16", "collide {i}",
    },
    "feetech": {"overheat {i}", "collide {i}", "reset {i}"},
}  # fmt: skip
"""After these a servo is left, as only a person can help; everything else passes."""


STRUCK_S = 0.6


@cache
def of_kind(kind):
    """Return the quick rig of a kind, and its joints in motion: to be copied."""
    rig = quick(rig_of(kind))
    return rig, started(rig)


def started(rig):
    machine = Machine(rig)
    machine.start()
    return machine


@pytest.mark.parametrize(
    ("kind", "case"),
    [(kind, case) for kind in CASES for case in CASES[kind]],
    ids=lambda value: value if isinstance(value, str) else value.name,
)
def test_whatever_befalls_a_bus_ends_well(kind, case):
    """Every tick checks the true servos: goals in the limits, positions in the range, speeds."""
    machine = copied(of_kind(kind)[1])
    machine.volts = VOLTS[kind]
    outcome = machine.apply_fault(*pair_of(machine.rig, kind), case, STRUCK_S)
    assert outcome.survived, outcome
    assert (outcome.end == "left, named") == (case.name in LEFT.get(kind, ())), outcome
    # A write to an adapter that accepts no bytes times out after 0.25 s.
    assert outcome.longest_s < (0.3 if "block" in case.name else 0.1)
    machine.body.stop()
    assert all(machine.true_goal(i) is None for i in range(len(machine.names)))


def test_a_servo_that_cannot_be_set_up_again_is_named_and_keeps_no_other_waiting():
    rig, machine = copied(of_kind("dynamixel"))
    bus, i, j = pair_of(rig, "dynamixel")
    # A second servo has its id, which only shows if both are apart without torque.
    again = ("collide {i}", "unplug", "brown-out {i}", "brown-out {j}")
    outcome = machine.apply_fault(bus, i, j, Case(again, ("plug",)))
    assert outcome.end == "left, named", outcome
    assert [k for k, heard in enumerate(machine.heard) if not heard] == [i]


@pytest.mark.parametrize("bit", [3, 9])
def test_a_hit_bit_is_not_taken_for_the_pulse_of_a_channel_that_gives_none(bit):
    rig, machine = copied(of_kind("maestro"))
    case = Case(("error script-stack", f"corrupt {{i}} {bit}"))
    assert machine.apply_fault(pair_of(rig, "maestro")[0], 0, 1, case).end == "came back"


# --- several kinds in one head

ALONE = (
    Case(("unplug",), ("plug",)),
    Case(("lose all",)),
    Case(("delay all 5",)),
    Case(("babble on",)),
    Case(("unplug", "deny on"), ("plug", "deny off")),
)


@pytest.fixture(scope="module")
def mixed(tmp_path_factory):
    rig = mixed_rig(tmp_path_factory.mktemp("rig"))
    # As those of the desk rig: with the gains from the factory it lags far behind.
    neck = replace(rig.joints["neck_yaw"], gains=(4000, 0, 4000))
    return quick(replace(rig, joints={**rig.joints, "neck_yaw": neck}))


@pytest.fixture(scope="module")
def mixed_machine(mixed):
    return started(mixed)


@pytest.mark.parametrize("case", ALONE, ids=lambda case: case.name)
@pytest.mark.parametrize("kind", ["dynamixel", "feetech", "maestro"])
def test_what_befalls_one_bus_leaves_the_joints_of_the_others_moving(
    mixed, mixed_machine, kind, case
):
    machine = copied(mixed_machine)
    bus, i, j = pair_of(mixed, kind)
    began_s, heard, tick = machine.clock.now_s(), [], machine.tick

    def listened():
        well = tick()
        heard.append(machine.heard)
        return well

    machine.tick = listened
    outcome = machine.apply_fault(bus, i, j, case)
    assert outcome.end == "came back", outcome
    others = [k for k, name in enumerate(mixed.names) if mixed.joints[name].bus != bus]
    assert all(one[k] for one in heard for k in others)
    # Its patience is paid by all, but seldom: slots are not left out for long.
    slots = (machine.clock.now_s() - began_s) / machine.period_s
    assert len(heard) > (0.5 if "delay" in case.name else 0.8) * slots


# --- the whole robot

STRUCK = {
    "dynamixel": ("lose 3 for 0.3", "delay all 3 for 0.2", "unplug for 0.3", "brown-out 5"),
    "feetech": ("lose 3 for 0.3", "delay all 3 for 0.2", "unplug for 0.3", "brown-out 5"),
    "maestro": ("lose all for 0.3", "error protocol", "unplug for 0.3", "brown-out"),
    "pca9685": ("lose all for 0.3", "nack for 0.3", "unplug for 0.3", "brown-out"),
}


@pytest.mark.parametrize("kind", RIGS)
def test_a_robot_that_looks_at_people_goes_on_looking(monkeypatch, kind):
    devices, build = [], run_bus.build

    def seen(*given):
        devices.append(build(*given))
        return devices[-1]

    monkeypatch.setattr(run_bus, "build", seen)
    rig = rig_of(kind)
    made = assemble(rig, RunOptions(mock=True, fast=True, seed=0, scene="visitor"))
    clock, head = made.clock, made.robot
    head.start(clock)
    bounds, missed = limits(rig.joints), 0
    for k in range(1, 401):
        clock.sleep_until(k * 0.01)
        if k % 80 == 40 and k < 340:
            devices[0].faults.command(STRUCK[kind][k // 80])
        tick = head.tick(clock.now_s(), 0.01)
        missed += bool(tick.joints.missing)
        for angle, limit in zip(tick.guard_result.command_rad, bounds, strict=True):
            assert limit.low_rad - 1e-9 <= angle <= limit.high_rad + 1e-9
    assert missed > 0
    assert tick.joints.missing == () and all(tick.joints.torque)
    head.stop()
    made.close()
