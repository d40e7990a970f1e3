"""What is particular to PCA9685 boards: ramps, set-up, other programs, the kernel's bus."""

import errno

import pytest
from pca9685_world import BOARD, GRAIN, QUICK, SPEED_STEPS_S, SMBus, World, setup
from smbus2 import i2c_msg

from gazerig.drivers.errors import BusLost, PortError, ServoMissing
from gazerig.drivers.hobby_board.board import stop_pulses
from gazerig.drivers.hobby_board.bus import HobbyBoardBus
from gazerig.drivers.i2c import port as i2c_port
from gazerig.drivers.i2c.port import I2cPort, transfer_at
from gazerig.drivers.i2c.transfers import read, write
from gazerig.drivers.pca9685.board import (
    AWAKE,
    LED0,
    MODE1,
    MODE2,
    PRESCALE,
    Pca9685Board,
    Pca9685Params,
    counts_of,
    probe,
    pulse_registers,
)
from gazerig.drivers.serial.list_ports import open_failure_text
from gazerig.drivers.serial.port import BlockingPort, port_at_path

ASLEEP = 0x30


@pytest.fixture
def world():
    return World()


def poke(world, *data, address=0x40):
    """Write registers as another program would."""
    SMBus(world.device).i2c_rdwr(i2c_msg.write(address, data))


def bus_of(world, setups=None):
    return HobbyBoardBus(Pca9685Board(world.port, BOARD, QUICK), setups or world.setups)


# --- bytes


def test_transfers_are_commands_of_the_bridge_and_come_back_as_they_were():
    text = write(0x40, 6, b"\1\2") + read(0x41, 0xFE, 1)
    assert text.hex(" ") == "53 80 03 06 01 02 50 53 82 01 fe 53 83 01 50"
    end, (written,) = transfer_at(text, 0)
    assert (end, written.addr, bytes(written)) == (7, 0x40, b"\6\1\2")
    end, (register, asked) = transfer_at(text, end)
    assert (bytes(register), asked.addr, asked.len) == (b"\xfe", 0x41, 1)
    with pytest.raises(ValueError, match="no whole transfer"):
        transfer_at(text[:-1], 7)


def test_pulses_are_registers_and_back():
    assert all(counts_of(pulse_registers(counts)) == counts for counts in range(4096))
    assert pulse_registers(0)[3] == 0x10
    assert Pca9685Params(oscillator_hz=25e6).prescale == 121


def test_pulses_inside_the_limits_are_rounded_inside():
    for low in range(4400, 4440):
        world = World((0,), min_steps=low).held()
        world.run(1.0, [low])
        assert low <= world.widths()[0] <= low + GRAIN


# --- torque on


def test_open_changes_nothing_and_torque_on_sets_up_and_goes_to_the_rest(world):
    before = bytes(world.registers())
    world.bus.open()
    assert bytes(world.registers()) == before
    assert world.bus.enable_torque() == (6000, 6000, 6000)
    assert (world.registers()[MODE1], world.registers()[PRESCALE]) == (AWAKE, 121)
    assert world.widths() == pytest.approx([6000] * 3, abs=GRAIN / 2)
    assert sum(world.device.pulse_steps(k) > 0 for k in range(16)) == 3
    assert any("had no pulses" in line for line in world.bus.events())


def test_pulses_that_are_there_go_on_and_nothing_sleeps(world):
    world.held().run(0.5, [5000, 6800, 6000])
    places = world.places()
    again = bus_of(world)
    world.sent.clear()
    again.open()
    goals = again.enable_torque()
    assert goals == pytest.approx((5000, 6800, 6000), abs=GRAIN)
    asleep = write(0x40, MODE1, bytes((ASLEEP,)))
    assert not any(asleep in packet for packet in world.sent)
    world.now[0] += 0.3
    assert world.places() == pytest.approx(places, abs=1.0)


@pytest.mark.parametrize(("believed_hz", "room"), [(26.4e6, 0.003), (25e6, 0.08)])
def test_a_measured_oscillator_makes_true_pulses(believed_hz, room):
    world = World(params=Pca9685Params(oscillator_hz=believed_hz), oscillator_hz=26.4e6).held()
    world.run(0.8, [6000, 7200, 5000])
    assert world.widths() == pytest.approx([6000, 7200, 5000], rel=room, abs=GRAIN)
    assert (world.widths()[0] < 0.96 * 6000) == (believed_hz < 26e6)


# --- moving


def test_after_a_pause_nothing_leaps(world):
    world.held().run(0.1, [7600, 6000, 6000])
    before = world.widths()[0]
    world.now[0] += 2.0
    world.run(0.01, [7600, 6000, 6000])
    assert 0 <= world.widths()[0] - before <= SPEED_STEPS_S * 0.06 + GRAIN


def test_while_the_board_is_silent_the_last_pulses_are_sent_again(world):
    world.held().run(0.5, [5000] * 3)
    before = world.widths()
    world.command("lose all")
    world.run(0.01)
    poke(world, LED0, *pulse_registers(400))  # as a damaged write
    world.bus.write([7000] * 3)
    assert world.widths() == before


# --- what goes wrong


def test_what_another_program_changes_is_set_right(world):
    world.held().run(0.3, [6000] * 3)
    poke(world, MODE1, 0x01)
    world.run(0.5, [6000] * 3)
    assert (world.registers()[MODE1], world.registers()[PRESCALE]) == (AWAKE, 121)
    assert world.widths() == pytest.approx([6000] * 3, abs=GRAIN / 2)
    assert any("restarted: set up again" in line for line in world.bus.events())


def test_what_cannot_be_used_is_named_and_nothing_moves(world):
    world.command("lose all")
    before = bytes(world.registers())
    assert probe(world.port) == ()
    with pytest.raises(ServoMissing, match="no answer as an I2C bus") as caught:
        world.bus.open()
    assert "\n" not in str(caught.value) and str(caught.value).startswith("emulated: ")
    assert bytes(world.registers()) == before
    world.command("clear")
    world.held()


@pytest.mark.parametrize(("register", "byte"), [(MODE2, 0xA5), (MODE1, 0x60)])
def test_another_chip_or_one_with_an_external_clock_is_refused(world, register, byte):
    world.registers()[register] = byte
    with pytest.raises(ServoMissing, match="is not a PCA9685, or noise .*: switch .* off and on"):
        world.bus.open()
    assert probe(world.port) == ()


def test_only_own_channels_stop_unless_they_do_not(world):
    world.held()
    poke(world, LED0 + 4 * 9, *pulse_registers(300))
    world.bus.disable_torque()
    assert world.widths() == [0, 0, 0] and world.device.chips[0x40].counts(9) == 300
    world.bus.enable_torque()
    world.command("lose-writes 6")
    world.bus.disable_torque()
    assert not any(world.device.chips[0x40].counts(k) for k in range(16))


def test_a_guardian_stops_pulses_whatever_the_board_was_set_to(world, monkeypatch):
    world.held()
    poke(world, MODE1, 0x01)

    def left() -> tuple[int, ...]:
        board = Pca9685Board(world.port, BOARD)
        return stop_pulses(board, (0, 1, 5))

    assert left() == ()
    assert world.widths() == [0, 0, 0]
    world.device.chips[0x41] = world.device.chips.pop(0x40)
    assert left() == (0, 1, 5)
    monkeypatch.setattr(world.port, "setBaudRate", lambda baud: False)
    with pytest.raises(PortError, match=r"cannot run at 115200 bit/s: choose 115200"):
        left()


# --- params


def test_what_no_board_can_have_is_refused(world):
    for wrong, reported in (
        (setup(16), "the board has channels 0 to 15"),
        (setup(0, min_steps=1000), "within 500..2500 us"),
    ):
        with pytest.raises(ValueError, match=reported):
            bus_of(world, [wrong])
    with pytest.raises(ValueError, match="each can move one servo only"):
        bus_of(world, [setup(0), setup(0)])


# --- the kernel's bus


class Kernel:
    """A bus of the kernel: opened by its path, and the kernel's errors."""

    def __init__(self, world):
        self.bus, self.refuses = SMBus(world.device), 0

    def open(self, path):
        if self.refuses:
            raise OSError(self.refuses, "refused")
        self.bus.gone = False
        return self.bus


@pytest.fixture
def kernel(world, monkeypatch):
    made = Kernel(world)
    port = I2cPort("/dev/i2c-7")
    monkeypatch.setattr(i2c_port, "SMBus", made.open)
    clock = type("Clock", (), {"sleep": lambda seconds: None})
    monkeypatch.setattr(i2c_port, "time", clock)
    monkeypatch.setattr(I2cPort, "now_s", lambda port: world.now[0])
    board = Pca9685Board(port, BOARD, QUICK._replace(give_up_s=2.0))
    world.bus = HobbyBoardBus(board, world.setups)
    return made


def test_the_kernels_bus_is_driven_as_a_bridge_is(world, kernel):
    world.held().run(0.6, [5000, 6500, 7000])
    assert world.widths() == pytest.approx([5000, 6500, 7000], abs=GRAIN / 2)
    assert world.bus.health().errors == {}
    world.bus.disable_torque()
    assert world.widths() == [0, 0, 0]


def test_an_adapter_that_goes_comes_back_and_holds(world, kernel):
    world.held().run(0.3, [6500] * 3)
    kernel.bus.gone, kernel.refuses = True, errno.ENOENT
    assert world.run(0.3, [6500] * 3).missing == (0, 1, 2)
    kernel.refuses = 0
    feedback = world.run(1.0, [6500] * 3)
    assert feedback.missing == () and all(feedback.torque)
    reported = " ".join(world.bus.events())
    assert "port lost: /dev/i2c-7 is gone" in reported and "port back after" in reported
    kernel.bus.gone, kernel.refuses = True, errno.ENOENT
    with pytest.raises(BusLost, match="has been gone for 2"):
        world.run(3.0)


@pytest.mark.parametrize(
    ("code", "reported"),
    [
        (errno.ENOENT, "no I2C bus /dev/i2c-7: switch I2C on"),
        (errno.EACCES, "join its group with 'sudo usermod"),
        (errno.EBUSY, "is busy: close the other program"),
        (errno.ENOTTY, "cannot open .* as I2C bus"),
    ],
)
def test_a_bus_that_cannot_be_opened_is_named_with_its_cure(world, kernel, code, reported):
    kernel.refuses = code
    with pytest.raises(PortError, match=reported) as caught:
        world.bus.open()
    assert "\n" not in str(caught.value)


def test_an_adapter_is_locked_and_waits_no_second_for_a_stuck_line(kernel, world, monkeypatch):
    """The requests of the kernel's i2c-dev: 10 ms units in 0702, tries in 0701."""
    done = []
    monkeypatch.setattr(kernel.bus, "fd", 5)
    monkeypatch.setattr(i2c_port.fcntl, "flock", lambda *call: done.append(call))
    monkeypatch.setattr(i2c_port.fcntl, "ioctl", lambda *call: done.append(call))
    world.bus.open()
    assert done == [(5, 2 | 4), (5, 0x0702, 2), (5, 0x0701, 1)]


def test_a_path_says_what_kind_of_port_it_is(tmp_path):
    assert isinstance(port_at_path("/dev/i2c-1"), I2cPort)
    assert isinstance(port_at_path("/dev/ttyUSB0"), BlockingPort)
    link = tmp_path / "servos"
    link.symlink_to("/dev/i2c-3")
    assert isinstance(port_at_path(str(link)), I2cPort)
    assert "no I2C bus" in open_failure_text("/dev/i2c-99", errno.ENOENT)
