"""One channel moved slowly for a person to watch: its motion, and the end of its pulses."""

import pytest

from gazerig.drivers.errors import ServoFault
from gazerig.drivers.maestro.board import MaestroBoard
from gazerig.drivers.maestro.params import MaestroParams
from gazerig.drivers.pca9685.board import Pca9685Board
from gazerig.drivers.pca9685.params import Pca9685Params
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.channel_test import SLOW_STEPS_S, ChannelPosition, walk_channel
from gazerig.sim_mock.hobby_servo import HobbySpec
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.maestro.board import build_board
from gazerig.sim_mock.pca9685.bridge import build_bridge

LID = ServoConfig(2, "hobby", 4400, 7600, 9000.0, "left_upper_lid", rest_steps=5000)
PLACES = (5000, 4780, 5220, 5000)


class Bench:
    """A board whose time passes as it is waited for; every look at its channel is kept."""

    pulse = "position"

    def __init__(self, low=2000, high=10_000):
        self.now_s = 5.0
        spec = HobbySpec(2, 6500.0, min_steps=low, max_steps=high)
        self.board = build_board(12, lambda: self.now_s, servos=[spec])
        self.port = InProcessPort(self.board)
        self.port.setBaudRate(115_200)
        self.driver = MaestroBoard(self.port, MaestroParams())
        self.seen = []

    def sleep_until(self, t_s):
        while self.now_s < t_s:
            self.now_s = min(t_s, self.now_s + 0.01)
            channel = self.board.faults.reports()[2]
            self.seen.append((self.now_s, channel[self.pulse], channel["place"]))

    def walk(self, fault="", looks=None):
        """Walk; a fault command is carried out at every wait, or after this many looks."""

        def sleep_until(t_s):
            self.sleep_until(t_s)
            if fault and looks in (None, len(self.seen)):
                self.board.faults.command(fault)

        return walk_channel(self.driver, LID, PLACES, sleep_until)


def test_the_first_place_at_once_the_others_slowly_and_the_pulses_end():
    bench = Bench()
    assert bench.walk() == tuple(ChannelPosition(p, p) for p in PLACES)
    pulses = [pulse for _, pulse, _ in bench.seen]
    assert pulses[0] == 5000
    ways = [abs(b - a) for a, b in zip(pulses, pulses[1:], strict=False)]
    assert 0 < max(ways) <= 0.011 * (SLOW_STEPS_S + 100.0)
    assert {4780, 5220} <= set(pulses)
    # The servo was seen at both places, and no other one has moved.
    places = [place for _, _, place in bench.seen]
    assert min(places) < 4810 and max(places[-100:]) > 5190
    assert [c["position"] for c in bench.board.faults.reports()] == [0] * 12


def test_a_channel_that_gives_pulses_already_is_led_slowly_from_there():
    bench = Bench()
    bench.board.exchange(bytes.fromhex("84 02 64 32"))  # 6500
    bench.sleep_until(5.5)
    bench.seen.clear()
    bench.walk()
    pulses = [pulse for _, pulse, _ in bench.seen]
    assert pulses[0] > 6400
    assert max(abs(b - a) for a, b in zip(pulses, pulses[1:], strict=False)) <= 11
    assert bench.board.faults.reports()[2]["position"] == 0


def test_ctrl_c_ends_the_pulses():
    bench = Bench()

    def interrupted(t_s):
        bench.sleep_until(t_s)
        if len(bench.seen) > 60:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        walk_channel(bench.driver, LID, PLACES, interrupted)
    assert bench.board.faults.reports()[2]["position"] == 0


def test_a_board_that_falls_silent():
    bench = Bench()
    with pytest.raises(ServoFault, match="may still get pulses: switch the servo supply off"):
        bench.walk("lose all")
    # It did not answer, but it obeyed.
    assert bench.board.faults.reports()[2]["position"] == 0


class I2cBench(Bench):
    """The same on a PCA9685, whose pulses the driver ramps."""

    pulse = "target"

    def __init__(self):
        self.now_s = 5.0
        self.board = build_bridge(  # type: ignore[assignment]
            (0x40,), lambda: self.now_s, 25.4e6, servos=[HobbySpec(2, 6500.0)]
        )
        self.port = InProcessPort(self.board)
        self.port.setBaudRate(115_200)
        self.driver = Pca9685Board(self.port, Pca9685Params(oscillator_hz=25.4e6))  # type: ignore[assignment]
        self.seen = []


def test_a_pca9685_is_led_as_slowly_and_its_pulses_end():
    bench = I2cBench()
    assert bench.walk() == tuple(ChannelPosition(p, p) for p in PLACES)
    pulses = [pulse for _, pulse, _ in bench.seen]
    assert abs(pulses[0] - 5000) <= 10
    ways = [abs(b - a) for a, b in zip(pulses, pulses[1:], strict=False)]
    assert 0 < max(ways) <= 0.02 * SLOW_STEPS_S + 20
    assert min(pulses) < 4791 and max(pulses) > 5209
    assert [c["target"] for c in bench.board.faults.reports()] == [0] * 16
    assert bench.now_s - 5.0 < 6.0


def test_a_pca9685_that_restarts_on_the_way_gives_no_pulses_and_is_told():
    bench = I2cBench()
    gone = bench.walk("brown-out", looks=60)
    assert gone[0] == ChannelPosition(5000, 5000) and gone[-1] == ChannelPosition(5000, 0)
    assert bench.board.faults.reports()[2]["target"] == 0
