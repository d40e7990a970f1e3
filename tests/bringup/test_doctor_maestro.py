"""Findings about a Maestro and its channels, what is mended, and what is only said."""

from xml.etree.ElementTree import fromstring

import pytest
from present import present

from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.maestro.line import MaestroLink
from gazerig.drivers.maestro.params import MaestroParams
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.channel_test import sent_home
from gazerig.features.bringup.doctor.boards import stop_script, visit_maestro
from gazerig.features.bringup.doctor.diagnostics import worst
from gazerig.features.bringup.doctor.run import apply_fixes
from gazerig.features.bringup.maestro_settings import (
    clipped,
    instructions,
    range_us,
    settings_file,
    start_limits,
    wide_range,
)
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.maestro.board import build_board

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


def one(findings, level, where, words):
    """Return the finding of this level at this place that says these words."""
    named = [f for f in findings if f.level == level and f.where == where and words in f.what]
    assert len(named) == 1, [str(f) for f in findings]
    return named[0]


def test_a_good_board_and_what_no_board_tells():
    rig = Rig(usb=MINI)
    findings = rig.check()
    assert {f.level for f in findings} == {"ok", "note"}
    assert "12 channels" in one(findings, "ok", "the board", "compact and the pololu form").what
    assert one(findings, "note", "the servos", "hobby servos tell nothing")
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
    assert one(rig.check(), "note", "eyes_tilt (channel 8)", "was not asked")
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
    assert sent_home(MaestroLink(rig.port, rig.params)) == ("serial protocol error",)
    assert [c["position"] for c in rig.board.faults.reports()] == [0] * 12
    rig.board.choose("mode", "mute")
    with pytest.raises(ServoMissing, match="no Maestro answers"):
        sent_home(MaestroLink(rig.port, rig.params))


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
    assert clipped(LID, 3600, 3968) == (
        "left_upper_lid (channel 2) is sent to 900 us and the board stays at 992 us: set its Min "
        "to 896 and its Max to 1808 in Pololu's program"
    )
    assert "gives no pulses" in clipped(LID, 3600, 0)
