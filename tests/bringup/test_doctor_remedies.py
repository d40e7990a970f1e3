"""What the doctor mends, what it says of ports, and its words."""

import pytest
from doctor_rig import BAUD, PAN, TILT, YAW, Rig, each, one

from gazerig.drivers.errors import PortError
from gazerig.drivers.feetech.memory_table import TABLE_END
from gazerig.drivers.serial.list_ports import Access, Host, SerialPort
from gazerig.drivers.servo_bus.discovery import FoundServo
from gazerig.features.bringup.bus_search import SearchRound
from gazerig.features.bringup.cli.scan import remarks
from gazerig.features.bringup.doctor.diagnostics import (
    Diagnostic,
    Fix,
    group_findings,
    join_places,
    summarize,
    worst,
)
from gazerig.features.bringup.doctor.port import UDEV_RULE, PortFacts, examine_latency, examine_port
from gazerig.features.bringup.doctor.run import find_servos, fix_latency
from gazerig.features.bringup.servo_families import DYNAMIXEL, FEETECH

# --- fixes


def test_fix_mends_what_is_safe_and_says_it():
    rig = Rig(DYNAMIXEL)
    rig.set(
        1, return_delay_time=250, drive_mode=1, operating_mode=4, secondary_id=9,
        startup_configuration=1, min_position_limit=0, max_position_limit=4095,
    )  # fmt: skip
    rig.set(2, bus_watchdog=255)
    before = rig.chain.positions_steps()
    done = rig.fix(rig.check())
    assert all(one.done for one in done)
    assert f"{PAN}: return delay time 250 -> 0: done" in map(str, done)
    assert f"{TILT}: bus watchdog 255 -> 0: done" in map(str, done)
    assert worst(rig.check()) == "note" and not any(f.fixes for f in rig.check())
    assert rig.chain.positions_steps() == before
    assert rig.fix(rig.check()) == []


def test_fix_mends_an_sts_servo_for_good():
    rig = Rig(FEETECH)
    rig.set(1, return_delay_time=250, operating_mode=1, phase=28, unloading_condition=0,
            temperature_limit=90, min_position_limit=0, max_position_limit=0)  # fmt: skip
    rig.set(2, lock=0, status_return_level=0)
    before = rig.chain.positions_steps()
    done = rig.fix(rig.check())
    assert all(one.done for one in done), [str(one) for one in done]
    assert f"{PAN}: return delay time 250 -> 0: done" in map(str, done)
    assert f"{TILT}: lock 0 -> 1: done" in map(str, done)
    assert not any(f.fixes for f in rig.check())
    assert rig.chain.positions_steps() == before
    for i in (1, 2):  # it outlives the power
        rig.chain[i].restart()
    rig.pass_time(1.0)
    assert not any(f.fixes for f in rig.check()) and worst(rig.check()) == "note"
    assert rig.chain[1].read(TABLE_END - 1, 1) and rig.chain[1].read(55, 1) == b"\1"


def test_a_servo_that_answers_pings_alone_is_brought_to_speak():
    rig = Rig(DYNAMIXEL)
    servo = rig.chain[2]
    servo.memory.set("status_return_level", 0)
    servo.status_level = 0
    found = one(rig.check(), "error", TILT, "answers pings and nothing else")
    (done,) = rig.fix([found])
    assert done.done and worst(rig.check()) == "note"


@each
def test_fix_leaves_a_servo_alone_whose_torque_is_on(kind):
    rig = Rig(kind)
    rig.set(1, return_delay_time=250)
    rig.hold(1)
    (done,) = rig.fix(rig.check())
    assert str(done) == f"{PAN}: return delay time 250 -> 0: not done, its torque is on"
    assert (rig.get(1, "return_delay_time"), rig.get(1, "torque_enable")) == (250, 1)


@pytest.mark.parametrize(
    ("kind", "fault", "says"),
    [
        (DYNAMIXEL, "refuse 7 7", "does not take it"),
        (DYNAMIXEL, "lose 7", "does not answer"),
        (FEETECH, "lose 7", "does not answer"),
    ],
)
def test_a_servo_that_does_not_take_it_is_said(kind, fault, says):
    rig = Rig(kind)
    fix = Diagnostic("warn", "w", YAW, "", (Fix(7, "return_delay_time", 3, 0),))
    rig.command(fault)
    (done,) = rig.fix([fix])
    assert not done.done and says in done.what


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
    rig = Rig(DYNAMIXEL)
    rig.port.port_name = str(tmp_path / "ttyUSB9")
    (only,) = rig.check_all(Host())
    assert only.level == "error" and only.where.endswith("ttyUSB9")


def test_what_goes_wrong_on_the_way_is_a_finding(tmp_path):
    rig, host = Rig(DYNAMIXEL), Host(processes=tmp_path)
    rig.port.port_name = "/dev/null"  # a character device that may be opened
    rig.port.faults.command("deny on")
    findings = rig.check_all(host)
    assert worst(findings) == "error" and findings[-1].where == "/dev/null"
    rig.port.faults.command("clear")
    assert len(rig.check_all(host)) > 3
    assert not rig.port.is_open
    rig.port.setBaudRate = lambda baud: False  # type: ignore[assignment, method-assign]
    with pytest.raises(PortError, match="cannot run at 1000000"):
        find_servos(rig.port, DYNAMIXEL, rig.setups, BAUD, lambda _: None)


# --- words


def test_findings_in_words():
    finding = Diagnostic("warn", "hot", "neck_yaw (servo 7)", "let it cool")
    assert str(finding) == "warn: neck_yaw (servo 7): hot: let it cool"
    assert worst([]) == "ok"
    same = [Diagnostic("note", "n", f"j{i} (servo {i})") for i in (1, 2, 4)]
    worst_first = group_findings([*same, finding])
    assert [row[0] for row in worst_first] == ["warn", "note"]
    assert worst_first[1] == ("note", "j1, j2, j4 (servos 1-2, 4)", "n", "")
    assert join_places(["/dev/ttyUSB0", "j1 (servo 1)"]) == "/dev/ttyUSB0, j1 (servo 1)"
    fixable = Diagnostic("warn", "w", "x", fixes=(Fix(1, "return_delay_time", 0, 250),))
    assert summarize([finding, fixable], "desk", False) == (
        "desk: 2 warn; gazerig doctor --fix mends 1 of them"
    )
    assert "--fix" not in summarize([fixable], "desk", True)


def test_remarks_of_a_scan():
    two = (FoundServo(1, 1190, 53, BAUD, "xl330-m077"), FoundServo(1, 1190, 53, BAUD, "xl330-m077"))
    said = " ".join(remarks([SearchRound("dynamixel", BAUD, True, two)], "/dev/x"))
    assert "2 servos on /dev/x" in said and "two or more servos have id 1 at 1000000" in said
    merged = [SearchRound("dynamixel", BAUD, True, two[:1], shared=(1,))]
    assert "two or more servos have id 1" in " ".join(remarks(merged, "/dev/x"))
    rounds = [
        SearchRound("dynamixel", 9600, junk=40),
        SearchRound("dynamixel", 57_600, protocol_1=(5,)),
        SearchRound("dynamixel", 1, possible=False),
    ]
    lines = list(remarks(rounds, "/dev/x"))
    assert any("only pieces came" in line for line in lines)
    assert any("Protocol 1 as id 5" in line for line in lines)
    assert "searched dynamixel at 9600, 57600 bit/s" in lines[0] and "supply" in lines[-1]
    # Feetech servos answer the old protocol's ping: that is no riddle where they were found.
    sts = SearchRound("feetech", 57_600, True, two[:1])
    assert not any("Protocol 1" in line for line in remarks([*rounds, sts], "/dev/x"))
