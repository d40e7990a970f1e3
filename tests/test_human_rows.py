"""Runs from the shipped scene to measured joints, and the script that measures rows on them."""

import importlib
import sys
from pathlib import Path

import numpy as np
import pytest
from human.measured_run import BEGIN_S, MeasuredRun, measured_run

BENCH = Path(__file__).parent / "bench"


@pytest.fixture(scope="module")
def run() -> MeasuredRun:
    return measured_run("face-to-face", seconds=8.0)


def test_a_measured_run_is_what_servos_and_scene_say(run: MeasuredRun) -> None:
    n = len(run.t_s)
    assert n == pytest.approx(200 * (8.0 - BEGIN_S), abs=2)
    for name, shape in (("gaze_deg", (2,)), ("eyes_deg", (2, 2)), ("head_deg", (3,)),
                        ("eyes_goal_deg", (2, 2)), ("head_goal_deg", (3,)), ("lids", (2,)),
                        ("phase", ()), ("target_m", (3,))):  # fmt: skip
        assert getattr(run, name).shape == (n, *shape), name
    # The gaze is on the person that the scene held, who is nearer than the next thing is.
    off = np.abs(run.gaze_deg - run.truth_deg("face 0"))
    assert np.median(off[:, 0]) < 3.0 and np.median(off[:, 1]) < 6.0
    # Measured, not commanded: the eyes are late, and encoders have steps.
    late = np.abs(run.eyes_deg - run.eyes_goal_deg).max()
    assert 1.0 < late < 25.0
    # Eyes on the head are the gaze.
    level = np.abs(run.head_deg[:, 2]) < 0.5
    both = run.eyes_deg.mean(axis=1) + run.head_deg[:, :2]
    assert np.abs(run.gaze_deg - both)[level].max() < 2.5


def test_a_run_is_made_once_and_its_parameters_count(run: MeasuredRun) -> None:
    assert measured_run("face-to-face", seconds=8.0) is run
    still = measured_run(
        "face-to-face", seconds=8.0, overrides={"gaze.scanpath.model": "face_tracking"}
    )
    assert still.saccades[-1] < 0.7 * run.saccades[-1]  # small ones within the face are left


def test_every_row_measures_what_it_wants(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(BENCH))
    bench = importlib.import_module("measured_rows")
    for number, row in [*bench.rows("human").items(), *bench.rows("seeing").items()]:
        assert row.__doc__ and callable(row.measure), number
        assert all(low <= high for low, high in row.WANTED.values()), number


def test_the_script_tells_inside_from_outside(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.syspath_prepend(str(BENCH))
    bench = importlib.import_module("bench_human")

    class Row:
        """Definition of a row."""

        WANTED = {"low": (0.0, 1.0), "high": (0.0, 1.0), "lost": (0.0, 1.0)}

        @staticmethod
        def measure(run: object, seconds: float, seeds: object) -> dict[str, float]:
            return {"low": 0.5, "high": 2.0, "lost": float("nan"), "beside": 7.0}

    monkeypatch.setattr(importlib.import_module("measured_rows"), "rows", lambda folder: {99: Row})
    saved = tmp_path / "saved.json"
    monkeypatch.setattr(sys, "argv", ["bench_human", "--save", str(saved)])
    bench.main()
    monkeypatch.setattr(sys, "argv", ["bench_human", "--against", str(saved)])
    bench.main()
    lines = capsys.readouterr().out.splitlines()
    words = {line.split()[0]: line.split()[-1] for line in lines if line.startswith("    ")}
    assert words == {"low": "inside", "high": "OUTSIDE", "lost": "MEASURED", "beside": "7.000"}
    assert any("2.000 ->" in line for line in lines)
    assert lines[-1].startswith("1 of 3 figures inside")
