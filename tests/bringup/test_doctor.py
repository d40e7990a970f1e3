"""Findings: each thing that can be wrong with a port or a servo is found, named and remedied."""

from dataclasses import replace
from functools import cache

import pytest
from doctor_rig import BAUD, EYE, NECK, PAN, TILT, YAW, Rig, each, one, setups_of
from present import present

from gazerig.drivers.servo_bus.discovery import ping
from gazerig.drivers.servo_bus.registers import Registers
from gazerig.features.bringup.doctor.diagnostics import worst
from gazerig.features.bringup.doctor.families import CHECKS
from gazerig.features.bringup.doctor.servo_rules import examine, read_state
from gazerig.features.bringup.servo_families import DYNAMIXEL, FEETECH, KINDS
from gazerig.sim_mock.smart_servo.physics import ServoSpec

FIRMWARE = {"dynamixel": 53, "feetech": 353}


@cache
def healthy(name):
    """Return the first servo of an emulated rig of a kind as the doctor reads it."""
    kind = KINDS[name]
    rig = Rig(kind)
    if kind is DYNAMIXEL:
        rig.set(1, shutdown=52)  # as from the factory it is worth a note
    found = ping(rig.port, kind.family, 1, BAUD)
    registers = Registers(rig.port, kind.family)
    state = read_state(registers, CHECKS[kind.name], rig.setups[0], present(found), 0)
    assert None not in state.values.values() and worst(examine(state)) == "ok"
    return state


def found_as(kind, **other):
    return healthy(kind.name).found._replace(**other)


def servo_state(kind, setup=None, found=None, corrupt=0, **values):
    """Return a healthy servo with some registers otherwise."""
    state = healthy(kind.name)
    return replace(
        state,
        setup=setup or state.setup,
        found=found or state.found,
        corrupt=corrupt,
        values={**state.values, **values},
    )


BOTH_RULES = [
    ({"torque_enable": 1}, "warn", "torque is on", "hold the joint"),
    ({"present_temperature": 60}, "warn", "60 degC, it switches off above 70", "cool"),
    ({"present_temperature": 70}, "error", "70 degC", "cool"),
    ({"present_position": 1649}, "warn", "is at step 1649, outside", "gazerig calibrate"),
    ({"return_delay_time": 250}, "warn", "waits 500 us", "--fix"),
    ({"min_position_limit": 1700}, "warn", "1700..2446 cut the YAML's range 1650..2446", "--fix"),
    ({"max_position_limit": 4095}, "note", "1650..4095 are wider than the YAML's range", "--fix"),
]


DYNAMIXEL_RULES = [
    ({"drive_mode": 1}, "warn", "Drive Mode 1 (reversed)", "--fix"),
    (
        {"drive_mode": 12},
        "warn",
        "profile in milliseconds, torque on with any goal",
        "--fix",
    ),
    ({"operating_mode": 4}, "warn", "extended position mode", "--fix"),
    ({"secondary_id": 7}, "error", "also obeys what is sent to servo 7", "--fix"),
    ({"startup_configuration": 1}, "warn", "switches its torque on by itself", "--fix"),
    ({"homing_offset": -200}, "warn", "Homing Offset -200", "Wizard"),
    ({"velocity_limit": 100}, "note", "its Velocity Limit is 137 deg/s", "max_speed_deg_s"),
    (
        {"shutdown": 1},
        "warn",
        "does not switch off at overheating, electrical shock, overload",
        "set Shutdown (63) to 53",
    ),
    ({"status_return_level": 1}, "warn", "does not confirm commands", "--fix"),
    ({"protocol_type": 20}, "warn", "Protocol Type 20", "Wizard"),
    ({"hardware_error_status": 0x20}, "error", "latched: overload", "gazerig reboot 1"),
    ({"hardware_error_status": 0x04}, "error", "latched: overheating", "cool"),
    ({"hardware_error_status": 0x01}, "error", "latched: input voltage", "supply"),
    ({"present_input_voltage": 34}, "error", "3.4 V, its limits are 3.5..7.0 V", "supply"),
    ({"present_input_voltage": 71}, "error", "7.1 V", "supply"),
    ({"present_input_voltage": 44}, "warn", "made for 5 V", "thin wires"),
    ({"bus_watchdog": 255}, "warn", "bus watchdog has tripped", "--fix"),
    ({"baud_rate": 1}, "warn", "its Baud Rate is 57600", "gazerig setup"),
]


FEETECH_RULES = [
    ({"status": 0x20}, "error", "reports: overload", "gazerig reboot 1"),
    ({"status": 0x08}, "error", "reports: overcurrent", "shorts"),
    ({"status": 0x04}, "error", "reports: overheating", "cool"),
    ({"status": 0x02}, "error", "reports: encoder", "replace"),
    ({"present_input_voltage": 121}, "error", "12.1 V, its limits are 4.0..8.0 V", "sts3215-12v"),
    ({"present_input_voltage": 85}, "error", "8.5 V", "correct the supply"),
    ({"present_input_voltage": 39}, "error", "3.9 V", "correct the supply"),
    ({"present_input_voltage": 60}, "warn", "made for 7.4 V", "thin wires"),
    ({"lock": 0}, "warn", "its memory is open (Lock 0)", "--fix"),
    ({"baud_rate": 4}, "warn", "its Baud Rate is 115200", "gazerig setup"),
    ({"status_return_level": 0}, "warn", "does not confirm", "--fix"),
    ({"operating_mode": 1}, "warn", "is in wheel mode", "--fix"),
    ({"angular_resolution": 2}, "warn", "counts 2 turns for one", "--fix"),
    ({"phase": 28}, "warn", "beyond one turn (Phase 28)", "--fix"),
    ({"min_position_limit": 0, "max_position_limit": 0}, "warn", "many turns", "--fix"),
    ({"position_offset": -85}, "note", "shifted by -85 steps", "gazerig calibrate"),
    ({"max_torque": 400}, "note", "gives 40% of its torque", "Max Torque (16)"),
    ({"unloading_condition": 4}, "warn", "protect itself at overcurrent, overload", "--fix"),
    ({"temperature_limit": 85}, "warn", "switches off above 85 degC only", "--fix"),
    ({"overload_torque": 100}, "warn", "overload protection cannot act", "Overload Torque (36)"),
    ({"protection_time": 0}, "warn", "overload protection cannot act", "Protection Time (35)"),
]


RULES = [
    *((kind, *rule) for kind in (DYNAMIXEL, FEETECH) for rule in BOTH_RULES),
    *((DYNAMIXEL, *rule) for rule in DYNAMIXEL_RULES),
    *((FEETECH, *rule) for rule in FEETECH_RULES),
]


@pytest.mark.parametrize(("kind", "values", "level", "words", "remedy"), RULES)
def test_what_can_be_wrong(kind, values, level, words, remedy):
    found = one(examine(servo_state(kind, **values)), level, PAN, words)
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
        (DYNAMIXEL, {"present_input_voltage": 70}, "ok"),
        (DYNAMIXEL, {"present_input_voltage": 45}, "ok"),
        (DYNAMIXEL, {"bus_watchdog": 10}, "ok"),
        (DYNAMIXEL, {"secondary_id": 253}, "ok"),
        (DYNAMIXEL, {"shutdown": 52}, "ok"),
        (FEETECH, {"present_input_voltage": 80}, "ok"),
        (FEETECH, {"present_input_voltage": 67}, "ok"),
        (FEETECH, {"unloading_condition": 47}, "ok"),
        (FEETECH, {"temperature_limit": 60}, "ok"),
    ],
)
def test_at_the_edge(kind, values, edge):
    assert worst(examine(servo_state(kind, **values))) == edge


def test_two_latches_are_two_findings():
    findings = examine(servo_state(DYNAMIXEL, hardware_error_status=0x24))
    assert [f.what for f in findings if f.level == "error"] == [
        "has latched: overheating",
        "has latched: overload",
    ]


def test_a_twelve_volt_servo_that_is_still_set_for_less():
    strong = setups_of(FEETECH)[0]._replace(model="sts3215-12v")
    findings = examine(servo_state(FEETECH, strong, present_input_voltage=120))
    found = one(findings, "error", PAN, "limits are 4.0..8.0 V")
    assert "must come off this supply" in found.remedy
    assert "Max Voltage (14) to 140" in found.remedy
    assert not found.fixes  # nobody but a person can see which servo it is


def test_a_joint_that_asks_for_more_speed_than_there_is():
    fast = setups_of(FEETECH)[0]._replace(max_speed_steps_s=4000.0)
    assert one(examine(servo_state(FEETECH, fast)), "note", PAN, "asks its shaft for 352 deg/s")


@each
def test_firmware_that_is_too_old(kind):
    now = FIRMWARE[kind.name]
    wanted = setups_of(kind)[0]._replace(firmware_min=now + 1)
    findings = examine(servo_state(kind, wanted))
    assert one(findings, "error", PAN, f"firmware {now}, the YAML wants {now + 1}")


def test_what_old_firmware_of_a_dynamixel_lacks():
    old = examine(servo_state(DYNAMIXEL, found=found_as(DYNAMIXEL, firmware=45)))
    assert one(old, "warn", PAN, "no fast sync read").remedy
    known = examine(servo_state(DYNAMIXEL, found=found_as(DYNAMIXEL, firmware=52)))
    assert one(known, "note", PAN, "firmware 52")


@each
def test_a_wrong_model_or_two_servos_are_not_judged_further(kind):
    other = found_as(kind, number=1240 if kind is DYNAMIXEL else 1029)
    (only,) = examine(servo_state(kind, found=other, torque_enable=1))
    assert only.level == "error" and f"the YAML says {EYE[kind.name]}" in only.what
    assert "gazerig setup --joint left_eye_pan" in only.remedy
    (only,) = examine(servo_state(kind, corrupt=3, torque_enable=1))
    assert "two servos share id 1" in only.what


def test_what_was_not_read_is_said():
    findings = examine(servo_state(DYNAMIXEL, shutdown=None, velocity_limit=None))
    found = one(findings, "error", PAN, "gave no good answer about")
    assert "shutdown" in found.what and "velocity limit" in found.what


@each
def test_every_rule_stands_registers_that_were_not_read(kind):
    state = servo_state(kind)
    for name in state.values:
        assert one(examine(servo_state(kind, **{name: None})), "error", PAN, "no good answer about")


@each
def test_a_servo_that_does_not_tell(kind):
    rig = Rig(kind)
    if kind is DYNAMIXEL:
        rig.set(1, shutdown=52)  # as from the factory it is worth a note
    found = ping(rig.port, kind.family, 1, BAUD, 1)
    rig.command("lose 1")
    checks = CHECKS[kind.name]
    (only,) = examine(
        read_state(Registers(rig.port, kind.family), checks, rig.setups[0], present(found), 0)
    )
    says = "no good answer about its registers" if kind is FEETECH else "answers pings and nothing"
    assert only.level == "error" and says in only.what


# --- a whole bus


@each
def test_a_good_rig_is_well(kind):
    findings = Rig(kind).check()
    assert {f.level for f in findings} == {"ok", "note"}
    assert [f.where for f in findings if f.level == "ok"] == [PAN, TILT, YAW]
    version = "53" if kind is DYNAMIXEL else "3.53"
    well = one(findings, "ok", YAW, f"{NECK[kind.name]}, firmware {version}, ")
    assert "degC, at step 2048" in well.what and not well.remedy and not well.fixes


def test_that_nobody_guards_servos_without_a_watchdog_is_said():
    (note,) = [f for f in Rig(FEETECH).check() if f.level != "ok"]
    assert note.level == "note" and "no bus watchdog" in note.what and "switch" in note.what


def test_the_voltage_latch_is_explained_where_it_is_armed():
    findings = Rig(DYNAMIXEL).check()
    note = one(findings, "note", PAN, "switches its torque off until it is restarted")
    assert "gazerig reboot" in note.remedy and "3.5..7.0 V" in note.what
    assert not any(f.level == "note" and f.where == YAW for f in findings)


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
def test_a_new_servo_among_the_others(kind):
    eye, neck = EYE[kind.name], NECK[kind.name]
    rig = Rig(kind, [ServoSpec(1, eye), ServoSpec(2, eye), ServoSpec(11, neck)])
    rig.set(11, baud_rate=kind.family.baud_rates.index(57_600))
    found = one(rig.check(), "warn", "the bus", f"servo 11 ({neck}) answers at 57600")
    assert "gazerig setup" in found.remedy


@each
def test_nobody(kind):
    rig = Rig(kind)
    rig.command("lose all")
    (only,) = rig.check()
    assert only.level == "error" and kind.no_reply in only.remedy


@each
def test_two_servos_with_one_id(kind):
    rig = Rig(kind)
    rig.command("collide 2")
    assert "alone" in one(rig.check(), "error", TILT, "two servos share id 2").remedy


@each
def test_a_servo_of_which_only_pieces_come(kind):
    rig = Rig(kind)
    rig.command("corrupt 2")
    assert "alone" in one(rig.check(), "error", TILT, "in pieces only").remedy


def test_what_servos_suffer():
    rig = Rig(FEETECH)
    rig.hold(7)
    for fault in ("voltage 1 12.0", "temperature 2 64", "overload 7"):
        rig.command(fault)
    findings = rig.check()
    assert "sts3215-12v" in one(findings, "error", PAN, "12.0 V").remedy
    assert one(findings, "warn", TILT, "64 degC")
    assert one(findings, "error", YAW, "reports: overload")
    assert one(findings, "warn", YAW, "torque is on")


@each
def test_reading_changes_nothing(kind):
    rig = Rig(kind)
    odd = {"bus_watchdog": 255} if kind is DYNAMIXEL else {"lock": 0}
    rig.set(2, return_delay_time=250, operating_mode=1, **odd)
    rig.hold(1)
    before = rig.kept()
    rig.check()
    assert rig.kept() == before
