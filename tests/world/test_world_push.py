"""A pushed head yields within its torque limits and returns; registers show it."""

from pathlib import Path

import pytest
from world_rigs import WorldBench, arm, read

from gazerig.config.schema import load_rig
from gazerig.features.world.run.run_world import rig_in_world
from gazerig.features.world.serve import SentWorld
from gazerig.features.world.world_spec import WorldSpec
from gazerig.robot.app.run_bus import emulated_lines
from gazerig.sim_mock.pty.line import BusSettings
from gazerig.sim_mock.pty.server import Server, ServerSettings

pytestmark = pytest.mark.usefixtures("mujoco")
NECK = ("neck_yaw", "neck_pitch", "neck_roll")


def _held() -> WorldBench:
    """Return a desk rig whose neck holds its angles."""
    bench = WorldBench("desk")
    for name in NECK:
        arm(bench.servos[name])
    bench.pass_ms(200)
    return bench


def test_a_push_shows_in_the_registers_and_the_head_comes_back() -> None:
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


def test_servos_yield_within_their_torque_limits() -> None:
    """Of a push that is too strong for them they keep all their torque and no more."""
    bench = _held()
    roll = bench.servos["neck_roll"]
    bench.world.push("head", (0.0, 40.0, 0.0), 0.3)
    bench.pass_ms(280)
    assert abs(bench.world.joints_rad()["neck_roll"]) > 0.3
    assert 0.8 < abs(roll.shaft.effort) <= 1.01


# --- as a command


def test_a_push_that_cannot_be_is_refused_with_what_would_be_right() -> None:
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


def test_a_server_passes_a_push_on_to_its_world_and_everything_else_to_its_servos(
    tmp_path: Path,
) -> None:
    """``gazerig ctl fault`` orders both."""
    spec = WorldSpec(None, (rig_in_world(load_rig("desk"), looks=False),))
    (line,) = emulated_lines(load_rig("desk")).values()
    around = SentWorld(spec, tmp_path)
    server = Server(ServerSettings((BusSettings(line),), True, around), lambda text: None)
    try:
        assert "pushed left with 5 N" in server._obey("push head 5 left 0.1")
        assert "NEWTONS is missing; usage: push BODY NEWTONS" in server._obey("push head")
        assert "servo 7 is stuck" in server._obey("stick 7")
    finally:
        server.close()
