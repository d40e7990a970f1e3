"""Findings about boards of hobby servos and their channels, fixes, and settings of a Maestro."""

from xml.etree.ElementTree import fromstring

import pytest
from doctor_rig import one
from present import present

from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.i2c import bridge
from gazerig.drivers.maestro.line import MaestroLink
from gazerig.drivers.maestro.params import MaestroParams
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
from gazerig.features.bringup.channel_test import send_home
from gazerig.features.bringup.doctor.boards import stop_script, visit_maestro, visit_pca9685
from gazerig.features.bringup.doctor.diagnostics import worst
from gazerig.features.bringup.doctor.run import apply_fixes
from gazerig.features.bringup.maestro_settings import (
    clipping_text,
    instructions,
    range_us,
    settings_file,
    start_limits,
    wide_range,
)
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.maestro.board import build_board
from gazerig.sim_mock.pca9685.bridge import build_bridge

PAN = ServoConfig(0, "hobby", 4400, 7600, 9000.0, "eyes_pan", rest_steps=6000)
LID = ServoConfig(2, "hobby", 3600, 7200, 9000.0, "left_upper_lid", rest_steps=5000)
SETUPS = (PAN, LID)
MINI, MICRO = "1ffb:008a", "1ffb:0089"


class Rig:
    """A board in this process; what is sent to it is kept."""

    def __init__(self, channels=12, params=None, setups=SETUPS, usb="", **board):
        self.board = build_board(channels, lambda: 0.0, **board)
        self.sent = b""
        self.port = InProcessPort(self.board, self.tap)
        self.params, self.setups, self.usb = params or MaestroParams(), setups, usb

    def tap(self, data):
        self.sent += data

    def do(self, text):
        self.board.exchange(bytes.fromhex(text))

    def check(self):
        return visit_maestro(self.port, self.params, self.setups, self.usb)

    def errors(self):
        return self.board.faults.board()["errors"]


def test_a_good_board_and_what_no_board_tells():
    rig = Rig(usb=MINI)
    findings = rig.check()
    assert {f.level for f in findings} == {"ok", "note"}
    assert "12 channels" in one(findings, "ok", "the board", "compact and the pololu form").what
    assert one(findings, "note", "the servos", "hobby servos report nothing")
    reported = one(findings, "note", "the board", "serial timeout cannot be read")
    assert "Pololu's program" in reported.remedy and "gazerig setup" in reported.remedy
    wide = one(findings, "note", "left_upper_lid (channel 2)", "goes to 900..1800 us")
    assert "Min to 896" in wide.remedy and "cuts goals silently" in wide.what
    assert not any(f.where == "eyes_pan (channel 0)" for f in findings)


def test_nothing_moves_and_no_error_is_made():
    rig = Rig(usb=MINI)
    rig.do("84 00 70 2E")
    rig.check()
    assert [one["position"] for one in rig.board.faults.reports()] == [6000] + [0] * 11
    assert rig.errors() == [] and b"\xff" not in rig.sent


def test_nobody_answers():
    rig = Rig()
    rig.board.choose("mode", "mute")
    (only,) = rig.check()
    assert only.level == "error" and "serial pins" in only.remedy
    rig.usb = MINI
    (only,) = rig.check()
    assert "USB Dual Port" in only.remedy and "serial pins" not in only.remedy


@pytest.mark.parametrize(("real", "wanted"), [(True, False), (False, True)])
def test_check_bytes(real, wanted):
    rig = Rig(params=MaestroParams(crc=wanted), crc=real)
    found = one(rig.check(), "error", "the board", "the YAML says crc")
    assert f"bus.maestro.crc: {str(real).lower()}" in found.remedy


def test_another_device_number():
    rig = Rig(params=MaestroParams(protocol="pololu"), device=3)
    found = one(rig.check(), "error", "the board", "answers the compact form only")
    assert "its device number is not 12" in found.remedy
    assert worst(Rig(params=MaestroParams(protocol="pololu", device=3), device=3).check()) == "note"


def test_a_board_with_fewer_channels_than_the_rig():
    far = PAN._replace(id=8, name="eyes_tilt")
    rig = Rig(6, setups=(PAN, far), usb=MICRO)
    findings = rig.check()
    assert one(findings, "error", "the board", "has 6 channels, the YAML says 12")
    assert one(findings, "error", "eyes_tilt (channel 8)", "channels 0..5 only")
    assert bytes.fromhex("9008") not in rig.sent  # an error to a board sends all channels home


def test_where_the_size_is_not_known_a_missing_channel_is_found_by_its_silence():
    far = PAN._replace(id=8, name="eyes_tilt")
    rig = Rig(6, setups=(PAN, far))
    assert one(rig.check(), "error", "eyes_tilt (channel 8)", "does not answer about this channel")
    assert rig.errors() == []  # the doctor has cleaned up after itself


def test_a_channel_that_may_not_be_there_is_not_asked_for_while_servos_have_pulses():
    far = PAN._replace(id=8, name="eyes_tilt")
    rig = Rig(6, setups=(PAN, far))
    rig.do("84 00 70 2E")
    assert one(rig.check(), "note", "eyes_tilt (channel 8)", "was not read")
    assert bytes.fromhex("9008") not in rig.sent
    assert rig.board.faults.reports()[0]["position"] == 6000
    known = Rig(12, setups=(PAN, far), usb=MINI)
    known.do("84 00 70 2E")
    assert not any(f.where == "eyes_tilt (channel 8)" for f in known.check())


@pytest.mark.parametrize(
    ("name", "says", "level", "cure"),
    [
        ("signal", "serial signal error", "warn", "bus.maestro.baud"),
        ("crc", "serial CRC error", "warn", "Enable CRC"),
        ("protocol", "serial protocol error", "warn", "another program"),
        ("script-counter", "script program counter error", "warn", "delete it"),
        ("timeout", "serial timeout", "note", "while no program runs"),
    ],
)
def test_errors_that_it_held(name, says, level, cure):
    rig = Rig()
    rig.board.faults.command(f"error {name}")
    found = one(rig.check(), level, "the board", f"cleared now: {says}")
    assert cure in found.remedy
    assert not any("cleared now" in f.what for f in rig.check())


def test_a_script_is_stopped_by_fix():
    rig = Rig()
    rig.board.faults.command("script 0")
    findings = rig.check()
    assert one(findings, "warn", "the board", "runs a script")
    assert rig.board.faults.board()["script"]  # looking alone does not stop it
    (done,) = apply_fixes(lambda _: stop_script(rig.port, rig.params), findings)
    assert str(done) == "the board: script 1 -> 0: done"
    assert not rig.board.faults.board()["script"] and worst(rig.check()) != "warn"


def test_pulses_without_a_program():
    rig = Rig()
    rig.do("84 00 70 2E")
    found = one(rig.check(), "warn", "eyes_pan (channel 0)", "1500 us though no program runs it")
    assert "gazerig home" in found.remedy
    rig.do("84 00 00 1F")
    found = one(rig.check(), "error", "eyes_pan (channel 0)", "outside its range 1100..1900 us")
    assert "switch the servo supply off" in found.remedy


def test_home():
    rig = Rig()
    rig.do("84 00 70 2E")
    rig.do("55")
    rig.do("84 00 70 2E")
    rig.port.setBaudRate(115_200)
    assert send_home(MaestroLink(rig.port, rig.params)) == ("serial protocol error",)
    assert [c["position"] for c in rig.board.faults.reports()] == [0] * 12
    rig.board.choose("mode", "mute")
    with pytest.raises(ServoMissing, match="no Maestro answers"):
        send_home(MaestroLink(rig.port, rig.params))


# --- what to set in Pololu's program


def test_ranges_are_rounded_outwards_to_what_a_board_can_keep():
    assert range_us(PAN) == (1088, 1904)
    assert range_us(LID) == (896, 1808)
    assert (wide_range(PAN), wide_range(LID)) == (None, (896, 1808))
    edge = PAN._replace(min_steps=3968, max_steps=8000)
    assert (range_us(edge), wide_range(edge)) == ((992, 2000), None)
    assert wide_range(edge._replace(max_steps=8001)) == (992, 2016)


def test_what_to_set_is_said_for_every_channel():
    said = "\n".join(instructions(MaestroParams(device=5, crc=True), SETUPS, True))
    assert "USB Dual Port" in said and "Device Number: 5" in said and "Enable CRC: on" in said
    assert "channel  2: Min  896, Max 1808, Speed" in said and "Timeout: 0.50 s" in said
    pins = "\n".join(instructions(MaestroParams(baud=57_600), SETUPS, False))
    assert "UART, fixed baud rate 57600" in pins and "USB Dual Port" not in pins


def test_the_same_as_a_settings_file_of_pololu_s_programs():
    params = MaestroParams(device=5, crc=True)
    root = fromstring(settings_file(params, SETUPS, True))
    assert (root.findtext("EnableCrc"), root.findtext("SerialMode")) == ("true", "USB_DUAL_PORT")
    assert root.findtext("SerialTimeout") == "50"  # hundredths of a second
    channels = root.findall("Channels/Channel")
    assert len(channels) == params.channels
    assert {one.get("homemode") for one in channels} == {"Off"}
    lid = channels[LID.id]
    assert (lid.get("name"), lid.get("min"), lid.get("max")) == (LID.name, "3584", "7232")
    assert (int(present(lid.get("speed"))), int(present(lid.get("acceleration")))) == start_limits(
        LID
    )
    assert len(fromstring(settings_file(MaestroParams(channels=6), SETUPS, False))[7]) == 6


@pytest.mark.parametrize(("steps_s", "units"), [(3100.0, 31), (3300.0, 32), (12_345.0, 124)])
def test_a_speed_is_given_as_the_board_keeps_it(steps_s, units):
    assert start_limits(LID._replace(max_speed_steps_s=steps_s))[0] == units


def test_a_place_that_is_cut():
    assert clipping_text(LID, 3600, 3968) == (
        "left_upper_lid (channel 2) is sent to 900 us and the board stays at 992 us: set its Min "
        "to 896 and its Max to 1808 in Pololu's program"
    )
    assert "gives no pulses" in clipping_text(LID, 3600, 0)


# --- PCA9685

CHANNELS = (
    ServoConfig(0, "hobby", 4400, 7600, 12_000.0, "eyes_pan"),
    ServoConfig(1, "hobby", 4400, 7600, 12_000.0, "eyes_tilt"),
)
PCA9685 = Pca9685Params()


class Pca9685Rig:
    """One emulated board, and what a program before may have left in it."""

    def __init__(self) -> None:
        self.now_s = 1.0
        self.chain = build_bridge((0x40,), lambda: self.now_s)
        self.port = InProcessPort(self.chain)

    def leave_pulse(self, channel: int, counts: int) -> None:
        self.port.setBaudRate(PCA9685.baud)
        prescale = prescale_of(PCA9685.frequency_hz, PCA9685.oscillator_hz)
        for register, data in (
            (MODE1, bytes((SLEEP,))),
            (PRESCALE, bytes((prescale,))),
            (MODE1, bytes((AWAKE,))),
            (LED0 + 4 * channel, pulse(counts)),
        ):
            self.port.write(bridge.write(0x40, register, data))
            self.now_s += 0.01


def test_a_good_pca9685_is_well_and_what_it_cannot_tell_is_said() -> None:
    findings = visit_pca9685(Pca9685Rig().port, PCA9685, CHANNELS)
    assert worst(findings) == "note"
    assert findings[0].what == "answers at 0x40; pulses on 0 of 2 channels"
    assert any("no watchdog" in one.what for one in findings)


def test_a_board_that_is_not_there_is_one_finding_with_its_remedy() -> None:
    (only,) = visit_pca9685(Pca9685Rig().port, Pca9685Params(address=0x41), CHANNELS)
    assert only.level == "error" and only.what == "no PCA9685 answers at 0x41"
    assert "VCC" in only.remedy and "jumpers" in only.remedy


def test_a_channel_that_no_board_has() -> None:
    wrong = CHANNELS[1]._replace(id=16)
    findings = visit_pca9685(Pca9685Rig().port, PCA9685, (CHANNELS[0], wrong))
    assert findings[0].level == "error" and "channels 0 to 15" in findings[0].what
    assert "eyes_tilt" in findings[0].where


@pytest.mark.parametrize(
    ("counts", "level", "remedy"),
    [(307, "warn", "gazerig home"), (500, "error", "reboot eyes_pan")],
)
def test_pulses_of_a_pca9685_that_were_left_on(counts: int, level: str, remedy: str) -> None:
    rig = Pca9685Rig()
    rig.leave_pulse(0, counts)
    found = visit_pca9685(rig.port, PCA9685, CHANNELS)[0]
    assert found.level == level and "though no program runs it" in found.what
    assert remedy in found.remedy
