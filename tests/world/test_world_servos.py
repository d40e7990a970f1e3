"""Emulated servos whose mechanics are a world's: motion and registers as before, and gravity."""

from pathlib import Path
from typing import Any

import pytest
from world_rigs import WorldBench, arm, write

pytestmark = pytest.mark.usefixtures("mujoco")
STEP = 200
"""Steps of 4096 that a joint is sent."""


def _armed(name: str, joint: str, gains: tuple[int, ...] = ()) -> WorldBench:
    """Return a rig whose joint holds its position, in the world and alone."""
    bench = WorldBench(name)
    for servo in bench.both(joint):
        arm(servo, gains)
    bench.pass_ms(100)
    return bench


def _moves(bench: WorldBench, joint: str, ms: int) -> tuple[list[Any], list[Any]]:
    """Return (position, speed, effort) every 5 ms of both, from where each began."""
    starts = [servo.position_steps for servo in bench.both(joint)]
    rows: tuple[list[Any], list[Any]] = [], []
    for servo, start in zip(bench.both(joint), starts, strict=True):
        write(servo, "goal_position", round(start) + STEP)
    for _ in range(ms // 5):
        bench.pass_ms(5)
        for servo, start, own in zip(bench.both(joint), starts, rows, strict=True):
            own.append((servo.position_steps - start, servo.shaft.v, servo.shaft.effort))
    return rows


@pytest.mark.parametrize(
    ("name", "joint", "gains"),
    [
        ("desk", "left_eye_pan", (1200, 0, 12000)),
        ("desk", "neck_yaw", ()),
        ("feetech", "left_eye_pan", ()),
        ("feetech", "neck_yaw", ()),
    ],
)
def test_a_step_is_as_that_of_servos_with_mechanics_of_their_own(
    name: str, joint: str, gains: tuple[int, ...]
) -> None:
    """Position within 3 % of the step at every moment, peaks of speed and torque within 8 %."""
    world, own = _moves(_armed(name, joint, gains), joint, 400)
    assert max(abs(a[0] - b[0]) for a, b in zip(world, own, strict=True)) < 0.03 * STEP
    for nth in (1, 2):
        assert max(abs(a[nth]) for a in world) == pytest.approx(
            max(abs(b[nth]) for b in own), rel=0.08
        )
    assert abs(world[-1][0] - STEP) < 6.0


def test_without_torque_a_hand_turns_the_joint_and_it_stays_there() -> None:
    """Dry friction of the gear holds what is balanced."""
    bench = WorldBench("desk")
    servo = bench.servos["neck_yaw"]
    before = servo.position_steps
    servo.turn(150.0)
    bench.pass_ms(300)
    assert servo.position_steps == pytest.approx(before + 150.0, abs=1.0)
    assert servo.shaft.effort == 0.0


def test_a_stop_holds_a_servo_that_runs_against_it() -> None:
    """It does not bounce, its registers have the current, the overload protection acts."""
    bench = _armed("desk", "left_eye_pan")
    servo = bench.servos["left_eye_pan"]
    write(servo, "goal_position", 3000)  # 84 deg, the stop is at 39
    bench.pass_ms(400)
    at = servo.position_steps
    assert at == pytest.approx(2048 + 39.0 / 360.0 * 4096, abs=2.0)
    assert abs(servo.shaft.v) < 0.02 and servo.shaft.effort > 0.7
    bench.pass_ms(2200)
    assert servo.errors & 0x20 and not servo.torque


def test_the_neck_goes_limp_and_falls_when_its_load_is_heavier_than_friction() -> None:
    """With the torque off nothing but friction holds; under torque it comes back."""
    bench = _armed("desk", "neck_pitch")
    servo = bench.servos["neck_pitch"]
    before = servo.position_steps
    servo.shaft.axis.load(-0.15)
    bench.pass_ms(300)
    held = servo.position_steps
    assert abs(held - before) < 40 and servo.shaft.effort > 0.05
    write(servo, "torque_enable", 0)
    bench.pass_ms(300)
    assert servo.position_steps < held - 100 and servo.shaft.effort == 0.0


def test_the_bus_watchdog_halts_a_servo_at_its_time_although_nobody_asks() -> None:
    """The world brings all devices up to date."""
    bench = _armed("desk", "neck_yaw")
    servo, device = bench.servos["neck_yaw"], bench.devices[""]
    write(servo, "profile_velocity", 20)
    write(servo, "bus_watchdog", 10)
    write(servo, "goal_position", round(servo.position_steps) + 400)
    bench.now_s += 1.0
    bench.world.advance(round(bench.now_s * 1000.0))
    assert servo.memory.get("bus_watchdog") == 255
    assert servo.position_steps < 2048 + 40
    assert device.positions_steps()


def test_a_world_whose_numbers_run_away_says_so(tmp_path: Path) -> None:
    """MuJoCo would reset silently, and servos would see a joint jump."""
    from gazerig.features.world.physics import WorldUnstable

    spring = (
        '<body pos="1 0 0"><joint name="s" stiffness="1e12" ref="1"/><geom size=".001"/></body>'
    )
    (tmp_path / "own.xml").write_text(
        f'<mujoco><worldbody><site name="gazerig"/>{spring}</worldbody></mujoco>'
    )
    bench = WorldBench("desk", mjcf_file=tmp_path / "own.xml")
    bench.world._data.qvel[-1] = float("nan")
    with pytest.raises(WorldUnstable, match="became unstable 0.0"):
        bench.pass_ms(20)


def test_a_head_at_rest_does_not_tremble() -> None:
    """After a push all nine joints come to rest, stiff gains and all: speeds are none."""
    bench = WorldBench("desk")
    for name, servo in bench.servos.items():
        arm(servo, bench.rig.joints[name].gains or ())
    bench.pass_ms(300)
    bench.world.push("head", (4.0, 6.0, 3.0), 0.1)
    bench.pass_ms(1500)
    before = {name: servo.position_steps for name, servo in bench.servos.items()}
    for _ in range(20):
        bench.pass_ms(5)
        for name, servo in bench.servos.items():
            assert servo.shaft.v == 0.0, name
            assert servo.position_steps == pytest.approx(before[name], abs=0.05)
