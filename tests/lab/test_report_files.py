"""Files that a report reads and writes: nothing of the user's is lost."""

import os
from pathlib import Path

import numpy as np
import pytest
from command_line import typed

from gazerig.drivers.errors import SetupError
from gazerig.features.lab.analysis.eye_tracker_csv import read_recording
from gazerig.features.lab.report.files import files_of, write_all
from gazerig.features.lab.report.gaze_trace import GazeTrace, TraceRow
from gazerig.features.lab.report.page import Figure, RunHeader, report_page
from gazerig.features.lab.report.plotting import COLOURS, Shown, png
from gazerig.features.lab.report.report import DRAWINGS, findings_of


def test_a_pipe_is_no_eye_tracker_recording(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.csv"
    os.mkfifo(pipe)
    with pytest.raises(SetupError, match="is a named pipe, not a regular file"):
        read_recording(pipe)


@pytest.mark.parametrize(
    "words",
    [
        ("report", "--scene", "visitor", "--out", "{}.html"),
        ("compare", "a.mcap", "b.mcap", "--out", "{}.html"),
    ],
    ids=lambda words: words[0],
)
def test_no_report_writes_over_a_file_of_yours(
    words: tuple[str, ...], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "mine.html").write_text("precious")
    assert typed(*(word.replace("{}", str(tmp_path / "mine")) for word in words)) != 0
    assert "unexpected" not in capfd.readouterr().err
    assert (tmp_path / "mine.html").read_text() == "precious"


def test_a_report_leaves_the_summary_of_the_run_and_is_refused_before_any_work(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    run, summary = tmp_path / "x.mcap", tmp_path / "x.json"
    words = ["run", "--mock", "--fast", "--seconds", "1", "--record", str(run)]
    assert typed(*words, "--summary", str(summary)) == 0
    figures = summary.read_bytes()
    made = '<meta name="generator" content="gazerig">'
    for page in (f"{made}a page", f"{made}a newer page"):
        paths, data = write_all(tmp_path / "x.html", page, (), [{"key": 1}], "newer" in page)
        assert summary.read_bytes() == figures and data.name == "x_measures.json" and not paths
    with pytest.raises(SetupError, match="already exists"):
        write_all(tmp_path / "x.html", "another page", (), [])
    capfd.readouterr()
    for reporting in (["report"], ["compare", str(run), "--out", str(tmp_path / "x.html")]):
        assert typed(*reporting, str(run)) == 2
        said = capfd.readouterr().err
        assert "x.html already exists" in said and said.count("\n") == 1
    assert (tmp_path / "x.html").read_text() == f"{made}a newer page"
    assert typed("export", str(run), "--csv") == 0
    assert typed("export", str(run), "--csv") == 2
    assert typed("export", str(run), "--csv", "--force") == 0
    theirs = tmp_path / "theirs"
    theirs.mkdir()
    (theirs / "participants.tsv").write_text("precious")
    assert typed("export", str(run), "--bids", "--out", str(theirs)) == 2
    assert (theirs / "participants.tsv").read_text() == "precious"


@pytest.mark.parametrize(
    "name", ["notes.html", "notes_measures.json", "notes_figures/overview.png"]
)
@pytest.mark.parametrize("command", ["report", "compare"])
def test_a_report_writes_over_nothing_that_no_report_has_made(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], name: str, command: str
) -> None:
    page, theirs = tmp_path / "notes.html", tmp_path / name
    theirs.parent.mkdir(exist_ok=True)
    theirs.write_text("somebody's own")
    # Refused before any work: neither recording is there.
    words = [command, "a.mcap", *(["b.mcap"] if command == "compare" else []), "--out", str(page)]
    for force, text in (((), "already exists: name another file, or use --force"),
                        (("--force",), "was not made by gazerig report or compare")):  # fmt: skip
        assert typed(*words, *force) == 2
        said = capfd.readouterr().err
        assert said.count("\n") == 1 and str(theirs) in said and text in said
        assert theirs.read_text() == "somebody's own"


def test_a_report_writes_over_one_of_before_when_it_is_forced(tmp_path: Path) -> None:
    run = GazeTrace(np.zeros((0, len(TraceRow._fields))), (), (), ())
    about, findings = RunHeader("x"), findings_of(run)
    drawing = DRAWINGS[0]
    figure = Figure(drawing, png(drawing, [Shown("x", run, COLOURS[0])]), "nothing")
    page = report_page(about, run, findings, [figure])
    numbers: list[dict[str, object]] = [{"key": f.band.key} for f in findings]
    out = tmp_path / "x.html"
    write_all(out, page, [figure], numbers)
    files = files_of(out, [drawing.key])
    for file in files:
        file.write_bytes(file.read_bytes() + b"old")
    with pytest.raises(SetupError, match="already exists"):
        write_all(out, page, [figure], numbers)
    write_all(out, page, [figure], numbers, True)
    assert len(files) == 3 and not any(file.read_bytes().endswith(b"old") for file in files)
