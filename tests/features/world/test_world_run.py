"""Whole runs in a world: servo bytes, torques, motion, what is seen, and back to servo bytes."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fakes.runs import record
from present import present
from slow_rigs import slowed

from gazerig.config.schema import load_rig
from gazerig.features.world.gl_context import NoRenderer
from gazerig.features.world.opponent_motion import HOLD_S, MAX_M_S, MAX_M_S2, TAKE_S, OpponentMotion
from gazerig.features.world.run.poses import RigInState, WorldPoses
from gazerig.features.world.run.run_world import world_of, world_scene
from gazerig.features.world.world_scene import WorldScene
from gazerig.gaze.types import Vec3
from gazerig.robot.loop.tick import Tick
from gazerig.robot.model.commands import MoveOpponent
from gazerig.robot.recording.read import RunRecording
from gazerig.robot.run.emulated import emulated_lines
from gazerig.robot.run.models import rig_kinematics
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.rerun import rerun
from gazerig.robot.run.run import Run
from gazerig.robot.run.run_rig import with_options
from gazerig.sim_mock.pty.line import BusSettings

simulate = pytest.importorskip("gazerig.features.lab.simulated_run").simulate

pytestmark = pytest.mark.usefixtures("mujoco")
FAST = RunOptions(
    mock=True, fast=True, seed=3, world="living-room", no_pictures=True, seconds=1.0
).check_and_complete()


def test_a_head_in_a_world_finds_the_person_there():
    made = simulate(slowed(load_rig("desk"), 50.0), replace(FAST, seconds=5.0))
    assert int(str(made.figures["faces_seen"])) > 100
    off_deg = made.trace.column("off").mean(axis=1)
    assert np.median(off_deg[made.trace.slow()]) < 1.0
    assert made.figures["joint_faults"] == {}


def test_without_a_renderer_the_run_ends_with_the_reason_and_the_remedy(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "none")
    with pytest.raises(NoRenderer, match=r"No module named 'mujoco\.none'.*--no-pictures"):
        Run(load_rig("desk"), replace(FAST, no_pictures=False))


# --- The world of the emulator's process, and the camera that looks into it from another one


class Host:
    """A clock that is set, and a world on it."""

    def __init__(self, folder: Path) -> None:
        from gazerig.features.world.served_world import ServedWorld

        self.rig = load_rig("minimal")
        self.world = world_of(self.rig, RunOptions(mock=True, world="living-room"))
        self.t_s = 100.0
        self.served = ServedWorld(self.world.spec, folder / "state", lambda: self.t_s)
        for name, line in emulated_lines(self.rig).items():
            self.served.device(BusSettings(line, name))
        joints = RigInState(rig_kinematics(self.rig), self.served.joints())
        self.poses = WorldPoses(folder / "state", joints)

    def serve(self, seconds: float, heard: bool) -> None:
        end_s = self.t_s + seconds
        while self.t_s < end_s - 1e-9:
            self.t_s += 0.001
            self.served.serve(heard)


@pytest.fixture
def host(tmp_path) -> Host:
    return Host(tmp_path)


def test_people_wait_until_a_client_has_spoken(host):
    from gazerig.features.world.served_world import PUBLISH_MS

    host.serve(0.05, heard=False)
    assert host.poses.newest() is None and host.poses.begin_s is None
    host.serve(0.05, heard=True)
    begin_s, newest = host.poses.begin_s, host.poses.newest()
    assert begin_s is not None and newest is not None
    assert begin_s == pytest.approx(100.051, abs=0.002)
    assert 0.0 <= host.t_s - newest.host_s <= PUBLISH_MS / 1e3 + 1e-9
    state = host.poses.state
    assert state is not None and state.t_s == pytest.approx(newest.host_s - begin_s, abs=0.002)


# --- A boxer whose fist a person moves: limits, take-over and return, score, and a repeated run


BOXING = RunOptions(
    mock=True, fast=True, seed=1, rig="desk", world="boxing", no_pictures=True, bus="ideal"
)
READY, HIT, LOW = (0.7, 0.0, 0.05), (0.36, 0.0, 0.12), (0.7, 0.0, -0.3)


def path(t_s: float) -> Vec3 | None:
    """Return the orders: a punch at 2 s, an open guard from 3 to 4 s, none after 5 s."""
    if not 1.0 <= t_s < 5.0:
        return None
    return HIT if 2.0 <= t_s < 2.5 else LOW if 3.0 <= t_s < 4.0 else READY


@pytest.fixture
def scene() -> WorldScene:
    return world_scene("boxing", 0)


def hands(scene: WorldScene, orders: Callable[[float], Vec3 | None] = path) -> np.ndarray:
    """Return places of both hands and the face, (n, 3, 3), every 10 ms of 7 s."""
    opponent, found = scene.opponent, []
    assert opponent is not None
    for k in range(700):
        t_s = 0.01 * k
        if k % 5 == 0 and (p_m := orders(t_s)) is not None:
            opponent.move(p_m, t_s)
        opponent.update(t_s)
        left, right = (scene.hand("rival", side, t_s) for side in ("left", "right"))
        found.append((left, right, scene.face("rival", t_s)))
    return np.array(found)


MOVED = """
99 6843 -158 189 8203 1818 189 9176 34 2132
110 6849 -150 195 8209 1824 189 9187 38 2132
150 6904 47 642 8240 1924 189 9202 148 2141
205 6866 56 675 8260 2009 189 9219 233 2141
215 4915 96 759 8216 2015 189 9176 239 2141
245 3128 30 717 7601 2025 189 8561 249 2141
305 6886 56 631 7435 2031 189 8395 255 2141
320 6869 123 -1846 7588 1984 -1852 8626 256 2141
390 6715 276 -3128 7895 1886 -3134 9144 256 2141
430 6905 56 325 8243 2032 189 9202 256 2141
500 6905 56 667 8263 2032 189 9223 256 2141
560 6905 56 667 8265 2032 189 9225 256 2141
640 6886 -1616 -2564 8909 3750 -2565 9429 86 2154
690 6869 -1853 -2893 8981 3931 -2893 9412 35 2157
"""
"""Times in hundredths of a second; x, y, z of the left hand, the right one and the face in .1 mm.

Pinned, not derived: pin anew in the commit that moves a boxer otherwise on purpose.
"""


def test_the_fist_follows_within_its_limits(scene):
    at = hands(scene)
    assert np.linalg.norm(np.diff(at, axis=0), axis=2).max() < 0.01 * MAX_M_S
    # The front fist is at its ordered place; a low one takes the other hand along.
    assert at[245, 0] == pytest.approx(HIT, abs=0.05)
    for row in MOVED.strip().splitlines():
        k, *places = map(int, row.split())
        assert np.abs(1e4 * at[k].ravel() - places).max() < 1.0, row


def test_the_fist_keeps_its_acceleration_where_its_order_jumps():
    motion = OpponentMotion(READY)
    motion.set_target(HIT, 0.0)
    fist = np.array([motion.step(k).fist_m for k in range(90)])
    m_s2 = np.linalg.norm(np.diff(fist, n=2, axis=0), axis=1) / 0.01**2
    assert 0.9 * MAX_M_S2 < m_s2.max() <= MAX_M_S2 + 1e-6


def test_the_script_takes_over_again_after_a_second(scene):
    alone = hands(world_scene("boxing", 0), lambda t_s: None)
    at = hands(scene)
    assert (at[:100] == alone[:100]).all()
    ends_s = 4.95 + HOLD_S + TAKE_S
    (span,) = present(scene.figures.opponent).spans_s
    assert span == pytest.approx((1.02, ends_s), abs=0.05)
    assert (at[int(100 * ends_s) + 5 :] == alone[int(100 * ends_s) + 5 :]).all()
    # The punch of the script at 1.9 s was not thrown, that of the person at 2 s was.
    assert alone[210:230, 0, 0].min() < 0.36 and at[190:200, 0, 0].min() > 0.6


def test_the_recording_of_a_moved_opponent_repeats_to_the_bit(tmp_path):
    def order(number: int, made: Run) -> None:
        if number % 5 == 0 and (p_m := path(0.01 * number)) is not None:
            made.robot.command(MoveOpponent(p_m))

    options = replace(BOXING, character="strong_boxer")
    rig = slowed(with_options(load_rig("desk", "strong_boxer"), options), 100.0)
    ticks: list[Tick] = record(tmp_path / "run.mcap", rig, 3.0, options, order)
    assert any(tick.target.plan.startswith("guard") for tick in ticks)
    ordered = [one for tick in ticks for one in tick.commands]
    assert len(ordered) == 40 and all(isinstance(one, MoveOpponent) for one in ordered)
    found = rerun(RunRecording(tmp_path / "run.mcap"))
    assert found.is_same and found.agreeing_ticks == found.ticks == 299
