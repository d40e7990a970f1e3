"""Hobby servos and ideal ones whose mechanics are a world's."""

import pytest
from world_rigs import WorldBench, mujoco_or_skip

mujoco_or_skip()

from gazerig.config.schema import load_rig  # noqa: E402
from gazerig.features.world.model import world_model  # noqa: E402
from gazerig.features.world.physics import World  # noqa: E402
from gazerig.features.world.run.run_world import rig_in_world, world_ideal_bus  # noqa: E402

MOVE = 800
"""Quarter microseconds that a servo is sent away, 18 deg."""


@pytest.mark.parametrize("name", ["maker", "six_hobby"])
def test_hobby_servos_follow_their_pulses_as_those_with_mechanics_of_their_own(name: str) -> None:
    """They need as long, and stop within their dead band."""
    bench = WorldBench(name)
    joint = bench.rig.names[0]
    for board in (*bench.devices.values(), *bench.own_devices.values()):
        board.body.channels[bench.rig.joints[joint].id].set_target(6000)
    bench.pass_ms(600)
    for board in (*bench.devices.values(), *bench.own_devices.values()):
        board.body.channels[bench.rig.joints[joint].id].set_target(6000 + MOVE)
    halfway_ms = [0, 0]
    for servo in bench.both(joint):
        assert abs(servo.place_steps - 6000) <= 2 * servo.spec.dead_steps
    for ms in range(10, 510, 10):
        bench.pass_ms(10)
        for nth, servo in enumerate(bench.both(joint)):
            if servo.place_steps > 6000 + MOVE / 2 and not halfway_ms[nth]:
                halfway_ms[nth] = ms
    assert halfway_ms[0] and abs(halfway_ms[0] - halfway_ms[1]) <= 20
    for servo in bench.both(joint):
        assert abs(servo.place_steps - 6000 - MOVE) <= 1.5 * servo.spec.dead_steps
        assert servo.is_resting


def test_a_hobby_servo_without_pulses_is_limp() -> None:
    """A hand turns it and it stays; with pulses it goes back."""
    bench = WorldBench("maker")
    joint = bench.rig.names[0]
    servo = bench.servos[joint]
    assert servo.is_unpowered
    before = servo.place_steps
    servo.turn(300.0)
    bench.pass_ms(200)
    assert servo.place_steps == pytest.approx(before + 300.0, abs=3.0)
    bench.devices[""].body.channels[bench.rig.joints[joint].id].set_target(round(before))
    bench.pass_ms(400)
    assert abs(servo.place_steps - before) <= 30.0


def test_ideal_servos_lead_the_joints_of_a_world() -> None:
    """With their lag, within a step; without torque the joints are limp."""
    now_s = [0.0]
    rig = load_rig("desk")
    world = World(world_model(None, [rig_in_world(rig, looks=False)]), lambda: now_s[0])
    bus = world_ideal_bus(rig, world)
    bus.open()
    goals = [round(steps) for steps in bus.enable_torque()]
    goals[0] += 300
    goals[7] += 200
    bus.write(goals)
    now_s[0] = 0.008
    moved = bus.read(now_s[0]).position_steps[0] - goals[0] + 300
    assert 0.5 * 300 < moved < 0.75 * 300  # 1 - 1/e, and the lag of a joint with inertia
    now_s[0] = 0.2
    assert bus.read(now_s[0]).position_steps == pytest.approx(goals, abs=1.0)
    angles = world.joints_rad()
    assert angles["left_eye_pan"] == pytest.approx(
        rig.joints["left_eye_pan"].angle_rad(goals[0]), abs=0.002
    )
    bus.disable_torque()
    goals[0] -= 300
    bus.write(goals)
    now_s[0] = 0.4
    assert bus.read(now_s[0]).position_steps[0] == pytest.approx(goals[0] + 300, abs=2.0)
