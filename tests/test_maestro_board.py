"""The emulated Maestro against the numbers of its user's guide, byte by byte."""

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gazerig.drivers.errors import BusLost
from gazerig.sim_mock.hobby_servo import HobbySpec
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.maestro.board import SIZES, build_board
from gazerig.sim_mock.maestro.channel import EmulatedChannel, brakes_within
from gazerig.sim_mock.maestro.commands import ERRORS, crc7
from gazerig.sim_mock.maestro.faults import COMMANDS

PROTOCOL = 1 << ERRORS.index("protocol")
TIMEOUT = 1 << ERRORS.index("timeout")


def words(*numbers):
    return b"".join(bytes((n & 0x7F, n >> 7)) for n in numbers)


def target(channel, steps):
    return bytes((0x84, channel)) + words(steps)


def speed(channel, limit):
    return bytes((0x87, channel)) + words(limit)


def acceleration(channel, limit):
    return bytes((0x89, channel)) + words(limit)


def check(packet):
    return packet + bytes((crc7(packet),))


class World:
    """A board and its clock."""

    def __init__(self, channels=12, **options):
        self.now_s = 0.0
        self.board = build_board(channels, lambda: self.now_s, **options)

    def ask(self, data, baud=None):
        return self.board.receive(bytes.fromhex(data) if isinstance(data, str) else data, baud)

    def after(self, seconds):
        self.now_s += seconds
        return self

    def position(self, channel=0):
        return int.from_bytes(self.ask(bytes((0x90, channel))), "little")

    def positions(self):
        return [self.position(c) for c in range(len(self.board.body.channels))]

    def errors(self):
        return int.from_bytes(self.ask("A1"), "little")

    def do(self, text):
        return self.board.faults.command(text)


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


# --- motion


def test_without_limits_a_target_counts_at_once(world):
    world.ask(target(0, 4400))
    world.ask(target(0, 7600))
    assert world.position() == 7600
    assert world.ask("93") == b"\x00"


def test_the_speed_of_the_guide_takes_100_ms_from_1000_to_1350_us(world):
    world.ask(target(5, 4000))
    world.ask("87 05 0C 01")
    world.ask(target(5, 5400))
    for period in range(1, 12):
        expected = min(4000 + 140 * period, 5400)
        assert world.after(0.01).position(5) == expected
        assert world.ask("93") == bytes((expected != 5400,))


def test_speed_140_takes_1_ms_of_pulse_in_286_ms(world):
    world.ask(target(0, 4000) + speed(0, 140) + target(0, 8000))
    assert world.after(0.28).position() < 8000
    assert world.after(0.01).position() == 8000


def test_the_slowest_speed_takes_40_s_from_1_to_2_ms(world):
    world.ask(target(0, 4000) + speed(0, 1) + target(0, 8000))
    assert world.after(39.99).position() == 7999
    assert world.after(0.01).position() == 8000


def test_acceleration_1_takes_somewhat_over_3_s_from_1_to_2_ms(world):
    """The guide says about 3 s; at rest on both ends it is 2 sqrt(4000 * 8) periods."""
    world.ask(target(0, 4000) + acceleration(0, 1) + target(0, 8000))
    assert world.after(3.5).position() < 8000
    assert world.after(0.1).position() == 8000


def test_acceleration_4_is_1250_us_a_second_every_second(world):
    world.ask(target(0, 4000) + acceleration(0, 4) + target(0, 8000))
    places = [world.after(0.08).position() for _ in range(6)]
    # 4 quarter us per 10 ms more every 80 ms: half of that times 8 periods, then 1, 3, 5 ...
    growth = [b - a for a, b in zip([4000, *places], places, strict=False)]
    assert [b - a for a, b in zip(growth, growth[1:], strict=False)] == [32] * 5


def test_with_both_limits_it_is_a_trapezoid_that_ends_on_the_target(world):
    world.ask(target(0, 4000) + speed(0, 40) + acceleration(0, 16) + target(0, 6000))
    places = [4000] + [world.after(0.01).position() for _ in range(100)]
    rates = [b - a for a, b in zip(places, places[1:], strict=False)]
    assert rates[:5] == [2, 4, 6, 8, 10]
    assert max(rates) == 40
    assert places[-1] == 6000
    assert all(abs(b - a) <= 3 for a, b in zip(rates, rates[1:], strict=False))
    assert rates.count(40) >= 28


def test_a_new_target_on_the_way_turns_without_a_jolt(world):
    world.ask(target(0, 4000) + speed(0, 60) + acceleration(0, 8) + target(0, 8000))
    before = world.after(0.5).position()
    world.ask(target(0, 4200))
    places = [before] + [world.after(0.01).position() for _ in range(400)]
    rates = [b - a for a, b in zip(places, places[1:], strict=False)]
    assert max(places) > before + 100
    assert all(abs(b - a) <= 2 for a, b in zip(rates, rates[1:], strict=False))
    assert places[-1] == 4200


def test_the_first_target_after_silence_ignores_the_limits(world):
    world.ask(speed(0, 1) + acceleration(0, 1) + target(0, 8000))
    assert world.position() == 8000
    assert world.ask("93") == b"\x00"
    world.ask(target(0, 0) + target(0, 4000))
    assert world.position() == 4000


def test_only_limited_channels_count_as_moving(world):
    world.ask(target(0, 4000) + target(1, 4000) + speed(1, 5) + target(0, 8000))
    assert world.ask("93") == b"\x00"
    world.ask(target(1, 4010))
    assert world.ask("93") == b"\x01"
    assert world.after(0.02).ask("93") == b"\x00"


def test_targets_are_clipped_to_what_the_channel_is_set_to(world):
    world.ask(target(0, 16_383) + target(1, 4))
    assert world.positions()[:2] == [8000, 3968]
    world.do("set max-us 2500")
    world.ask(target(0, 16_383))
    assert world.position() == 10_000
    own = World(servos=[HobbySpec(2, min_steps=5000, max_steps=7000)])
    own.ask(target(2, 8000))
    assert own.position(2) == 7000


@given(st.integers(0, 20_000), st.integers(1, 255))
def test_the_largest_first_step_is_the_largest(way, limit):
    def stops_within(first):
        steps = first // limit
        return first * (steps + 1) - limit * steps * (steps + 1) // 2 <= way

    first = brakes_within(way, limit)
    assert stops_within(first)
    assert not stops_within(first + 1)


_ORDERS = st.one_of(
    st.tuples(st.just("aim"), st.integers(0, 16_383)),
    st.tuples(st.just("limit_speed"), st.integers(0, 400)),
    st.tuples(st.just("limit_acceleration"), st.integers(0, 255)),
    st.tuples(st.just("step"), st.integers(1, 60)),
)


@given(st.lists(_ORDERS, max_size=25))
def test_a_channel_keeps_its_limits_and_always_arrives(orders):
    channel = EmulatedChannel(3968, 8000)
    for order, number in orders:
        if order != "step":
            getattr(channel, order)(number)
        for _ in range(number if order == "step" else 0):
            before = channel.position
            channel.step()
            # A speed limit that was lowered on the way is reached at the acceleration.
            if channel.speed and not channel.acceleration:
                assert abs(channel.position - before) <= channel.speed
        assert channel.position == 0 or 3968 <= channel.position <= 8000
    channel.limit_speed(0)
    for _ in range(800):
        channel.step()
    assert channel.position == channel.target
    assert not channel.moving


# --- servos, time


def test_servos_follow_the_pulses(world):
    assert world.board.positions_steps() == (6000.0,) * 12
    world.ask(target(0, 8000) + target(1, 4000))
    places = world.after(0.5).board.positions_steps()
    assert places[0] == pytest.approx(8000, abs=20)
    assert places[1] == pytest.approx(4000, abs=20)
    assert places[2:] == (6000.0,) * 10


def test_a_servo_jumps_at_the_first_pulse_at_its_own_speed(world):
    world.ask(speed(0, 1) + target(0, 8000))
    world.after(0.06)
    assert world.board.positions_steps()[0] >= 6000 + 22_000 * 0.04


def test_a_pulse_comes_every_20_ms(world):
    world.ask(target(0, 4000) + speed(0, 10) + target(0, 6000))
    widths = []
    for _ in range(6):
        world.after(0.01).position()
        widths.append(world.board.body.servos[0].width_steps)
    assert widths == [0, 4020, 4020, 4040, 4040, 4060]


@given(st.lists(st.integers(1, 180), min_size=1, max_size=30))
@settings(max_examples=30)
def test_how_often_it_is_looked_at_changes_nothing(naps_ms):
    often, once = World(), World()
    orders = target(0, 4000) + speed(0, 30) + acceleration(0, 9) + target(0, 7000)
    for world in (often, once):
        world.ask(orders)
    for nap_ms in naps_ms:
        often.now_s += nap_ms / 1000.0
        assert often.position() >= 4000
    once.now_s = often.now_s
    assert once.position() == often.position()
    assert once.board.positions_steps() == often.board.positions_steps()


def test_a_day_of_silence_costs_no_work(world):
    world.ask(target(0, 7000))
    world.do("stick 1")
    world.ask(target(1, 7000))
    world.after(86_400.0)
    steps = 0
    for servo in world.board.body.servos:
        counted = servo.step

        def step(counted=counted):
            nonlocal steps
            steps += 1
            counted()

        servo.step = step
    assert world.position() == 7000
    assert steps < 12 * 200


# --- who hears


def test_a_mute_port_says_nothing(world):
    world.do("set mode mute")
    assert world.ask("AA A1") == b""
    assert not world.board.hears(9600)
    world.do("set mode usb-chained")
    assert world.ask("A1") == bytes(2)


def test_serial_pins_that_detect_the_rate_wait_for_its_sign():
    world = World()
    world.do("set mode uart-detect")
    assert world.board.heed_baud
    assert world.ask("A1", 115_200) == b""
    (reply,) = world.board.exchange(bytes.fromhex("84 00 AA A1"), 115_200)
    assert (reply.end, reply.pieces[0].data) == (4, bytes(2))
    assert world.ask("A1", 9600) == b""
    assert world.ask("A1", 115_200) == bytes((1, 0))
    world.do("brown-out")
    assert world.after(0.2).ask("A1", 9600) == b""
    assert world.ask("AA A1", 9600) == bytes(2)


def test_serial_pins_with_a_rate_of_their_own():
    world = World(baud=57_600)
    assert world.board.hears(57_600) and not world.board.hears(9600)
    world.ask(target(0, 6000), 57_600)
    assert world.ask("90 00", 57_600) == b"\x70\x17"
    assert world.ask("A1", 9600) == b""
    assert world.ask("90 00", 57_600) == bytes(2)
    assert world.ask("A1", 57_600) == bytes((1, 0))


# --- faults


def test_a_brown_out_is_deafness_then_a_board_as_switched_on(world):
    world.ask(target(0, 7000) + speed(0, 5) + acceleration(0, 3) + b"\x00")
    world.ask(target(0, 7000))
    world.after(1.0)
    world.do("brown-out")
    assert world.ask("A1") == b""
    assert world.after(0.1).errors() == 0
    assert world.positions() == [0] * 12
    world.ask(target(0, 7000) + target(0, 4000))
    assert world.position() == 4000
    report = json.loads(world.do("status"))["servos"][0]
    assert (report["speed"], report["acceleration"]) == (0, 0)


def test_after_a_brown_out_channels_may_be_set_to_go_home(world):
    world.do("set startup home")
    world.do("brown-out")
    assert world.after(0.05).board.body.channels[0].position == 0
    assert world.after(0.05).positions() == [6000] * 12


@pytest.mark.parametrize("name", ERRORS)
def test_errors_at_will(world, name):
    world.ask(target(0, 6000))
    world.do(f"error {name}")
    assert world.errors() == 1 << ERRORS.index(name)
    assert world.position() == 0


def test_a_script_runs_and_swings_a_channel_against_the_host(world):
    assert world.ask("AE") == b"\x01"
    world.do("script 2")
    assert world.ask("AE") == b"\x00"
    seen = {world.after(0.5).position(2) for _ in range(8)}
    assert seen >= {3968, 8000}
    world.ask("A4")
    assert world.ask("AE") == b"\x01"
    world.ask(target(2, 6000))
    assert world.after(5.0).position(2) == 6000
    world.do("script on")
    assert (world.ask("AE"), world.after(3.0).position(2)) == (b"\x00", 6000)
    world.ask("A7 00")
    assert world.errors() == 1 << ERRORS.index("script-counter")
    assert world.ask("AE") == b"\x01"


def test_servos_without_their_supply_are_limp_and_the_board_notices_nothing(world):
    world.ask(target(0, 7000))
    world.after(1.0)
    world.do("power off")
    world.after(0.1).do("turn 0 -500")
    fallen = world.after(1.0).board.positions_steps()[0]
    assert fallen == pytest.approx(6490, abs=20)
    assert (world.position(), world.errors()) == (7000, 0)
    world.do("power on")
    assert world.after(1.0).board.positions_steps()[0] == pytest.approx(7000, abs=20)


def test_a_stuck_servo_shows_in_nothing_that_the_board_tells(world):
    world.do("stick 4")
    world.ask(target(4, 7600))
    world.after(1.0)
    assert world.position(4) == 7600
    report = json.loads(world.do("status"))["servos"][4]
    assert (report["place"], report["straining"]) == (6000.0, True)
    world.do("free all")
    assert world.after(1.0).board.positions_steps()[4] == pytest.approx(7600, abs=20)


def test_commands_and_bytes_are_lost_on_their_way(world):
    world.do("lose-writes 1")
    assert world.ask("A1") == bytes(2)
    world.ask(target(0, 6000))
    assert world.position() == 0
    world.ask(target(0, 6000))
    assert world.position() == 6000
    world.do("lose-bytes 1")
    world.ask(target(0, 6000))
    assert world.errors() == PROTOCOL
    assert not world.board.faults.wire.any


def test_answers_are_lost_spoilt_and_late_as_on_any_line(world):
    world.ask(target(3, 6000))
    world.do("lose 3 count 1")
    assert (world.ask("90 03"), world.ask("90 03")) == (b"", b"\x70\x17")
    world.do("drop all 0 count 1")
    assert world.ask("90 03") == b"\x17"
    world.do("corrupt 3 8 count 1")
    assert world.ask("90 02 90 03") == bytes((0, 0, 0x70, 0x16))
    world.do("noise before AA55 count 1")
    assert world.ask("A1") == b"\xaa\x55\x00\x00"
    world.do("delay 3 30 count 1")
    assert world.board.exchange(b"\x90\x03")[0].pieces[0].late_s == 0.03
    world.do("echo on")
    assert world.ask("A1") == b"\xa1\x00\x00"


def test_status_tells_channels_errors_and_faults(world):
    world.ask(target(0, 6000))
    world.do("set on-error ignore")
    world.do("error crc")
    world.do("lose all")
    told = json.loads(world.do("status"))
    assert (told["errors"], told["script"], told["faults"]) == (["crc"], False, ["lose all"])
    assert [servo["position"] for servo in told["servos"]] == [6000] + [0] * 11


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("lose 12", "no channel 12; there is 0 to 11"),
        ("lose x", "'x' is not a channel from 0 to 23"),
        ("error heat", "'heat' is none of signal, overrun"),
        ("overload 1", "'overload' is no command; there is lose"),
        ("script 99", "'99' is not a channel"),
        ("turn 1 far", "'far' is not quarter us"),
        ("set mode loud", "it can be usb-dual-port, usb-chained"),
        ("set crc maybe", "it can be on, off"),
        ("set timeout-ms -1", "not a number of milliseconds from 0"),
        ("set timeout-ms nan", "not a number of milliseconds from 0"),
        ("set home-us 20", "not a pulse width from 64 to 3280 us"),
        ("set min-us 2400", "min-us 2400 would be above max-us 2000"),
        ("set afterwards skip", "unknown; there is mode, crc, timeout-ms"),
    ],
)
def test_a_wrong_word_is_named_with_what_would_be_right(world, text, says):
    with pytest.raises(ValueError) as error:
        world.do(text)
    assert says in str(error.value)


def test_help_explains_every_command_and_case(world):
    text = world.do("help")
    assert all(COMMANDS.usage(name) in text for name in COMMANDS.verbs)
    assert all(f"  {case} " in text for case in COMMANDS.cases)


@pytest.mark.parametrize(
    ("channels", "options", "says"),
    [
        (8, {}, "8 channels: a Maestro has 6, 12, 18, 24"),
        (6, {"device": 128}, "0 to 127"),
        (6, {"servos": [HobbySpec(6)]}, "there is 0 to 5"),
        (6, {"servos": [(1,), (1,)]}, "two servos are on one channel"),
    ],
)
def test_boards_that_do_not_exist(channels, options, says):
    with pytest.raises(ValueError, match=says):
        build_board(channels, lambda: 0.0, **options)


# --- on a line


def test_behind_a_port_answers_take_their_time_on_the_wire():
    world = World(baud=9600)

    def sleep_until(t_s):
        world.now_s = t_s

    port = InProcessPort(world.board, sleep_until=sleep_until)
    slow = InProcessPort(world.board, sleep_until=sleep_until, wire_time=True)
    port.setBaudRate(9600)
    port.write(target(0, 6000) + b"\x90\x00")
    assert (port.read_until(2, 0.0), world.now_s) == (b"\x70\x17", 0.0)
    slow.setBaudRate(9600)
    slow.write(b"\x90\x00")
    assert slow.read_until(2, 1.0) == b"\x70\x17"
    assert world.now_s == pytest.approx(4 * 10 / 9600)


def test_an_unplugged_board_goes_on_as_it_was():
    world = World()
    port = InProcessPort(world.board)
    port.setBaudRate(9600)
    port.write(target(0, 6000))
    world.do("unplug for 1")
    with pytest.raises(BusLost):
        port.write(b"\xa1")
    world.after(1.0)
    port.setBaudRate(9600)
    port.write(b"\x90\x00")
    assert port.read_until(2, world.now_s) == b"\x70\x17"


# --- anything at all


@given(
    st.sampled_from(SIZES),
    st.booleans(),
    st.lists(st.tuples(st.binary(max_size=40), st.integers(0, 500)), max_size=12),
)
def test_no_bytes_break_it_and_no_pulse_leaves_its_limits(channels, crc, talk):
    twins = [World(channels, crc=crc) for _ in range(2)]
    for data, nap_ms in talk:
        answers = []
        for world in twins:
            answers.append(world.ask(data))
            world.now_s += nap_ms / 1000.0
            for channel in world.board.body.channels:
                assert channel.position == 0 or 3968 <= channel.position <= 8000
        assert answers[0] == answers[1]
    assert twins[0].board.positions_steps() == twins[1].board.positions_steps()


_WORDS = st.sampled_from([*COMMANDS.verbs, "0", "1", "-1", "on", "off", "all", "crc", "mode", "5"])


@given(st.lists(st.lists(_WORDS, min_size=1, max_size=4), max_size=6))
def test_no_mixture_of_commands_breaks_the_board(lines):
    world = World()
    for line in lines:
        try:
            world.do(" ".join(line))
        except ValueError as error:
            assert str(error)
        world.after(0.05).ask(target(0, 6000) + bytes.fromhex("90 00 A1"))
    for text in ("clear", "set crc off", "script off", "set timeout-ms 0"):
        world.do(text)
    world.after(1.0).ask("A1")
    world.ask(target(0, 6000))
    assert world.position() == 6000
