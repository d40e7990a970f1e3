"""Emulated servos whose mechanics are a world's: motion and registers as before, and gravity."""

from dataclasses import replace
from math import radians
from typing import Any

import numpy as np
import pytest
from world_rigs import WorldBench, arm, read, write

from gazerig.config.schema import load_rig
from gazerig.robot.model.coupling import CouplingParams

pytestmark = pytest.mark.usefixtures("mujoco")
COUPLING = CouplingParams("neck_pitch", "neck_roll", 1.5, 1.2)
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
def test_a_step_is_as_that_of_servos_with_mechanics_of_their_own(name, joint, gains):
    """Position within 3 % of the step at every moment, peaks of speed and torque within 8 %."""
    world, own = _moves(_armed(name, joint, gains), joint, 400)
    assert max(abs(a[0] - b[0]) for a, b in zip(world, own, strict=True)) < 0.03 * STEP
    for nth in (1, 2):
        assert max(abs(a[nth]) for a in world) == pytest.approx(
            max(abs(b[nth]) for b in own), rel=0.08
        )
    assert abs(world[-1][0] - STEP) < 6.0


def test_a_stop_holds_a_servo_that_runs_against_it():
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


def test_the_neck_goes_limp_and_falls_when_its_load_is_heavier_than_friction():
    """With the torque off nothing but friction holds; under torque it comes back."""
    bench = _armed("desk", "neck_pitch")
    servo = bench.servos["neck_pitch"]
    before = servo.position_steps
    bench.world._data.qfrc_applied[servo.shaft.axis.dof] = -0.15
    bench.pass_ms(300)
    held = servo.position_steps
    assert abs(held - before) < 40 and servo.shaft.effort > 0.05
    write(servo, "torque_enable", 0)
    bench.pass_ms(300)
    assert servo.position_steps < held - 100 and servo.shaft.effort == 0.0


def test_a_world_whose_numbers_run_away_says_so(tmp_path):
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


def test_a_head_at_rest_does_not_tremble():
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


# --- Hobby servos and ideal ones whose mechanics are a world's


MOVE = 800
"""Quarter microseconds that a servo is sent away, 18 deg."""


@pytest.mark.parametrize("name", ["maker", "six_hobby"])
def test_hobby_servos_follow_their_pulses_as_those_with_mechanics_of_their_own(name):
    """They need as long, and stop within their dead band."""
    bench = WorldBench(name)
    joint = bench.rig.names[0]
    boards = *bench.devices.values(), *bench.own_devices.values()
    channels = [board.channels[bench.rig.joints[joint].id] for board in boards]
    for channel in channels:
        channel.set_target(6000)
    bench.pass_ms(600)
    for servo in bench.both(joint):
        assert abs(servo.place_steps - 6000) <= 2 * servo.spec.dead_steps
    for channel in channels:
        channel.set_target(6000 + MOVE)
    passed = []
    for _ in range(50):
        bench.pass_ms(10)
        passed.append([one.place_steps > 6000 + MOVE / 2 for one in bench.both(joint)])
    short, long = sorted(np.argmax(passed, axis=0))
    assert passed[long] == [True, True] and long - short <= 2
    for servo in bench.both(joint):
        assert abs(servo.place_steps - 6000 - MOVE) <= 1.5 * servo.spec.dead_steps


# --- Several buses and coupled servos in one world


def test_two_servos_move_two_joints_together():
    """Both give what their gears make of the joints' angles, and hold them there."""
    rig = replace(load_rig("desk"), couplings={"neck": COUPLING})
    bench = WorldBench(rig)
    pair = [bench.servos[name] for name in ("neck_pitch", "neck_roll")]
    joints = [rig.joints[name] for name in ("neck_pitch", "neck_roll")]
    for servo in pair:
        arm(servo)
    bench.pass_ms(150)
    for servo, joint, angle in zip(pair, joints, COUPLING.servo_rad((0.2, -0.15)), strict=True):
        write(servo, "goal_position", round(joint.steps(angle)))
    for ms in (20, 20, 40, 900):
        bench.pass_ms(ms)
        angles = bench.world.joints_rad()
        truly = COUPLING.servo_rad((angles["neck_pitch"], angles["neck_roll"]))
        for servo, joint, angle in zip(pair, joints, truly, strict=True):
            ahead = servo.shaft.x - servo.shaft.joint
            assert servo.position_steps - ahead == pytest.approx(joint.steps(angle), abs=0.05)
            assert abs(ahead) < 4.0  # play of both joints
    assert angles["neck_pitch"] == pytest.approx(0.2, abs=radians(1.0))
    assert angles["neck_roll"] == pytest.approx(-0.15, abs=radians(1.0))


# --- A pushed head yields within its torque limits and returns; registers show it


NECK = ("neck_yaw", "neck_pitch", "neck_roll")


def _held() -> WorldBench:
    """Return a desk rig whose neck holds its angles."""
    bench = WorldBench("desk")
    for name in NECK:
        arm(bench.servos[name])
    bench.pass_ms(200)
    return bench


def test_a_push_shows_in_the_registers_and_the_head_comes_back():
    """Present Current against the push, Present Position away from the goal, then as before."""
    bench = _held()
    yaw = bench.servos["neck_yaw"]
    goal, upright = (
        read(yaw, "present_position"),
        read(bench.servos["neck_roll"], "present_position"),
    )
    bench.world.push("head", (0.0, 10.0, 0.0), 0.4)
    bench.pass_ms(300)
    assert read(yaw, "present_position") - goal > 15  # to the left
    # More than 0.1 of the stall current of 1.8 A, in the opposite direction, in units of 1 mA.
    assert read(yaw, "present_current") < -180
    assert read(bench.servos["neck_roll"], "present_position") < upright - 15
    bench.pass_ms(1500)
    assert abs(read(yaw, "present_position") - goal) <= 6
    assert abs(read(yaw, "present_current")) < 80 and not yaw.errors


# --- as a command


def test_a_push_that_cannot_be_is_refused_with_what_would_be_right():
    """The usage follows."""
    from gazerig.features.world.served_world import COMMANDS

    world = WorldBench("desk").world
    for text, message in (
        ("push tail 5 left", "no body 'tail': there is base_link, "),
        ("push head 500 left", "'500' is not NEWTONS from 0 to 100"),
        ("push head 5 sideways", "'sideways' is not forward.back"),
        ("kick head", "'kick' is not a command; commands: push, help"),
    ):
        with pytest.raises(ValueError, match=message):
            COMMANDS.obey(world, text)
