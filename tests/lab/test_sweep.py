"""Sweeps: the same table whatever the number of processes, and no process left behind."""

import csv
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from command_line import Invoked, invoked
from hypothesis import given, settings
from hypothesis import strategies as st

from gazerig.config.save_text import params_text
from gazerig.config.schema import Rig, load_rig
from gazerig.drivers.errors import SetupError
from gazerig.features.lab.analysis.human_norms import BY_KEY
from gazerig.features.lab.sweep.axes import (
    Axis,
    Point,
    latin_hypercube,
    make_axes,
)
from gazerig.features.lab.sweep.fit import (
    counted_measures,
    fit_settings,
)
from gazerig.features.lab.sweep.run_outcome import (
    OUTSIDE,
    Outcome,
    table_rows,
)
from gazerig.features.lab.sweep.worker import figures_at
from gazerig.features.lab.sweep.worker_pool import Job, SweepInterrupted, WorkerPool
from gazerig.robot.app.options import RunOptions
from gazerig.robot.cli.tune import read_value

EYES_ALONE = "gaze.head.eye_only_range_deg"
LOW, HIGH = "joints.neck_roll.min_deg", "joints.neck_roll.max_deg"
QUICK = ("--seconds", "1", "--bus", "ideal", "--jobs", "1")
OPTIONS = RunOptions(mock=True, fast=True, scene="visitor", seconds=1.0, bus="ideal")


def swept(out: Path, *words: str) -> Invoked:
    return invoked("sweep", "--out", str(out), *QUICK, *words)


def table(out: Path) -> list[dict[str, str]]:
    with (out / "table.csv").open() as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a sweep of two points and two seeds, one of whose points fails."""
    out = tmp_path_factory.mktemp("sweep") / "grid"
    done = swept(out, "--set", f"{LOW}=-25.0,0.0", "--set", f"{HIGH}=0.0,25.0", "--seeds", "1")
    assert done.code == 0, done.err
    assert "4 points, 1 seeds each: 4 runs" in done.err
    assert "failed: joints.neck_roll.min_deg=0.0, joints.neck_roll.max_deg=0.0, seed 0" in done.err
    return out


def test_a_run_that_fails_is_a_row_with_its_reason(finished: Path) -> None:
    rows = table(finished)
    levels = [(row[LOW], row[HIGH], row["seed"]) for row in rows]
    assert levels == [
        ("-25.0", "0.0", "0"),
        ("-25.0", "25.0", "0"),
        ("0.0", "0.0", "0"),
        ("0.0", "25.0", "0"),
    ]
    failed = [row["failed"] for row in rows]
    assert "min_deg 0.0 must be below max_deg 0.0" in failed[2]
    assert not any(failed[:2]) and not failed[3]
    assert rows[2]["seconds"] == "" and rows[0]["seconds"] == "0.99"
    assert rows[0]["verdict.rest_error"] in ("pass", "outside", "too few events")
    assert "wall_seconds" not in rows[0]  # no two runs take the same


def test_ctrl_c_leaves_the_table_of_what_is_finished(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(pool: WorkerPool, runs: Sequence[tuple[Point, int]]) -> Iterator[object]:
        yield 0, Outcome(*runs[0], {OUTSIDE: 2})
        raise SweepInterrupted

    monkeypatch.setattr(WorkerPool, "outcomes", interrupted)
    done = swept(tmp_path / "cut", "--set", f"{LOW}=-25.0,-20.0", "--seeds", "1")
    assert done.code == 130 and "table.csv: 1 of 2 runs" in done.err
    (row,) = table(tmp_path / "cut")
    assert (row[LOW], row[OUTSIDE]) == ("-25.0", "2")


def test_two_processes_make_the_table_of_one(desk_rig: Rig, tmp_path: Path) -> None:
    points: list[Point] = [{EYES_ALONE: 4.0}, {EYES_ALONE: 12.0}]
    runs = [(point, seed) for point in points for seed in (0, 1)]
    with WorkerPool(Job(OPTIONS, params_text(desk_rig)), 2, lambda: None) as pool:
        found = dict(pool.outcomes(runs))
        assert len(pool.pids) == 2
    ordered = [found[i] for i in range(len(runs))]
    alone = [
        Outcome(point, seed, figures_at(desk_rig, replace(OPTIONS, seed=seed), point, lambda: None))
        for point, seed in runs
    ]
    assert table_rows(ordered) == table_rows(alone)
    assert ordered[0].figures != ordered[1].figures


# ---- what is refused


BLINKING = "gaze.lids.blinks_per_min"


# --- What --set takes, what is refused before anything runs, and the points that come of it


def read(*settings: str) -> list[Axis]:
    return make_axes(load_rig("desk"), settings, read_value)


def test_steps_lists_and_ranges_are_read() -> None:
    steps, words, flags, reach = read(
        f"{EYES_ALONE}=4:16:7",
        "gaze.saccade.profile=min_jerk, human",
        "gaze.oculomotor.refixations=true,false",
        f"{BLINKING}=8..30.5",
    )
    assert steps.values == (4.0, 6.0, 8.0, 10.0, 12.0, 14.0, 16.0) and steps.unit == "deg"
    assert words.values == ("min_jerk", "human") and flags.values == (True, False)
    assert reach.is_range and (reach.low, reach.high, reach.whole) == (8.0, 30.5, False)
    assert reach.label == f"{BLINKING}, 1/min" and words.label == "gaze.saccade.profile"


OTHER_AXES = (
    Axis("a", (), -2.0, 5.0), Axis("b", (), 1.0, 6.0, whole=True), Axis("c", ("x", "y", "z")),
)  # fmt: skip


@settings(max_examples=60)
@given(st.integers(2, 60), st.integers(0, 2**32))
def test_a_latin_hypercube_falls_once_into_each_part_of_every_axis(n: int, seed: int) -> None:
    points = latin_hypercube(OTHER_AXES, n, seed)
    assert len(points) == n and points == latin_hypercube(OTHER_AXES, n, seed)
    parts = sorted(int((float(str(point["a"])) + 2.0) / 7.0 * n * (1 - 1e-6)) for point in points)
    near = [abs(part - k) <= 1 for k, part in enumerate(parts)]  # six digits are kept
    assert all(near) and len(set(parts)) >= n - 1
    assert all(-2.0 <= float(str(point["a"])) <= 5.0 for point in points)
    whole = Counter(point["b"] for point in points)
    assert set(whole) <= set(range(1, 7)) and all(isinstance(b, int) for b in whole)
    assert all(abs(whole[b] - n / 6) < 2 for b in range(1, 7))
    levels = Counter(point["c"] for point in points)
    assert all(abs(levels[c] - n / 3) < 2 for c in "xyz")


FITTED = (
    Axis("gaze.lids.blinks_per_min", (), 1.0, 60.0),
    Axis("gaze.lids.close_ms", (), 30.0, 300.0),
    Axis("gaze.saccade.profile", ("min_jerk", "human", "literal_frame")),
)
# --- Fitting: what counts as outside, the search, and the YAML that a run takes


START: Point = dict(zip((axis.key for axis in FITTED), (50.0, 250.0, "literal_frame"), strict=True))
KEYS = ("blink_rate", "blink_close", "skew")


def outcome(point: Point, seed: int, values: Sequence[float | None]) -> Outcome:
    """Return a run with three measures, None where too few events were found."""
    figures: dict[str, float | str | None] = {}
    for key, value in zip(KEYS, values, strict=True):
        band = BY_KEY[key]
        inside = value is not None and band.low <= value <= band.high
        word = "too few events" if value is None else "pass" if inside else "outside"
        figures |= {f"report.{key}": value, f"verdict.{key}": word}
    return Outcome(point, seed, figures)


def blinking(points: Sequence[Point]) -> list[list[Outcome]]:
    """Run points in a world in which each measure is its parameter; two seeds."""
    found = []
    for point in points:
        rate, close, profile = point.values()
        assert isinstance(rate, float) and isinstance(close, float)
        skew = BY_KEY["skew"].low if profile == "human" else BY_KEY["skew"].high + 1.0
        found.append([outcome(point, seed, (rate + seed, close, skew)) for seed in (0, 1)])
    return found


def test_a_search_puts_the_measures_inside_their_bands() -> None:
    found = fit_settings(blinking, FITTED, START, 96, 1)
    assert found.counted and set(found.counted) == set(KEYS)
    assert found.start.point == START and found.start.outside == 3.0
    assert found.best.outside == 0.0 and found.best.score == 0.0
    assert found.best.point["gaze.saccade.profile"] == "human"
    assert 60 <= len(found.trials) <= 98


def test_measures_count_if_half_of_the_runs_can_judge_them() -> None:
    runs = [outcome(START, 0, (17.0, None, 0.3)), outcome(START, 1, (40.0, None, None))]
    assert set(counted_measures(runs)) == {"blink_rate", "skew"}
    with pytest.raises(SetupError, match="too short: no measure has enough events"):
        counted_measures([outcome(START, 0, (None, None, None))])
    with pytest.raises(SetupError, match="own values cannot be run: it failed"):
        counted_measures([Outcome(START, 0, {}, "it failed")])
