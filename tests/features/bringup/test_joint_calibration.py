"""Zero, sign and range from servo positions, anywhere on the encoder, with and without its seam."""

from collections.abc import Callable
from dataclasses import replace
from math import radians
from typing import Any

import pytest
from emulated_rig import EmulatedRig
from hypothesis import given
from hypothesis import strategies as st

from gazerig.config.schema import Rig, load_rig
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
    CalibrationRefused,
    Marks,
    PositionUnwrapper,
    joint_calibration,
    with_calibration,
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
STEPS_PER_DEG = TURN / 360.0


# --- following a position over the seam


@given(
    start=st.integers(0, TURN - 1),
    moves=st.lists(st.integers(-1500, 1500), max_size=60),
    wraps=st.booleans(),
)
def test_a_position_is_followed_over_the_seam_however_it_is_reported(
    start: int, moves: list[int], wraps: bool
):
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


@given(
    zero=st.integers(0, TURN - 1),
    sign=st.sampled_from([1, -1]),
    plus_deg=st.floats(3.0, 170.0),
    minus_deg=st.floats(3.0, 170.0),
    margin=st.floats(0.0, 3.0),
    ratio=st.sampled_from([0.5, 1.0, 2.5]),
    turn=st.integers(-2, 2),
)
def test_what_is_found_is_what_is_there_or_it_is_refused(
    zero: int, sign: int, plus_deg: float, minus_deg: float, margin: float, ratio: float, turn: int
):
    joint = replace(EYE, ratio=ratio, min_deg=-1.0, max_deg=1.0)
    scale = sign * ratio * STEPS_PER_DEG
    # Turned before by hand by whole turns: that must not matter.
    place = zero + turn * TURN
    marks = Marks(round(place + scale * plus_deg), round(place - scale * minus_deg), place)
    ends = [end - turn * TURN for end in marks[:2]]
    inside = all(0 <= end < TURN for end in ends)
    try:
        found = joint_calibration("left_eye_pan", marks, joint, margin)
    except CalibrationRefused as refused:
        roomy = plus_deg > margin + 0.2 and minus_deg > margin + 0.2
        wide = plus_deg + minus_deg - 2.0 * margin > 5.5
        assert not (inside and roomy and wide), refused
        return
    assert inside
    assert found.zero_step == zero and found.sign == sign
    made = with_calibration("left_eye_pan", joint, found)
    for angle, end in ((found.max_deg, ends[0]), (found.min_deg, ends[1])):
        short_steps = (end - made.steps(radians(angle))) * (1 if angle > 0 else -1) * sign
        assert margin <= short_steps / (ratio * STEPS_PER_DEG) + 0.1 / ratio
        assert short_steps / (ratio * STEPS_PER_DEG) < margin + 0.1 + 0.2 / ratio


# --- Calibrating one emulated joint by hand or by motion; refused joints


def test_by_hand_over_the_seam_the_middle_of_a_feetech_servo_can_be_set():
    bench = Bench(STS, 3900)
    bench.script = ["600", "-1200", "600"]
    with pytest.raises(CalibrationRefused, match=r"crosses the servo's seam .* --set-middle"):
        calibrate_by_hand(bench.joint, bench, 2.0)
    offset = bench.joint.set_middle()
    bench.command("brown-out {id}")
    bench.clock.sleep_until(bench.clock.now_s() + 1.0)
    assert [bench.get(name) for name in ("position_offset", "lock", "torque_enable")] == [
        offset, 1, 0,
    ]  # fmt: skip
    bench.script = ["600", "-1200", "600"]
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
def test_a_servo_that_suffers_or_is_silent_is_named(joint: JointParams, fault: str, says: str):
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


def test_a_channel_that_gives_pulses_does_not_jump(maker_rig: Rig):
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
def test_whoever_ends_it_gets_a_limp_servo(why: str):
    bench = LinkageBench("eyes_pan", "", "1700")
    bench.script += [""] if why == "SIGINT" else []
    if why == "SIGINT":
        bench.tell = lambda line: setattr(bench, "why", why)  # type: ignore[method-assign]
    with pytest.raises(CalibrationStopped):
        bench.measure()
    assert bench.pulse() == 0
