"""Late ticks: joints go on from their goals softly; and servos that tell no angle."""

from math import radians

from guarded_desk import DT, NECK, ZERO, guarding, joints_at

from gazerig.robot.safety.guard import LATE_RAD_S2, SOFT_START_RAD_S2

LOW, HIGH, TOP, ACCEL = NECK[:4]


def test_a_joint_whose_ticks_do_not_come_goes_on_from_its_goal_softly() -> None:
    accel = 3.0 * LATE_RAD_S2
    limit = NECK._replace(speed_rad_s=radians(900.0), accel_rad_s2=accel)
    for missed in (2, 10, 400):
        guard = guarding((LOW,) * 9, (limit,) * 9, period_s=DT)
        t_s, before, speed = 0.0, LOW, 0.0
        for k in range(16):
            t_s += DT if k != 8 else missed * DT
            joints = joints_at((before,) * 9, t_s)
            now = guard.check((HIGH,) * 9, joints, 0.0, t_s).command_rad[0]
            if k >= 8:
                braked = max(0.0, speed - accel * (missed - 1) * DT) if k == 8 else speed
                assert (now - before) / DT <= braked + LATE_RAD_S2 * DT + 1e-9
            before, speed = now, (now - before) / DT


def test_a_slow_joint_regains_its_speed_after_late_ticks_and_no_more() -> None:
    """Every third tick misses some slots."""
    for missed in (2, 60):
        guard = guarding(
            (LOW,) * 9, (NECK,) * 9, gentle=True, period_s=DT, soft_start_speed_deg_s=20.0
        )
        t_s, before, fastest, last = 0.0, LOW, 0.0, 0.0
        for k in range(1, 400):
            gap = missed if k % 3 == 0 else 0
            t_s += (1 + gap) * DT
            joints = joints_at((before,) * 9, t_s)
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
    guard = guarding((LOW,) * 9, (NECK,) * 9, period_s=DT)
    before = LOW
    for k in range(1, 25):
        joints = joints_at((before,) * 9, 2 * k * DT)
        now = guard.check((HIGH,) * 9, joints, 0.0, 2 * k * DT).command_rad[0]
        speed, before = (now - before) / (2 * DT), now
    assert speed > 0.8 * TOP


def test_a_servo_without_feedback_is_never_found_stalled() -> None:
    guard = guarding(limits=(NECK,) * 9, gentle=True)
    for k in range(1, 200):
        joints = joints_at(ZERO, k * DT, measured=(False,) * 9)
        verdict = guard.check((0.4,) * 9, joints, 0.0, k * DT)
        assert verdict.applied("neck_yaw").reason != "not moving"
