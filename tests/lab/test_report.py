"""The report: human gaze passes, robotic gaze is outside, rare events are reported as too few."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from html import unescape
from pathlib import Path

import cv2
import numpy as np
import pytest
from made_traces import EMPTY, run_of, verdicts
from typer.testing import CliRunner

from gazerig.config.schema import Rig, load_rig, load_walk
from gazerig.drivers.errors import SetupError
from gazerig.features.lab.cli.report import app, page_file
from gazerig.features.lab.report import face
from gazerig.features.lab.report import report as build
from gazerig.features.lab.report.compare import differences_of
from gazerig.features.lab.report.compare_page import compare_page
from gazerig.features.lab.report.gaze_trace import GazeTrace, GazeTraceBuilder, TraceRow
from gazerig.features.lab.report.page import RunHeader, band_text, gauge, report_page
from gazerig.features.lab.report.plotting import COLOURS, Shown, png
from gazerig.features.lab.report.reference_walk import published_walk, rig_walk
from gazerig.features.lab.report.report import DRAWINGS, findings_of, measure_run, report_of
from gazerig.features.lab.report.statistics import (
    MeasuredValue,
    judge,
    longest,
    mean,
    median,
    number,
)
from gazerig.gaze.types import PARTS
from gazerig.robot.analysis import human_norms as human
from gazerig.robot.analysis import norm_bands as bands
from gazerig.robot.analysis.event_detector import FixationEvent
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import run

pytestmark = pytest.mark.usefixtures("ideal_servos")

RIG = load_rig("desk")
SLOWER = replace(RIG, loop=replace(RIG.loop, rate_hz=100.0))
"""Half the ticks: a minute of them is what takes longest here."""


def looked(scene: str, seconds: float, rig: Rig = RIG, **choice: str) -> GazeTrace:
    """Gather a simulated run."""
    made, gathering = assemble(rig, RunOptions(True, True, 0, scene, **choice)), GazeTraceBuilder()  # type: ignore[arg-type]
    made.robot.start(made.clock)
    over: Callable[[float], str | None] = lambda s: "over" if s > seconds else None  # noqa: E731
    run(made.robot, made.clock, made.loop, over, gathering.update)
    made.robot.stop()
    made.close()
    return gathering.trace()


@pytest.fixture(scope="module")
def walking() -> GazeTrace:
    return looked("face-to-face", 60.0, SLOWER)


@pytest.mark.slow
def test_a_gaze_that_wanders_as_people_do_passes_on_the_face(walking: GazeTrace) -> None:
    seen = verdicts(walking)
    for key in ("on_parts", "eyes_share", "visit", "never_taken", "heat", "part_share", "rate",
                "below_15", "peak_small", "rest_error", "left_mm", "right_mm", "in_cone",
                "vergence", "vergence_ok"):  # fmt: skip
        assert seen[key].verdict == "pass", seen[key]
        assert seen[key].measured.events >= seen[key].band.least
        assert seen[key].low95 <= seen[key].value <= seen[key].high95


@pytest.mark.slow
def test_what_the_paper_makes_other_than_people_is_outside() -> None:
    seen = verdicts(looked("face-to-face", 20.0, SLOWER, saccade="min_jerk"))
    assert seen["duration_small"].verdict == "outside"
    assert seen["duration_small"].measured.asked < 0.3  # as commanded
    assert seen["skew"].value > 0.05  # minimum jerk is symmetric, people rise faster
    assert seen["longest_look"].verdict == "pass"  # it looks away without a conversation too


def test_random_angles_are_outside() -> None:
    seen = verdicts(looked("face-to-face", 40.0, SLOWER, scanpath="random"))
    for key in ("on_parts", "below_15", "heat"):
        assert seen[key].verdict == "outside", seen[key]
    assert seen["rate"].value < 1.5 and seen["rate"].verdict != "pass"


def test_jumps_of_two_frames_are_outside() -> None:
    seen = verdicts(looked("face-to-face", 16.0, saccade="literal_frame"))
    assert seen["peak_small"].verdict == "outside"
    assert seen["peak_small"].value < 0.5


def test_one_point_is_too_few_or_outside() -> None:
    seen = verdicts(looked("sits-still", 6.0, scanpath="face_tracking"))
    assert seen["never_taken"].verdict == "too few events"
    assert seen["transitions"].verdict == "too few events"
    assert not any(seen[key].verdict == "pass" for key in ("part_share", "heat", "peak_small"))


def human_saccades(faster: float = 1.0, longer: float = 1.0) -> list[tuple[float, ...]]:
    """Return saccades as people make them, or faster or longer ones."""
    dice = np.random.default_rng(3)
    sizes = np.concatenate([dice.uniform(1.5, 7.9, 40), dice.uniform(13.0, 40.0, 40)])
    peak = faster * 0.5 * (human.slowest_peak(sizes) + human.fastest_peak(sizes))
    duration = longer * 0.5 * (human.shortest_ms(sizes) + human.longest_ms(sizes))
    return list(zip(sizes, duration, peak, human.peak_at(sizes), strict=True))


def test_the_bands_of_the_main_sequence_cut_on_both_sides() -> None:
    keys = ("peak_small", "peak_large", "duration_small", "duration_large", "skew")
    right = verdicts(run_of(human_saccades()))  # type: ignore[arg-type]
    assert [right[key].verdict for key in keys] == ["pass"] * 5
    for faster, longer in ((0.6, 0.6), (1.7, 1.7)):
        wrong = verdicts(run_of(human_saccades(faster, longer)))  # type: ignore[arg-type]
        assert [wrong[key].verdict for key in keys[:4]] == ["outside"] * 4


def test_blinks_of_a_human_shape_pass_and_are_counted_by_the_minute() -> None:
    seen = verdicts(run_of([], blinks=10))
    for key in ("blink_close", "blink_hold", "blink_open", "blink_ratio", "blink_rate"):
        assert seen[key].verdict == "pass", seen[key]
    assert seen["blink_rate"].value == pytest.approx(20.0, rel=0.02)
    assert "blink_rate_talk" not in seen
    assert verdicts(run_of([], blinks=3))["blink_rate"].verdict == "too few events"


def test_too_few_events_are_no_pass_and_nothing_is_too_few() -> None:
    band = bands.BY_KEY["rate"]
    ones = np.full(band.least - 1, 0.4)
    few = judge(MeasuredValue("rate", ones, mean), band)
    assert few.verdict == "too few events" and np.isnan(few.low95)
    assert {finding.verdict for finding in findings_of(EMPTY)} == {"too few events"}


def test_a_verdict_rests_on_the_band_alone() -> None:
    band = bands.BY_KEY["vergence"]
    for value, verdict in ((0.99, "pass"), (-0.99, "pass"), (1.01, "outside"), (-1.01, "outside")):
        assert judge(MeasuredValue("vergence", np.full(40, value), median), band).verdict == verdict


def test_a_figure_outside_by_what_chance_may_do_is_uncertain() -> None:
    """Express reactions may be 5 %: 1 of 14 is no proof of more, 100 of 1400 is."""
    band = bands.BY_KEY["express"]
    for times, verdict in ((1, "uncertain"), (100, "outside")):
        rows = np.array([1.0] * times + [0.0] * 13 * times)
        assert judge(MeasuredValue("express", rows, mean), band).verdict == verdict
    inside = judge(MeasuredValue("express", np.zeros(14), mean), band)
    assert inside.verdict == "pass" and inside.high95 > band.high  # as wide as 14 events are
    one_look = MeasuredValue("longest_look", np.array([3.0, 15.4]), longest)
    look = judge(one_look, bands.BY_KEY["longest_look"])
    assert look.verdict == "outside" and np.isnan(look.high95)  # it has happened


def test_every_measure_has_its_band_and_every_band_its_source(walking: GazeTrace) -> None:
    keys = [measure.key for measure in measure_run(walking)]
    assert len(set(keys)) == len(keys) and set(keys) <= set(bands.BY_KEY)
    for mode in ("talk", "listen", "think", "none"):
        assert any(bands.applies(band, mode) for band in bands.BANDS if band.mode)
    for band in bands.BANDS:
        assert band.low < band.high and band.least >= 1 and band.group in bands.GROUPS
        assert re.search(r"\d{4}|Nakamoto|Mitake|the same|healthy|log-normal|stare|fixations",
                         band.source), band.key  # fmt: skip


def test_people_are_as_published() -> None:
    walk = load_walk("nakamoto_tsuruno")
    assert walk.order == PARTS
    assert walk.dwell_mean_s == human.DWELL_MEAN_S and walk.dwell_sd_s == human.DWELL_SD_S
    rows = np.array(walk.matrix)
    assert human.matrix() == pytest.approx(rows / rows.sum(axis=1, keepdims=True))
    share = [0.0654, 0.1146, 0.0580, 0.1077, 0.2012, 0.1073, 0.2892, 0.0566]
    assert face.human_share() == pytest.approx(share, abs=2e-4)
    visits = [0.244, 0.480, 0.173, 0.261, 0.288, 0.286, 0.286, 0.165]
    assert human.visit_s(human.matrix(), human.DWELL_MEAN_S) == pytest.approx(visits, abs=1e-3)
    assert human.head_deg([20.0, 40.0, 80.0]) == pytest.approx([1.6, 17.0, 47.8], abs=0.1)
    assert human.evoked_blink([17.0, 33.0]) == pytest.approx([0.5, 0.97], abs=0.01)
    assert published_walk().share(np.random.default_rng(0)) == pytest.approx(share, abs=0.02)


def test_the_rigs_own_walk_knows_its_floor() -> None:
    walk, dice = load_walk(RIG.gaze.scanpath.transition_matrix), np.random.default_rng(0)
    model = rig_walk(RIG.gaze.scanpath, walk)
    assert model is not None
    assert model.visits(0, 300, dice).min() >= RIG.gaze.scanpath.min_dwell_ms / 1e3


def fixed(parts: list[int], seconds: float = 0.3) -> GazeTrace:
    """Make a run that looks at one part after the other."""
    every = tuple(
        FixationEvent(n * seconds, seconds, PARTS[part], True, 1, "face", PARTS[part])
        for n, part in enumerate(parts)
    )
    return GazeTrace(np.zeros((0, len(TraceRow._fields))), (), every, ())


def test_a_walk_drawn_from_the_matrix_passes_and_its_reverse_does_not() -> None:
    dice, steps = np.random.default_rng(5), human.visit_matrix(human.matrix())
    parts = [0]
    for _ in range(600):
        parts.append(int(dice.choice(8, p=steps[parts[-1]])))
    forth, back = verdicts(fixed(parts)), verdicts(fixed(parts[::-1]))
    assert forth["transitions"].verdict == "pass" and forth["never_taken"].value == 0.0
    assert back["never_taken"].verdict == "outside"
    assert back["transitions"].value > 1.5 * forth["transitions"].value


@pytest.mark.slow
def test_the_whole_report_is_written(walking: GazeTrace, tmp_path: Path) -> None:
    reported: list[tuple[str, float]] = []
    about = RunHeader(
        "a <run>", (("rig", "desk"),), frozenset({"saccade min_jerk"}), warnings=("cut & short",)
    )
    out = tmp_path / "deep" / "report.html"
    made = report_of(walking, about, out, lambda words, share: reported.append((words, share)))
    raw = out.read_text(encoding="utf-8")
    page = unescape(raw)
    assert "a &lt;run&gt;" in raw and "cut &amp; short" in raw
    assert page.count("data:image/png;base64,") == len(DRAWINGS) == len(made.figures)
    assert not re.search(r'(src|href)="(?!data:)', page)  # it needs no other file
    assert "by design: Mitake et al. eq 5" in page
    for path in made.figures:
        picture = cv2.imread(str(path))
        assert picture is not None and picture.std() > 5.0
    numbers = json.loads(made.data.read_text(encoding="utf-8"))
    assert {row["key"] for row in numbers} == {f.band.key for f in made.findings}
    for finding in made.findings:
        assert finding.band.title in page and band_text(finding.band) in page
    assert reported[-1] == (build.DRAWING, 1.0)
    assert [share for _, share in reported] == sorted(share for _, share in reported)


HOSTILE = "<img src=x onerror=alert(1)> $\\frac{$"


@pytest.mark.usefixtures("unlaid_figures")
def test_names_are_never_markup_nor_formulas(walking: GazeTrace) -> None:
    about = RunHeader(HOSTILE, (("rig", HOSTILE), (HOSTILE, "x")), warnings=(HOSTILE,))
    findings = build.findings_of(walking)
    shown = [Shown(HOSTILE, walking, colour) for colour in COLOURS]
    for drawing in DRAWINGS[:3]:
        assert png(drawing, shown).startswith(b"\x89PNG")
    pages = (
        report_page(about, walking, findings, ()),
        compare_page((about, about), [walking, walking], differences_of((), ()), ()),
    )
    for page in pages:
        assert "<img src=x" not in page and page.count("&lt;img src=x onerror=alert(1)&gt;") >= 3


@pytest.mark.usefixtures("unlaid_figures")
@pytest.mark.parametrize("drawing", DRAWINGS, ids=[d.key for d in DRAWINGS])
def test_a_figure_of_nothing_says_so(drawing: object) -> None:
    assert png(drawing, [Shown("none", EMPTY, COLOURS[0])])[:4] == b"\x89PNG"  # type: ignore[arg-type]


def test_an_empty_run_and_a_bad_place_are_told_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(build, "DRAWINGS", build.DRAWINGS[:1])  # all are drawn elsewhere
    with pytest.raises(SetupError, match="0 ticks are too few for a report"):
        build.read([], RunHeader("empty"), lambda words, share: None)
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(SetupError, match="name another file"):
        report_of(EMPTY, RunHeader("x"), tmp_path / "file" / "r.html", lambda words, share: None)


def test_numbers_are_short() -> None:
    values = {0.0: "0", 0.123456: "0.12", 1.5: "1.5", 20.0: "20", 123.4: "123", -0.002: "-0.002"}
    assert {value: number(value) for value in values} == values
    place = gauge(
        judge(MeasuredValue("vergence", np.full(40, 9.0), median), bands.BY_KEY["vergence"])
    )
    assert place.value == 100.0 and place.band_from == pytest.approx(30.0)


@pytest.mark.parametrize(
    ("given", "written"),
    [
        ("evening", "evening.html"),
        ("evening.html", "evening.html"),
        ("evening.HTM", "evening.HTM"),
        ("evening-0.5", "evening-0.5.html"),
        ("runs.old/evening", "runs.old/evening.html"),
    ],
)
def test_a_page_ends_as_a_browser_wants_it(given: str, written: str) -> None:
    assert page_file(Path(given)) == Path(written)


def test_the_command_takes_a_file_or_a_scene() -> None:
    runner = CliRunner()
    for arguments in (["report"], ["report", "x.mcap", "--scene", "visitor"]):
        done = runner.invoke(app, arguments)
        assert done.exit_code == 2 and "report takes either" in done.output
    done = runner.invoke(app, ["report", "--scene", "nowhere", "--seconds", "5"])
    assert done.exit_code == 2 and "unknown; scenes" in done.output
    done = runner.invoke(app, ["report", "nothing.mcap"])
    assert done.exit_code == 2 and len(done.output.strip().splitlines()) == 1


# --- landings, rests, reactions
