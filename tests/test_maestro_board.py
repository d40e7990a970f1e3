"""The emulated Maestro against the numbers of its user's guide, byte by byte."""

import pytest
from maestro_world import PROTOCOL, World, speed, target

from gazerig.sim_mock.maestro.commands import ERRORS, crc7

TIMEOUT = 1 << ERRORS.index("timeout")


def check(packet):
    return packet + bytes((crc7(packet),))


@pytest.fixture
def world():
    return World()


# --- bytes


@pytest.mark.parametrize(("packet", "check_byte"), [("8301", 0x17), ("8400702E", 0x2B)])
def test_the_crc_of_the_guide(packet, check_byte):
    assert crc7(bytes.fromhex(packet)) == check_byte


def test_set_target_and_get_position(world):
    assert world.ask("84 00 70 2E") == b""
    assert world.ask("90 00") == (6000).to_bytes(2, "little") == b"\x70\x17"
    # The answer is whole bytes, not seven bits each.
    world.ask(target(0, 4095))
    assert world.ask("90 00") == b"\xff\x0f"
    assert world.errors() == 0


def test_the_three_forms_say_the_same(world):
    world.ask("AA 0C 04 01 70 2E")
    world.ask("FF 02 7F")
    world.ask("84 03 70 2E")
    assert world.ask("AA 0C 10 01") == b"\x70\x17"
    assert world.positions() == [0, 6000, 6000, 6000] + [0] * 8


@pytest.mark.parametrize(("value", "us"), [(0, 1023.75), (127, 1500.0), (254, 1976.25)])
def test_mini_ssc_covers_its_range(world, value, us):
    world.ask(bytes((0xFF, 5, value)))
    assert world.position(5) == us * 4


def test_set_multiple_targets_as_in_the_guide(world):
    world.ask(target(3, 6000))
    world.ask("9F 02 03 00 00 70 2E")
    assert world.positions()[2:6] == [0, 0, 6000, 0]
    world.ask("AA 0C 1F 02 00 70 2E 70 2E")
    assert world.positions()[:2] == [6000, 6000]
    world.ask("9F 0C 00" + "70 2E" * 12)
    assert world.positions() == [6000] * 12
    assert world.errors() == 0
    world.ask("9F 02 0B 70 2E 70 2E")
    assert world.errors() == PROTOCOL


def test_a_micro_knows_neither_multiple_targets_nor_pwm():
    for command in ("9F 01 00 70 2E", "8A 00 10 00 20"):
        micro, mini = World(6), World(12)
        micro.ask(command)
        mini.ask(command)
        assert micro.errors() == PROTOCOL
        assert micro.position() == 0
        assert mini.errors() == 0


def test_another_devices_packets_are_let_pass(world):
    world.ask("AA 0D 04 00 70 2E")
    world.ask("AA 07 7E 01 02 03")
    assert world.position() == 0
    assert world.errors() == 0
    assert World(device=13).ask("AA 0D 21") == bytes(2)


def test_the_sign_of_the_baud_rate_is_no_error(world):
    assert world.ask("AA A1") == bytes(2)
    assert world.ask("AA AA 0C 21") == bytes(2)


def test_with_a_crc_only_checked_commands_count():
    world = World(crc=True)
    world.ask(check(target(0, 6000)))
    assert world.ask(check(b"\x90\x00")) == b"\x70\x17"
    assert world.ask(check(bytes.fromhex("AA0C1000"))) == b"\x70\x17"
    world.ask("FF 01 7F")
    assert world.ask(check(b"\x90\x01")) == b"\x70\x17"
    world.ask(target(0, 6100) + b"\x00")
    assert world.ask(check(b"\xa1")) == bytes((1 << ERRORS.index("crc"), 0))
    assert world.ask(check(b"\x90\x00")) == bytes(2)


def test_answers_say_where_their_command_ended(world):
    replies = world.board.exchange(bytes.fromhex("90 00 84 00 70 2E 90 00 93"))
    assert [reply.end for reply in replies] == [2, 8, 9]
    assert [reply.pieces[0].data.hex() for reply in replies] == ["0000", "7017", "00"]


def test_a_command_may_come_in_pieces(world):
    assert [world.ask(bytes((byte,))) for byte in bytes.fromhex("84 00 70 2E 90")] == [b""] * 5
    assert world.ask("00") == b"\x70\x17"


# --- errors


@pytest.mark.parametrize(
    "wrong",
    ["00", "84 00 70 90 00", "80", "84 0C 70 2E", "90 0C", "FF FF 63 7F", "AA 0C 7F", "9F 00 00"],
    ids=["data first", "cut short", "unknown", "no channel", "no channel asked", "cut SSC",
         "unknown in Pololu form", "none of the targets"],
)  # fmt: skip
def test_bytes_without_sense_are_protocol_errors_and_end_all_pulses(world, wrong):
    world.ask(target(3, 6000))
    world.ask(wrong)
    assert world.ask("A1") == bytes((PROTOCOL, 0))
    assert world.ask("A1") == bytes(2)
    assert world.positions() == [0] * 12


def test_after_an_error_targets_count_again(world):
    world.ask("00")
    world.ask(target(0, 6000))
    assert world.position() == 6000
    assert world.errors() == PROTOCOL


@pytest.mark.parametrize(("choice", "steps"), [("off", 0), ("home", 5600), ("ignore", 7000)])
def test_what_channels_do_on_an_error_and_when_sent_home(choice, steps):
    for cause in ("00", "A2"):
        world = World()
        world.do(f"set on-error {choice}")
        world.do("set home-us 1400")
        world.ask(target(0, 7000))
        world.ask(cause)
        assert world.position() == steps


def test_home_is_reached_at_the_speed_that_was_set(world):
    world.do("set on-error home")
    world.ask(target(0, 7000) + speed(0, 10) + b"\xa2")
    assert world.after(0.5).position() == 7000 - 50 * 10
    assert world.after(10.0).position() == 6000


def test_a_host_that_falls_silent_is_an_error_where_that_is_set(world):
    world.ask(target(0, 6000))
    assert world.after(1000.0).position() == 6000
    world.do("set timeout-ms 500")
    world.ask(target(0, 6000))
    assert world.after(0.49).position() == 6000
    assert world.after(0.49).position() == 6000
    assert world.after(0.5).position() == 0
    assert world.errors() == TIMEOUT
    # Bytes that are no command feed nothing.
    world.after(0.3).ask("00")
    world.after(0.3)
    assert world.errors() == PROTOCOL | TIMEOUT


def test_a_timeout_is_counted_once_until_the_host_speaks_again(world):
    world.do("set timeout-ms 100")
    world.after(5.0)
    assert world.errors() == TIMEOUT
    assert world.errors() == 0
    assert world.after(0.2).errors() == TIMEOUT
