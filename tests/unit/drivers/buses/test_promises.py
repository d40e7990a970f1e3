"""Promises of every kind of servo bus, one test each, as seen from outside.

Those of gazerig.testing.BusSuite are not repeated here (test_bus_kinds runs it on every kind):
torque on and after a restart without a jump and at the configured speed, goals inside the limits,
NaN refused, missing servos named, a port that stays away given up.
"""

import itertools
from contextlib import suppress
from statistics import mean

import pytest
from bus_kinds import BOARDS, FEETECH, SMART, TICK_S, every_kind, in_process
from dynamixel_sdk import PacketHandler
from fakes.sdk_port import SdkPort

from gazerig.drivers.errors import BusLost, ServoFault, ServoMissing

SILENT_S = 3.9
"""An adapter that is away for this long is used again."""


def near(bench, steps, goals, share=0.02):
    room = share * (bench.kind.high - bench.kind.low)
    return all(abs(a - b) <= room for a, b in zip(steps, goals, strict=True))


def label(bench, i):
    return bench.setups[i].label("channel" if bench.kind.board else "servo")


def has_line(lines, *words):
    return any(all(word in line for word in words) for line in lines)


# --- servos that do not answer, and answers that are not right


@pytest.mark.parametrize("fault", ["lose {}", "truncate {} 5", "corrupt {}"])
@every_kind(*BOARDS)  # the channels of a board do not answer one by one
def test_one_servo_that_is_not_heard_costs_at_most_two_percent_of_a_cycle(name, fault):
    bench = in_process(name, wire_time=True)
    bus = bench.hold()

    def cycle():
        began_s = bench.now_s()
        missing = bus.read(began_s).missing
        bus.write(bench.steps([0.5] * 4))
        return bench.now_s() - began_s, missing

    for _ in range(150):
        cycle()
    usual_s = mean(cycle()[0] for _ in range(50))
    bench.command(fault.format(bench.setups[2].id))
    struck = [cycle() for _ in range(200)]
    # At first a damaged block of one packet for all may take its neighbour with it.
    assert {missing for _, missing in struck[8:]} == {(2,)}
    # The first time all of the reserve is waited: this computer might have paused.
    assert struck[0][0] < usual_s + 0.02
    assert mean(s for s, _ in struck[1:]) <= 1.02 * usual_s < 0.0018
    bench.command("clear")
    bench.recovered(bus)


ONE = ("lose {}", "delay {} 8", "delay {} 60", "truncate {} 5", "corrupt {}")
ALL = ("lose all", "delay all 15", "delay all 80 count 9", "truncate all 6", "corrupt all")


@pytest.mark.parametrize("fault", [*ONE, *ALL])
@every_kind()
def test_lost_late_cut_and_damaged_answers_are_never_data(name, fault):
    """``tick`` compares every value with the true servo."""
    bench = in_process(name)
    bus = bench.hold()
    bench.ticks(bus, 0.3)
    for duration, seconds in (("count 3", 0.3), ("for 0.7", 0.8)):
        lasting = fault if "count" in fault else f"{fault} {duration}"
        bench.command(lasting.format(bench.setups[1].id))
        struck = bench.ticks(bus, seconds)
        if fault in ONE and name in SMART and "delay" not in fault:
            assert not any({0, 2, 3} & set(f.missing) for f in struck[8:])
    bench.command("clear")
    bench.recovered(bus)
    assert bus.faults() == () or name in BOARDS  # which keep their counts of errors for a while


@every_kind(*BOARDS)  # a board has wires of its own for each direction
def test_an_adapter_that_echoes_costs_nothing(name):
    bench = in_process(name)
    bench.command("echo")
    bus = bench.hold()
    assert all(f.missing == () and all(f.torque) for f in bench.ticks(bus, 1.0))
    assert bus.health().errors == {}


@every_kind(*BOARDS)  # a board does not measure its servos
def test_a_joint_that_a_hand_has_turned_is_believed_soon(name):
    bench = in_process(name)
    bus = bench.hold()
    bench.ticks(bus, 0.3)
    bus.disable_torque()
    bench.run(bus, 1.0)  # it comes to rest
    bench.command(f"turn {bench.setups[1].id} {-0.3 * (bench.kind.high - bench.kind.low)}")
    feedback = bench.run(bus, 0.1)
    assert abs(feedback.position_steps[1] - bench.places()[1]) <= 2


# --- what comes back


@every_kind()
def test_an_adapter_that_is_replugged_within_four_seconds_is_used_again(name):
    bench = in_process(name)
    bus = bench.hold()
    bench.ticks(bus, 0.5)
    bench.command("unplug")
    gone = bench.ticks(bus, SILENT_S)
    assert all(f.missing == (0, 1, 2, 3) for f in gone)
    bench.command("plug")
    back = bench.ticks(bus, 1.0)
    assert all(any(f.rearmed[i] for f in back) for i in range(4))
    assert back[-1].missing == () and all(back[-1].torque)
    bench.go(bus, [0.5] * 4)


@every_kind()
def test_a_restart_while_unplugged_or_silent_is_found_and_nothing_jumps(name):
    bench = in_process(name)
    bus = bench.hold()
    bench.ticks(bus, 0.5)
    for begin, end in (("unplug", "plug"), ("lose all", "clear")):
        bench.command(begin)
        bench.ticks(bus, 0.3)
        bench.brown_out()
        bench.command(end)
        before_s, before = bench.now_s(), bench.places()
        for _ in range(150):
            bench.tick(bus)
            now_s, now = bench.now_s(), bench.places()
            most = 1.2 * bench.kind.speed_steps_s * (now_s - before_s) + 12.0
            assert all(abs(b - a) <= most for a, b in zip(before, now, strict=True))
            before_s, before = now_s, now
        bench.go(bus, [0.5] * 4)
        assert bus.faults() == () and all(bench.holding())


@every_kind()
def test_a_servo_that_restarts_again_and_again_is_named_and_stays_limp(name):
    bench = in_process(name)
    bus = bench.hold()
    for _ in range(5):
        bench.brown_out()
        bench.ticks(bus, 1.5)
    if name in BOARDS:
        assert has_line(bus.events(), "restarted")
        return
    (fault,) = bus.faults()
    assert label(bench, 0) in fault and "again and again" in fault
    assert bench.holding() == [False, True, True, True]


# --- torque on and off


@every_kind()
def test_a_joint_outside_its_limits_comes_in_slowly(name):
    bench = in_process(name)
    low, high = bench.steps([0.45, 0.6])
    entry = 0.5 * (high - low)
    inner = [
        s._replace(min_steps=low, max_steps=high, entry_speed_steps_s=entry) for s in bench.setups
    ]
    bus = bench.hold(inner)
    before, outside = bench.places(), 0
    room = 0.004 * (bench.kind.high - bench.kind.low)
    for _ in range(200):
        feedback = bus.read(bench.now_s())
        bus.write(bench.steps([0.5] * 4))
        bench.wait(TICK_S)
        now = bench.places()
        for i, (was, at) in enumerate(zip(before, now, strict=True)):
            if not low - 8 <= was <= high + 8 and not low - 8 <= at <= high + 8:
                outside += 1
                assert abs(at - was) <= 1.5 * entry * TICK_S + room
                assert bench.kind.board or feedback.rearmed[i]
        before = now
    assert outside > 20 and near(bench, before, bench.steps([0.5] * 4))


@every_kind()
def test_torque_off_is_confirmed_and_names_who_was_not_reached(name):
    bench = in_process(name)
    bus = bench.hold()
    bus.disable_torque()
    assert not any(bench.holding()) and bus.events() == ()
    bus.enable_torque()
    if name in BOARDS:
        bench.command("lose all")
        bus.disable_torque()
        assert has_line(bus.events(), label(bench, 0))
        return
    bench.command(f"lose {bench.setups[1].id}")
    bus.disable_torque()
    lines = bus.events()
    assert has_line(lines, label(bench, 1), "torque-off not confirmed", "cut the servo power")
    assert not any(label(bench, i) in line for i in (0, 2, 3) for line in lines)
    assert not any(bench.holding())


@every_kind()
def test_a_torque_off_while_unplugged_is_carried_out_when_the_port_is_back(name):
    bench = in_process(name)
    bus = bench.hold(give_up_s=1.0)
    bench.ticks(bus, 0.1)
    bench.command("unplug")
    with pytest.raises(BusLost):
        bus.disable_torque()

    def read_on(seconds):
        for _ in range(round(seconds / TICK_S)):
            bench.wait(TICK_S)
            with suppress(BusLost):
                bus.read(bench.now_s())

    read_on(3.0)  # longer than it takes to give up
    assert all(bench.holding())
    bench.command("plug")
    read_on(0.5)
    assert not any(bench.holding())
    assert has_line(bus.events(), "torque switched off")
    read_on(1.0)
    assert not any(bench.holding())
    bus.enable_torque()
    read_on(0.2)
    assert all(bench.holding())
    bus.disable_torque()
    bench.command("unplug")
    with pytest.raises(BusLost):
        bus.enable_torque()
    bench.command("plug")
    read_on(1.5)
    assert not any(bench.holding())


@every_kind()
def test_torque_comes_on_and_goes_although_packets_are_lost(name):
    bench = in_process(name)
    bus, write, count = bench.bus(), bench.port.write, itertools.count()
    every = 1000 if name in BOARDS else 4  # a board that hears less is reported
    bus.open()
    bench.port.write = lambda data: None if next(count) % every == 1 else write(data)  # type: ignore[method-assign]
    bus.enable_torque()
    assert all(bench.holding())
    bus.disable_torque()
    assert not any(bench.holding())


@every_kind()
def test_a_second_open_changes_nothing(name):
    """An EEPROM lasts for some thousand writes."""
    bench = in_process(name)
    bus = bench.hold()
    bus.disable_torque()
    bus.close()
    bus.open()
    assert not has_line(bus.events(), "->")


@every_kind(*FEETECH, *BOARDS)  # it has no watchdog and holds its last goal
def test_the_watchdog_stops_the_servos_of_a_host_that_falls_silent(name):
    bench = in_process(name)
    bus = bench.hold([s._replace(max_speed_steps_s=500.0) for s in bench.setups])
    bench.run(bus, 0.1, [0.9] * 4)
    bench.wait(2.0)
    stopped = bench.places()
    assert all(at < bench.steps([0.8])[0] for at in stopped)
    # The host goes on: without a jump.
    first = bus.read(bench.now_s()), bus.read(bench.now_s())
    assert any(all(f.rearmed) for f in first)
    assert near(bench, bench.places(), stopped, 0.005)
    bench.go(bus, [0.9] * 4)
    assert has_line(bus.events(), "watchdog")


# --- what is named


@every_kind(*BOARDS)  # a board does not measure its servos
def test_two_servos_with_one_id_are_named(name):
    bench = in_process(name)
    bus = bench.hold()
    bench.ticks(bus, 0.5)
    bench.command(f"turn {bench.setups[1].id} {0.15 * (bench.kind.high - bench.kind.low)}")
    bench.command(f"collide {bench.setups[1].id}")
    bench.command(f"turn {bench.setups[1].id} {-0.1 * (bench.kind.high - bench.kind.low)}")
    for _ in range(300):
        feedback = bus.read(bench.now_s())
        assert not {0, 2, 3} & set(feedback.missing)
        bus.write(bench.steps([0.5] * 4))
        bench.wait(TICK_S)
    assert has_line(bus.events(), label(bench, 1), "second servo with its id")


@every_kind(*BOARDS)  # a board does not know its servos
def test_a_wrong_model_is_named_at_open(name):
    bench = in_process(name)
    other = "scs15" if name in FEETECH else "xl430-w250"
    wrong = [s._replace(model=other) if i == 2 else s for i, s in enumerate(bench.setups)]
    with pytest.raises(ServoMissing) as caught:
        bench.bus(wrong).open()
    text = str(caught.value)
    assert label(bench, 2) in text and bench.kind.model in text and other in text


@every_kind(*BOARDS)  # a board's servos have no firmware
def test_a_firmware_that_is_old_or_unlike_its_neighbours_is_named_at_open(name):
    plain = in_process(name).bus()
    plain.open()
    old = name == "old dynamixel"
    assert len([line for line in plain.events() if "firmware" in line]) == old
    bench = in_process(name, firmware={1: 44})
    bus = bench.bus()
    bus.open()
    lines = [line for line in bus.events() if "firmware" in line]
    found, right = ("3.44", "others of this model have 3.53") if name in FEETECH else ("44", "46")
    assert has_line(lines, label(bench, 1), f"firmware {found}, ", right, "update it with")
    assert len(lines) == 1 + old and label(bench, 0) not in lines[0]
    bus.enable_torque()
    bench.go(bus, [0.5] * 4)


@pytest.mark.parametrize("low", [True, False])
@every_kind(*BOARDS)  # a board does not measure its supply
def test_a_wrong_voltage_is_named_before_anything_moves(name, low):
    bench = in_process(name)
    volts = 16.0 if not low else 3.8 if name == "feetech" else 3.0
    bench.command(f"voltage {bench.setups[1].id} {volts}")
    bench.wait(1.0)
    bus, told = bench.bus(), []
    try:
        bus.open()
        bench.run(bus, 0.1)
        bus.enable_torque()
        bench.run(bus, 0.1)
    except (ServoFault, ServoMissing) as error:
        told.append(str(error))
    assert has_line([*told, *bus.faults(), *bus.events()], label(bench, 1), "voltage")


@pytest.mark.parametrize("level", [0, 1])
@every_kind(*BOARDS)  # a board has no such setting
def test_servos_that_answer_less_than_they_could_are_understood(name, level):
    bench = in_process(name)
    protocol, address, lock = (
        (1.0, 8, 48 if name == "scs" else 55) if name in FEETECH else (2.0, 68, 0)
    )
    assert bench.port.setBaudRate(1_000_000)
    for setup in bench.setups:
        packets, port = PacketHandler(protocol), SdkPort(bench.port)
        if lock:
            packets.write1ByteTxOnly(port, setup.id, lock, 0)
        packets.write1ByteTxOnly(port, setup.id, address, level)
    bench.port.closePort()
    bus = bench.hold()
    assert all(f.missing == () and all(f.torque) for f in bench.ticks(bus, 1.0))
    assert bus.health().errors == {}
