"""Comparison of two runs: real differences are found, chance is not, and the page shows both."""

import json
from html import unescape
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from gazerig.config.save_text import params_text, walk_text
from gazerig.config.schema import load_rig
from gazerig.features.lab.analysis.human_norms import BY_KEY
from gazerig.features.lab.cli.report import app
from gazerig.features.lab.report import report as build
from gazerig.features.lab.report.compare import compare, measure_differences, permutation_p_value
from gazerig.features.lab.report.page import RunHeader
from gazerig.features.lab.report.statistics import MeasuredValue, correct_p_values, mean, median
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import run
from gazerig.robot.recording.read import RunRecording
from gazerig.robot.recording.recorder import Recorder
from gazerig.robot.recording.run_info import RunInfo, versions

pytestmark = pytest.mark.usefixtures("ideal_servos")

SECONDS = 16.0
DICE = np.random.default_rng(11)


def rates(mean_s: float, count: int, seed: int) -> MeasuredValue:
    dice = np.random.default_rng(seed)
    return MeasuredValue("visit", dice.lognormal(np.log(mean_s), 0.6, count), mean)


def test_what_differs_is_more_than_chance() -> None:
    (found,) = measure_differences([rates(0.25, 200, 1)], [rates(0.35, 200, 2)])
    assert found.word == "more than chance"
    assert found.low95 < found.difference < found.high95 and found.low95 > 0.0
    assert found.p_value < 0.01 and found.shape_p_value < 0.01


def test_the_same_is_chance_nineteen_times_of_twenty() -> None:
    words = []
    for seed in range(20):
        (found,) = measure_differences([rates(0.3, 80, seed)], [rates(0.3, 80, 100 + seed)])
        words.append(found.word)
    assert words.count("more than chance") <= 3
    assert set(words) <= {"more than chance", "may be chance"}


def test_another_spread_is_found_where_the_middle_is_the_same() -> None:
    narrow = MeasuredValue("vergence", DICE.normal(0.0, 0.1, 300), median)
    wide = MeasuredValue("vergence", DICE.normal(0.0, 0.6, 300), median)
    (found,) = measure_differences([narrow], [wide])
    assert found.shape_p_value < 0.001 and found.word == "more than chance"


def test_too_few_events_tell_nothing() -> None:
    few = MeasuredValue("visit", np.full(BY_KEY["visit"].min_events - 1, 9.0), mean)
    (found,) = measure_differences([few], [rates(0.3, 200, 1)])
    assert found.word == "too few events" and np.isnan(found.difference)
    assert measure_differences([few], [MeasuredValue("rate", np.ones(40), mean)]) == ()


def test_dealing_out_again_gives_the_chance_of_a_known_case() -> None:
    a, b = MeasuredValue("visit", np.zeros(4), mean), MeasuredValue("visit", np.ones(4), mean)
    # of the 70 deals of 8 events, 2 are as extreme
    assert permutation_p_value(a, b, np.random.default_rng(0)) == pytest.approx(2 / 70, abs=0.012)
    assert permutation_p_value(a, a, np.random.default_rng(0)) == 1.0


def test_chances_are_corrected_for_their_number() -> None:
    found = correct_p_values({"a": 0.01, "b": 0.04, "c": 0.03})
    assert found == pytest.approx({"a": 0.03, "c": 0.06, "b": 0.06})
    assert correct_p_values({"a": 0.9, "b": 0.8}) == {"a": 1.0, "b": 1.0}


def record(path: Path, seconds: float, saccade: str) -> None:
    """Record a simulated run."""
    made = assemble(load_rig("desk"), RunOptions(True, True, 0, "face-to-face", saccade=saccade))
    rig = made.live_params.rig
    info = RunInfo(
        "desk", rig.profile, params_text(rig), 0, 200.0, "2026-01-31T12:00:00+00:00",
        walk_yaml=walk_text(rig.gaze.scanpath.transition_matrix), scene="face-to-face", mock=True, fast=True,
        versions=versions(),
    )  # fmt: skip
    recorder = Recorder(path, info, patient=True)
    recorder.open()
    made.robot.start(made.clock)
    run(
        made.robot,
        made.clock,
        made.loop,
        lambda s: "over" if s > seconds else None,
        recorder.record,
    )
    made.robot.stop()
    recorder.close("seconds")
    made.close()


@pytest.fixture(scope="module")
def soft(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("runs") / "soft.mcap"
    record(path, SECONDS, "min_jerk")
    return path


@pytest.fixture(scope="module")
def hard(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("runs") / "hard.mcap"
    record(path, SECONDS, "literal_frame")
    return path


@pytest.mark.slow
@pytest.mark.usefixtures("unlaid_figures")
def test_two_recordings_on_the_command_line(soft: Path, hard: Path, tmp_path: Path) -> None:
    out, runner = tmp_path / "both.html", CliRunner()
    done = runner.invoke(app, ["compare", str(soft), str(hard), "--out", str(tmp_path / "both")])
    assert done.exit_code == 0, done.output
    page = unescape(out.read_text(encoding="utf-8"))
    assert "soft" in page and "hard" in page
    assert page.count("data:image/png;base64,") == len(build.DRAWINGS) > 10
    measures = json.loads((tmp_path / "both_measures.json").read_text(encoding="utf-8"))
    rows = {row["key"]: row for row in measures}
    assert rows["peak_small"]["word"] == "more than chance"
    assert rows["peak_small"]["verdicts"] == ["pass", "outside"]
    # The profile of a saccade decides how fast the eyes go, not where they come to rest.
    assert rows["rest_error"]["word"] == "may be chance"
    assert "peak speed inside the human band" in done.output


def test_one_recording_on_the_command_line(hard: Path, few_drawings: int, tmp_path: Path) -> None:
    one = CliRunner().invoke(app, ["report", str(hard), "--out", str(tmp_path / "one")])
    assert one.exit_code == 0, one.output
    page = (tmp_path / "one.html").read_text(encoding="utf-8")
    assert "over in two frames" in page and "literal_frame" in page
    assert len(list((tmp_path / "one_figures").glob("*.png"))) == few_drawings


def test_a_run_against_itself_differs_in_nothing(
    soft: Path, few_drawings: int, tmp_path: Path
) -> None:
    ticks = list(RunRecording(soft).ticks())
    abouts = RunHeader("this", duration_s=SECONDS), RunHeader("again", duration_s=SECONDS)
    reported: list[str] = []
    found = compare(
        (ticks, ticks), abouts, tmp_path / "same.html", lambda words, share: reported.append(words)
    )
    assert any(d.word == "may be chance" for d in found.differences)
    assert not any(d.word == "more than chance" for d in found.differences)
    page = found.page.read_text("utf-8")
    assert "Nothing differs by more than chance" in page
    assert page.count("data:image/png;base64,") == few_drawings
    assert reported[0] == "reading the run" and reported[-1] == "drawing figures"
