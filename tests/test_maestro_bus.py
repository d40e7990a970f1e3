"""The Maestro driver against an emulated board: holding, following, errors, restarts, silence."""

from typing import Any

import pytest
from feedback_rows import rows

from gazerig.drivers.bus.timing import BusTiming
from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.maestro.board import MaestroBus, MaestroParams
from gazerig.drivers.types import ServoConfig
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.maestro.board import build_board

CENTRE = 6000
SPEED = 12_000.0
LOW, HIGH = 4400, 7600

SETUPS = (
    ServoConfig(0, "hobby", LOW, HIGH, SPEED, "eyes", rest_steps=6100),
    ServoConfig(1, "hobby", LOW, HIGH, SPEED, "lid"),
    ServoConfig(5, "hobby", LOW, HIGH, SPEED, "brow", rest_steps=9000),
)

IDS = tuple(setup.id for setup in SETUPS)
TICK_S = 0.01


class Bench:
    """A board, a port to it, and a bus; time passes during waits."""

    def __init__(self, setups=SETUPS, channels=12, chosen=(), crc=False):
        self.now_s = 0.0
        self.sent: list[Any] = []
        self.board = build_board(channels, lambda: self.now_s, crc=crc)
        for case, value in chosen:
            self.board.choose_behaviour(case, value)
        self.port = InProcessPort(self.board, self.sent.append, "emulated board", self._sleep_until)
        self.bus = MaestroBus(self.port, setups, MaestroParams(crc, channels))

    def _sleep_until(self, at_s):
        self.now_s = max(self.now_s, at_s)

    def raw(self, text):
        """Speak to the board past the driver."""
        replies = self.board.exchange(bytes.fromhex(text))
        return b"".join(piece.data for reply in replies for piece in reply.pieces)

    def pulses(self, ids=IDS):
        return [int.from_bytes(self.raw(f"90 {channel:02X}"), "little") for channel in ids]

    def order(self, *goals):
        """Send channels past the driver."""
        for channel, goal in zip(IDS, goals, strict=True):
            self.raw(f"84 {channel:02X} {goal & 127:02X} {goal >> 7:02X}")

    def run(self, seconds, goals=None):
        """Tick every 10 ms; give all readings."""
        seen = []
        for _ in range(round(seconds / TICK_S)):
            self.now_s += TICK_S
            seen.append(rows(self.bus.read(self.now_s)))
            if goals is not None:
                self.bus.write(goals)
        return seen

    def packets(self):
        """Return what was sent since the last call."""
        sent, self.sent[:] = list(self.sent), []
        return sent


def places(readings):
    return [None if r is None else r.position_steps for r in readings]


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


# --- open and read


def test_errors_from_before_are_told_and_cleared():
    bench = Bench()
    bench.raw("90 7F A1 55")
    bench.bus.open()
    assert any("serial protocol error" in line for line in bench.bus.events())
    bench.run(0.1)
    assert bench.bus.faults() == ()


@pytest.mark.parametrize("crc", [False, True])
def test_commands_with_and_without_check_bytes(crc):
    bench = Bench(crc=crc)
    bench.bus.open()
    bench.bus.enable_torque()
    bench.run(0.5, [5000, 5500, 6500])
    assert places(bench.run(0.01)[-1]) == [5000, 5500, 6500]
    assert bench.bus.health().errors == {}


def test_a_mute_board_is_named_with_its_causes():
    bench = Bench()
    bench.board.choose_behaviour("mode", "mute")
    with pytest.raises(ServoMissing, match="USB Dual Port.*CRC must be off"):
        bench.bus.open()
    assert bench.now_s < 0.2


def test_a_board_without_the_check_byte_is_not_fed_errors():
    bench = Bench()
    bench.bus = MaestroBus(bench.port, SETUPS, MaestroParams(crc=True))
    with pytest.raises(ServoMissing, match="expects no CRC: switch Enable CRC on"):
        bench.bus.open()


def test_a_channel_that_the_board_has_not():
    bench = Bench(SETUPS[:2], 6)
    bench.bus = MaestroBus(
        bench.port, (*SETUPS, SETUPS[0]._replace(id=11, name="jaw")), MaestroParams(channels=12)
    )
    with pytest.raises(ServoMissing, match=r"jaw \(channel 11\): has the board 12 channels"):
        bench.bus.open()


@pytest.mark.parametrize(
    "setup",
    [
        SETUPS[0]._replace(id=12),
        SETUPS[0]._replace(min_steps=0),
        SETUPS[0]._replace(min_steps=7000, max_steps=6000),
    ],
)
def test_setups_that_no_board_can_have(setup):
    with pytest.raises(ValueError, match=f"channel {setup.id}"):
        Bench((setup,))


def test_two_servos_on_one_channel():
    with pytest.raises(ValueError, match="one servo only"):
        Bench((SETUPS[0], SETUPS[0]))


# --- engage


def test_limits_are_armed_before_the_goal(bench):
    bench.bus = MaestroBus(
        bench.port,
        (SETUPS[0]._replace(max_accel_steps_s2=100_000.0),),
        MaestroParams(),
        BusTiming(stagger_s=0.0),
    )
    bench.bus.open()
    bench.packets()
    bench.bus.enable_torque()
    sent = b"".join(bench.packets())
    speed, accel, target = (
        sent.index(bytes.fromhex(text)) for text in ("87 00 78 00", "89 00 50 00", "84 00 54 2F")
    )
    assert speed < accel < target


def test_channels_without_pulses_go_to_their_rest_one_after_another(bench):
    assert bench.bus.enable_torque() == (6100, CENTRE, HIGH)
    assert bench.pulses() == [6100, CENTRE, HIGH]
    assert bench.now_s >= 0.2
    said = " ".join(bench.bus.events())
    assert "report no positions" in said
    assert "eyes (channel 0), lid (channel 1), brow (channel 5) had no pulses" in said
    assert all(reading.torque for reading in bench.run(0.01)[-1])


def test_a_joint_outside_its_limits_comes_inside_slowly(bench):
    bench.order(4000, 6000, 7000)
    assert bench.bus.enable_torque() == (LOW, 6000, 7000)
    bench.run(0.1, [LOW, 6000, 7000])
    assert 4000 < bench.pulses()[0] < 4200
    bench.run(0.6, [LOW, 6000, 7000])
    assert bench.pulses()[0] == LOW
    before = bench.run(0.05, [5000, 6000, 7000])[-1][0].position_steps
    assert before - LOW > 300


def test_a_board_with_a_narrower_range_is_refused(bench):
    bench.board.choose_behaviour("max-us", "1800")
    with pytest.raises(ServoMissing, match="brow.*sent to 1900 us and gets 1800 us.*widen"):
        bench.bus.enable_torque()
    assert bench.pulses() == [0, 0, 0]


def test_no_answer_at_engage(bench):
    bench.board.choose_behaviour("mode", "mute")
    with pytest.raises(ServoMissing, match="no answer about eyes"):
        bench.bus.enable_torque()


# --- following


def test_neighbours_share_one_command_and_all_goals_one_write(held):
    held.packets()
    held.bus.write([5000, 6000, 7000])
    assert held.packets() == [bytes.fromhex("9F 02 00 08 27 70 2E 84 05 58 36")]


def test_release_is_confirmed_and_reported_where_it_is_not(held):
    held.bus.disable_torque()
    assert held.pulses() == [0, 0, 0]
    assert not any(reading.torque for reading in held.run(0.05)[-1])
    held.bus.enable_torque()
    held.bus.events()
    held.board.choose_behaviour("mode", "mute")
    held.bus.disable_torque()
    assert sum("not confirmed" in line for line in held.bus.events()) == 3


# Faults of a Maestro bus, and the recovery of our driver


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
    held.raw("55")  # a data byte instead of a command
    assert held.pulses() == [0, 0, 0]
    seen = held.run(0.3, [5500, 5600, 6600])
    assert any(r is not None and r.rearmed for r in seen[2])
    assert held.pulses() == [5500, 5600, 6600]
    said = " ".join(held.bus.events())
    assert "the board reports: serial protocol error" in said
    assert "sent home by an error (serial protocol error)" in said
    assert held.bus.faults() == ("the board: serial protocol error",)
    assert held.bus.health().errors["serial protocol error"] == 1
    held.run(11.0, [5500, 5600, 6600])
    assert held.bus.faults() == ()


def test_where_home_is_a_place_they_come_back_before_they_are_there(held):
    held.board.choose_behaviour("on-error", "home")
    held.run(1.0, [5000, 5000, 5000])
    held.raw("55")
    seen = held.run(0.3)
    assert not any(r is None or r.rearmed for readings in seen for r in readings)
    assert held.pulses() == [5000, 5000, 5000]


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


def test_a_channel_that_meets_an_end_of_the_board_is_told(held):
    held.board.choose_behaviour("max-us", "1850")
    held.run(2.0, [7600, 6000, 7000])
    (line,) = [line for line in held.bus.events() if "sent to" in line]
    assert "gets 1850 us: widen its range" in line


def test_a_running_script_is_stopped_at_engage(bench):
    bench.board.faults.command("script on")
    bench.bus.enable_torque()
    assert "the board was running its own script: stopped" in bench.bus.events()
    assert bench.raw("AE") != b"\0"


def test_nothing_is_sent_to_a_board_that_may_have_restarted(held):
    held.board.choose_behaviour("mode", "mute")
    held.run(TICK_S)
    held.packets()
    held.bus.write([7000] * 3)
    assert held.packets() == []
