"""Late ticks: joints go on from their goals softly; and servos that tell no angle."""

from math import radians

from desk import GAZE_JOINTS
from msgspec.structs import replace

from gazerig.robot.model.guard_params import GuardParams
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.types import JointState
from gazerig.robot.safety.guard import LATE_RAD_S2, SOFT_START_RAD_S2, Guard

DT = 0.005
TOP, ACCEL = radians(200), radians(1_500)
LOW, HIGH = radians(-60), radians(50)


def test_a_joint_whose_ticks_do_not_come_goes_on_from_its_goal_softly() -> None:
    accel = 3.0 * LATE_RAD_S2
    limit = JointLimit(LOW, HIGH, radians(900.0), accel, 70.0, 3.5, 7.0)
    for missed in (2, 10, 400):
        guard = Guard(GuardParams(), (limit,) * 9, GAZE_JOINTS, period_s=DT)
        guard.reset(0.0, (LOW,) * 9)
        guard._gentle = [False] * 9
        t_s, before, speed = 0.0, LOW, 0.0
        for k in range(16):
            t_s += DT if k != 8 else missed * DT
            joints = JointState((before,) * 9, (0.0,) * 9, (t_s,) * 9, ())
            now = guard.check((HIGH,) * 9, joints, 0.0, t_s).command_rad[0]
            if k >= 8:
                braked = max(0.0, speed - accel * (missed - 1) * DT) if k == 8 else speed
                assert (now - before) / DT <= braked + LATE_RAD_S2 * DT + 1e-9
            before, speed = now, (now - before) / DT


def test_a_slow_joint_regains_its_speed_after_late_ticks_and_no_more() -> None:
    """Every third tick misses some slots."""
    limit = JointLimit(LOW, HIGH, TOP, ACCEL, 70.0, 3.5, 7.0)
    params = GuardParams(soft_start_speed_deg_s=20.0)
    for missed in (2, 60):
        guard = Guard(params, (limit,) * 9, GAZE_JOINTS, period_s=DT)
        guard.reset(0.0, (LOW,) * 9)
        t_s, before, fastest, last = 0.0, LOW, 0.0, 0.0
        for k in range(1, 400):
            gap = missed if k % 3 == 0 else 0
            t_s += (1 + gap) * DT
            joints = JointState((before,) * 9, (0.0,) * 9, (t_s,) * 9, ())
            now = guard.check((HIGH,) * 9, joints, 0.0, t_s).command_rad[0]
            speed, before = (now - before) / DT, now
            assert speed <= min(radians(20.0), fastest + SOFT_START_RAD_S2 * DT) + 1e-9
            braked = max(0.0, last - ACCEL * gap * DT)
            assert abs(speed - braked) <= ACCEL * DT + 1e-9
            if gap > 50:  # longer than that it begins as from rest
                assert speed <= braked + SOFT_START_RAD_S2 * DT + 1e-9
            fastest, last = max(fastest, speed), speed
        assert (now > LOW + 0.2) == (missed == 2)


def test_a_loop_that_always_takes_two_slots_is_a_slower_loop() -> None:
    limit = JointLimit(LOW, HIGH, TOP, ACCEL, 70.0, 3.5, 7.0)
    guard = Guard(GuardParams(), (limit,) * 9, GAZE_JOINTS, period_s=DT)
    guard.reset(0.0, (LOW,) * 9)
    guard._gentle = [False] * 9
    before = LOW
    for k in range(1, 25):
        joints = JointState((before,) * 9, (0.0,) * 9, (2 * k * DT,) * 9, ())
        now = guard.check((HIGH,) * 9, joints, 0.0, 2 * k * DT).command_rad[0]
        speed, before = (now - before) / (2 * DT), now
    assert speed > 0.8 * TOP


def test_a_servo_without_feedback_is_never_found_stalled() -> None:
    limit = JointLimit(LOW, HIGH, TOP, ACCEL, 70.0, 3.5, 7.0)
    guard = Guard(GuardParams(), (limit,) * 9, GAZE_JOINTS)
    guard.reset(0.0, (0.0,) * 9)
    for k in range(1, 200):
        joints = JointState((0.0,) * 9, (0.0,) * 9, (k * DT,) * 9, ())
        verdict = guard.check((0.4,) * 9, replace(joints, measured=(False,) * 9), 0.0, k * DT)
        assert verdict.applied("neck_yaw").reason != "not moving"
