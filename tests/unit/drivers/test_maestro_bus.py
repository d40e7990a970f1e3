"""What is particular to the Maestro's driver: limits before goals, errors, restarts, the line."""

import re

import pytest
from maestro_world import IDS, SETUPS, TICK_S, World, target
from present import present
from stand_in import StandIn

from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.hobby_board.bus import HobbyBoardBus
from gazerig.drivers.maestro.board import MaestroBoard, MaestroParams, probe
from gazerig.drivers.serial.port import BusTiming
from gazerig.sim_mock.hobby_servo import HobbySpec

GOALS = (5500, 5600, 6600)
NARROW = [HobbySpec(5, max_steps=7000)]


@pytest.fixture
def world():
    made = World()
    made.bus.open()
    return made


@pytest.fixture
def held():
    return World().held(5000, 6000, 7000)


# --- open


def test_errors_from_before_are_cleared():
    world = World()
    world.ask("90 7F A1 55")
    world.bus.open()
    assert world.errors() == 0


@pytest.mark.parametrize("crc", [False, True])
def test_commands_with_and_without_check_bytes(crc):
    world = World(crc=crc)
    world.bus.open()
    world.bus.enable_torque()
    world.run(0.5, [5000, 5500, 6500])
    assert world.run(0.01)[-1].position_steps == (5000, 5500, 6500)
    assert world.bus.health().errors == {}


def test_what_cannot_be_used_is_named_with_its_cause():
    world = World()
    world.do("lose all")
    with pytest.raises(ServoMissing, match="USB Dual Port.*CRC must be off"):
        world.bus.open()
    assert world.now_s < 0.2
    world.do("clear")
    with pytest.raises(ServoMissing, match="its CRC must be on"):
        HobbyBoardBus(MaestroBoard(world.port, MaestroParams(crc=True)), SETUPS).open()
    small = World(6)
    far = SETUPS[0]._replace(id=11, name="jaw")
    with pytest.raises(ServoMissing, match=r"jaw \(channel 11\).*has the board 12 channels"):
        HobbyBoardBus(MaestroBoard(small.port, MaestroParams()), (*SETUPS, far)).open()


@pytest.mark.parametrize(
    "setup",
    [
        SETUPS[0]._replace(id=12),
        SETUPS[0]._replace(min_steps=255),
        SETUPS[0]._replace(max_steps=16_321),
        SETUPS[0]._replace(min_steps=7000, max_steps=6000),
    ],
)
def test_setups_that_no_board_can_have(setup):
    with pytest.raises(ValueError, match=f"channel {setup.id}"):
        World(setups=(setup,))


# --- torque on


def test_limits_are_armed_before_the_goal():
    setup = SETUPS[0]._replace(max_accel_steps_s2=100_000.0)
    world = World(setups=(setup,), timing=BusTiming(stagger_s=0.0))
    world.bus.open()
    world.packets()
    world.bus.enable_torque()
    sent = b"".join(world.packets())
    speed, accel, goal = (
        sent.index(bytes.fromhex(text)) for text in ("87 00 78 00", "89 00 50 00", "84 00 54 2F")
    )
    assert speed < accel < goal


def test_channels_without_pulses_go_to_their_rest_one_after_another(world):
    assert world.bus.enable_torque() == (6100, 6000, 7600)
    assert world.positions(IDS) == [6100, 6000, 7600]
    assert world.now_s >= 0.2
    said = " ".join(world.bus.events())
    assert "report no positions" in said
    assert "eyes (channel 0), lid (channel 1), brow (channel 5) had no pulses" in said


def test_a_board_with_a_narrower_range_is_refused():
    world = World(servos=NARROW)
    world.bus.open()
    with pytest.raises(ServoMissing, match="brow.*sent to 1900 us and gets 1750 us.*widen"):
        world.bus.enable_torque()
    assert world.positions(IDS) == [0, 0, 0]


def test_a_running_script_is_stopped(world):
    world.board.is_script_running = True
    world.bus.open()
    assert not world.board.is_script_running


# --- errors and restarts


def test_after_a_restart_channels_are_armed_one_by_one_before_any_goal(held):
    held.run(0.5, GOALS)
    held.do("brown-out")
    held.packets()
    on, rearmed = [], 0
    for _ in range(60):
        (feedback,) = held.run(TICK_S, GOALS)
        on.append(sum(pulse > 0 for pulse in held.positions(IDS)))
        assert (len(feedback.missing) == 3) == (on[-1] < 3)
        for i in (i for i, again in enumerate(feedback.rearmed) if again):
            rearmed += 1
            assert feedback.position_steps[i] == pytest.approx(GOALS[i], abs=1)
    assert [n for n in on if n][:3] == [1, 2, 3] and rearmed == 3
    sent = b"".join(held.packets())
    for channel in IDS:
        armed = sent.index(bytes((0x87, channel, 120, 0)))
        assert armed < sent.index(bytes((0x84, channel)))
    assert "the board restarted: set up again" in held.bus.events()


def test_an_error_that_sends_all_home_is_named_and_healed(held):
    held.run(0.5, GOALS)
    held.ask("55")  # a data byte instead of a command
    assert held.positions(IDS) == [0, 0, 0]
    assert any(any(feedback.rearmed) for feedback in held.run(0.3, GOALS))
    assert held.positions(IDS) == [*GOALS]
    said = " ".join(held.bus.events())
    assert "sent home by an error (serial protocol error)" in said
    assert held.bus.faults() == ()


@pytest.mark.parametrize(
    ("command", "named"), [("brown-out", "restarted"), ("error 3", "error .serial CRC error.")]
)
def test_a_board_that_loses_its_pulses_again_soon_stays_without(held, command, named):
    for _ in range(2):
        held.do(command)
        feedback = held.run(1.0, GOALS)[-1]
    assert held.positions(IDS) == [0, 0, 0] and not any(feedback.torque)
    for fault in feedback.fault:
        assert re.search(
            f"{named}, for the second time in 1.. s: check its power and the cable", fault
        )
    assert len(held.bus.faults()) >= 3
    held.packets()
    held.bus.write([5000] * 3)
    assert held.packets() == []
    assert held.bus.enable_torque() == GOALS
    assert held.run(0.1, GOALS)[-1].fault == ("", "", "")


def test_a_channel_that_ends_at_the_boards_own_range_is_named_and_all_stop():
    narrow = [HobbySpec(5, max_steps=6200)]
    held = World(servos=narrow).held(5000, 6000, 6200)
    assert held.run(4.0, [7600, 6000, 7600])[-1].torque == (False,) * 3
    assert held.positions(IDS) == [0, 0, 0]
    for fault in held.bus.faults():
        assert re.search(
            r"brow \(channel 5\) is sent to .* gets 1550 us.*: .* widen its range", fault
        )


def test_a_channel_that_cannot_be_enabled_again_is_named(held):
    held.do("brown-out")
    held.do("lose-writes 100000")
    feedback = held.run(5.0, GOALS)[-1]
    assert feedback.missing == () and not any(feedback.torque)
    assert all("has no pulses: set its channel to Servo" in fault for fault in feedback.fault)


def test_a_channel_whose_answers_are_damaged_is_not_held_by_a_guess(held):
    held.run(0.5, GOALS)
    held.do("error 6")
    held.do("corrupt 1 9 for 1")
    assert held.run(0.9, GOALS)[-1].missing == (0, 1, 2)
    assert held.positions(IDS)[::2] == [GOALS[0], GOALS[2]]
    feedback = held.run(1.0, GOALS)[-1]
    assert feedback.missing == () and all(feedback.torque)


# --- the line


class ScriptedPort(StandIn):
    """A port whose answers are a list of byte strings; a late one arrives while draining."""

    port_name = "scripted"

    def __init__(self, *answers, late=b""):
        self.answers, self.late, self.sent = list(answers), late, []

    def now_s(self):
        return 0.0

    def read_until(self, length, deadline_s):
        came = self.answers.pop(0) if self.answers else b""
        if came is None:
            self.answers.insert(0, self.late)  # it is still in transit
            return b""
        return came

    def write(self, request):
        self.sent.append(request)

    def drain(self, quiet_s=0.003):
        if quiet_s:
            self.answers = [answer for answer in self.answers if answer is not self.late]
        return 0


PULSE = b"\x70\x17"


@pytest.mark.parametrize(
    ("answers", "late", "error"),
    [([None], b"\xff\x00", "timeout"), ([b"\xff\xff"], b"", "damaged")],
    ids=["an answer after its time is not the next one's", "not a pulse"],
)
def test_what_is_not_a_pulse_for_sure_is_not_taken(answers, late, error):
    board = MaestroBoard(ScriptedPort(*answers, PULSE, late=late), MaestroParams())
    assert board.read_pulses((0,)) is None
    assert board.errors == {error: 1}
    assert board.read_pulses((0,)) == (6000,)


def test_servos_are_held_at_pulses_that_were_read_twice_alike():
    port = ScriptedPort(PULSE, b"\x70\x1b", PULSE, PULSE)
    assert MaestroBoard(port, MaestroParams()).read_all(SETUPS[:1]) == (6000,)


def test_a_pulse_in_the_place_of_the_error_register_is_damage():
    board = MaestroBoard(ScriptedPort(PULSE * 2), MaestroParams())
    assert board.read_status(0) is None


# --- search


def test_a_search_finds_pulses_and_errors_and_moves_nothing():
    world = World()
    world.do("error 4")
    world.ask(target(0, 6000) + target(4, 5000))
    found = present(probe(world.port, MaestroParams()))
    assert found == (False, ("serial protocol error",), (6000, 0, 0, 0, 5000, 0))
    assert present(probe(world.port, MaestroParams())).errors == ()
    assert world.positions(range(5)) == [6000, 0, 0, 0, 5000]
    world.do("lose all")
    assert probe(world.port, MaestroParams()) is None


@pytest.mark.parametrize("wanted", [False, True])
@pytest.mark.parametrize("real", [False, True])
def test_a_search_finds_out_the_check_byte(wanted, real):
    found = probe(World(crc=real).port, MaestroParams(crc=wanted))
    assert present(found).expects_crc is real
