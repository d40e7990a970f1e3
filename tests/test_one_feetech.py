"""Calibrating one emulated STS servo: turned by a hand, or driven gently between its stops."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from drivers.errors import BusLost, ServoFault, ServoMissing
from drivers.feetech.registers import StsRegisters
from robot.bringup.single_joint import SingleJoint, Stopped
from robot.bringup.smart_servo import SmartServo
from robot.calibrate.calibrating import by_hand, by_motion
from robot.calibrate.calibration import CalibrationRefused
from robot.calibrate.placing import HandPlacer, Steered, by_places
from robot.calibrate.stop_search import STEPS_PER_DEG, StopSearchParams
from robot.clock import SimulatedClock
from robot.joint import JointParams
from sim_mock.feetech.chain import build_feetech
from sim_mock.in_process_port import InProcessPort
from sim_mock.smart_servo.physics import Physics, ServoSpec

EYE = JointParams(3, "sts3215", -35.0, 35.0, 300.0, 20000.0)
GENTLY = StopSearchParams()
FREE = (-1e9, 1e9)


class Bench:
    """One emulated servo between stops, and a person with a script."""

    def __init__(self, start: int = 2100, stops: tuple[float, float] = FREE) -> None:
        self.clock = SimulatedClock()
        physics = Physics(stop_low_steps=stops[0], stop_high_steps=stops[1])
        spec = ServoSpec(EYE.id, EYE.model, start, physics=physics)
        self.chain = build_feetech([spec], self.clock.now_s)
        self.port = InProcessPort(self.chain, sleep_until=self.clock.sleep_until)
        self.port.setBaudRate(1_000_000)
        self.registers = StsRegisters(self.port)
        self.why: str | None = None
        self.script: list[int] = []
        self.said: list[str] = []
        self.servo = SmartServo("left_eye_pan", EYE.id, EYE.model, self.port)
        self.joint = SingleJoint("left_eye_pan", EYE, self.servo, self.clock, lambda: self.why)

    def get(self, register: str) -> int:
        value = self.registers.read(EYE.id, register)
        assert value is not None
        return value

    def kept(self) -> dict[str, int]:
        """Give what a restart brings back."""
        self.chain.faults.command(f"brown-out {EYE.id}")
        self.clock.sleep_until(self.clock.now_s() + 1.0)
        return {name: self.get(name) for name in ("min_position_limit", "max_position_limit")}

    # robot.calibrate.calibrating.Person

    def tell(self, line: str) -> None:
        self.said.append(line)

    def wait(self, question: str, live: Callable[[], str]) -> None:
        self.said.append(question)
        if not self.script:
            raise Stopped("stopped by you")
        left = self.script.pop(0)
        while left:
            step = max(-100, min(100, left))
            self.chain.here(EYE.id).turn(step)
            left -= step
            self.clock.sleep_until(self.clock.now_s() + 0.04)
            live()

    def agrees(self, question: str, live: Callable[[], str]) -> bool:
        self.said.append(question)
        live()
        return True


def test_by_hand_zero_sign_and_range_are_found() -> None:
    bench = Bench()
    bench.registers.write(EYE.id, "torque_enable", 1)
    bench.script = [-400, 850, -440]  # left end at fewer steps: the sign is -1
    bench.joint.check()
    found = by_hand(bench.joint, bench, 2.0)
    assert found.sign == -1 and found.zero_step == pytest.approx(2110, abs=2)
    assert found.max_deg == pytest.approx(410 / STEPS_PER_DEG - 2.0, abs=0.2)
    assert bench.get("torque_enable") == 0


def test_by_hand_over_the_seam_the_middle_can_be_set() -> None:
    bench = Bench(start=3900)
    bench.script = [600, -1200, 600]
    with pytest.raises(CalibrationRefused, match=r"crosses the servo's seam .* --set-middle"):
        by_hand(bench.joint, bench, 2.0)
    bench.joint.set_middle()
    bench.script = [600, -1200, 600]
    found = by_hand(bench.joint, bench, 2.0)
    assert found.zero_step == pytest.approx(2048, abs=4) and found.max_deg > 45.0


def test_an_offset_that_was_set_can_be_cleared_for_good() -> None:
    bench = Bench(start=3000)
    bench.joint.set_middle()
    offset = bench.get("position_offset")
    assert offset and bench.joint.check().homing_offset == offset
    assert bench.joint.clear_offset() == offset
    bench.kept()
    assert bench.get("position_offset") == 0
    assert bench.get("present_position") == pytest.approx(3000, abs=4)


def test_by_motion_finds_the_stops_and_puts_everything_back() -> None:
    bench = Bench(2100, (1700.0, 2500.0))
    bench.registers.keep(EYE.id, "min_position_limit", 2000)
    bench.registers.keep(EYE.id, "max_position_limit", 2200)
    names = ("torque_limit", "goal_speed", "acceleration", "min_position_limit",
             "max_position_limit", "lock")  # fmt: skip
    before = {name: bench.get(name) for name in names}
    found = by_motion(bench.joint, bench, 2.0, GENTLY, "middle")
    assert found.sign == 1 and found.zero_step == pytest.approx(2100, abs=8)
    assert found.max_deg == pytest.approx(400 / STEPS_PER_DEG - 2.0, abs=1.0)
    assert found.min_deg == pytest.approx(-400 / STEPS_PER_DEG + 2.0, abs=1.0)
    assert bench.get("torque_enable") == 0
    assert {name: bench.get(name) for name in names} == before
    pushed = [float(line.split("pushed for ")[1].split()[0]) for line in bench.said if "pu" in line]
    assert len(pushed) == 2 and max(pushed) <= 500.0


def test_by_motion_is_slow_and_weak_and_says_that_nothing_watches_it() -> None:
    bench = Bench(2100, (1700.0, 2500.0))
    bench.joint.take_on(GENTLY)
    assert bench.get("torque_limit") == 300
    assert 0 < bench.get("goal_speed") <= 2.0 * 15.0 * STEPS_PER_DEG
    assert "no watchdog" in bench.joint.alone
    bench.joint.leave()
    by_motion(bench.joint, bench, 2.0, GENTLY, "middle")
    assert any("no watchdog" in line for line in bench.said)


def test_limits_that_a_killed_program_left_open_are_narrow_again_after_a_restart() -> None:
    bench = Bench(2100, (1700.0, 2500.0))
    bench.registers.keep(EYE.id, "min_position_limit", 2000)
    bench.registers.keep(EYE.id, "max_position_limit", 2200)
    bench.joint.take_on(GENTLY)
    assert bench.get("min_position_limit") == 0
    assert bench.kept() == {"min_position_limit": 2000, "max_position_limit": 2200}


def test_by_motion_a_stop_that_is_asked_for_lets_go_at_once() -> None:
    bench = Bench(2100, (1700.0, 2500.0))
    bench.why = "SIGINT"
    with pytest.raises(Stopped, match="SIGINT"):
        by_motion(bench.joint, bench, 2.0, GENTLY, "middle")
    assert bench.get("torque_enable") == 0 and bench.get("torque_limit") == 1000


def test_a_servo_that_restarts_on_the_way_has_met_no_stop() -> None:
    bench = Bench(2100, (1000.0, 3000.0))
    bench.joint.take_on(GENTLY)
    bench.chain.faults.command(f"brown-out {EYE.id}")
    with pytest.raises((ServoFault, BusLost)):
        bench.joint.find_stop(GENTLY, 1)


@pytest.mark.parametrize(
    ("register", "value", "says"),
    [
        ("operating_mode", 1, r"operating_mode is 1, not 0: gazerig doctor --fix"),
        ("phase", 0x1C, r"phase is 28, not 12: gazerig doctor --fix"),
    ],
)
def test_a_servo_set_up_in_another_way_is_refused(register: str, value: int, says: str) -> None:
    bench = Bench()
    bench.registers.keep(EYE.id, register, value)
    with pytest.raises(ServoMissing, match=says):
        bench.joint.check()


def test_a_servo_that_suffers_or_is_silent_is_named() -> None:
    bench = Bench()
    bench.port.faults.command(f"overheat {EYE.id}")
    bench.clock.sleep_until(bench.clock.now_s() + 0.1)
    with pytest.raises(ServoFault, match="overheating: let it cool"):
        bench.joint.check()
    bench.port.faults.command(f"lose {EYE.id}")
    with pytest.raises(ServoMissing, match="does not answer"):
        bench.joint.check()
    with pytest.raises(BusLost, match="does not answer any more"):
        bench.joint.position()


class Reader(Bench):
    """Who turns a joint by hand and says the angles read off, those proposed where it is None."""

    angles: list[float | None]

    def number(self, question: str, proposed: float, live: Callable[[], str]) -> float:
        self.said.append(question)
        live()
        said = self.angles.pop(0)
        return proposed if said is None else said

    def steer(self, question: str, servo: Steered) -> None:
        raise AssertionError("a servo that tells its place is turned by hand")


def test_a_push_rod_on_an_sts_servo_is_measured_by_hand() -> None:
    rod = replace(EYE, min_deg=-20.0, max_deg=20.0, linkage=((-25.0, 1800.0), (25.0, 2400.0)))
    bench = Reader(2100)
    single = SingleJoint("left_eye_pan", rod, bench.servo, bench.clock, lambda: None)
    bench.script = [0, 250, -490, 120, 240]
    bench.angles = [22.0, -21.0, None, 10.0]
    made = by_places(HandPlacer(single, bench), bench, 1.0, 1)
    assert [round(at) for _, at in made.linkage] == [1860, 1980, 2100, 2220, 2350]
    assert [angle for angle, _ in made.linkage] == [-21.0, -10.5, 0.0, 10.0, 22.0]
    assert (made.min_deg, made.max_deg) == (-20.0, 21.0)
    assert any("turn left_eye_pan until it reads about step 1980" in line for line in bench.said)
