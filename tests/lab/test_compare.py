"""Comparison of two runs: the page shows both beside the bands of people."""

import json
from html import unescape
from pathlib import Path

import pytest
from typer.testing import CliRunner

from gazerig.config.save_text import params_text, walk_text
from gazerig.config.schema import load_rig
from gazerig.features.lab.cli.report import app
from gazerig.features.lab.report import report as build
from gazerig.features.lab.report.compare import compare
from gazerig.features.lab.report.page import RunHeader
from gazerig.features.lab.report.statistics import correct_p_values
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import run
from gazerig.robot.recording.read import RunRecording
from gazerig.robot.recording.recorder import Recorder
from gazerig.robot.recording.run_info import RunInfo, versions

pytestmark = pytest.mark.usefixtures("ideal_servos")

SECONDS = 16.0


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
    done = runner.invoke(app, [str(soft), str(hard), "--out", str(tmp_path / "both")])
    assert done.exit_code == 0, done.output
    page = unescape(out.read_text(encoding="utf-8"))
    assert "soft" in page and "hard" in page
    assert page.count("data:image/png;base64,") == len(build.DRAWINGS) > 10
    measures = json.loads((tmp_path / "both_measures.json").read_text(encoding="utf-8"))
    rows = {row["key"]: row for row in measures}
    assert rows["peak_small"]["verdicts"] == ["pass", "outside"]
    assert "peak speed inside the human band" in done.output


def test_one_recording_on_the_command_line(hard: Path, few_drawings: int, tmp_path: Path) -> None:
    one = CliRunner().invoke(app, [str(hard), "--out", str(tmp_path / "one")])
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
    assert any(d.difference == 0.0 for d in found.differences)
    assert not any(d.difference > 0.0 or d.difference < 0.0 for d in found.differences)
    page = found.page.read_text("utf-8")
    assert page.count("data:image/png;base64,") == few_drawings
    assert reported[0] == "reading the run" and reported[-1] == "drawing figures"
