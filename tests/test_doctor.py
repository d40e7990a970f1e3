"""Findings: each thing that can be wrong with a port or a servo is found, named and cured."""

import pytest

from drivers.dynamixel.discovery import Found
from drivers.errors import PortError
from drivers.serial.list_ports import Access, Host, SerialPort
from drivers.types import ServoSetup
from robot.bringup.doctor.checks import apply_fix, examine
from robot.bringup.doctor.dynamixel import DYNAMIXEL as CHECKS
from robot.bringup.doctor.dynamixel import READ
from robot.bringup.doctor.findings import Finding, Fix, worst
from robot.bringup.doctor.port import UDEV_RULE, PortFacts, examine_latency, examine_port
from robot.bringup.doctor.run import apply_fixes, check, check_all, fix_latency, look
from robot.bringup.doctor.subject import ServoState
from robot.bringup.scan_report import remarks
from robot.bringup.searching import Looked
from robot.bringup.servo_families import DYNAMIXEL
from robot.bringup.servo_report import grouped, summed_up, together
from sim_mock.dynamixel.chain import build_dynamixel
from sim_mock.in_process_port import InProcessPort
from sim_mock.smart_servo.physics import ServoSpec

BAUD = 1_000_000
SETUPS = (
    ServoSetup(1, "xl330-m077", 1650, 2446, 6000.0, "left_eye_pan"),
    ServoSetup(2, "xl330-m077", 1650, 2446, 6000.0, "left_eye_tilt"),
    ServoSetup(7, "xc330-m288", 1252, 2844, 2000.0, "neck_yaw"),
)
GOOD = {"return_delay_time": 0, "min_position_limit": 1650, "max_position_limit": 2446}


class Rig:
    """Three servos in this process, set as the rig wants them; some may be spoilt."""

    def __init__(self, specs=None):
        specs = specs or [ServoSpec(s.id, s.model, 2048) for s in SETUPS]
        self.chain = build_dynamixel(specs, lambda: 0.0, baud=BAUD)
        self.port = InProcessPort(self.chain)
        for setup in SETUPS:
            if any(servo.id == setup.id for servo in self.chain.servos):
                self.set(setup.id, return_delay_time=0, min_position_limit=setup.min_steps,
                         max_position_limit=setup.max_steps)  # fmt: skip

    def set(self, servo_id, **values):
        servo = self.chain[servo_id]
        for name, value in values.items():
            servo.memory.set(name, value)
        self.chain.refresh()

    def check(self):
        self.told = []
        return check(self.port, DYNAMIXEL, SETUPS, BAUD, self.told.append)

    def fix(self, findings):
        return list(apply_fixes(lambda fix: apply_fix(self.port, DYNAMIXEL, fix), findings))

    def check_all(self, host):
        return check_all(self.port, host, self.check)


def one(findings, level, where, words):
    """Give the finding of this level at this place that says these words."""
    named = [f for f in findings if f.level == level and f.where == where and words in f.what]
    assert len(named) == 1, [str(f) for f in findings]
    return named[0]


def test_a_good_rig_is_well():
    findings = Rig().check()
    assert {f.level for f in findings} == {"ok", "note"}
    assert [f.where for f in findings if f.level == "ok"] == [
        "left_eye_pan (servo 1)",
        "left_eye_tilt (servo 2)",
        "neck_yaw (servo 7)",
    ]
    well = one(findings, "ok", "neck_yaw (servo 7)", "xc330-m288, firmware 53, ")
    assert "degC" in well.what and not well.remedy and not well.fixes


def test_the_voltage_latch_is_explained_where_it_is_armed():
    findings = Rig().check()
    note = one(findings, "note", "left_eye_pan (servo 1)", "makes it limp until it is restarted")
    assert "gazerig reboot" in note.remedy and "3.5..7.0 V" in note.what
    assert not any(f.level == "note" and f.where == "neck_yaw (servo 7)" for f in findings)


BY_REGISTER = [
    ("return_delay_time", 250, "warn", "waits 500 us", True),
    ("drive_mode", 1, "warn", "Drive Mode 1 (reversed)", True),
    ("drive_mode", 12, "warn", "profile in milliseconds, torque on with any goal", True),
    ("operating_mode", 4, "warn", "extended position mode", True),
    ("secondary_id", 7, "error", "also obeys what is sent to servo 7", True),
    ("startup_configuration", 1, "warn", "switches its torque on by itself", True),
    ("homing_offset", -200, "warn", "Homing Offset -200", False),
    ("min_position_limit", 1700, "warn", "1700..2446 cut the YAML's range 1650..2446", True),
    ("max_position_limit", 4095, "note", "1650..4095 are wider than the YAML's range", True),
    ("velocity_limit", 100, "note", "its Velocity Limit is 137 deg/s", False),
    (
        "shutdown",
        1,
        "warn",
        "does not switch off at overheating, electrical shock, overload",
        False,
    ),
    ("status_return_level", 1, "warn", "does not confirm what it is told", True),
    ("protocol_type", 20, "warn", "Protocol Type 20", False),
]


@pytest.mark.parametrize(("register", "value", "level", "words", "fixable"), BY_REGISTER)
def test_a_register_that_is_not_as_wished(register, value, level, words, fixable):
    findings = examine(servo_state(**{register: value}))
    found = one(findings, level, "left_eye_pan (servo 1)", words)
    assert found.remedy and bool(found.fixes) == fixable
    if fixable:
        assert any(fix.register == register and fix.was == value for fix in found.fixes)


def servo_state(setup=SETUPS[0], found=None, corrupt=0, **values):
    """Give a healthy servo with some registers otherwise."""
    good = {
        **dict.fromkeys(READ, 0),
        **GOOD,
        "status_return_level": 2,
        "baud_rate": 3,
        "operating_mode": 3,
        "secondary_id": 255,
        "protocol_type": 2,
        "temperature_limit": 70,
        "max_voltage_limit": 70,
        "min_voltage_limit": 35,
        "velocity_limit": 1620,
        "shutdown": 52,
        "present_position": 2048,
        "present_input_voltage": 50,
        "present_temperature": 30,
    }
    return ServoState(CHECKS, setup, found or Found(1, 1190, 53, BAUD), {**good, **values}, corrupt)


BY_STATE = [
    ({"hardware_error_status": 0x20}, "error", "latched: overload", "gazerig reboot 1"),
    ({"hardware_error_status": 0x04}, "error", "latched: overheating", "cool"),
    ({"hardware_error_status": 0x01}, "error", "latched: input voltage", "supply"),
    ({"present_input_voltage": 34}, "error", "3.4 V, its limits are 3.5..7.0 V", "supply"),
    ({"present_input_voltage": 71}, "error", "7.1 V", "supply"),
    ({"present_input_voltage": 44}, "warn", "made for 5 V", "thin wires"),
    ({"present_temperature": 60}, "warn", "60 degC, it switches off above 70", "cool"),
    ({"present_temperature": 70}, "error", "70 degC", "cool"),
    ({"torque_enable": 1}, "warn", "torque is on", "hold the joint"),
    ({"bus_watchdog": 255}, "warn", "bus watchdog has tripped", "--fix"),
    ({"present_position": 1649}, "warn", "stands at step 1649, outside", "gazerig calibrate"),
    ({"baud_rate": 1}, "warn", "its Baud Rate is 57600", "gazerig setup"),
]


@pytest.mark.parametrize(("values", "level", "words", "cure"), BY_STATE)
def test_the_state_of_a_servo(values, level, words, cure):
    found = one(examine(servo_state(**values)), level, "left_eye_pan (servo 1)", words)
    assert cure in found.remedy


def test_two_latches_are_two_findings():
    findings = examine(servo_state(hardware_error_status=0x24))
    assert [f.what for f in findings if f.level == "error"] == [
        "has latched: overheating",
        "has latched: overload",
    ]


@pytest.mark.parametrize(
    ("values", "edge"),
    [
        ({"present_input_voltage": 35, "torque_enable": 0}, "warn"),
        ({"present_input_voltage": 70}, "ok"),
        ({"present_input_voltage": 45}, "ok"),
        ({"present_temperature": 59}, "ok"),
        ({"present_position": 1650}, "ok"),
        ({"present_position": 2446}, "ok"),
        ({"bus_watchdog": 10}, "ok"),
        ({"secondary_id": 253}, "ok"),
        ({"shutdown": 52}, "ok"),
    ],
)
def test_at_the_edge(values, edge):
    assert worst(examine(servo_state(**values))) == edge


def test_firmware():
    old = examine(servo_state(found=Found(1, 1190, 45, BAUD)))
    assert one(old, "warn", "left_eye_pan (servo 1)", "no fast sync read").remedy
    known = examine(servo_state(found=Found(1, 1190, 52, BAUD)))
    assert one(known, "note", "left_eye_pan (servo 1)", "firmware 52")
    wanted = SETUPS[0]._replace(firmware_min=53)
    below = examine(servo_state(setup=wanted, found=Found(1, 1190, 52, BAUD)))
    assert one(below, "error", "left_eye_pan (servo 1)", "the YAML wants 53")


def test_a_wrong_model_is_not_judged_further():
    (only,) = examine(servo_state(found=Found(1, 1240, 53, BAUD), torque_enable=1))
    assert only.level == "error" and "is xc330-m288, the YAML says xl330-m077" in only.what
    assert "gazerig setup --joint left_eye_pan" in only.remedy


def test_what_was_not_read_is_said():
    found = one(examine(servo_state(shutdown=None, velocity_limit=None)), "error",
                "left_eye_pan (servo 1)", "gave no good answer about")  # fmt: skip
    assert "shutdown" in found.what and "velocity limit" in found.what


# --- a whole bus


def test_a_missing_servo_a_stranger_and_one_at_another_rate():
    rig = Rig([ServoSpec(1, "xl330-m077"), ServoSpec(2, "xl330-m077"), ServoSpec(30, "xc330-m288")])
    rig.set(2, baud_rate=1)
    findings = rig.check()
    assert "57600" in one(findings, "error", "left_eye_tilt (servo 2)", "answers at 57600").what
    assert "gazerig setup" in one(findings, "error", "neck_yaw (servo 7)", "does not answer").remedy
    assert one(findings, "warn", "the bus", "servo 30 (xc330-m288) answers")
    assert one(findings, "ok", "left_eye_pan (servo 1)", "xl330-m077")
    assert any("57600" in words for words in rig.told)
    # The port is back at the rig's rate, so that the others could be read.
    assert rig.port.baudrate == BAUD


def test_a_factory_fresh_servo_among_the_others():
    rig = Rig([*(ServoSpec(s.id, s.model) for s in SETUPS[:2]), ServoSpec(11, "xc330-m288")])
    rig.set(11, baud_rate=1)
    found = one(rig.check(), "warn", "the bus", "servo 11 (xc330-m288) answers at 57600")
    assert "gazerig setup" in found.remedy


def test_nobody():
    rig = Rig()
    rig.port.faults.command("lose all")
    (only,) = rig.check()
    assert only.level == "error" and "supply" in only.remedy


def test_two_servos_with_one_id():
    rig = Rig()
    rig.port.faults.command("collide 2")
    found = one(rig.check(), "error", "left_eye_tilt (servo 2)", "two servos share id 2")
    assert "alone" in found.remedy


def test_a_servo_of_which_only_pieces_come():
    rig = Rig()
    rig.port.faults.command("corrupt 2")
    found = one(rig.check(), "error", "left_eye_tilt (servo 2)", "in pieces only")
    assert "alone" in found.remedy


def test_reading_changes_nothing():
    rig = Rig()
    rig.set(2, return_delay_time=250, operating_mode=1, bus_watchdog=255)
    rig.chain[1].write(64, b"\x01")
    before = [bytes(servo.memory.bytes[:120]) for servo in rig.chain.servos]
    rig.check()
    assert [bytes(servo.memory.bytes[:120]) for servo in rig.chain.servos] == before


# --- mending


def test_fix_mends_what_is_safe_and_says_it():
    rig = Rig()
    rig.set(
        1, return_delay_time=250, drive_mode=1, operating_mode=4, secondary_id=9,
        startup_configuration=1, min_position_limit=0, max_position_limit=4095,
    )  # fmt: skip
    rig.set(2, bus_watchdog=255)
    before = rig.chain.positions_steps()
    done = rig.fix(rig.check())
    assert all(one.done for one in done)
    assert "left_eye_pan (servo 1): return delay time 250 -> 0: done" in map(str, done)
    assert "left_eye_tilt (servo 2): bus watchdog 255 -> 0: done" in map(str, done)
    assert worst(rig.check()) == "note" and not any(f.fixes for f in rig.check())
    assert rig.chain.positions_steps() == before
    assert rig.fix(rig.check()) == []


def test_a_servo_that_answers_pings_alone_is_brought_to_speak():
    rig = Rig()
    servo = rig.chain[2]
    servo.memory.set("status_return_level", 0)
    servo.status_level = 0
    found = one(rig.check(), "error", "left_eye_tilt (servo 2)", "answers pings and nothing else")
    (done,) = rig.fix([found])
    assert done.done and worst(rig.check()) == "note"


def test_fix_leaves_a_servo_alone_whose_torque_is_on():
    rig = Rig()
    rig.set(1, return_delay_time=250)
    rig.chain[1].write(64, b"\x01")
    findings = rig.check()
    (done,) = rig.fix(findings)
    assert str(done) == (
        "left_eye_pan (servo 1): return delay time 250 -> 0: not done, its torque is on"
    )
    get = rig.chain[1].memory.get
    assert (get("return_delay_time"), get("torque_enable")) == (250, 1)


def test_a_servo_that_does_not_take_it_is_said():
    rig = Rig()
    fix = Finding("warn", "w", "neck_yaw (servo 7)", "", (Fix(7, "return_delay_time", 3, 0),))
    rig.port.faults.command("refuse 7 7")
    (done,) = rig.fix([fix])
    assert not done.done and "does not take it" in done.what


# --- ports

USB = SerialPort("/dev/ttyUSB0", "U2D2", "0403:6014", "/dev/serial/by-id/usb-FTDI-if00")


def facts(access, holders=()):
    return PortFacts("/dev/ttyUSB0", access, holders, (USB,))


def test_a_good_port_and_its_lasting_name():
    first, second = examine_port(facts(Access(True, True, True, "dialout", True)))
    assert (first.level, second.level) == ("ok", "note")
    assert "/dev/serial/by-id/usb-FTDI-if00" in second.remedy


@pytest.mark.parametrize(
    ("access", "holders", "words", "cure"),
    [
        (Access(False, False, False, "", False), (), "no such port", "by-id/usb-FTDI-if00 (U2D2)"),
        (Access(True, False, True, "root", True), (), "no serial port", "gazerig scan"),
        (Access(True, True, False, "dialout", False), (), "the group dialout only",
         "sudo usermod -aG dialout $USER"),
        (Access(True, True, False, "dialout", True), (), "the group dialout only",
         "log out and in again"),
        (Access(True, True, True, "dialout", True), ("minicom (process 12)",),
         "held open by minicom (process 12)", "end it"),
    ],
)  # fmt: skip
def test_a_port_that_cannot_be_used(access, holders, words, cure):
    (only,) = examine_port(facts(access, holders))
    assert only.level == "error" and words in only.what and cure in only.remedy


def test_latency_timer(tmp_path):
    host = Host(latency=tmp_path)
    assert examine_latency("/dev/ttyUSB0", host) == []
    file = tmp_path / "ttyUSB0" / "latency_timer"
    file.parent.mkdir()
    file.write_text("16\n")
    (slow,) = examine_latency("/dev/ttyUSB0", host)
    assert slow.level == "warn" and "16 ms" in slow.what
    assert UDEV_RULE in slow.remedy and str(file) in slow.remedy
    assert UDEV_RULE == (
        'ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", ATTR{latency_timer}="1"'
    )
    (done,) = fix_latency("/dev/ttyUSB0", host)
    assert str(done) == "/dev/ttyUSB0: latency timer 16 -> 1 ms: done"
    (good,) = examine_latency("/dev/ttyUSB0", host)
    assert good.level == "ok" and fix_latency("/dev/ttyUSB0", host) == []
    file.write_text("what?")
    (unread,) = examine_latency("/dev/ttyUSB0", host)
    assert unread.level == "note"


def test_a_port_that_is_not_there_ends_the_examination(tmp_path):
    rig = Rig()
    rig.port.port_name = str(tmp_path / "ttyUSB9")
    (only,) = rig.check_all(Host())
    assert only.level == "error" and only.where.endswith("ttyUSB9")


def test_what_goes_wrong_on_the_way_is_a_finding(tmp_path):
    rig, host = Rig(), Host(processes=tmp_path)
    rig.port.port_name = "/dev/null"  # a character device that may be opened
    rig.port.faults.command("deny on")
    findings = rig.check_all(host)
    assert worst(findings) == "error" and findings[-1].where == "/dev/null"
    rig.port.faults.command("clear")
    assert len(rig.check_all(host)) > 3
    assert not rig.port.is_open
    rig.port.setBaudRate = lambda baud: False
    with pytest.raises(PortError, match="cannot run at 1000000"):
        look(rig.port, DYNAMIXEL, SETUPS, BAUD, lambda _: None)


# --- words


def test_findings_in_words():
    finding = Finding("warn", "hot", "neck_yaw (servo 7)", "let it cool")
    assert str(finding) == "warn: neck_yaw (servo 7): hot: let it cool"
    assert worst([]) == "ok"
    same = [Finding("note", "n", f"j{i} (servo {i})") for i in (1, 2, 4)]
    worst_first = grouped([*same, finding])
    assert [row[0] for row in worst_first] == ["warn", "note"]
    assert worst_first[1] == ("note", "j1, j2, j4 (servos 1-2, 4)", "n", "")
    assert together(["/dev/ttyUSB0", "j1 (servo 1)"]) == "/dev/ttyUSB0, j1 (servo 1)"
    fixable = Finding("warn", "w", "x", fixes=(Fix(1, "return_delay_time", 0, 250),))
    assert summed_up([finding, fixable], "desk", False) == (
        "desk: 2 warn; gazerig doctor --fix mends 1 of them"
    )
    assert "--fix" not in summed_up([fixable], "desk", True)


def test_remarks_of_a_scan():
    two = (Found(1, 1190, 53, BAUD), Found(1, 1190, 53, BAUD))
    said = " ".join(remarks([Looked("dynamixel", BAUD, True, two)], "/dev/x"))
    assert "2 servos on /dev/x" in said and "two or more servos have id 1 at 1000000" in said
    merged = [Looked("dynamixel", BAUD, True, two[:1], shared=(1,))]
    assert "two or more servos have id 1" in " ".join(remarks(merged, "/dev/x"))
    rounds = [
        Looked("dynamixel", 9600, junk=40),
        Looked("dynamixel", 57_600, protocol_1=(5,)),
        Looked("dynamixel", 1, possible=False),
    ]
    said = list(remarks(rounds, "/dev/x"))
    assert any("only pieces came" in line for line in said)
    assert any("Protocol 1 as id 5" in line for line in said)
    assert "asked dynamixel at 9600, 57600 bit/s" in said[0] and "supply" in said[-1]
    # Feetech servos answer the old protocol's ping: that is no riddle where they were found.
    sts = Looked("feetech", 57_600, True, two[:1])
    assert not any("Protocol 1" in line for line in remarks([*rounds, sts], "/dev/x"))
