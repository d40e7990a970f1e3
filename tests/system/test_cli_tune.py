"""Tuning a running rig from a shell: gazerig ctl get, set, revert, ask, status; gazerig stop."""

import json
import os
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from branch import Branch
from command_line import invoked
from slow_rigs import at_rate

import gazerig
from gazerig.robot.loop import body

RATE = "loop.rate_hz"


def opened(rig: str) -> gazerig.Head:
    return gazerig.open(rig, mock=True, bus="ideal", scene="visitor")


@pytest.fixture(scope="module")
def rig() -> Iterator[str]:
    """Return the file of a rig that runs, in a folder with its socket."""
    folder = Path(tempfile.mkdtemp(prefix="gz-", dir="/tmp"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_RUNTIME_DIR", str(folder))
        patch.setattr(body, "MIN_HOLD_S", 0.0)
        patch.setattr(body, "MIN_RESUME_GAP_S", 0.0)
        yield at_rate(folder, "desk", 80.0)
    shutil.rmtree(folder)


@pytest.fixture(scope="module")
def running(rig: str) -> Iterator[gazerig.Head]:
    with opened(rig) as head:
        yield head


@pytest.fixture
def head(running: gazerig.Head) -> Iterator[gazerig.Head]:
    """Return a head whose values, torque and gaze are restored after the test."""
    yield running
    running.revert()
    running.resume(confirmed=True)
    running.look_freely()


REFUSED = (
    ((RATE, "1e9"), "20 to 1000 Hz"),
    (("gaze.scanpath.model", "markof"), "did you mean 'markov'?"),
    ((RATE,), "a value is missing"),
    ((RATE, "100\nmore: 1"), "more than one value"),
)


def test_values_are_shown_set_refused_and_reverted(head):
    everything = invoked("ctl", "get").out.splitlines()
    assert len(everything) > 200 and everything[0].split() == ["key", "value", "unit", "default"]
    for words, rule in REFUSED:
        done = invoked("ctl", "set", *words)
        assert done.code == 2 and rule in done.err and "Traceback" not in done.err
        assert done.out == "" and head.get(RATE) == {RATE: 80.0}
    done = invoked("ctl", "set", RATE, "150", "gaze.scanpath.model", "random")
    assert done.code == 0, done.err
    assert sorted(done.out.splitlines()) == [
        "gaze.scanpath.model = random",
        f"{RATE} = 150.0 (at the next start)",
    ]
    assert "already active" in invoked("ctl", "set", RATE, "150.0").err
    assert "not saved yet: 2 values" in done.err
    table = invoked("ctl", "get", "loop").out.splitlines()
    (row,) = (line for line in table if RATE in line)
    assert row.split() == ["*", RATE, "150.0", "Hz", "200.0", "next", "start"]
    alone = invoked("ctl", "get", RATE).out
    assert "control rate; 20 .. 1000 Hz; changes at the next start" in alone
    done = invoked("ctl", "revert")
    assert f"{RATE} = 80.0" in done.out and head.get(RATE) == {RATE: 80.0}
    assert "2 values undone" in done.err


def test_status_menus_stop_and_resume(head, rig):
    said = invoked("ctl", "status").out
    assert f"rig: {rig}, process {os.getpid()}\n" in said
    assert "looks at: " in said and "guard: " in said and "neck_yaw" in said
    assert "all saved" in said and "STOPPED" not in said
    present, *others = head.menus()["conversation"]
    lines = invoked("ctl", "ask").out.splitlines()
    assert any(line.startswith("behaviour: ") for line in lines)
    assert f"conversation: {present} (in force), {', '.join(others)}" in lines
    done = invoked("ctl", "ask", "conversation", others[0])
    assert (done.code, done.err) == (0, f"conversation {others[0]} is active\n")
    (line,) = invoked("ctl", "ask", "conversation").out.splitlines()
    assert line.startswith(f"conversation: {others[0]} (in force), ")
    invoked("ctl", "set", RATE, "150")
    done = invoked("stop", "finger")
    assert done.code == 0 and "torque is off" in done.err
    assert head.state.stopped == "finger"
    said = invoked("ctl", "status").out
    assert "STOPPED, torque off: finger; gazerig ctl resume continues" in said
    assert "not saved: 1 value" in said and "said: stopped by gazerig stop (process" in said
    assert json.loads(invoked("ctl", "status", "--json").out)["stopped"] == "finger"
    unsure = invoked("ctl", "resume")  # no person confirms that no hand is in it
    assert unsure.code != 0 and "no hand" in unsure.out + unsure.err
    assert head.state.stopped == "finger"
    assert invoked("ctl", "resume", "--yes").code == 0
    assert "nothing to resume" in invoked("ctl", "resume").err


def test_stop_stops_every_rig_that_runs_and_says_where_none_does(head, rig, tmp_path, monkeypatch):
    def run() -> None:
        body.MIN_HOLD_S = 0.0
        with opened(rig):
            print("open", flush=True)
            signal.pause()

    with Branch(run, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        assert process.stdout is not None and process.stdout.readline() == "open\n"
        refused = invoked("ctl", "get", RATE)
        assert refused.code == 2 and "--pid" in refused.err and str(process.pid) in refused.err
        assert invoked("stop").code == 0
        with gazerig.connect(process.pid) as other:
            assert head.state.stopped and other.state.stopped
        named = invoked("ctl", "rigs").out.splitlines()
        assert [row.split()[0] for row in named] == ["desk", "desk"]
        ambiguous = invoked("ctl", "get", RATE, "--rig", "desk")
        assert ambiguous.code == 2 and "2 rigs named desk are running" in ambiguous.err
        assert invoked("ctl", "get", RATE, "--rig", str(process.pid)).code == 0
        unknown = invoked("ctl", "get", RATE, "--rig", "eva")
        assert "no rig named eva is running: desk (process " in unknown.err
        process.terminate()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    none = (2, "", "no rig is running: start one with gazerig run ...\n")
    for words in (("get",), ("set", RATE, "100"), ("stop",), ("look", "free"), ("save",),
                  ("ask",), ("status",)):  # fmt: skip
        assert invoked("ctl", *words) == none, words
    assert invoked("stop") == none
    done = invoked("stop", "--pid", "1")
    assert done.err == "no rig of process 1 is running: start one with gazerig run ...\n"
