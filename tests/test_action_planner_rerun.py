"""A recorded boxing match is done again to the same bytes: the planner sees what it saw."""

from pathlib import Path

import pytest

from gazerig.config.schema import load_rig
from gazerig.robot.app.assemble import Substitutes, assemble, with_options
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.resimulate import rerun
from gazerig.robot.app.run_rig import run_info
from gazerig.robot.app.session import shut_down
from gazerig.robot.control.loop import run
from gazerig.robot.control.tick import Tick
from gazerig.robot.recording.read import RunRecording
from gazerig.robot.recording.recorder import Recorder

pytestmark = pytest.mark.usefixtures("branched_children")


def test_what_the_planner_chose_is_recorded_and_chosen_again(tmp_path: Path) -> None:
    options = RunOptions(mock=True, fast=True, seed=3, scene="boxing")
    rig = with_options(load_rig("desk"), options)
    recorder = Recorder(tmp_path / "run.mcap", run_info(rig, options), patient=True)
    recorder.open()
    made = assemble(rig, options, Substitutes(body=recorder.wrap_body))
    plans: list[str] = []

    def watch(tick: Tick) -> None:
        recorder.record(tick)
        plans.append(tick.target.plan)

    made.robot.start(made.clock)
    stop = recorder.wrap_stop(lambda s: "seconds" if s >= 2.7 else None)
    count = run(made.robot, made.clock, lambda: made.loop, stop, watch)
    shut_down(made, count, lambda line: None)
    recorder.close(count.stopped_by, made.sent_digest())
    made.close()
    assert {plan.partition(":")[0] for plan in plans} >= {"wait", "guard"}
    recording = RunRecording(tmp_path / "run.mcap")
    recorded = [moment.tick.target.plan for moment in recording.moments()]
    assert recorded[: len(plans)] == plans
    again = rerun(recording, joints="emulated")
    assert again.same and again.tx_same is True
