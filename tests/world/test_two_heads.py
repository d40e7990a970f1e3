"""Two heads in one world: each by its own eyes, on one clock, counted by both."""

import json
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install -e '.[world]'")

from command_line import invoked

from gazerig.drivers.errors import SetupError
from gazerig.features.world.run.first_world import missing_requirement
from gazerig.features.world.run.head_group import (
    LinkedInterrupts,
    compose_group,
    has_other_heads,
    overload_message,
)
from gazerig.features.world.run.shared_world import Lockstep
from gazerig.robot.analysis.mutual_gaze import HeadPlacement, mutual_gaze
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.interrupts import Interrupts
from gazerig.robot.description.links import IDENTITY
from gazerig.robot.recording.read import RunRecording

ASKED = RunOptions(mock=True, fast=True, world="two-heads", seconds=3.0, no_pictures=True)


def ran(**more: Any) -> dict[str, Any]:
    """Return the figures of a short run of two heads."""
    options = RunOptions(**{**vars(ASKED), **more}).check_and_complete()
    return compose_group(options).run(lambda: None, lambda line: None)


def digest(figures: dict[str, Any]) -> Any:
    """Return the digest of a bus."""
    return figures["bus"]["tx_sha256"]


def test_two_heads_look_at_each_other_and_the_same_seed_gives_the_same_bytes() -> None:
    once, again = ran(), ran()
    other = once["heads"]["other"]
    assert once["faces_seen"] > 60 and other["faces_seen"] > 60
    assert once["stopped_by"] == other["stopped_by"] == "seconds"
    gaze = once["mutual_gaze"]["other"]
    assert gaze["both"] > 0.3 and gaze["mutual_gazes"] >= 1
    assert digest(once) == digest(again) != digest(other)
    assert digest(other) == digest(again["heads"]["other"])


def test_each_finds_the_face_of_the_other_in_its_own_picture() -> None:
    if needed := missing_requirement():
        pytest.skip(needed)
    once, again = (ran(no_pictures=False, seconds=0.37, bus="ideal") for _ in range(2))
    for head in (once, once["heads"]["other"]):
        assert head["pictures"] >= 10 and head["faces_seen"] >= 0.9 * head["pictures"]
    for figures in (once, again):
        figures.pop("wall_seconds"), figures["heads"]["other"].pop("wall_seconds")
    assert once == again


def test_a_world_with_one_head_is_no_group() -> None:
    assert has_other_heads(ASKED)
    assert not has_other_heads(RunOptions(mock=True, fast=True, world="living-room"))


def test_the_command_runs_all_heads_once(tmp_path: Path) -> None:
    out = tmp_path / "figures.json"
    told = "run --mock --fast --world two-heads --no-pictures --bus ideal --seconds 1"
    assert invoked(*told.split(), "--summary", str(out)).code == 0
    figures = json.loads(out.read_text())
    assert (
        figures["seconds"] == figures["heads"]["other"]["seconds"] == pytest.approx(1.0, abs=0.02)
    )
    assert figures["mutual_gaze"]["other"]["seconds"] > 0.9


def test_a_second_request_to_end_reaches_all_heads() -> None:
    lead = Interrupts(signals=False)
    other = LinkedInterrupts(lead)
    assert other() is None and other.requests == 0
    lead.request("SIGINT")
    assert other() == "SIGINT" and other.requests == 1
    lead.request("SIGINT")
    assert other.requests == 2


@pytest.mark.parametrize(
    ("overruns", "pictures", "behind"), [(10, 290, False), (300, 290, True), (10, 200, True)]
)
def test_who_falls_behind_is_told(overruns: int, pictures: int, behind: bool) -> None:
    well = {"ticks": 2000, "overruns": 0, "seconds": 10.0, "pictures": 300}
    figures = {**well, "overruns": overruns, "pictures": pictures}
    line = overload_message(
        [("first", well), ("other", figures), ("third", None)], 30.0, rendered=True
    )
    assert line.startswith("the computer is too busy for these heads (other: ") is behind
    assert line.endswith("; --no-pictures reduces the load") is behind
    if overruns == 300:
        assert "(other: 13% of ticks late, 29 of 30 pictures a second)" in line
        assert overload_message([("other", figures)], 30.0, rendered=False).endswith("second)")
    assert overload_message([("other", {**figures, "seconds": 1.0})], 30.0, rendered=True) == ""


def test_time_goes_on_when_all_wait_and_the_earliest_goes_first() -> None:
    shared, seen = Lockstep(2), list[tuple[int, float]]()

    def ticks(number: int, step_s: float, count: int) -> None:
        shared.enter(number)
        clock = shared.clock(number)
        for n in range(1, count + 1):
            clock.sleep_until(n * step_s)
            seen.append((number, clock.now_s()))
        shared.leave(number)

    thread = threading.Thread(target=ticks, args=(1, 0.5, 4))
    thread.start()
    ticks(0, 1.0, 3)
    thread.join()
    assert seen == [(1, 0.5), (0, 1.0), (1, 1.0), (1, 1.5), (0, 2.0), (1, 2.0), (0, 3.0)]


def test_mutual_gaze_is_counted() -> None:
    t_s = np.arange(1000) / 100.0
    first = (t_s >= 1.0) & (t_s < 6.0)
    second = (t_s >= 1.5) & (t_s < 4.0) | (t_s >= 5.0) & (t_s < 9.0)
    found = mutual_gaze(t_s, first, second)
    assert found["first_looks"] == pytest.approx(0.5) and found["second_looks"] == 0.65
    assert found["both"] == 0.35 and found["mutual_gazes"] == 2
    assert found["mean_s"] == pytest.approx(1.75) and found["longest_s"] == pytest.approx(2.49)
    assert found["ended_by_first"] == 1 and found["ended"] == 2
    assert found["answered_after_s"] == pytest.approx(0.5) and found["answers"] == 1


@pytest.mark.parametrize("cut", [(0.0, 3.0), (6.0, 10.0)], ids=["begins", "ends"])
def test_a_mutual_gaze_that_the_run_cuts_off_has_no_length(cut: tuple[float, float]) -> None:
    t_s = np.arange(1000) / 100.0
    both = (t_s >= 4.0) & (t_s < 5.0) | (t_s >= cut[0]) & (t_s < cut[1])
    found = mutual_gaze(t_s, both, both)
    assert found["mutual_gazes"] == 2 and found["ended"] == 1
    assert found["mean_s"] == found["median_s"] == pytest.approx(1.0)
    assert found["longest_s"] == pytest.approx(cut[1] - cut[0], abs=0.011)


def test_short_gaps_in_a_look_are_bridged_and_short_looks_are_none() -> None:
    t_s = np.arange(1000) / 100.0
    looks = (t_s >= 2.0) & (t_s < 5.0) & ~((t_s >= 3.0) & (t_s < 3.1)) | (t_s >= 8.0) & (t_s < 8.1)
    found = mutual_gaze(t_s, looks, np.ones(1000, bool))
    assert found["mutual_gazes"] == 1 and found["mean_s"] == pytest.approx(3.0)


@pytest.mark.usefixtures("few_drawings")
def test_two_recordings_report_the_figures_of_the_run(tmp_path: Path) -> None:
    record, page = tmp_path / "run.mcap", tmp_path / "page.html"
    figures = ran(record=record, bus="ideal", seconds=2.0)["mutual_gaze"]["other"]
    assert RunRecording(record).info.placement[:2] == (0.0, 0.0)
    both = str(record), "--with", str(tmp_path / "run-other.mcap"), "--out", str(page)
    assert invoked("report", *both).code == 0
    found = json.loads((tmp_path / "page_measures.json").read_text())[-1]
    assert found == {"key": "mutual_gaze", "first": "run", "second": "run-other", **figures}
    text = page.read_text()
    assert "<h2>Mutual gaze</h2>" in text and "Argyle &amp; Ingham 1972" in text


def test_the_report_refuses_a_head_that_was_alone_and_one_head_twice() -> None:
    report = pytest.importorskip("gazerig.features.lab.report.heads").mutual_gaze_report
    here, there = HeadPlacement(IDENTITY, (0.0, 0.0, 0.0)), HeadPlacement(IDENTITY, (1.0, 0.0, 0.0))
    assert HeadPlacement.from_numbers(there.as_numbers) == there
    with pytest.raises(SetupError, match="^b is from a run with one head"):
        report(((), ()), (here.as_numbers, ()), ("a", "b"))
    with pytest.raises(SetupError, match="are from the same head"):
        report(((), ()), (here.as_numbers, here.as_numbers), ("a", "b"))
    with pytest.raises(SetupError, match="no time in common"):
        report(((), ()), (here.as_numbers, there.as_numbers), ("a", "b"))
