"""The head shows a study's conditions: no jump at a switch; a lost bus is reported and mended."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from shown_page import wait_for
from slow_rigs import at_rate

from gazerig.features.study.journal import STEP_DEG, Record, TrialBegan, TrialEnded
from gazerig.features.study.run.head_presenter import HeadPresenter
from gazerig.features.study.run.head_process import decode_options, encode_options
from gazerig.features.study.run.study_file import LoadedStudy, load_study
from gazerig.features.study.run.trial_measures import SWITCH_S, measure_presentations
from gazerig.features.study.study_run import HeadLost
from gazerig.features.study.study_session import ShownTrial
from gazerig.robot.app.options import RunOptions
from gazerig.robot.model.clock import RealClock
from gazerig.robot.recording.read import RunRecording

SHOWN_S = 0.8


@pytest.fixture(scope="module")
def study() -> LoadedStudy:
    """The second shipped study, which shows a head, with its objective measures."""
    found = load_study("nakamoto_2")
    objective = ("mutual_gaze_share", "participant_gaze_share", "first_look_s", "rest_median")
    return replace(found, design=replace(found.design, objective=objective))


def presenter(study: LoadedStudy, folder: Path, agreed: tuple[bool, bool]) -> HeadPresenter:
    rig, scene = study.design.presentation.rig, study.design.presentation.scene
    slow = at_rate(folder, rig, 100.0)
    text = Path(slow).read_text(encoding="utf-8")
    # A rig whose bus is lost does not reach its parking pose.
    Path(slow).write_text(text.replace("\nloop:\n", "\nloop:\n  park_s: 1.0\n"), encoding="utf-8")
    options = RunOptions(mock=True, rig=slow, scene=scene, no_page=True).check_and_complete()
    return HeadPresenter(study, options, folder, lambda: agreed, RealClock())


def show_for(shows: HeadPresenter, seconds: float) -> None:
    """Wait by the head's own time, which a starved machine does not run ahead of."""
    head = shows.head
    assert head is not None
    end_s = head.state().t_s + seconds
    wait_for(lambda: head.state().t_s > end_s, "the end of a presentation")


def test_options_come_through_as_a_line(tmp_path: Path) -> None:
    options = RunOptions(mock=True, scene="visitor", record=tmp_path / "a.mcap", seed=3)
    assert decode_options(encode_options(options)) == options


@pytest.mark.slow
def test_conditions_switch_without_a_jump_and_a_lost_bus_is_told_and_mended(
    study: LoadedStudy, tmp_path: Path
) -> None:
    keys = list(study.design.conditions)
    shows = presenter(study, tmp_path, (True, False))
    said: list[str] = []
    records: list[Record] = []
    try:
        for trial, key in enumerate((*keys, keys[0])):
            shown = ShownTrial(trial, 0, 0, key)
            shows.begin(shown)
            show_for(shows, SHOWN_S)
            what = shows.end()
            records.append(TrialBegan(trial, 0, key, ""))
            records.append(
                TrialEnded(trial, 0, "complete", SHOWN_S, "", 0, what.recording, "", *what.span_s)
            )
        assert shows.fault() == "" and shows.report().state == "alive"
        head = shows.head
        assert head is not None
        head.client.fault("unplug")
        wait_for(lambda: "eyes_pan: stale joints" in shows.fault(), "the fault")
        shows.restart()
        assert shows.fault() == ""
        shows.begin(ShownTrial(3, 1, 0, keys[1]))
        assert shows.end().recording == "run-02.mcap"
        assert shows.stop("a hand") == ""
        wait_for(lambda: shows.report().state == "stopped", "the stop")
        assert "a hand" in shows.fault()
    finally:
        shows.close()
    assert shows.head is None
    found = measure_presentations(study, records, tmp_path, said.append)
    assert [(one.trial, one.condition) for one in found] == [*enumerate((*keys, keys[0]))]
    ticks = list(RunRecording(tmp_path / "run-01.mcap").ticks())
    (_, _, _, second, *_) = records
    assert isinstance(second, TrialEnded)
    later = [tick for tick in ticks if tick.t_s >= second.from_s - SWITCH_S]
    steps = np.abs(np.diff([tick.guard_result.command_rad for tick in later], axis=0))
    for one in found[1:]:
        assert 0.0 < one.values[STEP_DEG] <= np.degrees(steps.max())
        assert 0.2 <= one.values["participant_gaze_share"] <= 1.0
    tuned = [type(command).__name__ for tick in ticks for command in tick.commands]
    assert tuned.count("Tune") == 3, "each switch stands in the recording"
    assert (
        measure_presentations(study, [*records, *found], tmp_path, said.append) == () and not said
    )


def test_a_head_that_cannot_start_is_lost_with_its_reason(
    study: LoadedStudy, tmp_path: Path
) -> None:
    options = RunOptions(port="/dev/no-such-port", rig=study.design.presentation.rig, no_page=True)
    shows = HeadPresenter(study, options, tmp_path, lambda: (False, False), RealClock())
    try:
        with pytest.raises(HeadLost, match="/dev/no-such-port|/dev/video0"):
            shows.begin(ShownTrial(0, 0, 0, next(iter(study.design.conditions))))
    finally:
        shows.close()
    assert not list(tmp_path.glob("*.mcap"))


def test_a_recording_that_is_gone_is_said_and_costs_its_measures_alone(
    study: LoadedStudy, tmp_path: Path
) -> None:
    ended = TrialEnded(0, 0, "complete", 1.0, "", 0, "run-09.mcap", "", 1.0, 2.0)
    said: list[str] = []
    assert (
        measure_presentations(study, [TrialBegan(0, 0, "simple", ""), ended], tmp_path, said.append)
        == ()
    )
    assert len(said) == 1 and "run-09.mcap" in said[0]
