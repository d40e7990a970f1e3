"""Sweeps: the same table whatever the number of processes, resumed, and no process left behind."""

import csv
import json
import os
import signal
import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
import pytest
from branch import Branch, fresh_start, gazerig
from child_processes import running
from command_line import Invoked, invoked

from gazerig.config.load import shipped
from gazerig.config.save_text import params_text
from gazerig.config.schema import load_rig
from gazerig.drivers.errors import SetupError
from gazerig.drivers.process import child_process
from gazerig.features.lab.simulated_run import simulate
from gazerig.features.lab.sweep.axes import Axis, Point, grid, latin_hypercube
from gazerig.features.lab.sweep.outcome import (
    OUTSIDE,
    Outcome,
    figures_of,
    grade,
    rows_of,
    write_tables,
)
from gazerig.features.lab.sweep.response import most_responsive
from gazerig.features.lab.sweep.response_figure import response_png
from gazerig.features.lab.sweep.run_store import RUNS, run_store
from gazerig.features.lab.sweep.worker import figures_at
from gazerig.features.lab.sweep.worker_pool import Job, SweepInterrupted, WorkerPool
from gazerig.robot.app.options import RunOptions

pytestmark = pytest.mark.usefixtures("branched_children")

RIG, DESK = load_rig("desk"), shipped("rigs", "desk")
COMFORT = "gaze.head.comfort_deg"
LOW, HIGH = "gaze.head.min_salience", "gaze.head.max_salience"
QUICK = ("--seconds", "1", "--bus", "ideal", "--jobs", "1")
OPTIONS = RunOptions(mock=True, fast=True, scene="visitor", seconds=1.0, bus="ideal")
PATIENCE_S = 120.0
"""How long another process may take on a machine that is busy."""


def swept(out: Path, *words: str) -> Invoked:
    return invoked("sweep", "--out", str(out), *QUICK, *words)


def table(out: Path) -> list[dict[str, str]]:
    with (out / "table.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a sweep of two points and two seeds, one of whose points fails."""
    out = tmp_path_factory.mktemp("sweep") / "grid"
    done = swept(out, "--set", f"{LOW}=0.2,1.5", "--set", f"{HIGH}=1.0,1.8", "--seeds", "1")
    assert done.code == 0, done.err
    assert "4 points, 1 seeds each: 4 runs" in done.err
    assert "failed: gaze.head.min_salience=1.5, gaze.head.max_salience=1.0, seed 0" in done.err
    return out


def test_a_run_that_fails_is_a_row_with_its_reason(finished: Path) -> None:
    rows = table(finished)
    levels = [(row[LOW], row[HIGH], row["seed"]) for row in rows]
    assert levels == [
        ("0.2", "1.0", "0"),
        ("0.2", "1.8", "0"),
        ("1.5", "1.0", "0"),
        ("1.5", "1.8", "0"),
    ]
    failed = [row["failed"] for row in rows]
    assert failed[2] == "gaze.head: max_salience must be above min_salience"
    assert not any(failed[:2]) and not failed[3]
    assert rows[2]["seconds"] == "" and rows[0]["seconds"] == "0.99"
    assert rows[0]["verdict.rest_error"] in ("pass", "outside", "too few events")
    assert "wall_seconds" not in rows[0]  # no two runs take the same


def test_the_picture_and_parquet_hold_the_same(finished: Path) -> None:
    image = cv2.imdecode(np.frombuffer((finished / "response.png").read_bytes(), np.uint8), 1)
    assert image is not None and image.shape[0] > 200 and image.std() > 5.0
    parquet = pytest.importorskip("pyarrow.parquet")
    columns = parquet.read_table(finished / "table.parquet").to_pydict()
    rows = table(finished)
    assert list(columns) == list(rows[0])
    assert columns[HIGH] == [1.0, 1.8, 1.0, 1.8] and columns["seconds"][2] is None
    assert columns[OUTSIDE][0] == int(rows[0][OUTSIDE])


def test_a_sweep_is_done_once(finished: Path, tmp_path: Path) -> None:
    before = {path.name: path.read_bytes() for path in finished.iterdir()}
    again = swept(finished, "--set", f"{LOW}=0.2,1.5", "--set", f"{HIGH}=1.0,1.8", "--seeds", "1")
    assert again.code == 0, again.err
    assert {path.name: path.read_bytes() for path in finished.iterdir()} == before


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("--seeds", "2"), "seeds was [0], is now [0, 1]"),
        (("--seeds", "1", "--character", "shy"), "options.character was None, is now 'shy'"),
        (("--seeds", "1", "--samples", "4"), "search.samples was None, is now 4"),
    ],
)
def test_other_arguments_are_refused_with_what_differs(
    finished: Path, words: tuple[str, ...], text: str
) -> None:
    done = swept(finished, "--set", f"{LOW}=0.2,1.5", "--set", f"{HIGH}=1.0,1.8", *words)
    assert done.code == 2 and text in done.err and "another folder with --out" in done.err


def test_an_edited_rig_is_another_one(tmp_path: Path) -> None:
    file, out = tmp_path / "mine.yaml", tmp_path / "out"
    file.write_text(Path(DESK).read_text(encoding="utf-8"), encoding="utf-8")
    words = ("sweep", str(file), "--out", str(out), *QUICK, "--set", f"{COMFORT}=95,96")
    assert invoked(*words).code == 2 and not out.exists()
    with run_store(out, {"rig": {"gaze": {"a": 1, "b": 2}}}):
        pass
    with pytest.raises(SetupError, match="rig.gaze.b was 2, is now 3; repeat those"):  # noqa: SIM117
        with run_store(out, {"rig": {"gaze": {"a": 1, "b": 3}}}):
            pass


def test_a_folder_of_something_else_or_in_use_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    done = swept(tmp_path, "--set", f"{COMFORT}=4,8")
    assert done.code == 2 and "holds other files" in done.err
    with run_store(tmp_path / "busy", {}), pytest.raises(SetupError, match="another gazerig sweep"):  # noqa: SIM117
        with run_store(tmp_path / "busy", {}):
            pass


def test_a_line_that_was_being_written_when_the_power_went_is_done_again(tmp_path: Path) -> None:
    with run_store(tmp_path, {}) as store:
        store.add(Outcome({"a": (1, 2)}, 0, {"x": 1.5}))
        store.add(Outcome({"a": (1, 2)}, 1, {}, "too bad"))
    file = tmp_path / RUNS
    file.write_bytes(file.read_bytes()[:-4])
    with run_store(tmp_path, {}) as store:
        assert len(store) == 1 and store.get({"a": (1, 2)}, 1) is None
        kept = store.get({"a": (1, 2)}, 0)
        assert kept is not None and kept.figures == {"x": 1.5}
        store.add(Outcome({"a": (1, 2)}, 1, {"x": 2.5}))
    assert len(file.read_text(encoding="utf-8").splitlines()) == 2


def test_two_processes_make_the_table_of_one(tmp_path: Path) -> None:
    points: list[Point] = [{COMFORT: 4.0}, {COMFORT: 12.0}]
    runs = [(point, seed) for point in points for seed in (0, 1)]
    with WorkerPool(Job(OPTIONS, params_text(RIG)), 2, lambda: None) as pool:
        found = dict(pool.outcomes(runs))
        assert len(pool.pids) == 2
        pids = pool.pids
    assert not alive(pids)
    ordered = [found[i] for i in range(len(runs))]
    alone = [
        Outcome(point, seed, figures_at(RIG, _with_seed(seed), point, lambda: None))
        for point, seed in runs
    ]
    assert rows_of(ordered) == rows_of(alone)
    assert ordered[0].figures != ordered[1].figures


def _with_seed(seed: int) -> RunOptions:
    return RunOptions(mock=True, fast=True, scene="visitor", seconds=1.0, bus="ideal", seed=seed)


def alive(pids: Sequence[int]) -> list[int]:
    return [pid for pid in pids if Path(f"/proc/{pid}/stat").exists() and not _zombie(pid)]


def _zombie(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


def test_a_process_that_dies_costs_its_run_alone_and_the_end_comes_when_asked() -> None:
    ends: list[str] = []
    job = Job(RunOptions(mock=True, fast=True, scene="visitor", seconds=600.0, bus="ideal"), "")
    pool = WorkerPool(job, 1, lambda: ends[0] if ends else None)
    with pool:
        outcomes = pool.outcomes([({}, 0), ({}, 1), ({}, 2)])
        changed = next(outcomes)[1]  # "" is no rig's configuration
        assert changed.failed == "the files of desk changed while the sweep ran"
        os.kill(pool.pids[0], signal.SIGSTOP)
        killed = pool.pids[0]
        os.kill(killed, signal.SIGKILL)
        dead = next(outcomes)[1]
        assert dead.died and dead.failed.startswith("its process ended (killed by signal 9)")
        ends.append("SIGINT")
        with pytest.raises(SweepInterrupted):
            list(outcomes)
        pids = [killed, *pool.pids]
    assert not alive(pids)


# ---- the end from outside


@contextmanager
def begun(out: Path, fresh: bool = False) -> Iterator[Branch]:
    """Start a sweep and wait for its first run; fresh: its workers are other Pythons."""
    words = ("sweep", "--out", str(out), *QUICK, "--set", f"{COMFORT}=1:80:80", "--seeds", "50")
    pipe = subprocess.PIPE
    with pytest.MonkeyPatch.context() as patch:
        if fresh:
            patch.setattr(child_process, "start", fresh_start)
        process = Branch(gazerig(*words), stderr=pipe, text=True)
    file = out / RUNS
    try:
        wait_for(lambda: file.exists() and file.read_bytes().count(b"\n") > 0)
        yield process
    finally:
        process.kill()
        process.wait()
        assert process.stderr is not None
        process.stderr.close()


def wait_for(ready: object) -> None:
    end = time.monotonic() + PATIENCE_S
    assert callable(ready)
    while not ready():
        assert time.monotonic() < end, "it did not come"
        time.sleep(0.02)


def children(pid: int) -> list[int]:
    tasks = Path(f"/proc/{pid}/task").glob("*/children")
    return [int(child) for task in tasks for child in task.read_text().split()]


@pytest.mark.slow
def test_ctrl_c_keeps_what_is_finished_and_leaves_no_process(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with begun(out, fresh=True) as process:
        workers = children(process.pid)
        assert len(workers) == 1
        process.send_signal(signal.SIGINT)
        _, text = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130
    assert f"runs are kept in {out}: the same command continues" in text and "interrupted" in text
    assert not alive(workers)
    lines = (out / RUNS).read_text(encoding="utf-8").splitlines()
    assert lines and all(len(json.loads(line)) == 4 for line in lines)
    assert not (out / "table.csv").exists()


@pytest.mark.slow
def test_a_killed_sweep_leaves_no_process(tmp_path: Path) -> None:
    with begun(tmp_path / "out") as process:
        workers = children(process.pid)
        assert len(workers) == 1
        process.kill()
        process.wait()
        wait_for(lambda: not alive(workers))


# ---- figures


def outcomes_of(points: Sequence[Point], seeds: int = 4) -> list[Outcome]:
    """Return runs in which the blinks follow the first parameter, and nothing else any."""
    rng = np.random.default_rng(1)
    found = []
    for point in points:
        first = next(iter(point.values()))
        x = float(first) if isinstance(first, int | float) else float(len(str(first)))
        for seed in range(seeds):
            figures = {
                OUTSIDE: int(rng.integers(2, 6)),
                "report.blink_rate": x + rng.normal(),
                "report.blink_close": 80.0 + 0.1 * rng.normal(),
                "report.vor": 1.0 + 0.1 * rng.normal(),
                "report.blink_open": 150.0 + 1e-3 * x,  # it follows, by next to nothing
            }
            found.append(Outcome(point, seed, figures))
    return [*found, Outcome(points[0], 99, {}, "it failed")]


BLINKS = Axis("gaze.lids.blinks_per_min", (8.0, 14.0, 20.0), unit="1/min")
CLOSE = Axis("gaze.lids.close_ms", (50, 70), unit="ms")
PROFILE = Axis("gaze.saccade.profile", ("min_jerk", "main_sequence"))
RANGE = Axis("gaze.lids.blinks_per_min", (), 5.0, 30.0, unit="1/min")


def test_the_picture_shows_what_responds() -> None:
    runs = outcomes_of(grid([BLINKS, CLOSE]))[:-1]
    assert most_responsive([BLINKS, CLOSE], runs, 2) == [OUTSIDE, "report.blink_rate"]
    sample = outcomes_of(latin_hypercube([RANGE, PROFILE], 20, 0), 1)[:-1]
    assert most_responsive([RANGE, PROFILE], sample, 2) == [OUTSIDE, "report.blink_rate"]


@pytest.mark.parametrize(
    ("axes", "panels"),
    [((BLINKS,), 1), ((PROFILE,), 1), ((BLINKS, PROFILE), 1), ((BLINKS, CLOSE, PROFILE), 3),
     ((RANGE, PROFILE), 2)],
)  # fmt: skip
def test_a_picture_of_every_number_of_parameters(axes: tuple[Axis, ...], panels: int) -> None:
    points = grid(axes) if RANGE not in axes else latin_hypercube(axes, 12, 0)
    drawn = response_png(axes, outcomes_of(points), ["report.blink_rate"])
    image = cv2.imdecode(np.frombuffer(drawn, np.uint8), cv2.IMREAD_COLOR)
    assert image is not None and image.std() > 5.0
    assert image.shape[1] == pytest.approx(3.3 * 110 * max(panels, 2), abs=2)
    assert drawn == response_png(axes, outcomes_of(points), ["report.blink_rate"])


def test_a_measure_outside_its_band_counts_by_its_distance() -> None:
    assert grade(5.0, 4.0, 6.0) == grade(4.0, 4.0, 6.0) == 0.0
    assert grade(6.5, 4.0, 6.0) == grade(3.5, 4.0, 6.0) == pytest.approx(0.5)
    assert 0.5 < grade(8.0, 4.0, 6.0) < grade(100.0, 4.0, 6.0) < 1.0


def test_a_column_of_numbers_and_words_is_text_in_parquet(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    runs = [
        Outcome({"a": 1, "b": (1, 2)}, 0, {"x": 1}),
        Outcome({"a": "two", "b": True}, 0, {"x": 0.5}),
    ]
    write_tables(tmp_path, runs)
    held = parquet.read_table(tmp_path / "table.parquet").to_pydict()
    assert held["a"] == ["1", "two"] and held["b"] == ["[1, 2]", "True"] and held["x"] == [1.0, 0.5]


def test_a_run_gives_what_the_report_and_the_summary_give() -> None:
    run = simulate(RIG, OPTIONS)
    figures = figures_of(*run)
    assert figures["seconds"] == run.figures["seconds"] and figures["events"] == 0
    assert figures["gaze_error_deg.median"] == run.figures["gaze_error_deg"]["median"]  # type: ignore[index]
    verdicts = [held for name, held in figures.items() if name.startswith("verdict.")]
    assert figures[OUTSIDE] == verdicts.count("outside")
    assert figures["report.too_few_events"] == verdicts.count("too few events") > 5


def test_an_error_while_ticks_are_gathered_is_no_short_run() -> None:
    def fail(tick: object) -> None:
        raise RuntimeError("full")

    with pytest.raises(RuntimeError, match="full"):
        simulate(RIG, OPTIONS, watch=fail)
    assert not running()


# ---- what is refused


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ((), "nothing to vary: give --set KEY=VALUES"),
        (("--set", f"{COMFORT}=4,8", "--show", "blink_rat"), "did you mean 'blink_rate'?"),
        (("--set", f"{COMFORT}=4,8", "--scene", "visiter"), "unknown; scenes: "),
        (("--set", f"{COMFORT}=4,8", "--bus", "real"), "--bus real: unknown"),
        (("--set", f"{COMFORT}=4,8", "--conversation", "sing"), "sing"),
    ],
)
def test_what_cannot_be_run_is_refused_before_a_folder_is_made(
    tmp_path: Path, words: tuple[str, ...], text: str
) -> None:
    done = swept(tmp_path / "out", *words)
    assert done.code == 2 and text in done.err
    assert not (tmp_path / "out").exists()
