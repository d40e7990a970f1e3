"""Findings about PCA9685 boards and their channels, and what is said in setting them up."""

import pytest

from gazerig.drivers.i2c import bridge
from gazerig.drivers.pca9685.params import Pca9685Params
from gazerig.drivers.pca9685.registers import (
    AWAKE,
    LED0,
    MODE1,
    PRESCALE,
    SLEEP,
    prescale_of,
    pulse,
)
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.doctor.boards import visit_pca9685
from gazerig.features.bringup.doctor.diagnostics import worst
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.pca9685.bridge import build_bridge

SETUPS = (
    ServoConfig(0, "hobby", 4400, 7600, 12_000.0, "eyes_pan"),
    ServoConfig(1, "hobby", 4400, 7600, 12_000.0, "eyes_tilt"),
)
PARAMS = Pca9685Params()


class Rig:
    """One emulated board, and what a program before may have left in it."""

    def __init__(self) -> None:
        self.now_s = 1.0
        self.chain = build_bridge((0x40,), lambda: self.now_s)
        self.port = InProcessPort(self.chain)

    def leave_pulse(self, channel: int, counts: int) -> None:
        self.port.setBaudRate(PARAMS.baud)
        prescale = prescale_of(PARAMS.frequency_hz, PARAMS.oscillator_hz)
        for register, data in (
            (MODE1, bytes((SLEEP,))),
            (PRESCALE, bytes((prescale,))),
            (MODE1, bytes((AWAKE,))),
            (LED0 + 4 * channel, pulse(counts)),
        ):
            self.port.write(bridge.write(0x40, register, data))
            self.now_s += 0.01


def test_a_good_board_is_well_and_what_it_cannot_tell_is_said() -> None:
    findings = visit_pca9685(Rig().port, PARAMS, SETUPS)
    assert worst(findings) == "note"
    assert findings[0].what == "answers at 0x40; pulses on 0 of 2 channels"
    assert any("no watchdog" in one.what for one in findings)


def test_a_board_that_is_not_there_is_one_finding_with_its_remedy() -> None:
    (only,) = visit_pca9685(Rig().port, Pca9685Params(address=0x41), SETUPS)
    assert only.level == "error" and only.what == "no PCA9685 answers at 0x41"
    assert "VCC" in only.remedy and "jumpers" in only.remedy


def test_a_channel_that_no_board_has() -> None:
    wrong = SETUPS[1]._replace(id=16)
    findings = visit_pca9685(Rig().port, PARAMS, (SETUPS[0], wrong))
    assert findings[0].level == "error" and "channels 0 to 15" in findings[0].what
    assert "eyes_tilt" in findings[0].where


@pytest.mark.parametrize(
    ("counts", "level", "remedy"),
    [(307, "warn", "gazerig home"), (500, "error", "reboot eyes_pan")],
)
def test_pulses_that_were_left_on(counts: int, level: str, remedy: str) -> None:
    rig = Rig()
    rig.leave_pulse(0, counts)
    found = visit_pca9685(rig.port, PARAMS, SETUPS)[0]
    assert found.level == level and "though no program runs it" in found.what
    assert remedy in found.remedy
