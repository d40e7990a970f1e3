"""Fitting: what counts as outside, the search, and the YAML that a run takes."""

import json
from collections.abc import Sequence
from math import dist
from pathlib import Path

import pytest
from command_line import invoked

from gazerig.config.schema import load_rig
from gazerig.drivers.errors import SetupError
from gazerig.features.lab.sweep.axes import Axis, Point
from gazerig.features.lab.sweep.fit import counted_measures, fit, search, snippet_of, trial_of
from gazerig.features.lab.sweep.outcome import Outcome
from gazerig.robot.analysis.norm_bands import BY_KEY
from gazerig.robot.app.options import RunOptions

pytestmark = pytest.mark.usefixtures("branched_children")

AXES = (
    Axis("gaze.lids.blinks_per_min", (), 1.0, 60.0),
    Axis("gaze.lids.close_ms", (), 30.0, 300.0),
    Axis("gaze.saccade.profile", ("min_jerk", "main_sequence", "literal_frame")),
)
START: Point = dict(zip((axis.key for axis in AXES), (50.0, 250.0, "literal_frame"), strict=True))
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
        skew = BY_KEY["skew"].low if profile == "main_sequence" else BY_KEY["skew"].high + 1.0
        found.append([outcome(point, seed, (rate + seed, close, skew)) for seed in (0, 1)])
    return found


def test_a_search_puts_the_measures_inside_their_bands() -> None:
    found = fit(blinking, AXES, START, 96, 1)
    assert found.counted and set(found.counted) == set(KEYS)
    assert found.start.point == START and found.start.outside == 3.0
    assert found.best.outside == 0.0 and found.best.score == 0.0
    assert found.best.point["gaze.saccade.profile"] == "main_sequence"
    assert 60 <= len(found.trials) <= 98


def test_the_same_search_asks_for_the_same_points() -> None:
    assert fit(blinking, AXES, START, 24, 1) == fit(blinking, AXES, START, 24, 1)
    other = fit(blinking, AXES, START, 24, 2)
    assert [one.point for one in other.trials] != [
        one.point for one in fit(blinking, AXES, START, 24, 1).trials
    ]


def test_no_point_is_run_twice() -> None:
    asked: list[str] = []

    def run(points: Sequence[Point]) -> list[list[Outcome]]:
        asked.extend(json.dumps(point) for point in points)
        return [
            [outcome(p, 0, (50.0, 80.0, {"min_jerk": 1.0}.get(str(p[AXES[2].key]), 0.0)))]
            for p in points
        ]

    fit(run, AXES[2:], {AXES[2].key: "min_jerk"}, 30, 0)
    assert len(asked) == len(set(asked)) == 3


def test_the_search_beats_chance_and_takes_the_start_along() -> None:
    """A bowl in three dimensions: of 96 points by chance the nearest is about 0.13 off."""
    bowl, begun = (0.2, 0.7, 0.4), {"a": 0.5, "b": 0.5, "c": 0.5}
    axes = [Axis(key, (), 0.0, 1.0) for key in "abc"]
    nearest = []
    for seed in range(6):
        found: list[float] = []

        def scores(points: Sequence[Point], found: list[float] = found) -> list[float]:
            assert found or points[0] == begun
            found += [dist(bowl, [float(str(x)) for x in p.values()]) for p in points]
            return found[-len(points) :]

        search(scores, axes, begun, 96, seed)
        assert len(found) == 96
        nearest.append(min(found))
    assert sum(nearest) / len(nearest) < 0.05


def test_measures_count_if_half_of_the_runs_can_judge_them() -> None:
    runs = [outcome(START, 0, (17.0, None, 0.3)), outcome(START, 1, (40.0, None, None))]
    assert set(counted_measures(runs)) == {"blink_rate", "skew"}
    with pytest.raises(SetupError, match="too short: no measure has enough events"):
        counted_measures([outcome(START, 0, (None, None, None))])
    with pytest.raises(SetupError, match="own values cannot be run: it failed"):
        counted_measures([Outcome(START, 0, {}, "it failed")])


def test_what_can_no_longer_be_judged_is_outside_and_a_failure_worst_of_all() -> None:
    band = BY_KEY["blink_rate"]
    just = band.high + 0.25 * (band.high - band.low)
    trial = trial_of(START, [outcome(START, 0, (just, 80.0, None))], KEYS)
    assert trial.score == pytest.approx(1.5) and trial.outside == 2.0
    failed = trial_of(
        START, [outcome(START, 0, (17.0, 80.0, 0.3)), Outcome(START, 1, {}, "x")], KEYS
    )
    assert failed.score > len(KEYS) and failed.failed == "x"


def test_the_best_point_is_yaml_that_a_run_takes(tmp_path: Path) -> None:
    file = tmp_path / "best.yaml"
    point: Point = {"gaze.lids.close_ms": 90.5, "gaze.saccade.profile": "main_sequence"}
    file.write_text(snippet_of(RunOptions(character="shy"), point), encoding="utf-8")
    made, shy = load_rig("desk", str(file)), load_rig("desk", "shy")
    assert made.gaze.lids.close_ms == 90.5 and made.gaze.saccade.profile == "main_sequence"
    assert made.gaze.attention == shy.gaze.attention and shy != load_rig("desk")
    file.write_text(snippet_of(RunOptions(), point), encoding="utf-8")
    assert file.read_text(encoding="utf-8") == (
        "gaze:\n  lids:\n    close_ms: 90.5\n  saccade:\n    profile: main_sequence\n"
    )


def test_a_small_fit_goes_on_where_it_stopped_and_writes_what_it_found(tmp_path: Path) -> None:
    out, key, jerky = tmp_path / "fit", "gaze.saccade.profile", tmp_path / "jerky.yaml"
    jerky.write_text("gaze: {saccade: {profile: literal_frame}, lids: {hold_ms: 50}}\n")
    words = (
        *("sweep", "--fit", "--out", str(out), "--seconds", "16", "--bus", "ideal", "--jobs", "1"),
        *("--set", f"{key}=literal_frame,min_jerk", "--seeds", "1", "--samples", "16"),
        *("--character", str(jerky)),
    )
    done = invoked(*words)
    assert done.code == 0, done.err
    assert "measures count, 2 points tried; outside: " in done.err
    assert f"{key}: literal_frame -> min_jerk" in done.err
    assert f"to run it: gazerig run desk --character {out}/best.yaml" in done.err
    best = load_rig("desk", str(out / "best.yaml")).gaze
    assert (best.saccade.profile, best.lids.hold_ms) == ("min_jerk", 50.0)
    rows = (out / "table.csv").read_text(encoding="utf-8").splitlines()
    assert [row.split(",")[0] for row in rows] == [key, "literal_frame", "min_jerk"]
    runs = out / "runs.jsonl"
    runs.write_text("".join(f"{line}\n" for line in runs.read_text().splitlines()[:1]))
    again = invoked(*words)
    assert again.code == 0 and again.err.splitlines() == done.err.splitlines()
    assert (out / "table.csv").read_text(encoding="utf-8").splitlines() == rows


def test_levels_and_ends_of_a_fit_are_checked_before_anything_runs(tmp_path: Path) -> None:
    words = ("sweep", "--fit", "--out", str(tmp_path / "fit"), "--bus", "ideal")
    done = invoked(*words, "--set", "gaze.lids.close_ms=50,5000")
    assert done.code == 2 and "gaze.lids.close_ms: 5000 is above 500 (unit ms)" in done.err
    done = invoked(*words, "--set", "gaze.lids.close_ms=5:90")
    assert done.code == 2 and "gaze.lids.close_ms: 5.0 is below 30 (unit ms)" in done.err
    assert not (tmp_path / "fit").exists()
