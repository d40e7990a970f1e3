"""A recorded boxing match is done again to the same bytes: the planner sees what it saw."""

from pathlib import Path

import pytest
from fakes.runs import record

from gazerig.config.schema import load_rig
from gazerig.robot.app.assemble import with_options
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.resimulate import rerun
from gazerig.robot.recording.read import RunRecording

pytestmark = pytest.mark.usefixtures("branched_children")


def test_what_the_planner_chose_is_recorded_and_chosen_again(tmp_path: Path) -> None:
    options = RunOptions(mock=True, fast=True, seed=3, scene="boxing")
    rig = with_options(load_rig("desk"), options)
    ticks = record(tmp_path / "run.mcap", rig, 2.7, options)
    plans = [tick.target.plan for tick in ticks]
    assert {plan.partition(":")[0] for plan in plans} >= {"wait", "guard"}
    recording = RunRecording(tmp_path / "run.mcap")
    recorded = [moment.tick.target.plan for moment in recording.moments()]
    assert recorded[: len(plans)] == plans
    again = rerun(recording, joints="emulated")
    assert again.same and again.tx_same is True
