"""Hobby servos and ideal ones whose mechanics are a world's."""

import pytest
from world_rigs import WorldBench

pytestmark = pytest.mark.usefixtures("mujoco")
MOVE = 800
"""Quarter microseconds that a servo is sent away, 18 deg."""


@pytest.mark.parametrize("name", ["maker", "six_hobby"])
def test_hobby_servos_follow_their_pulses_as_those_with_mechanics_of_their_own(name: str) -> None:
    """They need as long, and stop within their dead band."""
    bench = WorldBench(name)
    joint = bench.rig.names[0]
    for board in (*bench.devices.values(), *bench.own_devices.values()):
        board.channels[bench.rig.joints[joint].id].set_target(6000)
    bench.pass_ms(600)
    for board in (*bench.devices.values(), *bench.own_devices.values()):
        board.channels[bench.rig.joints[joint].id].set_target(6000 + MOVE)
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


def test_a_hobby_servo_without_pulses_is_limp() -> None:
    """A hand turns it and it stays; with pulses it goes back."""
    bench = WorldBench("maker")
    joint = bench.rig.names[0]
    servo = bench.servos[joint]
    assert servo.width_steps == 0
    before = servo.place_steps
    servo.turn(300.0)
    bench.pass_ms(200)
    assert servo.place_steps == pytest.approx(before + 300.0, abs=3.0)
    bench.devices[""].channels[bench.rig.joints[joint].id].set_target(round(before))
    bench.pass_ms(400)
    assert abs(servo.place_steps - before) <= 30.0
