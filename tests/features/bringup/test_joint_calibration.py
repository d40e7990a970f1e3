"""Zero, sign and range from servo positions, anywhere on the encoder, with and without its seam."""

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from emulated_rig import EmulatedRig
from hypothesis import given
from hypothesis import strategies as st

from gazerig.config.schema import load_rig
from gazerig.drivers.errors import BusLost, ServoFault, ServoMissing
from gazerig.drivers.maestro.board import MaestroParams
from gazerig.drivers.servo_bus.settings import write_settings
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.features.bringup.calibration.hobby_calibration import (
    PULSES_US,
    SPEED_US_S,
    HobbyServoAccess,
    calibrate_by_marks,
)
from gazerig.features.bringup.calibration.joint_calibration import (
    Calibration,
    CalibrationRefused,
    Marks,
    PositionUnwrapper,
    centre_zero,
    joint_calibration,
    rig_changes,
)
from gazerig.features.bringup.calibration.joint_procedure import calibrate_by_hand
from gazerig.features.bringup.calibration.smart_servo_access import (
    CalibrationStopped,
    SmartServoAccess,
)
from gazerig.features.bringup.servo_kinds import servo_kind
from gazerig.robot.model.clock import SimulatedClock
from gazerig.robot.model.joint import JointParams
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.feetech.chain import build_feetech
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.smart_servo.physics import Physics, ServoSpec

EYE = JointParams(1, "xl330-m077", -35.0, 35.0, 600.0, 45000.0)
STS = JointParams(3, "sts3215", -35.0, 35.0, 300.0, 20000.0)


class Person:
    """A person at a calibration, with a script.

    "+40" and "1480" steer, "" is Enter while steering and the proposed number at a question.
    """

    def __init__(self, *script: str) -> None:
        self.script, self.said = list(script), list[str]()

    def next(self, question: str) -> str:
        self.said.append(question)
        if not self.script:
            raise CalibrationStopped("stopped by you")
        return self.script.pop(0)

    def tell(self, line: str) -> None:
        self.said.append(line)

    def wait(self, question: str, live: Callable[[], str]) -> None:
        raise AssertionError(question)

    def steer(self, question: str, servo: HobbyServoAccess) -> None:
        while answer := self.next(question):
            servo.aim(float(answer) + (servo.place_us if answer[0] in "+-" else 0.0))
            servo.live()

    def ask_number(self, question: str, proposed: float, live: Callable[[], str]) -> float:
        live()
        return float(self.next(question) or proposed)


class Bench(Person):
    """One emulated servo, and a person who turns it."""

    def __init__(self, joint: JointParams, start: int = 2100) -> None:
        super().__init__()
        self.clock = SimulatedClock()
        physics = Physics(stop_low_steps=-1e9, stop_high_steps=1e9)
        spec = ServoSpec(joint.id, joint.model, start, physics=physics)
        build = build_feetech if joint is STS else build_dynamixel
        self.chain = build([spec], self.clock.now_s)
        self.port = InProcessPort(self.chain, sleep_until=self.clock.sleep_until)
        self.port.setBaudRate(1_000_000)
        self.kind = servo_kind(joint.model)
        self.registers = Transactions(self.port, self.kind.family)
        self.id = joint.id
        self.joint = SmartServoAccess("left_eye_pan", joint, self.port, self.clock.now_s)

    def get(self, register: str) -> int:
        value = self.registers.read(self.id, register)
        assert value is not None
        return value

    def put(self, register: str, value: int) -> None:
        write_settings(self.registers, self.id, {register: value})

    def command(self, text: str) -> None:
        self.port.faults.command(text.format(id=self.id))
        self.clock.sleep_until(self.clock.now_s() + 0.1)

    def wait(self, question: str, live: Callable[[], str]) -> None:
        """Turn the joint as the script has it."""
        left = int(self.next(question))
        while left:
            step = max(-100, min(100, left))
            self.chain.find_servo(self.id).turn(step)
            left -= step
            self.clock.sleep_until(self.clock.now_s() + 0.04)
            live()


TURN = 4096


# --- following a position over the seam


@given(
    start=st.integers(0, TURN - 1),
    moves=st.lists(st.integers(-1500, 1500), max_size=60),
    wraps=st.booleans(),
)
def test_a_position_is_followed_over_the_seam_however_it_is_reported(start, moves, wraps):
    track, true = PositionUnwrapper(), start
    assert track.see(start, 0.0) == start
    for i, move in enumerate(moves, 1):
        true += move
        reported = true % TURN if wraps else true
        assert track.see(reported, i * 0.05) == true


def test_turning_unseen_is_refused_when_its_way_is_unknown():
    track = PositionUnwrapper()
    track.see(1000, 0.0)
    assert track.see(1400, 2.0) == 1400
    with pytest.raises(CalibrationRefused, match=r"turned by 97 deg .* for 1.0 s"):
        track.see(2500, 3.0)


# --- marks to a calibration


MARKS = """
left_eye_pan | 2502 1594 2048 | 1 2 | 2048 1 -37.9 37.9
left_eye_pan | 1594 2502 2048 | 1 0 | 2048 -1 -39.9 39.9
left_eye_pan | 2502 1900 2048 | 1 0 | 2048 1 -13 39.9
left_eye_pan | 1900 2502 2048 | 1 0.5 | 2048 -1 -39.4 12.5
left_eye_pan | 6598 5690 6144 | 1 2 | 2048 1 -37.9 37.9
left_eye_pan | -1594 -2502 -2048 | 1 2 | 2048 1 -37.9 37.9
left_eye_pan | 2502 1594 2048 | 2 2 | 2048 1 -17.9 17.9
left_eye_pan | 2276 1820 2048 | 0.5 1 | 2048 1 -39 39
left_eye_pan | 4095 1 2048 | 1 0 | 2048 1 -179.9 179.9
left_eye_pan | 4095 0 2048 | 1 0 | it turns 360 deg, and its servo counts only one turn
left_eye_pan | 2076 2020 2048 | 1 0 | only 4.9 deg are between the two ends, more than 5 are needed
left_eye_pan | 2077 2020 2048 | 1 0 | 4.9 deg are left between its ends, more than 5 and at most 180
left_eye_pan | 2082 2014 2048 | 1 1 | 3.8 deg are left between its ends
left_eye_pan | 3200 1900 2048 | 0.5 0 | 228.5 deg are left between its ends
left_eye_pan | 2502 1594 2600 | 1 0 | straight ahead (step 2600) is not between the ends (steps 1594 to
left_eye_pan | 2502 1594 1593 | 1 0 | straight ahead (step 1593) is not between
left_eye_pan | 2078 1594 2048 | 1 3 | -36.9..-0.4 deg, 3 deg short of its ends, does not include straight
left_eye_pan | 4200 3900 4050 | 1 0 | (steps 3900 to 104) crosses the servo's seam
left_eye_pan | 4200 3900 4050 | 1 0 | by 176 deg towards fewer steps (about 2048)
left_eye_pan | -100 300 100 | 1 0 | by 171 deg towards more steps (about 2048)
jaw | 2502 2048 2040 | 1 2 | 2048 1 0 37.9
jaw | 2048 2502 2510 | 1 2 | 2502 -1 0 37.9
jaw | 2502 2048 2502 | 1 2 | 2502 1 -37.9 0
jaw | 2502 2048 2036 | 1 2 | at rest (step 2036) is not between
"""
"""Name, places of the positive end, negative end and zero, ratio and margin, and what is found.

A degree is 4096 / 360 = 11.38 steps: 454 are 39.90 deg. Ranges are rounded down to tenths.
"""


@pytest.mark.parametrize("row", MARKS.strip().splitlines())
def test_marks_are_a_calibration_or_refused_with_the_reason(row):
    name, places, how, due = (part.strip() for part in row.split("|"))
    ratio, margin = map(float, how.split())
    marks, joint = Marks(*map(int, places.split())), replace(EYE, ratio=ratio)
    if re.fullmatch(r"[-\d. ]+", due):
        found = joint_calibration(name, marks, joint, margin)
        assert found == pytest.approx([*map(float, due.split())])
    else:
        with pytest.raises(CalibrationRefused, match=re.escape(due)):
            joint_calibration(name, marks, joint, margin)


def test_what_depends_on_a_range_follows_it():
    name, made = "left_upper_lid", Calibration(2048, 1, -30.0, 12.0)
    joint = replace(EYE, zero_step=2048, max_deg=12.0)
    for park, moved in ((-31.0, -30.0), (13.0, 12.0), (5.0, None)):
        found = rig_changes(name, joint, made, {name: park})
        assert found.pop(f"park_deg.{name}", None) == moved
        assert found == {f"joints.{name}.min_deg": -30.0, "lid_joints.left_deg": (-30.0, 12.0)}
    assert centre_zero(Marks(1001, 2000, 7)).zero == 1500


# --- Calibrating one emulated joint by hand or by motion; refused joints


def test_by_hand_over_the_seam_the_middle_of_a_feetech_servo_can_be_set():
    bench = Bench(STS, 3900)
    way = ["600", "-1200", "600"]
    bench.script = way.copy()
    bench.put("torque_enable", 1)
    with pytest.raises(CalibrationRefused, match=r"crosses the servo's seam .* --set-middle"):
        calibrate_by_hand(bench.joint, bench, 2.0)
    offset = bench.joint.set_middle()
    bench.command("brown-out {id}")
    bench.clock.sleep_until(bench.clock.now_s() + 1.0)
    assert [bench.get(name) for name in ("position_offset", "lock", "torque_enable")] == [
        offset, 1, 0,
    ]  # fmt: skip
    bench.script = way
    found = calibrate_by_hand(bench.joint, bench, 2.0)
    assert found.zero_step == pytest.approx(2048, abs=4) and found.max_deg > 45.0


# --- refused


@pytest.mark.parametrize(
    ("joint", "fault", "says"),
    [
        (EYE, "overload {id}", "overload: .*switch its power off and on"),
        (STS, "temperature {id} 90", "overheating: let it cool"),
    ],
)
def test_a_servo_that_suffers_or_is_silent_is_named(joint, fault, says):
    bench = Bench(joint)
    bench.command(fault)
    with pytest.raises(ServoFault, match=says):
        bench.joint.check()
    bench.command("lose {id}")
    with pytest.raises(ServoMissing, match="does not answer"):
        bench.joint.check()
    with pytest.raises(BusLost, match="does not answer any more"):
        bench.joint.position()


def test_a_servo_in_another_mode_or_with_an_offset_is_not_calibrated():
    bench = Bench(EYE)
    bench.put("operating_mode", 4)
    with pytest.raises(ServoFault, match=r"not in position mode .* --fix"):
        bench.joint.check()
    bench = Bench(EYE)
    bench.put("homing_offset", -200)
    with pytest.raises(ServoFault, match="Homing Offset -200"):
        bench.joint.check()


# --- measured by eye


class LinkageBench(Person):
    """The maker's board, one of its servos, and a person who measures it."""

    def __init__(self, name: str, *answers: str) -> None:
        super().__init__(*answers)
        made = EmulatedRig(load_rig("maker"))
        rig, self.clock, self.port = made.rig, made.clock, made.ports[""]
        self.board: Any = made.devices[""]
        self.why: str | None = None
        self.channel = rig.joints[name].id
        self.hobby = HobbyServoAccess(
            name,
            rig.joints[name],
            self.port,
            rig.bus.maestro,
            self.clock,
            lambda: self.why,
            self,
        )

    def place_us(self) -> float:
        """Return the true position of the shaft."""
        place_us: float = self.board.find_servo(self.channel).place_steps / 4
        return place_us

    def pulse(self) -> int:
        """Return the pulse that the board gives now."""
        target: int = self.board.faults.reports()[self.channel]["target"]
        return target

    def measure(self, margin: float = 2.0):
        try:
            return calibrate_by_marks(self.hobby, self, margin)
        finally:
            self.hobby.disable()


def test_eyes_are_measured_and_their_pulses_end():
    bench = LinkageBench("eyes_pan", "", "", "1800", "", "25", "1210", "", "-24", "-11", "12")
    made = bench.measure()
    assert made.transmission_points == (
        (-24.0, 1210.0), (-11.0, 1355.0), (0.0, 1500.0), (12.0, 1650.0), (25.0, 1800.0),
    )  # fmt: skip
    assert (made.min_deg, made.max_deg) == (-22.0, 23.0)
    assert bench.pulse() == 0 and bench.place_us() == pytest.approx(1500.0, abs=6.0)
    assert any("Keep your fingers out" in line for line in bench.said)


def test_a_channel_that_gives_pulses_does_not_jump(maker_rig):
    bench = LinkageBench("eyes_pan")
    bench.port.setBaudRate(115_200)
    bench.port.write(MaestroParams(crc=maker_rig.bus.maestro.crc).targets({0: 1534 * 4}))
    bench.clock.sleep_until(1.0)
    before = bench.place_us()
    bench.hobby.begin()
    assert bench.hobby.place_us == 1534.0
    bench.clock.sleep_until(2.0)
    assert bench.place_us() == pytest.approx(before, abs=1.0)


def test_it_moves_slowly_and_never_outside_the_pulses_of_a_servo():
    bench = LinkageBench("eyes_pan", "1700")
    bench.hobby.begin()
    bench.clock.sleep_until(bench.clock.now_s() + 0.5)
    assert bench.hobby.aim(2900.0) == PULSES_US[1] and bench.hobby.aim(100.0) == PULSES_US[0]
    bench.hobby.aim(1900.0)
    start_s, start_us = bench.clock.now_s(), bench.place_us()
    while not bench.hobby.look():
        way_us = bench.place_us() - start_us
        assert way_us <= SPEED_US_S * (bench.clock.now_s() - start_s + 0.05)
    assert bench.hobby.move_to(1900.0) == 1900.0
    assert bench.place_us() == pytest.approx(1900.0, abs=6.0)


@pytest.mark.parametrize("why", ["SIGINT", "q"])
def test_whoever_ends_it_gets_a_limp_servo(why):
    bench = LinkageBench("eyes_pan", "", "1700")
    bench.script += [""] if why == "SIGINT" else []
    if why == "SIGINT":
        bench.tell = lambda line: setattr(bench, "why", why)  # type: ignore[method-assign]
    with pytest.raises(CalibrationStopped):
        bench.measure()
    assert bench.pulse() == 0
