"""PCA9685 boards through the driver: over the kernel's bus, over a bridge, and what goes wrong."""

import errno

import pytest
from board_rig import SECTION, on_pca9685
from command_line import typed
from pca9685_world import BOARD, GRAIN, QUICK, SPEED_STEPS_S, World, setup
from smbus2 import i2c_msg

from gazerig.drivers.bus.timing import TIMING
from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.errors import BusLost, PortError, ServoMissing
from gazerig.drivers.hobby_board.release import stop_pulses
from gazerig.drivers.i2c import port as i2c_port
from gazerig.drivers.i2c.bridge import READ_STATUS, I2cMessage, commands, read, write
from gazerig.drivers.i2c.port import I2cPort
from gazerig.drivers.pca9685.board import Pca9685Board, Pca9685Bus, Pca9685Params
from gazerig.drivers.pca9685.probe import probe
from gazerig.drivers.pca9685.registers import (
    AWAKE,
    MODE1,
    PRESCALE,
    counts_of,
    prescale_of,
    pulse_registers,
)
from gazerig.drivers.serial.list_ports import check_owner, open_failure_text
from gazerig.drivers.serial.port import BlockingPort, port_at_path
from gazerig.drivers.servo_bus.torque import disable_torque
from gazerig.sim_mock.pca9685.smbus import EmulatedSMBus


@pytest.fixture
def world():
    return World()


# --- bytes


def test_transfers_are_commands_of_the_bridge_and_come_back_as_they_were():
    text = write(0x40, 6, b"\1\2") + READ_STATUS + read(0x41, 0xFE, 1)
    assert text.hex(" ") == "53 80 03 06 01 02 50 52 0a 50 53 82 01 fe 53 83 01 50"
    assert list(commands(text)) == [
        (I2cMessage(0x40, b"\6\1\2"),),
        (),
        (I2cMessage(0x41, b"\xfe"), I2cMessage(0x41, b"", 1)),
    ]
    with pytest.raises(ValueError, match="no whole command"):
        list(commands(text[:-1]))


def test_pulses_are_registers_and_back():
    assert all(counts_of(pulse_registers(counts)) == counts for counts in range(4096))
    assert pulse_registers(0)[3] == 0x10
    assert [prescale_of(f, 25e6) for f in (50.0, 60.0, 200.0, 1526.0, 9e9)] == [121, 101, 30, 3, 3]


# --- setting up


def test_open_changes_nothing_and_engage_sets_up_and_goes_to_the_rest(world):
    before = bytes(world.chip()._registers)
    world.bus.open()
    assert bytes(world.chip()._registers) == before
    goals = world.bus.enable_torque()
    assert goals == (6000, 6000, 6000)
    assert world.chip().read(0) == b""
    assert world.chip()._registers[MODE1] == AWAKE
    assert world.chip()._registers[PRESCALE] == 121
    assert all(abs(width - 6000) <= GRAIN / 2 for width in world.widths())
    assert sum(world.device.body.width_steps(k, world.now[0]) > 0 for k in range(16)) == 3
    assert any("had no pulses" in line for line in world.bus.events())


def test_pulses_that_are_there_go_on_and_nothing_sleeps(world):
    world.held().run(0.5, [5000, 6800, 6000])
    places = world.places()
    again = Pca9685Bus(world.port, world.setups, BOARD, QUICK)
    world.sent.clear()
    again.open()
    goals = again.enable_torque()
    assert [abs(g - w) <= GRAIN for g, w in zip(goals, (5000, 6800, 6000), strict=True)]
    asleep = write(0x40, MODE1, b"\x30")
    assert not any(asleep in packet for packet in world.sent)
    world.now[0] += 0.3
    assert world.places() == pytest.approx(places, abs=1.0)


def test_first_pulses_come_one_after_another():
    world = World(timing=TIMING)
    world.bus.open()
    began_s = world.now[0]
    world.bus.enable_torque()
    assert world.now[0] - began_s == pytest.approx(0.2, abs=0.02)


def test_a_measured_oscillator_makes_true_pulses():
    for believed_hz, room in ((26.4e6, 0.003), (25e6, 0.08)):
        params = Pca9685Params(oscillator_hz=believed_hz)
        world = World(params=params, oscillator_hz=26.4e6).held()
        world.run(0.8, [6000, 7200, 5000])
        for width, goal in zip(world.widths(), (6000, 7200, 5000), strict=True):
            assert width == pytest.approx(goal, rel=room, abs=GRAIN)
    assert world.widths()[0] < 0.96 * 6000


def test_two_boards_are_one_bus():
    params = Pca9685Params(further_addresses=(0x43,))
    world = World((2, 17), params, (0x40, 0x43)).held()
    world.run(1.0, [5000, 7000])
    assert world.widths() == pytest.approx([5000, 7000], abs=GRAIN / 2)
    assert world.chip(0x43).counts(1) and not world.chip(0x43).counts(2)
    world.bus.disable_torque()
    assert world.widths() == [0, 0]


def test_a_scan_finds_the_boards_and_no_other_chip():
    world = World((2, 17), Pca9685Params(further_addresses=(0x43,)), (0x40, 0x43))
    before = [bytes(chip._registers) for chip in world.device.body.chips.values()]
    assert probe(world.port, BOARD) == (0x40, 0x43)
    assert [bytes(chip._registers) for chip in world.device.body.chips.values()] == before
    world.command("foreign on")
    assert probe(world.port, BOARD) == ()
    world.command("stuck on")
    assert probe(world.port, BOARD) == ()
    assert world.bus.health().errors == {}


# --- moving


def test_a_goal_far_away_is_a_way_at_the_joints_speed(world):
    world.held()
    before = world.widths()[0]
    for _ in range(30):
        world.bus.read(world.now[0])
        world.bus.write([7600, 6000, 6000])
        width = world.widths()[0]
        assert width - before <= SPEED_STEPS_S * 0.01 + GRAIN
        before, world.now[0] = width, world.now[0] + 0.01
    assert before > 6000 + 0.9 * SPEED_STEPS_S * 0.28


def test_after_a_pause_nothing_leaps(world):
    world.held().run(0.1, [7600, 6000, 6000])
    before = world.widths()[0]
    world.now[0] += 2.0
    world.bus.read(world.now[0])
    assert 0 <= world.widths()[0] - before <= SPEED_STEPS_S * 0.05 + GRAIN


def test_a_joint_outside_its_limits_comes_inside_slowly():
    world = World(ids=(0,), min_steps=3000, max_steps=9000).held()
    world.run(1.0, [8400])
    narrow = Pca9685Bus(world.port, [setup(0)], BOARD, QUICK)
    narrow.open()
    assert narrow.enable_torque() == (7600,)
    world.bus, before = narrow, world.widths()[0]
    assert before == pytest.approx(8400, abs=GRAIN)
    readings = world.run(0.2, [7600])
    assert readings[0].rearmed
    # 30 deg/s of a shaft that turns 90 deg in 4000 steps
    assert before - world.widths()[0] == pytest.approx(1333 * 0.2, abs=2 * GRAIN)
    world.run(1.0, [7600])
    assert world.widths()[0] <= 7600


# --- what goes wrong


def test_a_brown_out_is_seen_and_set_up_anew_one_after_another(world):
    world.held().run(0.3, [5000, 6500, 7000])
    world.command("brown-out")
    on, seen = [], []
    for _ in range(30):
        readings = world.run(0.01, [5000, 6500, 7000])
        seen.append(sum(r is None for r in readings))
        on.append(sum(width > 0 for width in world.widths()))
    assert on[-1] == 3 and {1, 2} <= set(on) and max(seen) >= 2
    assert "the board restarted: set up again" in world.bus.events()
    assert world.chip()._registers[PRESCALE] == 121
    assert world.places() == pytest.approx([5000, 6500, 7000], abs=2 * GRAIN)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda bus: bus.write_byte_data(0x40, MODE1, 0x01),
        lambda bus: bus.write_byte_data(0x70, MODE1, 0x11),
        lambda bus: (bus.write_byte_data(0x40, MODE1, 0x30), bus.write_byte_data(0x40, 0xFE, 40),
                     bus.write_byte_data(0x40, MODE1, 0x20)),
        lambda bus: bus.i2c_rdwr(i2c_msg.write(0, [6])),
    ],
    ids=["mode", "all call does not reach it", "prescaler", "software reset"],
)  # fmt: skip
def test_what_another_program_changes_is_set_right(world, spoil):
    world.held().run(0.3, [6000, 6000, 6000])
    try:
        spoil(EmulatedSMBus(world.device.body))
    except OSError as error:
        assert error.errno == errno.EREMOTEIO
    world.run(0.5, [6000, 6000, 6000])
    assert (world.chip()._registers[MODE1], world.chip()._registers[PRESCALE]) == (AWAKE, 121)
    assert world.widths() == pytest.approx([6000] * 3, abs=GRAIN / 2)


@pytest.mark.parametrize(
    ("command", "reported"),
    [
        ("absent on", "no PCA9685 answers at 0x40: does the board have its logic supply"),
        ("stuck on", "the I2C bus is stuck"),
        ("foreign on", "the chip at 0x40 is not a PCA9685"),
        ("lose all", "no answer as an I2C bus"),
    ],
)
def test_what_cannot_be_used_is_named_and_nothing_moves(world, command, reported):
    world.command(command)
    before = bytes(world.chip()._registers)
    with pytest.raises(ServoMissing, match=reported) as caught:
        world.bus.open()
    assert "\n" not in str(caught.value) and str(caught.value).startswith("emulated: ")
    assert bytes(world.chip()._registers) == before
    world.command("clear")
    world.held()


def test_a_board_set_to_an_external_clock_on_the_way_is_reset_and_held_where_it_was(world):
    world.held().run(0.5, [5000] * 3)
    bus = EmulatedSMBus(world.device.body)
    bus.write_byte_data(0x40, MODE1, 0x30)
    bus.write_byte_data(0x40, MODE1, 0x70)
    places = world.places()
    assert not any(world.widths())
    assert list(world.run(0.01, [5000] * 3))[1:] == [None] * 2
    reported = world.run(0.1, [5000] * 3)
    assert all(one is not None and one.torque for one in reported)
    assert world.places() == pytest.approx(places, abs=GRAIN)
    assert world.widths() == pytest.approx([5000] * 3, abs=GRAIN)
    assert [text for text in world.bus.events() if "external clock" in text][1:] == [
        "the board was sent home by an error (it was set to an external clock, so it was reset): "
        "set up again"
    ]


def test_only_own_channels_stop_unless_they_do_not(world):
    world.held()
    other = EmulatedSMBus(world.device.body)
    other.i2c_rdwr(i2c_msg.write(0x40, [6 + 4 * 9, *pulse_registers(300)]))
    world.bus.disable_torque()
    assert world.widths() == [0, 0, 0]
    assert world.chip().counts(9) == 300
    world.bus.enable_torque()
    world.command("lose-writes 6")
    world.bus.disable_torque()
    assert not any(world.chip().counts(k) for k in range(16))


def test_a_guardian_stops_pulses_whatever_the_board_was_set_to(world):
    world.held()
    bus = EmulatedSMBus(world.device.body)
    bus.write_byte_data(0x40, MODE1, 0x01)

    def left() -> tuple[int, ...]:
        board = Pca9685Board(world.port, BOARD)
        return stop_pulses(world.port, BOARD.baud, board, (0, 1, 5))

    assert left() == ()
    assert world.widths() == [0, 0, 0]
    world.command("absent on")
    assert left() == (0, 1, 5)


def test_a_guardian_names_a_rate_that_would_work(world, monkeypatch):
    monkeypatch.setattr(world.port, "setBaudRate", lambda baud: False)
    with pytest.raises(PortError, match=r"cannot run at 9 bit/s: choose 115200"):
        stop_pulses(world.port, 9, Pca9685Board(world.port, BOARD), (0,))
    with pytest.raises(PortError, match=r"cannot run at 9 bit/s: choose 57600 or 1000000"):
        disable_torque(world.port, DYNAMIXEL, 9, (1,))


# --- params


def test_two_boards_with_one_address_are_refused():
    with pytest.raises(ValueError, match="two boards have the same address"):
        Pca9685Params(further_addresses=(0x40,))


def test_channels_and_pulses_outside_the_board_are_refused(world):
    for wrong, reported in (
        (setup(16), "the board has channels 0 to 15"),
        (setup(0, min_steps=1000), "within 500..2500 us"),
    ):
        with pytest.raises(ValueError, match=reported):
            Pca9685Bus(world.port, [wrong], BOARD)
    with pytest.raises(ValueError, match="each can move one servo only"):
        Pca9685Bus(world.port, [setup(0), setup(0)], BOARD)


# --- the kernel's bus


class Kernel:
    """A bus of the kernel: opened by its path, and the kernel's errors."""

    def __init__(self, world):
        self.bus, self.refuses = EmulatedSMBus(world.device.body), None

    def open(self, path):
        if self.refuses is not None:
            raise OSError(self.refuses, "refused")
        self.bus.gone = False
        return self.bus


@pytest.fixture
def kernel(world, monkeypatch):
    made = Kernel(world)
    port = I2cPort("/dev/i2c-7", open_bus=made.open)
    clock = type("Clock", (), {"monotonic": lambda: world.now[0], "sleep": lambda seconds: None})
    monkeypatch.setattr(i2c_port, "time", clock)
    made.servos = Pca9685Bus(port, world.setups, BOARD, QUICK._replace(give_up_s=2.0))  # type: ignore[attr-defined]
    return made


def ticks(world, bus, seconds, goals=None):
    world.bus = bus
    return world.run(seconds, goals)


def test_the_kernels_bus_is_driven_as_a_bridge_is(world, kernel):
    bus = kernel.servos
    bus.open()
    # Its oscillator's start is waited for by the clock of this world.
    world.now[0] += 0.01
    bus.enable_torque()
    world.now[0] += 0.01
    ticks(world, bus, 0.6, [5000, 6500, 7000])
    assert world.widths() == pytest.approx([5000, 6500, 7000], abs=GRAIN / 2)
    assert bus.health().errors == {}
    bus.disable_torque()
    assert world.widths() == [0, 0, 0]
    bus.close()


def test_an_adapter_that_goes_comes_back_and_holds(world, kernel):
    bus = kernel.servos
    bus.open()
    bus.enable_torque()
    ticks(world, bus, 0.3, [6500] * 3)
    kernel.bus.gone, kernel.refuses = True, errno.ENOENT
    assert ticks(world, bus, 0.3, [6500] * 3) == (None,) * 3
    kernel.refuses = None
    readings = ticks(world, bus, 1.0, [6500] * 3)
    assert all(r is not None and r.torque for r in readings)
    reported = " ".join(bus.events())
    assert "port lost: /dev/i2c-7 is gone" in reported and "port back after" in reported
    kernel.bus.gone, kernel.refuses = True, errno.ENOENT
    with pytest.raises(BusLost, match="has been gone for 2"):
        ticks(world, bus, 3.0)


@pytest.mark.parametrize(
    ("code", "reported"),
    [
        (errno.ENOENT, "no I2C bus /dev/i2c-7: switch I2C on"),
        (errno.EACCES, "'sudo usermod -aG i2c [$]USER'"),
        (errno.EBUSY, "is busy: close the other program"),
        (errno.ENOTTY, "is not an I2C bus"),
    ],
)
def test_a_bus_that_cannot_be_opened_is_named_with_its_cure(kernel, code, reported):
    kernel.refuses = code
    with pytest.raises(PortError, match=reported) as caught:
        kernel.servos.open()
    assert "\n" not in str(caught.value)


def test_a_path_says_what_kind_of_port_it_is(tmp_path):
    assert isinstance(port_at_path("/dev/i2c-1"), I2cPort)
    assert isinstance(port_at_path("/dev/ttyUSB0"), BlockingPort)
    link = tmp_path / "servos"
    link.symlink_to("/dev/i2c-3")
    assert isinstance(port_at_path(str(link)), I2cPort)
    assert "no I2C bus" in open_failure_text("/dev/i2c-99", errno.ENOENT)


def test_a_maestros_yaml_on_an_i2c_bus_is_refused():
    for kind in ("maestro", "dynamixel"):
        with pytest.raises(PortError, match="is an I2C bus, not a serial port.*pca9685"):
            check_owner("/dev/i2c-1", kind, ())
    check_owner("/dev/i2c-1", "pca9685", ())


# --- the same head on either board


@pytest.mark.parametrize("words", [("run", "--no-page", "--scene", "visitor"), ("doctor",)])
def test_a_rig_without_its_i2c_bus_is_told_to_switch_it_on(words, tmp_path, capfd):
    file = on_pca9685(tmp_path, SECTION.replace("i2c-1", "i2c-97"))
    verb, *rest = words
    assert typed(verb, file, *rest) in (1, 2)
    out, err = capfd.readouterr()
    assert "I2C bus" in out + err and "switch I2C on" in out + err
    assert "serial port" not in out + err and "adaptor" not in out + err
