"""Findings: each thing that can be wrong with a port or a servo is found, named and remedied."""

from dataclasses import replace
from functools import cache

import pytest
from doctor_rig import BAUD, EYE, NECK, PAN, TILT, YAW, Rig, each, one
from present import present

from gazerig.drivers.i2c.transfers import write
from gazerig.drivers.maestro.board import MaestroParams
from gazerig.drivers.pca9685.board import (
    AWAKE,
    LED0,
    MODE1,
    PRESCALE,
    SLEEP,
    Pca9685Params,
    pulse_registers,
)
from gazerig.drivers.serial.port import BlockingPort
from gazerig.drivers.servo_bus.discovery import FoundServo, ping
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.bus_search import SearchRound
from gazerig.features.bringup.cli.scan import scan_remarks
from gazerig.features.bringup.doctor.boards import examine_maestro, examine_pca9685
from gazerig.features.bringup.doctor.diagnostics import (
    Diagnostic,
    Fix,
    worst_level,
)
from gazerig.features.bringup.doctor.examination import examine_port
from gazerig.features.bringup.doctor.servo_checks import CHECKS
from gazerig.features.bringup.doctor.servo_rules import apply_rules, read_state
from gazerig.features.bringup.servo_kinds import DYNAMIXEL, FEETECH, KINDS
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.maestro.board import build_board
from gazerig.sim_mock.pca9685.bridge import build_bridge
from gazerig.sim_mock.smart_servo.physics import ServoSpec


@cache
def healthy(name):
    """Return the first servo of an emulated rig of a kind as the doctor reads it."""
    kind = KINDS[name]
    rig = Rig(kind)
    if kind is DYNAMIXEL:
        rig.set(1, shutdown=52)  # as from the factory it is worth a note
    found = ping(rig.port, kind.family, 1, BAUD)
    registers = Transactions(rig.port, kind.family)
    state = read_state(registers, CHECKS[kind.name], rig.setups[0], present(found), False)
    assert None not in state.values.values() and worst_level(apply_rules(state)) == "ok"
    return state


def found_as(kind, **other):
    return healthy(kind.name).found._replace(**other)


def servo_state(kind, setup=None, found=None, shares_id=False, **values):
    """Return a healthy servo with some registers otherwise."""
    state = healthy(kind.name)
    return replace(
        state,
        setup=setup or state.setup,
        found=found or state.found,
        shares_id=shares_id,
        values={**state.values, **values},
    )


@each
def test_a_joint_far_outside_its_range_is_an_error_with_the_text_of_a_refused_run(kind):
    specs = [ServoSpec(1, EYE[kind.name], 4050), ServoSpec(2, EYE[kind.name], 2500)]
    findings = Rig(kind, [*specs, ServoSpec(7, NECK[kind.name], 2048)]).check()
    far = one(findings, "error", PAN, "141 deg outside its range -34.98..34.98 deg: a slipped horn")
    assert "gazerig run --recover" in far.remedy and "gazerig calibrate --joint" in far.remedy
    assert not [
        f for f in findings if f.where == PAN and "is at step" in f.what and f.level != "ok"
    ]
    one(findings, "warn", TILT, "is at step 2500, outside")


BOTH_RULES = [
    ({"torque_enable": 1}, "warn", "torque is on", "hold the joint"),
    ({"present_temperature": 60}, "warn", "60 degC, it switches off above 70", "cool"),
    ({"present_position": 1649}, "warn", "is at step 1649, outside", "gazerig calibrate"),
    ({"return_delay_time": 250}, "warn", "waits 500 us", "--fix"),
    ({"min_position_limit": 1700}, "warn", "1700..2446 cut the YAML's range 1650..2446", "--fix"),
    ({"max_position_limit": 4095}, "note", "1650..4095 are wider than the YAML's range", "--fix"),
]
DYNAMIXEL_RULES = [
    ({"homing_offset": -200}, "warn", "Homing Offset -200", "Wizard"),
    ({"velocity_limit": 100}, "note", "its Velocity Limit is 137 deg/s", "max_speed_deg_s"),
    (
        {"shutdown": 1},
        "warn",
        "does not switch off at overheating, electrical shock, overload",
        "set Shutdown (63) to 53",
    ),
    ({"status_return_level": 1}, "warn", "does not confirm commands", "--fix"),
    ({"hardware_error_status": 0x20}, "error", "latched: overload", "switch its power off and on"),
    ({"present_input_voltage": 34}, "error", "3.4 V, its limits are 3.5..7.0 V", "supply"),
    ({"present_input_voltage": 44}, "warn", "made for 5 V", "thin wires"),
    ({"baud_rate": 1}, "warn", "its Baud Rate is 57600", "gazerig setup"),
]
FEETECH_RULES = [
    ({"status": 0x20}, "error", "reports: overload", "switch its "),
    ({"present_input_voltage": 121}, "error", "12.1 V, its limits are 4.0..8.0 V", "sts3215-12v"),
    ({"present_input_voltage": 60}, "warn", "made for 7.4 V", "thin wires"),
    ({"baud_rate": 4}, "warn", "its Baud Rate is 115200", "gazerig setup"),
    ({"angular_resolution": 2}, "warn", "counts 2 turns for one", "--fix"),
    ({"position_offset": -85}, "note", "shifted by -85 steps", "gazerig calibrate"),
    ({"max_torque": 400}, "note", "gives 40% of its torque", "Max Torque (16)"),
    ({"overload_torque": 100}, "warn", "overload protection cannot act", "Overload Torque (36)"),
]
RULES = [
    *((kind, *rule) for kind in (DYNAMIXEL, FEETECH) for rule in BOTH_RULES),
    *((DYNAMIXEL, *rule) for rule in DYNAMIXEL_RULES),
    *((FEETECH, *rule) for rule in FEETECH_RULES),
]


@pytest.mark.parametrize(("kind", "values", "level", "words", "remedy"), RULES)
def test_what_can_be_wrong(kind, values, level, words, remedy):
    found = one(apply_rules(servo_state(kind, **values)), level, PAN, words)
    assert remedy in found.remedy
    assert bool(found.fixes) == ("--fix" in found.remedy)
    for fix in found.fixes:
        assert fix.was == {**servo_state(kind).values, **values}[fix.register]


@pytest.mark.parametrize(
    ("kind", "values", "edge"),
    [
        *(
            (kind, values, "ok")
            for kind in (DYNAMIXEL, FEETECH)
            for values in (
                {"present_temperature": 59},
                {"present_position": 1650},
                {"present_position": 2446},
            )
        ),
        (DYNAMIXEL, {"present_input_voltage": 35, "torque_enable": 0}, "warn"),
        (DYNAMIXEL, {"present_input_voltage": 45}, "ok"),
        (DYNAMIXEL, {"secondary_id": 253}, "ok"),
        (DYNAMIXEL, {"shutdown": 52}, "ok"),
        (FEETECH, {"present_input_voltage": 67}, "ok"),
        (FEETECH, {"unloading_condition": 47}, "ok"),
        (FEETECH, {"temperature_limit": 60}, "ok"),
    ],
)
def test_at_the_edge(kind, values, edge):
    assert worst_level(apply_rules(servo_state(kind, **values))) == edge


@each
def test_a_wrong_model_or_two_servos_are_not_judged_further(kind):
    other = found_as(kind, number=1240 if kind is DYNAMIXEL else 1029)
    (only,) = apply_rules(servo_state(kind, found=other, torque_enable=1))
    assert only.level == "error" and f"the YAML says {EYE[kind.name]}" in only.what
    assert "gazerig setup --joint left_eye_pan" in only.remedy
    (only,) = apply_rules(servo_state(kind, shares_id=True, torque_enable=1))
    assert "two servos share id 1" in only.what


# --- a whole bus


@each
def test_a_good_rig_is_well(kind):
    findings = Rig(kind).check()
    assert {f.level for f in findings} == {"ok", "note"}
    assert [f.where for f in findings if f.level == "ok"] == [PAN, TILT, YAW]
    version = "53" if kind is DYNAMIXEL else "3.53"
    well = one(findings, "ok", YAW, f"{NECK[kind.name]}, firmware {version}, ")
    assert "degC, at step 2048" in well.what and not well.remedy and not well.fixes


@each
def test_a_missing_servo_a_stranger_and_one_at_another_rate(kind):
    eye, neck = EYE[kind.name], NECK[kind.name]
    rig = Rig(kind, [ServoSpec(1, eye), ServoSpec(2, eye), ServoSpec(30, neck)])
    rig.set(2, baud_rate=kind.family.baud_rates.index(115_200))
    findings = rig.check()
    assert "115200" in one(findings, "error", TILT, "answers at 115200").what
    assert "gazerig setup" in one(findings, "error", YAW, "does not answer").remedy
    assert one(findings, "warn", "the bus", f"servo 30 ({neck}) answers")
    assert one(findings, "ok", PAN, eye)
    assert any("115200" in words for words in rig.reported)
    # The port is back at the rig's rate, so that the others could be read.
    assert rig.port.baudrate == BAUD


@each
def test_nobody(kind):
    rig = Rig(kind)
    rig.command("lose all")
    (only,) = rig.check()
    assert only.level == "error" and kind.no_reply in only.remedy


@each
@pytest.mark.parametrize(
    ("fault", "says"), [("collide 2", "two servos share id 2"), ("corrupt 2", "in pieces only")]
)
def test_two_servos_with_one_id_and_one_of_which_only_pieces_come(kind, fault, says):
    rig = Rig(kind)
    rig.command(fault)
    assert "alone" in one(rig.check(), "error", TILT, says).remedy


@each
def test_reading_changes_nothing(kind):
    rig = Rig(kind)
    odd = {"bus_watchdog": 255} if kind is DYNAMIXEL else {"lock": 0}
    rig.set(2, return_delay_time=250, operating_mode=1, **odd)
    rig.hold(1)
    before = rig.kept()
    rig.check()
    assert rig.kept() == before


# --- Fixes of the doctor, its findings about ports, and its texts


ANY_RANGE = {"min_position_limit": 0, "max_position_limit": 4095}
SPOILT = [
    (
        DYNAMIXEL,
        dict(ANY_RANGE, return_delay_time=250, drive_mode=1, operating_mode=4, secondary_id=9,
             startup_configuration=1),
        {"bus_watchdog": 255},
        "bus watchdog 255 -> 0",
    ),
    (
        FEETECH,
        dict(return_delay_time=250, operating_mode=1, phase=28, unloading_condition=0,
             temperature_limit=90, min_position_limit=0, max_position_limit=0),
        {"lock": 0, "status_return_level": 0},
        "lock 0 -> 1",
    ),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "first", "second", "says"), SPOILT)
def test_fix_mends_what_is_safe_for_good_and_says_it(kind, first, second, says):
    rig = Rig(kind)
    rig.set(1, **first)
    rig.set(2, **second)
    before = rig.chain.positions_steps()
    done = rig.fix(rig.check())
    assert len(done) == len(first) + len(second) and all(one.endswith(": done") for one in done)
    assert f"{PAN}: return delay time 250 -> 0: done" in done
    assert f"{TILT}: {says}: done" in done
    assert rig.chain.positions_steps() == before
    assert rig.fix(rig.check()) == []
    for i in (1, 2):  # it outlives the power
        rig.chain[i].restart()
    rig.pass_time(1.0)
    assert not any(f.fixes for f in rig.check()) and worst_level(rig.check()) == "note"
    if kind is FEETECH:
        assert rig.chain[1].read(55, 1)[1] == b"\1"


@each
def test_fix_leaves_a_servo_alone_whose_torque_is_on(kind):
    rig = Rig(kind)
    rig.set(1, return_delay_time=250)
    rig.hold(1)
    (done,) = rig.fix(rig.check())
    assert done == f"{PAN}: return delay time 250 -> 0: not done, its torque is on"
    assert (rig.get(1, "return_delay_time"), rig.get(1, "torque_enable")) == (250, 1)


@pytest.mark.parametrize(
    ("kind", "value", "fault", "says"),
    [
        (DYNAMIXEL, 255, "clear", "does not take it"),
        (DYNAMIXEL, 3, "lose 7", "does not answer"),
        (FEETECH, 3, "lose 7", "does not answer"),
    ],
)
def test_a_servo_that_does_not_take_it_is_said(kind, value, fault, says):
    rig = Rig(kind)
    fix = Diagnostic("warn", "w", YAW, "", (Fix(7, "return_delay_time", value, 0),))
    rig.command(fault)
    (done,) = rig.fix([fix])
    assert "not done" in done and says in done


# --- ports


def test_a_port_that_cannot_be_opened_is_a_finding(tmp_path):
    port = BlockingPort(str(tmp_path / "ttyUSB0"))

    def examine():
        port.setBaudRate(BAUD)
        return []

    (only,) = examine_port(port, examine)
    assert only.level == "error" and "no serial port" in only.what


# --- words


def test_remarks_of_a_scan():
    two = (FoundServo(1, 1190, 53, BAUD, "xl330-m077"), FoundServo(1, 1190, 53, BAUD, "xl330-m077"))
    said = " ".join(scan_remarks([SearchRound("dynamixel", BAUD, True, two)], "/dev/x"))
    assert "2 servos on /dev/x" in said and "two or more servos have id 1 at 1000000" in said
    rounds = [SearchRound("dynamixel", 9600, unknown_bytes=40)]
    assert "only pieces came" in " ".join(scan_remarks(rounds, "/dev/x"))


# --- Findings about boards of hobby servos and their channels, and fixes


CHANNEL_PAN = ServoConfig(0, "hobby", 4400, 7600, 9000.0, "eyes_pan", rest_steps=6000)
LID = ServoConfig(2, "hobby", 3600, 7200, 9000.0, "left_upper_lid", rest_steps=5000)
SETUPS = (CHANNEL_PAN, LID)
MINI, MICRO = "1ffb:008a", "1ffb:0089"


class BoardRig:
    """A board in this process; what is sent to it is kept."""

    def __init__(self, channels=12, setups=SETUPS, usb="", **board):
        self.board = build_board(channels, lambda: 0.0, **board)
        self.sent = b""
        self.port = InProcessPort(self.board, self.tap)
        self.params, self.setups, self.usb = MaestroParams(), setups, usb

    def tap(self, data):
        self.sent += data

    def check(self):
        return examine_maestro(self.port, self.params, self.setups, self.usb)


def test_a_good_board_and_what_no_board_tells():
    rig = BoardRig(usb=MINI)
    findings = rig.check()
    assert {f.level for f in findings} == {"ok", "note"}
    assert "12 channels" in one(findings, "ok", "the board", "answers").what
    assert one(findings, "note", "the servos", "hobby servos report nothing")
    reported = one(findings, "note", "the board", "serial timeout cannot be read")
    assert "Pololu's program" in reported.remedy and "gazerig setup" in reported.remedy
    wide = one(findings, "note", "left_upper_lid (channel 2)", "goes to 900..1800 us")
    assert "Min to 896" in wide.remedy and "cuts goals silently" in wide.what
    assert not any(f.where == "eyes_pan (channel 0)" for f in findings)
    # Nothing moves, also where pulses are on, and the board finds no error.
    rig.board.exchange(bytes.fromhex("84 00 70 2E"))
    rig.check()
    assert [one["target"] for one in rig.board.faults.reports()] == [6000] + [0] * 11
    assert rig.board.errors == 0 and b"\xff" not in rig.sent


def test_a_board_with_fewer_channels_than_the_rig():
    far = CHANNEL_PAN._replace(id=8, name="eyes_tilt")
    rig = BoardRig(6, setups=(CHANNEL_PAN, far), usb=MICRO)
    findings = rig.check()
    assert one(findings, "error", "the board", "has 6 channels, the YAML says 12")
    assert one(findings, "error", "eyes_tilt (channel 8)", "channels 0..5 only")
    assert bytes.fromhex("9008") not in rig.sent  # an error to a board sends all channels home


@pytest.mark.parametrize(
    ("bit", "says", "level", "cure"),
    [
        (0, "serial signal error", "warn", "check ground and cable"),
        (5, "serial timeout", "note", "while no program runs"),
    ],
)
def test_errors_that_it_held(bit, says, level, cure):
    rig = BoardRig()
    rig.board.faults.command(f"error {bit}")
    found = one(rig.check(), level, "the board", f"cleared now: {says}")
    assert cure in found.remedy
    assert not any("cleared now" in f.what for f in rig.check())


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
        for register, data in (
            (MODE1, bytes((SLEEP,))),
            (PRESCALE, bytes((PCA9685.prescale,))),
            (MODE1, bytes((AWAKE,))),
            (LED0 + 4 * channel, pulse_registers(counts)),
        ):
            self.port.write(write(0x40, register, data))
            self.now_s += 0.01


def test_a_good_pca9685_is_well_and_what_it_cannot_tell_is_said() -> None:
    findings = examine_pca9685(Pca9685Rig().port, PCA9685, CHANNELS)
    assert worst_level(findings) == "note"
    assert findings[0].what == "answers at 0x40; pulses on 0 of 2 channels"
    assert any("no watchdog" in one.what for one in findings)


def test_a_board_that_is_not_there_is_one_finding_with_its_remedy() -> None:
    (only,) = examine_pca9685(Pca9685Rig().port, Pca9685Params(address=0x41), CHANNELS)
    assert only.level == "error" and only.what == "no PCA9685 answers at 0x41"
    assert "VCC" in only.remedy and "jumpers" in only.remedy


@pytest.mark.parametrize(
    ("counts", "level", "remedy"),
    [(307, "warn", "gazerig jog"), (500, "error", "board's power off and on")],
)
def test_pulses_of_a_pca9685_that_were_left_on(counts: int, level: str, remedy: str) -> None:
    rig = Pca9685Rig()
    rig.leave_pulse(0, counts)
    found = examine_pca9685(rig.port, PCA9685, CHANNELS)[0]
    assert found.level == level and "though no program runs it" in found.what
    assert remedy in found.remedy
