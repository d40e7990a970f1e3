"""The command run in simulated time, end to end: from picture to servo bytes."""

import json
import re
from typing import Any

import pytest
from command_line import figures, gazerig
from ideal_bus import ideal_buses
from slow_rigs import at_rate

from gazerig.robot.app import session
from gazerig.robot.app.options import RunOptions


@pytest.fixture(scope="module")
def half(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The desk rig at half its rate, for tests that do not concern the rate."""
    return at_rate(tmp_path_factory.mktemp("rigs"), "desk", 100.0)


@pytest.fixture(scope="module")
def visitor(half: str) -> dict[str, Any]:
    """One round of the visitor: comes, moves, waves, leaves and comes back."""
    return figures(half, "--seconds", "44", "--seed", "1")


@pytest.mark.slow
def test_summary_tells_all_it_promises(visitor: dict[str, Any]) -> None:
    promised = {
        "seconds", "wall_seconds", "ticks", "overruns", "faces_seen", "pictures", "fixations",
        "saccades", "blinks", "target_share", "part_share", "gaze_error_deg", "limited", "bus",
        "stopped_by",
    }  # fmt: skip
    assert promised <= set(visitor)
    assert {"tx_bytes", "rx_bytes", "errors"} <= set(visitor["bus"])
    assert visitor["stopped_by"] == "seconds" and visitor["overruns"] == 0
    assert visitor["ticks"] == pytest.approx(44 * 100, abs=2)


def test_who_asks_for_no_figures_gets_the_same_bytes_and_how_it_ended() -> None:
    asked = RunOptions(True, True, scene="boxing", seconds=0.5, rig="desk").check_and_complete()
    whole, less = (
        session.run(session.compose(asked), lambda: None, lambda line: None, summarised=summarised)
        for summarised in (True, False)
    )
    assert less["bus"] == whole["bus"] and {*less} < {*whole}
    assert less["stopped_by"] == "seconds" and less["ticks"] == whole["ticks"] != 0
    summed_up = {"seconds", "gaze_error_deg", "target_share", "behaviours"}
    assert summed_up <= {*whole} and not summed_up & {*less}


def test_the_head_looks_at_the_visitor(visitor: dict[str, Any]) -> None:
    share = visitor["target_share"]
    nobody = sum(share.get(kind, 0.0) for kind in ("rest", "search", "glance"))
    assert share["face"] > 0.6 and share["hand"] > 0.02 and nobody > 0.02
    assert len(visitor["part_share"]) >= 6
    assert visitor["gaze_error_deg"]["median"] < 0.3
    # A new target waits a reaction time and the gap after a saccade.
    assert visitor["gaze_error_deg"]["p95"] < 5.0
    assert visitor["bus"]["errors"] == {}
    assert 1.5 < visitor["saccades"] / visitor["seconds"] < 5.5
    assert 5 <= visitor["blinks"] <= 40


def bytes_sent(*words: str) -> str:
    digest: str = figures(*words)["bus"]["tx_sha256"]
    return digest


@pytest.mark.slow
def test_e59_same_seed_same_bytes_in_another_process(half: str) -> None:
    words = (half, "--seconds", "5", "--seed", "1")
    done = gazerig("run", "--mock", "--fast", "--summary", "-", *words)
    assert done.returncode == 0, done.stderr
    one: dict[str, Any] = json.loads(done.stdout)
    again = figures(*words)
    assert one.pop("wall_seconds") > 0.0 and again.pop("wall_seconds") > 0.0
    assert again == one
    assert re.fullmatch(r"[0-9a-f]{64}", again["bus"]["tx_sha256"])
    short = ("--seconds", "1", "--seed")
    assert bytes_sent(*short, "1") != bytes_sent(*short, "2")


@pytest.mark.slow
def test_boxing_shows_the_papers_five_behaviours_with_their_latencies(half: str) -> None:
    with ideal_buses():
        run = figures(half, "--scene", "boxing")
    seen = run["behaviours"]
    for name in ("punch", "attack", "face", "wave", "reach"):
        assert seen[name]["seen"] == seen[name]["of"] > 0, name
    assert seen["punch"]["latency_s"] <= 0.4 and seen["wave"]["latency_s"] <= 0.4
    assert run["seconds"] == pytest.approx(45.0, abs=0.1)
