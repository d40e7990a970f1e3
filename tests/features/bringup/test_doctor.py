"""Servos and boards: found on a port, examined, mended, and set up one at a time."""

from dataclasses import replace
from functools import cache
from math import pi

import pytest
from msgspec import structs
from present import present

from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.feetech.memory_table import REGISTERS
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
from gazerig.drivers.servo_bus.discovery import FoundServo, ping
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.cli.scan import ORDER, search_bus
from gazerig.features.bringup.doctor.boards import examine_maestro, examine_pca9685
from gazerig.features.bringup.doctor.diagnostics import Diagnostic, Fix, worst_level
from gazerig.features.bringup.doctor.examination import apply_fixes, examine_bus
from gazerig.features.bringup.doctor.servo_rules import apply_rules, read_state
from gazerig.features.bringup.servo_kinds import DYNAMIXEL, FEETECH, KINDS
from gazerig.features.bringup.servo_setup import (
    assign_servo,
    find_alone,
    search_rates,
)
from gazerig.robot.model.coupling import far_outside
from gazerig.robot.model.joint import JointLimit
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.feetech.chain import build_feetech
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.maestro.board import build_board
from gazerig.sim_mock.pca9685.bridge import build_bridge
from gazerig.sim_mock.smart_servo.physics import ServoSpec

BAUD = 1_000_000
RANGES = ((1, 1650, 2446, "left_eye_pan"), (2, 1650, 2446, "left_eye_tilt"),
          (7, 1252, 2844, "neck_yaw"))  # fmt: skip
EYE = {"dynamixel": "xl330-m077", "feetech": "sts3215"}
NECK = {"dynamixel": "xc330-m288", "feetech": "sts3215"}
SPEED = {"dynamixel": 6000.0, "feetech": 3000.0}
PAN, TILT, YAW = "left_eye_pan (servo 1)", "left_eye_tilt (servo 2)", "neck_yaw (servo 7)"
each = pytest.mark.parametrize("kind", [DYNAMIXEL, FEETECH], ids=lambda kind: kind.name)


def setups_of(kind):
    return tuple(
        ServoConfig(i, (NECK if i == 7 else EYE)[kind.name], low, high,
                   2000.0 if i == 7 else SPEED[kind.name], name)
        for i, low, high, name in RANGES
    )  # fmt: skip


class Rig:
    """Three servos in this process, set as the rig wants them; some may be spoilt."""

    def __init__(self, kind, specs=None, baud=BAUD):
        self.kind, self.setups, self.now_s = kind, setups_of(kind), 10.0
        specs = specs or [ServoSpec(s.id, s.model, 2048) for s in self.setups]
        build = build_feetech if kind is FEETECH else build_dynamixel
        self.chain = build(specs, lambda: self.now_s, baud=baud)
        self.port = InProcessPort(self.chain)
        self.port.setBaudRate(BAUD)
        self.reported = []
        for setup in self.setups:
            if any(spec.id == setup.id for spec in specs):
                self.set(setup.id, return_delay_time=0, min_position_limit=setup.min_steps,
                         max_position_limit=setup.max_steps)  # fmt: skip

    def set(self, servo_id, **values):
        servo = self.chain[servo_id]
        if self.kind is DYNAMIXEL:
            for name, value in values.items():
                servo.memory.set(name, value)
        else:
            servo.write(55, b"\0")
            for name, value in values.items():
                servo.write(REGISTERS[name].address, REGISTERS[name].encode(value))
            servo.write(55, bytes((values.get("lock", 1),)))
        self.pass_time()
        self.chain.refresh()

    def hold(self, servo_id):
        self.chain[servo_id].write(64 if self.kind is DYNAMIXEL else 40, b"\x01")

    def get(self, servo_id, name):
        return Transactions(self.port, self.kind.family).read(servo_id, name)

    def command(self, text):
        self.port.faults.command(text)
        self.pass_time()

    def pass_time(self, seconds=0.1):
        self.now_s += seconds
        self.chain.positions_steps()

    def check(self):
        self.reported.clear()
        return examine_bus(
            self.port, self.kind, self.setups, BAUD, self.reported.append, self.find_far
        )

    def find_far(self, steps):
        """Judge by the same rule as a run, for joints whose range is that of their servos."""
        found = {}
        for setup in self.setups:
            low, high = ((s - 2048) * pi / 2048 for s in (setup.min_steps, setup.max_steps))
            if setup.name in steps:
                angle = (steps[setup.name] - 2048) * pi / 2048
                found[setup.name] = far_outside(angle, JointLimit(low, high, 1.0, 1.0))
        return {name: text for name, text in found.items() if text}

    def fix(self, findings):
        tell = self.reported.append
        return list(apply_fixes(self.port, self.kind, self.setups, BAUD, findings, tell))


def one(findings, level, where, words):
    """Return the finding of this level at this place with these words."""
    named = [f for f in findings if f.level == level and f.where == where and words in f.what]
    assert len(named) == 1, [str(f) for f in findings]
    return named[0]


@cache
def healthy(name):
    """Return the first servo of an emulated rig of a kind as the doctor reads it."""
    kind = KINDS[name]
    rig = Rig(kind)
    if kind is DYNAMIXEL:
        rig.set(1, shutdown=52)  # as from the factory it is worth a note
    found = ping(rig.port, kind.family, 1, BAUD)
    registers = Transactions(rig.port, kind.family)
    state = read_state(registers, kind, rig.setups[0], present(found), False)
    assert None not in state.values.values() and worst_level(apply_rules(state)) == "ok"
    return state


def servo_state(kind, number=None, shares_id=False, **values):
    """Return a healthy servo with some registers otherwise, or of another model."""
    state = healthy(kind.name)
    found = state.found._replace(number=number or state.found.number)
    known = {**state.values, **values}
    return structs.replace(state, found=found, shares_id=shares_id, values=known)


@each
def test_a_joint_far_outside_its_range_is_an_error_with_the_text_of_a_refused_run(kind):
    specs = [ServoSpec(1, EYE[kind.name], 4050), ServoSpec(2, EYE[kind.name], 2500)]
    findings = Rig(kind, [*specs, ServoSpec(7, NECK[kind.name], 2048)]).check()
    far = one(findings, "error", PAN, "141 deg outside its range -34.98..34.98 deg: a slipped horn")
    assert (
        "gazerig run RIG --recover" in far.remedy and "gazerig calibrate RIG --joint" in far.remedy
    )
    assert not [
        f for f in findings if f.where == PAN and "is at step" in f.what and f.level != "ok"
    ]
    one(findings, "warn", TILT, "is at step 2500, outside")


RULES = """
both | torque_enable 1 | warn | torque is on | hold the joint
both | present_temperature 59 | ok | 59 degC |
both | present_temperature 60 | warn | 60 degC, it switches off above 70 | cool
both | present_temperature 69 | warn | 69 degC | cool
both | present_temperature 70 | error | 70 degC, it switches off above 70 | cool
both | present_position 1649 | warn | is at step 1649, outside | gazerig calibrate
both | present_position 1650 | ok | at step 1650 |
both | present_position 2446 | ok | at step 2446 |
both | present_position 2447 | warn | is at step 2447, outside its range 1650..2446 | calibrate
both | return_delay_time 250 | warn | waits 500 us | --fix
both | min_position_limit 1700 | warn | 1700..2446 cut the YAML's range 1650..2446 | --fix
both | max_position_limit 2445 | warn | 1650..2445 cut the YAML's range 1650..2446 | --fix
both | max_position_limit 4095 | note | 1650..4095 are wider than the YAML's range | --fix
both | min_position_limit 1649 | note | 1649..2446 are wider than the YAML's range | --fix
both | min_position_limit 1651 max_position_limit 2447 | warn | 1651..2447 cut | --fix
both | baud_rate 99 | ok | at step |
dynamixel | min_position_limit 0 max_position_limit 0 | warn | 0..0 cut | --fix
dynamixel | homing_offset -200 | warn | Homing Offset -200 | Wizard
dynamixel | velocity_limit 100 | note | its Velocity Limit is 137 deg/s | max_speed_deg_s
dynamixel | velocity_limit 382 | note | is 525 deg/s, the YAML asks for 526 | max_speed_deg_s
dynamixel | velocity_limit 383 | ok | at step |
dynamixel | shutdown 1 | warn | does not switch off at each of overheating, electrical shock, \
overload (Shutdown 1) | set Shutdown (63) to 53
dynamixel | status_return_level 1 | warn | does not confirm commands | --fix
dynamixel | hardware_error_status 32 | error | latched: overload | switch its power off and on
dynamixel | present_input_voltage 34 | error | 3.4 V, its limits are 3.5..7.0 V | supply
dynamixel | present_input_voltage 35 | warn | 3.5 V, its limits are 3.5..7.0 V; made for 5 V | wires
dynamixel | present_input_voltage 44 | warn | made for 5 V | thin wires
dynamixel | present_input_voltage 45 | ok | 4.5 V |
dynamixel | present_input_voltage 70 | ok | 7.0 V |
dynamixel | present_input_voltage 71 | error | 7.1 V, its limits are | correct the supply
dynamixel | baud_rate 1 | warn | its Baud Rate is 57600 | gazerig setup
feetech | min_position_limit 0 max_position_limit 0 | warn | has no position limits of its own | --fix
feetech | status 32 | error | reports: overload | switch its
feetech | present_input_voltage 39 | error | 3.9 V, its limits are 4.0..8.0 V | correct the supply
feetech | present_input_voltage 66 | warn | made for 7.4 V | thin wires
feetech | present_input_voltage 67 | ok | 6.7 V |
feetech | present_input_voltage 81 | error | 8.1 V, its limits are 4.0..8.0 V | correct the supply
feetech | present_input_voltage 104 | error | 10.4 V, its limits are | correct the supply
feetech | present_input_voltage 105 | error | 10.5 V, its limits are | sts3215-12v
feetech | present_input_voltage 121 | error | 12.1 V, its limits are 4.0..8.0 V | sts3215-12v
feetech | angular_resolution 2 | warn | counts 2 turns for one | --fix
feetech | position_offset -85 | note | shifted by -85 steps | gazerig calibrate
feetech | max_torque 400 | note | gives 40% of its torque | Max Torque (16)
feetech | overload_torque 100 | warn | overload protection cannot act | Overload Torque (36)
"""
"""Kind of servo, registers and values, worst level, words of the finding and of its remedy."""
CASES = [
    (kind, *rule)
    for named, *rule in ([*map(str.strip, row.split("|"))] for row in RULES.strip().splitlines())
    for kind in KINDS.values()
    if named in ("both", kind.name)
]


@pytest.mark.parametrize(("kind", "value", "level", "words", "remedy"), CASES)
def test_what_can_be_wrong(kind, value, level, words, remedy):
    parts = value.split()
    state = servo_state(kind, **dict(zip(parts[::2], map(int, parts[1::2]), strict=True)))
    findings = apply_rules(state)
    found = one(findings, level, PAN, words)
    assert worst_level(findings) == level
    assert remedy in found.remedy
    assert bool(found.fixes) == ("--fix" in found.remedy)
    for fix in found.fixes:
        assert fix.was == state.values[fix.register]


@each
def test_a_wrong_model_or_two_servos_are_not_judged_further(kind):
    other = 1240 if kind is DYNAMIXEL else 1029
    (only,) = apply_rules(servo_state(kind, other, torque_enable=1))
    assert only.level == "error" and f"the YAML says {EYE[kind.name]}" in only.what
    assert "gazerig setup RIG --joint left_eye_pan" in only.remedy
    (only,) = apply_rules(servo_state(kind, shares_id=True, torque_enable=1))
    assert "two servos share id 1" in only.what


# --- a whole bus


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
@pytest.mark.parametrize(
    ("fault", "says"), [("collide 2", "two servos share id 2"), ("corrupt 2", "in pieces only")]
)
def test_two_servos_with_one_id_and_one_of_which_only_pieces_come(kind, fault, says):
    rig = Rig(kind)
    rig.command(fault)
    assert "alone" in one(rig.check(), "error", TILT, says).remedy


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


# --- Findings about boards of hobby servos and their channels, and fixes


CHANNEL_PAN = ServoConfig(0, "hobby", 4400, 7600, 9000.0, "eyes_pan", rest_steps=6000)
LID = ServoConfig(2, "hobby", 3600, 7200, 9000.0, "left_upper_lid", rest_steps=5000)
SETUPS = (CHANNEL_PAN, LID)
MINI, MICRO = "1ffb:008a", "1ffb:0089"


class BoardRig:
    """A board in this process; what is sent to it is kept."""

    def __init__(self, channels=12, setups=SETUPS, usb=""):
        self.board = build_board(channels, lambda: 0.0)
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
    assert "Timeout to 0.5 s" in reported.remedy and "every channel to Off" in reported.remedy
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


def test_a_good_pca9685_is_well_and_what_it_cannot_tell_is_said():
    findings = examine_pca9685(Pca9685Rig().port, PCA9685, CHANNELS)
    assert worst_level(findings) == "note"
    assert findings[0].what == "answers at 0x40; pulses on 0 of 2 channels"
    assert any("no watchdog" in one.what for one in findings)


def test_a_board_that_is_not_there_is_one_finding_with_its_remedy():
    (only,) = examine_pca9685(Pca9685Rig().port, Pca9685Params(address=0x41), CHANNELS)
    assert only.level == "error" and only.what == "no PCA9685 answers at 0x41"
    assert "VCC" in only.remedy and "jumpers" in only.remedy


@pytest.mark.parametrize(
    ("counts", "level", "remedy"),
    [(307, "warn", "gazerig jog"), (500, "error", "board's power off and on")],
)
def test_pulses_of_a_pca9685_that_were_left_on(counts, level, remedy):
    rig = Pca9685Rig()
    rig.leave_pulse(0, counts)
    found = examine_pca9685(rig.port, PCA9685, CHANNELS)[0]
    assert found.level == level and "though no program runs it" in found.what
    assert remedy in found.remedy


# --- Setting servos up one at a time, on emulated servos, byte for byte


class Bench(Rig):
    """Servos on a table, factory fresh by default, which answer at their own rate only."""

    def __init__(self, *specs, baud=None, kind=DYNAMIXEL):
        self.model, self.baud = NECK[kind.name], baud or kind.family.factory_baud
        super().__init__(kind, specs or (ServoSpec(1, self.model, 2000),), self.baud)

    def find(self):
        order = dict.fromkeys((self.kind.family.factory_baud, *self.kind.family.baud_rates))
        answers = search_rates(
            self.port, self.kind, tuple(order), self.reported.append, thorough=True
        )
        return find_alone(answers, self.port.port_name)

    def assign(self):
        setup = self.setups[2]
        return assign_servo(self.port, self.kind, self.find(), setup, BAUD, self.reported.append)


NUMBER = {"dynamixel": (1240, 53), "feetech": (777, 353)}
"""Model number and firmware."""

ANYWHERE = [
    *((kind, *place) for kind in (DYNAMIXEL, FEETECH) for place in ((1, BAUD), (7, 115_200))),
    *((DYNAMIXEL, 1, 57_600), (FEETECH, 200, 57_600)),
    *((DYNAMIXEL, 200, baud) for baud in DYNAMIXEL.family.baud_rates if baud != 4_500_000),
]


@pytest.mark.parametrize(("kind", "servo_id", "baud"), ANYWHERE)
def test_a_servo_gets_its_id_and_rate_for_good_wherever_it_was(kind, servo_id, baud):
    bench = Bench(ServoSpec(servo_id, NECK[kind.name]), baud=baud, kind=kind)
    assert bench.find() == FoundServo(servo_id, *NUMBER[kind.name], baud, bench.model)
    after, changes = bench.assign()
    assert after == FoundServo(7, *NUMBER[kind.name], BAUD, bench.model)
    assert (f"id {servo_id} -> 7" in changes) == (servo_id != 7)
    assert (f"baud rate {baud} -> {BAUD} bit/s" in changes) == (baud != BAUD)
    assert len(changes) == (servo_id != 7) + (baud != BAUD)
    (servo,) = bench.chain.servos
    assert (servo.id, servo.torque) == (7, False)
    assert bench.get(7, "baud_rate") == kind.family.baud_rates.index(BAUD)
    bench.chain[7].restart()
    bench.pass_time(1.0)
    bench.chain.refresh()
    bench.port.setBaudRate(BAUD)
    assert ping(bench.port, kind.family, 7, BAUD) is not None
    lock = kind.family.lock_register
    assert lock is None or bench.get(7, lock) == 1


@each
def test_a_servo_whose_torque_is_on_is_let_go_first(kind):
    bench = Bench(kind=kind)
    bench.hold(1)
    assert bench.assign()[1][0] == "torque 1 -> 0"
    assert not bench.chain[7].torque


@each
@pytest.mark.parametrize(
    ("ids", "fault", "says"),
    [
        ((1,), "lose all", "no servo answers at any baud rate"),
        ((1,), "truncate all 5", "in pieces only"),
        ((1, 2), "clear", "several servos answer: id 1 .* id 2 .*: connect"),
        ((1, 1), "clear", "alone"),
    ],
)
def test_none_pieces_and_two_servos_are_refused(kind, ids, fault, says):
    model = NECK[kind.name]
    bench = Bench(*(ServoSpec(i, model, 1000 + 500 * n) for n, i in enumerate(ids)), kind=kind)
    bench.port.faults.command(fault)
    with pytest.raises(ServoMissing, match=says):
        bench.find()


@each
def test_another_model_is_refused_and_left_alone(kind):
    bench = Bench(kind=kind)
    before = bytes(bench.chain[1].memory.bytes[:40])
    models = {bench.model: replace(kind.family.models[bench.model], number=1029)}
    bench.kind = kind._replace(family=replace(kind.family, models=models))
    with pytest.raises(ServoMissing, match=r"this is model number \d+, neck_yaw \(servo 7\) wants"):
        bench.assign()
    assert bytes(bench.chain[1].memory.bytes[:40]) == before


# --- Searching a port for every kind: servos are found, and none is moved or changed


class Line:
    """A port in this process, and all that was sent through it."""

    def __init__(self, device):
        self.device, self.sent = device, b""
        self.port = InProcessPort(device, self.tap)

    def tap(self, data):
        self.sent += data

    def search(self, kinds=ORDER, thorough=False):
        return list(search_bus(self.port, kinds, thorough))


# --- a board is never sent what moves it

BOARDS = {
    "as from the shop": build_board(12, lambda: 0.0),
    "micro": build_board(6, lambda: 0.0),
    "with check bytes": build_board(12, lambda: 0.0, crc=True),
}


@pytest.mark.parametrize("board", BOARDS.values(), ids=list(BOARDS))
def test_a_board_is_recognised_before_anything_could_move_it(board):
    board.exchange(bytes.fromhex("8403102F"))
    before = [one["target"] for one in board.faults.reports()]
    line = Line(board)
    rounds = line.search()
    assert rounds[-1].board is not None and {one.kind for one in rounds} == {"maestro"}
    assert b"\xff" not in line.sent
    assert [one["target"] for one in board.faults.reports()] == before


# --- servos of each kind hear the other's packets and are left as they are


@pytest.mark.parametrize(
    ("build", "model", "ids", "kind"),
    [
        (build_dynamixel, "xl330-m077", (1, 2, 252), "dynamixel"),
        (build_feetech, "sts3215", (1, 49, 253), "feetech"),
    ],
)
def test_no_packet_changes_servos_of_either_kind(build, model, ids, kind):
    chain = build([ServoSpec(i, model, 1900 + i) for i in ids], lambda: 0.0)
    before = [bytes(servo.memory.bytes[:56]) for servo in chain.servos]
    places = chain.positions_steps()
    line = Line(chain)
    rounds = line.search(kinds=("feetech",), thorough=True) + line.search(thorough=True)
    assert {one.kind for one in rounds} == set(ORDER)
    found = {(one.kind, servo.id) for one in rounds if one.answers for servo in one.answers.found}
    assert found == {(kind, i) for i in ids}
    assert bytes.fromhex("FFFF0104020009") in line.sent  # an STS packet went over the line
    assert [bytes(servo.memory.bytes[:56]) for servo in chain.servos] == before
    assert chain.positions_steps() == places
