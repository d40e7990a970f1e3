"""Whole runs in a world: servo bytes, torques, motion, what is seen, and back to servo bytes."""

from dataclasses import replace
from pathlib import Path

import pytest
from fakes.runs import ticks
from rendering import why_not

from gazerig.config.schema import load_rig
from gazerig.features.world.gl_context import NoRenderer
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.resimulate import rerun
from gazerig.robot.app.session import compose, run
from gazerig.robot.recording.read import RunRecording
from gazerig.sim_mock.cameras.detections import SceneCamera

simulate = pytest.importorskip("gazerig.features.lab.simulated_run").simulate

pytestmark = pytest.mark.usefixtures("mujoco")
FAST = RunOptions(
    mock=True, fast=True, seed=3, world="living-room", no_pictures=True, seconds=1.0
).check_and_complete()


def digest(options: RunOptions) -> object:
    bus = simulate(load_rig("desk"), options).figures["bus"]
    assert isinstance(bus, dict)
    return bus["tx_sha256"]


def test_a_head_in_a_world_finds_the_person_there() -> None:
    made = simulate(load_rig("desk"), replace(FAST, seconds=8.0))
    assert int(str(made.figures["faces_seen"])) > 100
    error = made.figures["gaze_error_deg"]
    assert isinstance(error, dict) and error["median"] < 1.0
    assert made.figures["joint_faults"] == {}


def test_without_a_renderer_it_goes_on_and_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(make: object) -> object:
        raise NoRenderer("no pictures of a world: egl: it is missing")

    monkeypatch.setattr("gazerig.features.world.renderer.open_context", fail)
    made = assemble(load_rig("desk"), replace(FAST, no_pictures=False))
    try:
        assert isinstance(made.robot.camera, SceneCamera)
        made.robot.start(made.clock)
        (tick,) = ticks(made, 1)
        assert any("egl: it is missing; detections are computed" in one for one in tick.events)
        made.robot.stop()
    finally:
        made.close()


def test_a_recorded_run_can_be_done_again_to_the_same_bytes(tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    composed = compose(replace(FAST, record=file))
    figures = run(composed, lambda: None, lambda line: None)
    recording = RunRecording(file)
    assert recording.info.scene == "living-room" and "no pictures" in recording.info.eyes
    again = rerun(recording)
    assert again.is_same and again.sent_bytes_same, again.difference
    assert again.ticks == figures["ticks"]


def test_ideal_servos_move_the_world_too() -> None:
    """For tests above the bus; the head has its pose in the world."""
    made = simulate(load_rig("desk"), replace(FAST, bus="ideal", seconds=4.0))
    error = made.figures["gaze_error_deg"]
    assert isinstance(error, dict) and error["median"] < 1.0


def test_pictures_of_the_same_seed_give_the_same_bytes_on_one_machine() -> None:
    if reason := why_not():
        pytest.skip(reason)
    seen = replace(FAST, no_pictures=False, seconds=0.2)
    assert digest(seen) == digest(seen)
