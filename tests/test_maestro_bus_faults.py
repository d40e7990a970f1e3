"""What goes wrong on a Maestro bus, and how our driver gets over it."""

import time

import pytest
from maestro_bench import CENTRE, HIGH, IDS, SETUPS, TICK_S, Bench, places
from present import present

from gazerig.drivers.errors import BusLost
from gazerig.drivers.maestro.bus import MaestroBus, MaestroParams
from gazerig.drivers.serial.port import BlockingPort
from gazerig.sim_mock.devices import MaestroLine
from gazerig.sim_mock.pty.client import PtyBus
from gazerig.testing.rows import rows


@pytest.fixture
def bench():
    made = Bench()
    made.bus.open()
    return made


@pytest.fixture
def held(bench):
    bench.order(5000, 6000, 7000)
    assert bench.bus.enable_torque() == (5000, 6000, 7000)
    bench.run(0.1)
    bench.bus.events()
    return bench


def test_a_restart_is_noticed_within_a_tick_and_held_anew_where_it_was(held):
    held.run(1.0, [5500, 5600, 6600])
    held.board.faults.command("brown-out")
    seen = held.run(3.0, [5500, 5600, 6600])
    again = [[r is not None and r.rearmed for r in readings] for readings in seen]
    assert [sum(column) for column in zip(*again, strict=True)] == [1, 1, 1]
    for i, place in enumerate((5500, 5600, 6600)):
        first = next(r[i] for r, a in zip(seen, again, strict=True) if a[i])
        assert first.position_steps == pytest.approx(place, abs=1)
    assert held.pulses() == [5500, 5600, 6600]
    assert any("the board restarted: set up again" in line for line in held.bus.events())
    assert held.bus.health().errors["restarted"] == 1


def test_after_a_restart_limits_are_armed_before_any_goal(held):
    held.run(0.5, [5500, 5600, 6600])
    held.board.faults.command("brown-out")
    held.packets()
    held.run(3.0, [5500, 5600, 6600])
    sent = b"".join(held.packets())
    for channel in IDS:
        armed = sent.index(bytes((0x87, channel, 120, 0)))
        assert armed < sent.index(bytes((0x84, channel)))
    assert sent.index(b"\x9f") > sent.index(bytes((0x87, 1)))


def test_an_error_that_sends_all_home_is_named_and_healed(held):
    held.run(0.5, [5500, 5600, 6600])
    held.raw("55")  # a data byte where a command is due
    assert held.pulses() == [0, 0, 0]
    seen = held.run(0.3, [5500, 5600, 6600])
    assert any(r is not None and r.rearmed for r in seen[2])
    assert held.pulses() == [5500, 5600, 6600]
    said = " ".join(held.bus.events())
    assert "the board reports: serial protocol error" in said
    assert "sent home by an error (serial protocol error)" in said
    assert held.bus.faults() == ("board 12: serial protocol error",)
    assert held.bus.health().errors["serial protocol error"] == 1
    held.run(11.0, [5500, 5600, 6600])
    assert held.bus.faults() == ()


def test_an_error_that_moves_nothing_is_only_named(held):
    held.board.choose("on-error", "ignore")
    held.raw("55")
    seen = held.run(0.3, [5500, 5600, 6600])
    assert not any(r is None or r.rearmed for readings in seen for r in readings)
    assert held.bus.faults() == ("board 12: serial protocol error",)


def test_where_home_is_a_place_they_come_back_before_they_are_there(held):
    held.board.choose("on-error", "home")
    held.run(1.0, [5000, 5000, 5000])
    held.raw("55")
    seen = held.run(0.3)
    assert not any(r is None or r.rearmed for readings in seen for r in readings)
    assert held.pulses() == [5000, 5000, 5000]


def test_where_home_is_reached_at_once_they_are_held_there():
    bench = Bench(tuple(setup._replace(max_speed_steps_s=2e6) for setup in SETUPS))
    bench.board.choose("on-error", "home")
    bench.bus.open()
    bench.bus.enable_torque()
    bench.run(1.0, [5000, 5000, 5000])
    bench.raw("55")
    seen = bench.run(0.3)
    again = [r for readings in seen for r in readings if r is not None and r.rearmed]
    assert [r.position_steps for r in again] == [6000, 6000, 6000]
    assert bench.pulses() == [6000, 6000, 6000]
    assert "sent home by an error" in " ".join(bench.bus.events())


def test_errors_again_and_again_leave_the_servos_limp_until_the_line_is_quiet(held):
    unpowered = 0
    for _ in range(14):
        held.raw("55")
        unpowered += sum(None in readings for readings in held.run(0.1, [5500, 5600, 6600]))
    assert unpowered > 40
    assert not any("channel" in fault for fault in held.bus.faults())
    said = [event for event in held.bus.events() if "again and again" in event]
    assert len(said) == 1
    readings = held.run(1.5, [5500, 5600, 6600])[-1]
    assert held.pulses() == [5500, 5600, 6600]
    assert not any(reading.fault for reading in readings)


def test_a_board_that_restarts_again_and_again_stays_without_pulses(held):
    for _ in range(4):
        held.board.faults.command("brown-out")
        readings = held.run(1.0, [5500, 5600, 6600])[-1]
    assert held.pulses() == [0, 0, 0]
    assert all("supply too weak" in reading.fault for reading in readings)
    held.packets()
    held.bus.write([5000] * 3)
    assert held.packets() == []


def test_goals_never_switch_a_channel_on_that_is_not_held_yet(held):
    held.run(0.5, [5500, 5600, 6600])
    held.board.faults.command("brown-out")
    on = []
    for _ in range(60):
        readings = held.run(TICK_S, [5500, 5600, 6600])[-1]
        on.append(sum(pulse > 0 for pulse in held.pulses()))
        assert on[-1] == sum(reading is not None for reading in readings)
    # One more in each tick.
    assert [n for n in on if n][:3] == [1, 2, 3]


def test_a_channel_that_meets_an_end_of_the_board_is_told_once(held):
    held.board.choose("max-us", "1850")
    for _ in range(3):
        seen = held.run(1.0, [7600, 6000, 7000])
        held.run(1.0, [6000, 6000, 7000])
    assert seen[-1][0].position_steps == 7400
    assert not any(r is None or r.rearmed for readings in seen for r in readings)
    reported = [line for line in held.bus.events() if "sent to" in line]
    assert len(reported) == 1 and "gets 1850 us: widen its range" in reported[0]


def test_a_running_script_is_stopped_at_engage(bench):
    bench.board.faults.command("script on")
    bench.bus.enable_torque()
    assert "the board ran a script of its own: stopped" in bench.bus.events()
    assert bench.raw("AE") != b"\0"


def test_one_lost_answer_costs_one_tick_and_nothing_else(held):
    held.board.faults.command("lose all count 1")
    seen = held.run(0.2, [5500, 5600, 6600])
    assert places(seen[0]) == [None, None, None]
    assert not any(r is None or r.rearmed for readings in seen[1:] for r in readings)
    assert sum(held.bus.health().errors.values()) == 1


def test_a_late_answer_is_never_taken_for_another(held):
    held.run(1.0, [5000, 6000, 7000])
    held.board.faults.command("delay all 25 count 1")
    seen = held.run(0.3, [5000, 6000, 7000])
    for readings in seen:
        assert all(
            r is None or r.position_steps == at
            for r, at in zip(readings, (5000, 6000, 7000), strict=True)
        )
    assert not any(r is not None and r.rearmed for readings in seen for r in readings)


def test_a_silent_board_costs_little_time_and_is_given_up_in_the_end(held):
    held.bus._board.timing = held.bus._board.timing._replace(give_up_s=2.0)
    held.board.choose("mode", "mute")
    began_s, ticks = held.now_s, 0
    with pytest.raises(BusLost, match="has not answered for 2"):
        while True:
            before_s = held.now_s
            held.run(TICK_S, [5000, 6000, 7000])
            assert held.now_s - before_s < 0.04
            ticks += 1
    assert held.now_s - began_s < 2.6
    assert ticks > 100
    assert any("does not answer" in line for line in held.bus.events())


def test_nothing_is_sent_to_a_board_that_may_have_restarted(held):
    held.board.choose("mode", "mute")
    held.run(TICK_S)
    held.packets()
    held.bus.write([7000] * 3)
    assert held.packets() == []


def test_a_board_that_comes_back_after_silence_is_looked_at(held):
    held.board.choose("mode", "mute")
    held.run(2.0, [5000, 6000, 7000])
    held.board.choose("mode", "usb-dual-port")
    seen = held.run(1.0, [5000, 6000, 7000])
    assert places(seen[-1]) == [5000, 6000, 7000]
    assert any("answers again after" in line for line in held.bus.events())


def test_unplugged_and_plugged_in_again(held):
    held.run(0.5, [5500, 5600, 6600])
    held.board.faults.command("unplug")
    gone = held.run(0.5, [5500, 5600, 6600])
    assert all(reading is None for readings in gone for reading in readings)
    held.board.faults.command("plug")
    seen = held.run(2.0, [5500, 5600, 6600])
    again = [i for readings in seen for i, r in enumerate(readings) if r is not None and r.rearmed]
    assert sorted(again) == [0, 1, 2]
    assert held.pulses() == [5500, 5600, 6600]
    said = " ".join(held.bus.events())
    assert "port lost" in said and "port back after" in said


def test_a_port_that_stays_away(held):
    held.bus._link._give_up_s = 1.0
    held.board.faults.command("unplug")
    with pytest.raises(BusLost, match="check the USB cable"):
        held.run(2.0)
    with pytest.raises(BusLost, match="pulses could not be stopped"):
        held.bus.disable_torque()


def test_over_a_pseudo_terminal():
    with PtyBus() as server:
        port = BlockingPort(server.start_device(MaestroLine(12)))
        bus = MaestroBus(port, SETUPS, MaestroParams(reply_timeout_ms=200.0, stagger_ms=0.0))
        bus.open()
        assert bus.enable_torque() == (6100, CENTRE, HIGH)
        goals = [5500, 5600, 6600]
        end_s = port.now_s() + 20.0
        readings = rows(bus.read(port.now_s()))
        while places(readings) != goals and port.now_s() < end_s:
            bus.write(goals)
            time.sleep(0.01)
            readings = rows(bus.read(port.now_s()))
        assert places(readings) == goals
        assert bus.health().errors == {}
        bus.disable_torque()
        assert not any(present(reading).torque for reading in rows(bus.read(port.now_s())))
        bus.close()


def test_a_slow_line_is_asked_less_often():
    bench = Bench(watch_ms=40.0)
    bench.bus.open()
    bench.bus.enable_torque()
    bench.run(0.1)
    before = bench.bus.health().rx_bytes
    seen = bench.run(0.4, [5500, 5600, 6600])
    assert bench.bus.health().rx_bytes - before == 10 * 4
    assert all(r is not None for readings in seen for r in readings)
