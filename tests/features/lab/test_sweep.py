"""Sweeps: the same table whatever the number of processes or machines, and no run lost."""

import csv
import io
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest
from command_line import Invoked, invoked
from slow_rigs import slowed

from gazerig.config.load import ConfigError
from gazerig.config.schema import Rig
from gazerig.drivers.errors import SetupError
from gazerig.features.lab.sweep.points import Point, check_points, grid
from gazerig.features.lab.sweep.runs import Row, open_executor, run_all, run_row
from gazerig.robot.cli.ctl import read_value
from gazerig.robot.run.options import RunOptions

EYES_ALONE = "gaze.head.eye_only_range_deg"
BLINKING = "gaze.lids.blinks_per_min"
LOW, HIGH = "joints.neck_roll.min_deg", "joints.neck_roll.max_deg"
OPTIONS = RunOptions(mock=True, fast=True, scene="visitor", seconds=0.5, bus="ideal")
RUNS: list[tuple[Point, int]] = [({EYES_ALONE: at}, seed) for at in (16, 40) for seed in (0, 1, 2)]


def swept(out: Path, *words: str) -> Invoked:
    quick = ("--seconds", "0.5", "--bus", "ideal", "--jobs", "1")
    return invoked("sweep", "--out", str(out), *quick, *words)


@pytest.fixture(scope="module")
def desk_rig(desk_rig: Rig) -> Rig:
    return slowed(desk_rig, 50.0)


@pytest.fixture(scope="module")
def alone(desk_rig: Rig) -> list[Row]:
    """Return the rows of RUNS, made in this process."""
    return [run_row(desk_rig, replace(OPTIONS, seed=seed), point) for point, seed in RUNS]


def test_a_run_that_fails_is_a_row_with_its_reason(tmp_path):
    out = tmp_path / "grid.csv"
    done = swept(out, "--set", f"{LOW}=-25.0,0.0", "--set", f"{HIGH}=0.0,25.0", "--seeds", "1")
    assert done.code == 0, done.err
    assert "4 points, 1 seeds each: 4 of 4 runs" in done.err
    assert "1 failed: joints.neck_roll: min_deg 0.0 must be below max_deg 0.0" in done.err
    rows = list(csv.DictReader(io.StringIO(out.read_text())))
    levels = [(row[LOW], row[HIGH], row["seed"]) for row in rows]
    assert levels == [(a, b, "0") for a in ("-25.0", "0.0") for b in ("0.0", "25.0")]
    assert [bool(row["failed"]) for row in rows] == [False, False, True, False]
    assert rows[2]["seconds"] == "" and rows[0]["seconds"] == "0.49"
    # A lag without bytes says nothing about servos.
    assert rows[0]["verdict.rest_error"] == "not judged"
    assert rows[0]["verdict.visit"] == "too few events"
    assert swept(out, "--set", f"{LOW}=-25.0,0.0").code == 2  # the table is kept


def test_two_processes_make_the_table_of_one(desk_rig, alone):
    counts: list[int] = []
    with open_executor(2, None) as pool:
        rows = run_all(pool, desk_rig, OPTIONS, RUNS, lambda: None, counts.append)
    assert rows == alone
    assert counts[-1] == len(RUNS)


def test_ctrl_c_leaves_the_rows_of_what_is_finished(desk_rig, alone):
    counts: list[int] = []
    with ThreadPoolExecutor(1) as pool:
        stopped = lambda: "SIGINT" if counts and counts[-1] else None  # noqa: E731
        rows = run_all(pool, desk_rig, OPTIONS, RUNS, stopped, counts.append)
    assert 0 < len(rows) < len(RUNS)
    assert rows == alone[: len(rows)]


# ---- Several machines


@pytest.fixture
def cluster(tmp_path) -> Iterator[tuple[str, list["subprocess.Popen[bytes]"]]]:
    """Start a scheduler here and two workers; return its address and the workers."""
    distributed = pytest.importorskip("distributed")
    words = "-m", "distributed.cli.dask_worker", "--no-nanny", "--no-dashboard", "--nthreads", "1"
    where = "--host", "127.0.0.1", "--local-directory", str(tmp_path)
    with distributed.LocalCluster(n_workers=0, host="127.0.0.1", dashboard_address=None) as here:
        command = [sys.executable, *words, *where, here.scheduler_address]
        workers = [subprocess.Popen(command, stderr=subprocess.DEVNULL) for _ in range(2)]
        try:
            with distributed.Client(here.scheduler_address) as client:
                client.wait_for_workers(2)
            yield here.scheduler_address, workers
        finally:
            for process in workers:
                process.kill()
                process.wait()


def test_a_worker_that_is_killed_loses_no_run_and_repeats_none(cluster, desk_rig, alone):
    address, workers = cluster
    killed: list[int] = []

    def kill_one(done: int) -> None:
        if done and not killed:
            workers[0].kill()
            killed.append(done)

    with open_executor(None, address) as executor:
        rows = run_all(executor, desk_rig, OPTIONS, RUNS, lambda: None, kill_one)
    assert rows == alone
    assert killed and killed[0] < len(RUNS) and workers[0].wait() < 0


def test_no_scheduler_is_one_clear_error():
    pytest.importorskip("distributed")
    with pytest.raises(SetupError, match="--scheduler nowhere: no Dask scheduler answers"):
        open_executor(None, "nowhere").__enter__()


# ---- What --set takes, and what is refused before anything runs


def test_steps_and_lists_are_every_combination():
    points = grid([f"{EYES_ALONE}=4:16:7", "gaze.saccade.profile=min_jerk, human"], read_value)
    values = [tuple(point.values()) for point in points]  # the last key is the fastest
    assert values == [(at, name) for at in range(4, 17, 2) for name in ("min_jerk", "human")]
    assert grid([f"{BLINKING}=8:9:3"], read_value)[1] == {BLINKING: 8.5}


@pytest.mark.parametrize(
    ("settings", "why"),
    [
        ([EYES_ALONE], "not KEY=VALUES"),
        ([f"{EYES_ALONE}=1", f"{EYES_ALONE}=2"], "is given twice"),
        ([f"{EYES_ALONE}=9:4:3"], "LOW must be below HIGH"),
        ([f"{EYES_ALONE}=low:high:3"], "needs numbers"),
        (["profile=mitake"], "give --profile"),
    ],
)
def test_settings_of_no_form_are_refused(settings, why):
    with pytest.raises(SetupError, match=why):
        grid(settings, read_value)


def test_keys_and_values_that_no_point_may_have_are_refused(desk_rig):
    check_points(desk_rig, grid([f"{BLINKING}=-3,8"], read_value))
    for setting in ("gaze.lids.blinks_per_minute=8,9", f"{BLINKING}=-3,-2"):
        with pytest.raises(ConfigError, match="blinks_per_min"):
            check_points(desk_rig, grid([setting], read_value))
