"""Calibrating one emulated joint by hand or by motion; refused joints; and a push rod."""

from collections.abc import Callable
from dataclasses import replace

import pytest
from joint_bench import EYE, GENTLY, NECK, STS, Bench

from gazerig.drivers.errors import BusLost, ServoFault, ServoMissing, SetupError
from gazerig.features.bringup.calibration.endstop_search import STEPS_PER_DEG
from gazerig.features.bringup.calibration.joint_calibration import CalibrationRefused
from gazerig.features.bringup.calibration.joint_procedure import (
    calibrate_by_hand,
    calibrate_by_motion,
)
from gazerig.features.bringup.calibration.linkage_calibration import (
    HandMarker,
    JoggableJoint,
    calibrate_by_marks,
)
from gazerig.features.bringup.calibration.smart_servo_access import (
    CalibrationStopped,
    SingleJoint,
    SingleServo,
)
from gazerig.robot.model.joint import JointParams

STOPS = (1700.0, 2500.0)


each = pytest.mark.parametrize("joint", [EYE, STS], ids=["dynamixel", "feetech"])


@each
def test_by_hand_zero_sign_and_range_are_found(joint: JointParams) -> None:
    bench = Bench(joint)
    bench.script = [-400, 850, -440]  # left end at fewer steps: the sign is -1
    bench.servo.check()
    found = calibrate_by_hand(bench.joint, bench, 2.0)
    assert found.sign == -1 and found.zero_step == pytest.approx(2110, abs=2)
    assert found.max_deg == pytest.approx((2110 - 1700) / STEPS_PER_DEG - 2.0, abs=0.2)
    assert found.min_deg == pytest.approx(-(2550 - 2110) / STEPS_PER_DEG + 2.0, abs=0.2)
    assert "turn left_eye_pan to its LEFT end, then press Enter" in bench.said
    assert bench.get("torque_enable") == 0


@each
def test_by_hand_torque_that_was_left_on_goes_off_first(joint: JointParams) -> None:
    bench = Bench(joint)
    bench.registers.write(joint.id, "torque_enable", 1)
    bench.script = []
    with pytest.raises(CalibrationStopped):
        calibrate_by_hand(bench.joint, bench, 2.0)
    assert bench.get("torque_enable") == 0


@pytest.mark.parametrize("start", [3900, 200])
def test_by_hand_over_the_seam_is_refused_with_the_turn_that_helps(start: int) -> None:
    bench = Bench(EYE, start)
    bench.script = [600, -1200, 600]
    with pytest.raises(CalibrationRefused, match=r"crosses the servo's seam .* take the horn off"):
        calibrate_by_hand(bench.joint, bench, 2.0)
    with pytest.raises(SetupError, match="cannot set its middle"):
        bench.servo.set_middle()


def test_by_hand_over_the_seam_the_middle_of_a_feetech_servo_can_be_set() -> None:
    bench = Bench(STS, 3900)
    bench.script = [600, -1200, 600]
    with pytest.raises(CalibrationRefused, match=r"crosses the servo's seam .* --set-middle"):
        calibrate_by_hand(bench.joint, bench, 2.0)
    bench.servo.set_middle()
    bench.script = [600, -1200, 600]
    found = calibrate_by_hand(bench.joint, bench, 2.0)
    assert found.zero_step == pytest.approx(2048, abs=4) and found.max_deg > 45.0


def test_a_joint_next_to_the_seam_is_calibrated_on_its_side() -> None:
    bench = Bench(EYE, 3700)
    bench.script = [300, -800, 400]
    found = calibrate_by_hand(bench.joint, bench, 2.0)
    assert found.zero_step == 3600 and found.max_deg < 36.0


def test_a_servo_turned_by_whole_turns_before_gives_the_same() -> None:
    bench = Bench(EYE)
    bench.chain.here(1).turn(4096)
    bench.script = [400, -800, 400]
    assert calibrate_by_hand(bench.joint, bench, 2.0).zero_step == 2100


def test_an_offset_that_was_set_can_be_cleared_for_good() -> None:
    bench = Bench(STS, 3000)
    bench.servo.set_middle()
    offset = bench.get("position_offset")
    bench.servo.check()
    assert offset
    assert bench.servo.clear_offset() == offset
    bench.restart()
    assert bench.get("position_offset") == 0
    assert bench.get("present_position") == pytest.approx(3000, abs=4)


def test_a_homing_offset_can_be_cleared() -> None:
    bench = Bench(EYE)
    bench.put("homing_offset", 300)
    assert bench.servo.clear_offset() == 300
    bench.servo.check()
    assert bench.get("homing_offset") == 0


# --- driven


@each
def test_by_motion_finds_the_stops_and_puts_everything_back(joint: JointParams) -> None:
    bench = Bench(joint, 2100, STOPS)
    bench.put("min_position_limit", 2000)
    bench.put("max_position_limit", 2200)
    names = (
        ("torque_limit", "goal_speed", "acceleration", "lock")
        if joint is STS
        else ("goal_pwm", "profile_acceleration", "profile_velocity", "bus_watchdog")
    )
    before = [bench.get(name) for name in names]
    found = calibrate_by_motion(bench.joint, bench, 2.0, GENTLY, "middle")
    assert found.sign == 1 and found.zero_step == pytest.approx(2100, abs=8)
    assert found.max_deg == pytest.approx(400 / STEPS_PER_DEG - 2.0, abs=1.0)
    assert found.min_deg == pytest.approx(-400 / STEPS_PER_DEG + 2.0, abs=1.0)
    assert bench.get("torque_enable") == 0
    assert bench.limits() == (2000, 2200) and [bench.get(name) for name in names] == before
    pushed = [float(line.split("pushed for ")[1].split()[0]) for line in bench.said if "pu" in line]
    assert len(pushed) == 2 and max(pushed) <= 500.0


def test_drive_that_a_killed_program_left_weak_is_full_again() -> None:
    bench = Bench(EYE, 2100, STOPS)
    bench.put("goal_pwm", 200)
    calibrate_by_motion(bench.joint, bench, 2.0, GENTLY, "middle")
    assert bench.get("goal_pwm") == bench.get("pwm_limit")


def test_by_motion_the_person_says_which_way_it_went() -> None:
    bench = Bench(EYE, 2100, STOPS)
    bench.agreed = False
    assert calibrate_by_motion(bench.joint, bench, 2.0, GENTLY, "middle").sign == -1


def test_by_motion_zero_by_a_person() -> None:
    bench = Bench(EYE, 2100, STOPS)
    bench.script = [100]
    found = calibrate_by_motion(bench.joint, bench, 2.0, GENTLY, "person")
    assert found.zero_step == pytest.approx(2200, abs=15)


def test_by_motion_narrow_limits_of_a_neck_servo_are_opened_and_put_back() -> None:
    bench = Bench(NECK, 2100, STOPS)
    bench.put("min_position_limit", 2000)
    bench.put("max_position_limit", 2200)
    found = calibrate_by_motion(bench.joint, bench, 2.0, GENTLY, "middle")
    assert found.max_deg > 30.0 and bench.limits() == (2000, 2200)


def test_by_motion_without_a_stop_before_the_seam_is_refused() -> None:
    bench = Bench(EYE, 3900, (3000.0, 1e9))
    with pytest.raises(CalibrationRefused, match="end of the servo's turn"):
        calibrate_by_motion(bench.joint, bench, 2.0, GENTLY, "middle")
    assert bench.get("torque_enable") == 0


@each
def test_by_motion_a_stop_that_is_asked_for_lets_go_at_once(joint: JointParams) -> None:
    bench = Bench(joint, 2100, STOPS)
    bench.why = "SIGINT"
    with pytest.raises(CalibrationStopped, match="SIGINT"):
        calibrate_by_motion(bench.joint, bench, 2.0, GENTLY, "middle")
    assert bench.get("torque_enable") == 0
    if joint is STS:
        assert bench.get("torque_limit") == 1000
    else:
        assert bench.get("bus_watchdog") == 0


def test_by_motion_is_slow_and_weak() -> None:
    bench = Bench(EYE, 2100, STOPS)
    bench.joint.enable_torque(GENTLY)
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
    bench.servo.restore()


def test_by_motion_a_servo_without_a_watchdog_is_said_to_be_one() -> None:
    bench = Bench(STS, 2100, STOPS)
    bench.joint.enable_torque(GENTLY)
    assert bench.get("torque_limit") == 300
    assert 0 < bench.get("goal_speed") <= 2.0 * 15.0 * STEPS_PER_DEG
    assert "no watchdog" in bench.joint.alone and not Bench(EYE).joint.alone
    bench.servo.restore()
    calibrate_by_motion(bench.joint, bench, 2.0, GENTLY, "middle")
    assert any("no watchdog" in line for line in bench.said)


def test_limits_that_a_killed_program_left_open_are_narrow_again_after_a_restart() -> None:
    bench = Bench(STS, 2100, STOPS)
    bench.put("min_position_limit", 2000)
    bench.put("max_position_limit", 2200)
    bench.joint.enable_torque(GENTLY)
    assert bench.get("min_position_limit") == 0
    bench.restart()
    assert bench.limits() == (2000, 2200)


def test_a_servo_that_restarts_on_the_way_has_met_no_stop() -> None:
    bench = Bench(STS, 2100, (1000.0, 3000.0))
    bench.joint.enable_torque(GENTLY)
    bench.chain.faults.command(f"brown-out {STS.id}")
    with pytest.raises((ServoFault, BusLost)):
        bench.joint.find_stop(GENTLY, 1)


# --- refused


@pytest.mark.parametrize(
    ("joint", "register", "value", "says"),
    [
        (EYE, "homing_offset", 300, r"Homing Offset is 300 steps.*--clear-offset"),
        (EYE, "operating_mode", 4, r"operating_mode is 4, not 3: gazerig doctor --fix"),
        (EYE, "drive_mode", 1, r"drive_mode is 1, not 0"),
        (STS, "operating_mode", 1, r"operating_mode is 1, not 0: gazerig doctor --fix"),
        (STS, "phase", 0x1C, r"phase is 28, not 12: gazerig doctor --fix"),
    ],
)
def test_a_servo_set_up_in_another_way_is_refused(
    joint: JointParams, register: str, value: int, says: str
) -> None:
    bench = Bench(joint)
    bench.put(register, value)
    with pytest.raises(ServoMissing, match=says):
        bench.servo.check()


def test_a_wrong_model_is_named() -> None:
    bench = Bench(EYE)
    wrong = SingleServo("left_eye_pan", EYE.id, "xc330-m288", bench.port)
    with pytest.raises(ServoMissing, match="is xl330-m077, not xc330-m288"):
        wrong.check()


@pytest.mark.parametrize(
    ("joint", "fault", "says"),
    [
        (EYE, "overload {id}", "overload: .*gazerig reboot 1"),
        (STS, "overheat {id}", "overheating: let it cool"),
    ],
)
def test_a_servo_that_suffers_or_is_silent_is_named(
    joint: JointParams, fault: str, says: str
) -> None:
    bench = Bench(joint)
    bench.command(fault)
    with pytest.raises(ServoFault, match=says):
        bench.servo.check()
    bench.command("lose {id}")
    with pytest.raises(ServoMissing, match="does not answer"):
        bench.servo.check()
    with pytest.raises(BusLost, match="does not answer any more"):
        bench.joint.position()


def test_a_servo_that_answers_pings_alone_is_brought_to_speak() -> None:
    bench = Bench(EYE)
    bench.put("status_return_level", 0)
    bench.servo.check()
    assert bench.limits() == (0, 4095)


def test_a_joint_that_a_hand_took_over_the_seam_is_not_driven() -> None:
    bench = Bench(EYE, 4000)
    bench.chain.here(1).turn(200)
    with pytest.raises(ServoMissing, match="turned over the seam"):
        bench.joint.enable_torque(GENTLY)
    assert bench.get("torque_enable") == 0


def test_a_joint_that_is_left_alone_stops_by_itself() -> None:
    bench = Bench(EYE)
    bench.joint.enable_torque(GENTLY)
    bench.registers.write(1, "goal_position", 3000)
    bench.clock.sleep_until(bench.clock.now_s() + 1.0)
    stopped_at = bench.get("present_position")
    assert bench.get("bus_watchdog") == 255
    bench.clock.sleep_until(bench.clock.now_s() + 1.0)
    assert bench.get("present_position") == pytest.approx(stopped_at, abs=3)
    assert stopped_at < 2100 + 0.5 * 2.0 * 15.0 * STEPS_PER_DEG


class Reader(Bench):
    """Who turns a joint by hand and says the angles read off, those proposed where it is None."""

    angles: list[float | None]

    def number(self, question: str, proposed: float, live: Callable[[], str]) -> float:
        self.said.append(question)
        live()
        said = self.angles.pop(0)
        return proposed if said is None else said

    def steer(self, question: str, servo: JoggableJoint) -> None:
        raise AssertionError("a servo that tells its place is turned by hand")


def test_a_push_rod_on_a_smart_servo_is_measured_by_hand() -> None:
    rod = replace(
        STS, min_deg=-20.0, max_deg=20.0, transmission_points=((-25.0, 1800.0), (25.0, 2400.0))
    )
    bench = Reader(STS)
    single = SingleJoint("left_eye_pan", rod, bench.servo, bench.clock, lambda: None)
    bench.script = [0, 250, -490, 120, 240]
    bench.angles = [22.0, -21.0, None, 10.0]
    made = calibrate_by_marks(HandMarker(single, bench), bench, 1.0, 1)
    assert [round(at) for _, at in made.transmission_points] == [1860, 1980, 2100, 2220, 2350]
    assert [angle for angle, _ in made.transmission_points] == [-21.0, -10.5, 0.0, 10.0, 22.0]
    assert (made.min_deg, made.max_deg) == (-20.0, 21.0)
    assert any("turn left_eye_pan until it reads about step 1980" in line for line in bench.said)
