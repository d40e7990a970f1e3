"""Calibrating one emulated joint: turned by a hand, or driven gently between its stops."""

from collections.abc import Callable

import pytest

from drivers.errors import BusLost, ServoFault, ServoMissing
from drivers.servo_bus.registers import Registers
from robot.bringup.single_joint import SingleJoint, Stopped
from robot.bringup.smart_servo import SmartServo
from robot.calibrate.calibrating import by_hand, by_motion
from robot.calibrate.calibration import CalibrationRefused
from robot.calibrate.stop_search import STEPS_PER_DEG, StopSearchParams
from robot.clock import SimulatedClock
from robot.joint import JointParams
from sim_mock.dynamixel.chain import build_dynamixel
from sim_mock.in_process_port import InProcessPort
from sim_mock.smart_servo.physics import Physics, ServoSpec

EYE = JointParams(1, "xl330-m077", -35.0, 35.0, 600.0, 45000.0)
NECK = JointParams(7, "xc330-m288", -35.0, 35.0, 200.0, 2000.0)
GENTLY = StopSearchParams()


class Bench:
    """One emulated servo between stops, and a person with a script."""

    def __init__(self, joint: JointParams, start: int, stops: tuple[float, float]) -> None:
        self.clock = SimulatedClock()
        physics = Physics(stop_low_steps=stops[0], stop_high_steps=stops[1])
        spec = ServoSpec(joint.id, joint.model, start, physics=physics)
        self.chain = build_dynamixel([spec], self.clock.now_s)
        self.port = InProcessPort(self.chain, sleep_until=self.clock.sleep_until)
        self.port.setBaudRate(1_000_000)
        self.registers = Registers(self.port)
        self.why: str | None = None
        self.id = joint.id
        self.script: list[int] = []
        self.said: list[str] = []
        self.agreed = True
        name = "left_eye_pan" if joint.id == 1 else "neck_yaw"
        servo = SmartServo(name, joint.id, joint.model, self.port)
        self.joint = SingleJoint(name, joint, servo, self.clock, lambda: self.why)

    @property
    def servo(self) -> object:
        return self.chain.here(self.id)

    def get(self, register: str) -> int:
        value = self.registers.read(self.id, register)
        assert value is not None
        return value

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
            self.chain.here(self.id).turn(step)
            left -= step
            self.clock.sleep_until(self.clock.now_s() + 0.04)
            live()

    def agrees(self, question: str, live: Callable[[], str]) -> bool:
        self.said.append(question)
        live()
        return self.agreed


def free(joint: JointParams = EYE, start: int = 2100) -> Bench:
    return Bench(joint, start, (-1e9, 1e9))


def test_by_hand_zero_sign_and_range_are_found() -> None:
    bench = free()
    bench.script = [-400, 850, -440]  # left end at fewer steps: the sign is -1
    found = by_hand(bench.joint, bench, 2.0)
    assert found.sign == -1 and found.zero_step == 2110
    assert found.max_deg == pytest.approx((2110 - 1700) / STEPS_PER_DEG - 2.0, abs=0.11)
    assert found.min_deg == pytest.approx(-(2550 - 2110) / STEPS_PER_DEG + 2.0, abs=0.11)
    assert "turn left_eye_pan to its LEFT end, then press Enter" in bench.said
    assert bench.get("torque_enable") == 0


def test_by_hand_torque_that_was_left_on_goes_off_first() -> None:
    bench = free()
    bench.registers.write(1, "torque_enable", 1)
    bench.script = []
    with pytest.raises(Stopped):
        by_hand(bench.joint, bench, 2.0)
    assert bench.get("torque_enable") == 0


@pytest.mark.parametrize("start", [3900, 200])
def test_by_hand_over_the_seam_is_refused_with_the_turn_that_helps(start: int) -> None:
    bench = free(start=start)
    bench.script = [600, -1200, 600]
    with pytest.raises(CalibrationRefused, match=r"crosses the servo's seam .* take the horn off"):
        by_hand(bench.joint, bench, 2.0)


def test_a_joint_next_to_the_seam_is_calibrated_on_its_side() -> None:
    bench = free(start=3700)
    bench.script = [300, -800, 400]
    found = by_hand(bench.joint, bench, 2.0)
    assert found.zero_step == 3600 and found.max_deg < 36.0


def test_a_servo_turned_by_whole_turns_before_gives_the_same() -> None:
    bench = free(start=2100)
    bench.chain.here(1).turn(4096)
    bench.script = [400, -800, 400]
    assert by_hand(bench.joint, bench, 2.0).zero_step == 2100


def test_by_motion_finds_the_stops_and_lets_go() -> None:
    bench = Bench(EYE, 2100, (1700.0, 2500.0))
    found = by_motion(bench.joint, bench, 2.0, GENTLY, "middle")
    assert found.sign == 1 and found.zero_step == pytest.approx(2100, abs=6)
    assert found.max_deg == pytest.approx(400 / STEPS_PER_DEG - 2.0, abs=0.7)
    assert found.min_deg == pytest.approx(-400 / STEPS_PER_DEG + 2.0, abs=0.7)
    assert bench.get("torque_enable") == 0
    assert bench.get("goal_pwm") == bench.get("pwm_limit")
    pushed = [float(line.split("pushed for ")[1].split()[0]) for line in bench.said if "pu" in line]
    assert len(pushed) == 2 and max(pushed) <= 500.0


def test_by_motion_the_person_says_which_way_it_went() -> None:
    bench = Bench(EYE, 2100, (1700.0, 2500.0))
    bench.agreed = False
    assert by_motion(bench.joint, bench, 2.0, GENTLY, "middle").sign == -1


def test_by_motion_zero_by_a_person() -> None:
    bench = Bench(EYE, 2100, (1700.0, 2500.0))
    bench.script = [100]
    found = by_motion(bench.joint, bench, 2.0, GENTLY, "person")
    assert found.zero_step == pytest.approx(2200, abs=15)


def test_by_motion_narrow_limits_of_the_servo_are_opened_and_put_back() -> None:
    bench = Bench(NECK, 2100, (1700.0, 2500.0))
    bench.registers.write(7, "min_position_limit", 2000)
    bench.registers.write(7, "max_position_limit", 2200)
    found = by_motion(bench.joint, bench, 2.0, GENTLY, "middle")
    assert found.max_deg > 30.0
    assert (bench.get("min_position_limit"), bench.get("max_position_limit")) == (2000, 2200)


def test_by_motion_without_a_stop_before_the_seam_is_refused() -> None:
    bench = Bench(EYE, 3900, (3000.0, 1e9))
    with pytest.raises(CalibrationRefused, match="end of the servo's turn"):
        by_motion(bench.joint, bench, 2.0, GENTLY, "middle")
    assert bench.get("torque_enable") == 0


def test_by_motion_a_stop_that_is_asked_for_lets_go_at_once() -> None:
    bench = Bench(EYE, 2100, (1700.0, 2500.0))
    bench.why = "SIGINT"
    with pytest.raises(Stopped, match="SIGINT"):
        by_motion(bench.joint, bench, 2.0, GENTLY, "middle")
    assert bench.get("torque_enable") == 0 and bench.get("bus_watchdog") == 0


def test_by_motion_is_slow_and_weak() -> None:
    bench = Bench(EYE, 2100, (1700.0, 2500.0))
    bench.joint.take_on(GENTLY)
    assert bench.get("goal_pwm") == round(0.3 * bench.get("pwm_limit"))
    assert 0 < bench.get("profile_velocity") <= 2.0 * 15.0 * STEPS_PER_DEG / 15.6 + 1
    assert bench.get("bus_watchdog") == 15
    start, seen = bench.clock.now_s(), []
    real = bench.joint.position

    def position() -> tuple[int, float]:
        seen.append(real())
        return seen[-1]

    bench.joint.position = position  # type: ignore[method-assign]
    bench.joint.find_stop(GENTLY, 1)
    way = [(p, t) for p, t in seen if t > start + 1.0]
    speed = (way[60][0] - way[0][0]) / (way[60][1] - way[0][1]) / STEPS_PER_DEG
    assert 10.0 < speed < 20.0
    bench.joint.leave()


@pytest.mark.parametrize(
    ("register", "value", "says"),
    [
        ("homing_offset", 300, r"Homing Offset is 300 steps.*--clear-offset"),
        ("operating_mode", 4, r"operating_mode is 4, not 3: gazerig doctor --fix"),
        ("drive_mode", 1, r"drive_mode is 1, not 0"),
    ],
)
def test_a_servo_set_up_in_another_way_is_refused(register: str, value: int, says: str) -> None:
    bench = free()
    bench.registers.write(1, register, value)
    with pytest.raises(ServoMissing, match=says):
        bench.joint.check()


def test_a_homing_offset_can_be_cleared() -> None:
    bench = free()
    bench.registers.write(1, "homing_offset", 300)
    assert bench.joint.clear_offset() == 300
    assert bench.joint.check().homing_offset == 0


def test_a_wrong_model_a_fault_and_a_silent_servo_are_named() -> None:
    bench = free()
    wrong = SmartServo("left_eye_pan", EYE.id, "xc330-m288", bench.port)
    with pytest.raises(ServoMissing, match="is xl330-m077, not xc330-m288"):
        wrong.check()
    bench.port.faults.command("overload 1")
    with pytest.raises(ServoFault, match="overload: .*gazerig reboot 1"):
        bench.joint.check()
    bench.port.faults.command("lose 1")
    with pytest.raises(ServoMissing, match="does not answer"):
        bench.joint.check()
    with pytest.raises(BusLost, match="does not answer any more"):
        bench.joint.position()


def test_a_joint_that_a_hand_took_over_the_seam_is_not_driven() -> None:
    bench = free(start=4000)
    bench.chain.here(1).turn(200)
    with pytest.raises(ServoMissing, match="turned over the seam"):
        bench.joint.take_on(GENTLY)
    assert bench.get("torque_enable") == 0


def test_a_joint_that_is_left_alone_stops_by_itself() -> None:
    bench = free()
    bench.joint.take_on(GENTLY)
    bench.registers.write(1, "goal_position", 3000)
    bench.clock.sleep_until(bench.clock.now_s() + 1.0)
    stopped_at = bench.get("present_position")
    assert bench.get("bus_watchdog") == 255
    bench.clock.sleep_until(bench.clock.now_s() + 1.0)
    assert bench.get("present_position") == pytest.approx(stopped_at, abs=3)
    assert stopped_at < 2100 + 0.5 * 2.0 * 15.0 * STEPS_PER_DEG
