"""Findings about STS servos: each thing that can be wrong is found, named, cured and mended."""

import pytest

from drivers.feetech.memory_table import REGISTERS, TABLE_END
from drivers.feetech.registers import StsRegisters
from drivers.feetech.scan import Found
from drivers.types import ServoSetup
from robot.bringup.doctor.checks import apply_fix, examine, take
from robot.bringup.doctor.feetech import FEETECH as CHECKS
from robot.bringup.doctor.findings import worst
from robot.bringup.doctor.run import apply_fixes, check
from robot.bringup.doctor.subject import ServoState
from robot.bringup.servo_families import FEETECH
from sim_mock.feetech.chain import build_feetech
from sim_mock.in_process_port import InProcessPort
from sim_mock.smart_servo.physics import ServoSpec

BAUD = 1_000_000
SETUPS = (
    ServoSetup(1, "sts3215", 1650, 2446, 3000.0, "left_eye_pan"),
    ServoSetup(2, "sts3215", 1650, 2446, 3000.0, "left_eye_tilt"),
    ServoSetup(7, "sts3215", 1252, 2844, 2000.0, "neck_yaw"),
)
PAN, TILT, YAW = "left_eye_pan (servo 1)", "left_eye_tilt (servo 2)", "neck_yaw (servo 7)"


class Rig:
    """Three servos in this process, set as the rig wants them; some may be spoilt."""

    def __init__(self, specs=None, baud=BAUD):
        self.now_s = 10.0
        specs = specs or [ServoSpec(s.id, s.model, 2048) for s in SETUPS]
        self.chain = build_feetech(specs, lambda: self.now_s, baud=baud)
        self.port = InProcessPort(self.chain)
        self.port.setBaudRate(baud)
        for setup in SETUPS:
            if any(spec.id == setup.id for spec in specs):
                self.set(setup.id, return_delay_time=0, min_position_limit=setup.min_steps,
                         max_position_limit=setup.max_steps)  # fmt: skip

    def set(self, servo_id, **values):
        servo = self.chain[servo_id]
        servo.write(55, b"\0")
        for name, value in values.items():
            register = REGISTERS[name]
            servo.write(register.address, register.encode(value))
        servo.write(55, bytes((values.get("lock", 1),)))
        self.pass_time()

    def pass_time(self, seconds=0.1):
        self.now_s += seconds
        self.chain.positions_steps()

    def check(self):
        return check(self.port, FEETECH, SETUPS, BAUD, lambda _: None)

    def fix(self, findings):
        return list(apply_fixes(lambda fix: apply_fix(self.port, FEETECH, fix), findings))


def one(findings, level, where, words):
    """Give the finding of this level at this place that says these words."""
    named = [f for f in findings if f.level == level and f.where == where and words in f.what]
    assert len(named) == 1, [str(f) for f in findings]
    return named[0]


def test_a_good_rig_is_well_and_nobody_guards_it():
    findings = Rig().check()
    assert [f.where for f in findings if f.level == "ok"] == [PAN, TILT, YAW]
    (note,) = [f for f in findings if f.level != "ok"]
    assert note.level == "note" and "no bus watchdog" in note.what and "switch" in note.what
    assert one(findings, "ok", YAW, "sts3215, firmware 3.53, 7.4 V, 30 degC, at step 2048")


def servo_state(setup=SETUPS[0], found=None, corrupt=0, **values):
    """Give a healthy servo with some registers otherwise."""
    good = {
        "id": setup.id,
        "baud_rate": 0,
        "return_delay_time": 0,
        "status_return_level": 1,
        "min_position_limit": setup.min_steps,
        "max_position_limit": setup.max_steps,
        "temperature_limit": 70,
        "max_voltage_limit": 80,
        "min_voltage_limit": 40,
        "max_torque": 1000,
        "phase": 12,
        "unloading_condition": 44,
        "angular_resolution": 1,
        "position_offset": 0,
        "operating_mode": 0,
        "protection_time": 200,
        "overload_torque": 80,
        "torque_enable": 0,
        "lock": 1,
        "present_position": 2048,
        "present_input_voltage": 74,
        "present_temperature": 30,
        "status": 0,
    }
    return ServoState(
        CHECKS, setup, found or Found(setup.id, 777, 353, BAUD), {**good, **values}, corrupt
    )


RULES = [
    ({"status": 0x20}, "error", "reports: overload", "gazerig reboot 1"),
    ({"status": 0x08}, "error", "reports: overcurrent", "shorts"),
    ({"status": 0x04}, "error", "reports: overheating", "cool"),
    ({"status": 0x02}, "error", "reports: encoder", "replace"),
    ({"present_input_voltage": 121}, "error", "12.1 V, its limits are 4.0..8.0 V", "sts3215-12v"),
    ({"present_input_voltage": 85}, "error", "8.5 V", "correct the supply"),
    ({"present_input_voltage": 39}, "error", "3.9 V", "correct the supply"),
    ({"present_input_voltage": 60}, "warn", "made for 7.4 V", "thin wires"),
    ({"present_temperature": 60}, "warn", "60 degC, it switches off above 70", "cool"),
    ({"present_temperature": 70}, "error", "70 degC", "cool"),
    ({"torque_enable": 1}, "warn", "torque is on", "gazerig reboot 1"),
    ({"lock": 0}, "warn", "its memory is open (Lock 0)", "--fix"),
    ({"present_position": 1649}, "warn", "stands at step 1649, outside", "gazerig calibrate"),
    ({"baud_rate": 4}, "warn", "its Baud Rate is 115200", "gazerig setup"),
    ({"return_delay_time": 250}, "warn", "waits 500 us", "--fix"),
    ({"status_return_level": 0}, "warn", "does not confirm", "--fix"),
    ({"operating_mode": 1}, "warn", "is in wheel mode", "--fix"),
    ({"angular_resolution": 2}, "warn", "counts 2 turns for one", "--fix"),
    ({"phase": 28}, "warn", "beyond one turn (Phase 28)", "--fix"),
    ({"min_position_limit": 1700}, "warn", "1700..2446 cut the YAML's range 1650..2446", "--fix"),
    ({"min_position_limit": 0, "max_position_limit": 0}, "warn", "many turns", "--fix"),
    ({"max_position_limit": 4095}, "note", "are wider", "--fix"),
    ({"position_offset": -85}, "note", "shifted by -85 steps", "gazerig calibrate"),
    ({"max_torque": 400}, "note", "gives 40% of its torque", "Max Torque (16)"),
    ({"unloading_condition": 4}, "warn", "protect itself at overcurrent, overload", "--fix"),
    ({"temperature_limit": 85}, "warn", "switches off above 85 degC only", "--fix"),
    ({"overload_torque": 100}, "warn", "overload protection cannot act", "Overload Torque (36)"),
    ({"protection_time": 0}, "warn", "overload protection cannot act", "Protection Time (35)"),
]


@pytest.mark.parametrize(("values", "level", "words", "cure"), RULES)
def test_what_can_be_wrong(values, level, words, cure):
    found = one(examine(servo_state(**values)), level, PAN, words)
    assert cure in found.remedy
    assert bool(found.fixes) == (cure == "--fix")


@pytest.mark.parametrize(
    "values",
    [
        {"present_input_voltage": 80},
        {"present_input_voltage": 67},
        {"present_temperature": 59},
        {"present_position": 1650},
        {"present_position": 2446},
        {"unloading_condition": 47},
        {"temperature_limit": 60},
    ],
)
def test_at_the_edge(values):
    assert worst(examine(servo_state(**values))) == "ok"


def test_a_twelve_volt_servo_that_is_still_set_for_less():
    strong = ServoSetup(1, "sts3215-12v", 1650, 2446, 3000.0, "left_eye_pan")
    found = one(
        examine(servo_state(strong, present_input_voltage=120)),
        "error",
        PAN,
        "limits are 4.0..8.0 V",
    )
    assert "must come off this supply" in found.remedy and "Max Voltage (14) to 140" in found.remedy
    assert not found.fixes  # nobody but a person can see which servo it is


def test_a_joint_that_asks_for_more_speed_than_there_is():
    fast = SETUPS[0]._replace(max_speed_steps_s=4000.0)
    assert one(examine(servo_state(fast)), "note", PAN, "asks its shaft for 352 deg/s")


def test_a_wrong_model_or_two_servos_are_not_judged_further():
    other = servo_state(found=Found(1, 1029, 353, BAUD), status=0x20)
    (only,) = examine(other)
    assert "is model number 1029, the YAML says sts3215" in only.what
    (only,) = examine(servo_state(corrupt=3, status=0x20))
    assert "two servos share id 1" in only.what


def test_firmware():
    wanted = SETUPS[0]._replace(firmware_min=400)
    assert one(examine(servo_state(wanted)), "error", PAN, "firmware 353, the YAML wants 400")


def test_a_servo_that_does_not_tell():
    rig = Rig()
    found = FEETECH.ping(rig.port, 1, BAUD, 1)
    rig.port.faults.command("lose 1")
    (only,) = examine(take(StsRegisters(rig.port), CHECKS, SETUPS[0], found, 0))
    assert only.level == "error" and "no good answer" in only.what


# --- a whole bus, with what happens to real servos


def test_a_missing_servo_a_stranger_and_one_at_another_rate():
    rig = Rig([ServoSpec(1, "sts3215"), ServoSpec(2, "sts3215"), ServoSpec(30, "sts3215")])
    rig.set(2, baud_rate=4)
    rig.chain.refresh()
    findings = rig.check()
    assert "115200" in one(findings, "error", TILT, "answers at 115200").what
    assert "gazerig setup" in one(findings, "error", YAW, "does not answer").remedy
    assert one(findings, "warn", "the bus", "servo 30 (sts3215) answers")
    assert one(findings, "ok", PAN, "sts3215")
    assert rig.port.baudrate == BAUD


def test_two_servos_with_one_id():
    rig = Rig()
    rig.port.faults.command("collide 2")
    assert "alone" in one(rig.check(), "error", TILT, "two servos share id 2").remedy


def test_nobody():
    rig = Rig()
    rig.port.faults.command("lose all")
    (only,) = rig.check()
    assert only.level == "error" and "jumper" in only.remedy


def test_what_servos_suffer():
    rig = Rig()
    rig.port.faults.command("voltage 1 12.0")
    rig.port.faults.command("temperature 2 64")
    rig.chain[7].write(40, b"\x01")
    rig.port.faults.command("overload 7")
    rig.pass_time()
    findings = rig.check()
    assert "sts3215-12v" in one(findings, "error", PAN, "12.0 V").remedy
    assert one(findings, "warn", TILT, "64 degC")
    assert one(findings, "error", YAW, "reports: overload")
    assert one(findings, "warn", YAW, "torque is on")


def test_reading_changes_nothing():
    rig = Rig()
    rig.set(2, return_delay_time=250, operating_mode=1, lock=0)
    rig.chain[1].write(40, b"\x01")
    # Without the memory of places that live.
    before = [rig.chain[i].read(0, 56) for i in (1, 2, 7)]
    rig.check()
    assert [rig.chain[i].read(0, 56) for i in (1, 2, 7)] == before


def test_fix_mends_what_is_safe_for_good():
    rig = Rig()
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


def test_fix_leaves_a_servo_alone_whose_torque_is_on():
    rig = Rig()
    rig.set(1, return_delay_time=250)
    rig.chain[1].write(40, b"\x01")
    (done,) = rig.fix(rig.check())
    assert str(done) == f"{PAN}: return delay time 250 -> 0: not done, its torque is on"
    assert rig.chain[1].read(7, 1) == b"\xfa"


def test_a_servo_that_does_not_take_it_is_said():
    rig = Rig()
    rig.set(1, return_delay_time=250)
    findings = rig.check()
    rig.port.faults.command("lose 1")
    (done,) = rig.fix(findings)
    assert not done.done and "does not answer" in done.what
