"""Servos without bytes as an option: which options go with it, how they move, runs done again."""

from math import exp
from pathlib import Path

import pytest
from command_line import invoked

from gazerig.config.schema import load_rig
from gazerig.drivers.types import ServoConfig
from gazerig.robot.recording.read import RunRecording
from gazerig.robot.run import session
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.rerun import rerun
from gazerig.robot.run.run import Run
from gazerig.sim_mock.ideal.bus import LAG_S, IdealBus

CONFIGS = [ServoConfig(1, "xl330-m077", 1000, 3000, 1e4), ServoConfig(2, "mg90s", 1000, 3000, 1e4)]


class Bench:
    """Two servos on a clock that is set."""

    def __init__(self) -> None:
        self.now_s = 1.0
        self.bus = IdealBus(CONFIGS, (2048.0, 1500.0), (True, False), lambda: self.now_s)
        self.bus.open()

    def after(self, seconds: float):
        self.now_s += seconds
        return self.bus.read(self.now_s)


def test_goals_are_followed_with_a_lag_within_the_limits():
    bench = Bench()
    assert bench.bus.enable_torque() == (2048, 1500)
    bench.bus.write((2448, 5000))
    for k in range(1, 20):
        found = bench.after(0.003)
        left = exp(-0.003 * k / LAG_S)
        assert bench.bus.positions_steps() == pytest.approx((2448 - 400 * left, 3000 - 1500 * left))
        assert found.position_steps[0] == round(2448 - 400 * left)
    assert found.measured == (True, False) and found.temperature_c[1] is None
    assert found.velocity_steps_s[0] > 0.0 and found.torque == (True, True)


def test_without_torque_they_stand_still():
    bench = Bench()
    bench.bus.write((2448, 1700))
    assert bench.after(1.0).position_steps == (2048.0, 1500.0)
    bench.bus.enable_torque()
    bench.bus.write((2448, 1700))
    moving = bench.after(0.004)
    bench.bus.disable_torque()
    still = bench.after(1.0)
    assert still.position_steps == moving.position_steps != (2448.0, 1700.0)
    assert still.torque == (False, False)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--bus", "ideal"), "--bus ideal needs --mock"),
        (("--mock", "--bus", "ideal", "--port", "/dev/x"), "--port and --mock exclude"),
    ],
)
def test_options_that_make_no_sense_are_refused_in_one_line(words, said):
    done = invoked("run", *words, "--no-page")
    assert done.code == 2 and said in done.err and done.err.count("\n") == 1


@pytest.fixture
def recorded(tmp_path) -> Path:
    file = tmp_path / "run.mcap"
    options = RunOptions(mock=True, fast=True, bus="ideal", seed=3, seconds=3.0, record=file)
    options = options.check_and_complete()
    session.Session(Run(load_rig(options.rig), options), lambda: None, lambda line: None).run()
    return file


def test_a_recording_names_its_bus_and_comes_out_the_same_again(recorded):
    recording = RunRecording(recorded)
    assert recording.info.bus == "ideal" and recording.end.tx_sha256 == ""
    again = rerun(recording)
    assert again.is_same and again.ticks > 590, again.difference
    assert again.sent_bytes_same is None
