"""Tuning a running rig from a shell: gazerig ctl get, set, save ... on a rig in another process."""

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from branch import Branch
from ideal_bus import ideal_buses
from typer.testing import CliRunner

from gazerig.config.load import ConfigError, shipped_path
from gazerig.config.schema import load_rig
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.param_store import ParamStore
from gazerig.robot.cli.tune import app
from gazerig.robot.control.loop import Tick
from gazerig.robot.control.loop import run as run_loop
from gazerig.robot.model import commands
from gazerig.robot.remote import socket_server
from gazerig.robot.remote.client import RobotClient, connect_to_all
from gazerig.robot.remote.live_server import LiveServer

PACE_S = 0.01  # real seconds a tick


def here(work: Callable[..., Any], *words: Any, **named: Any) -> Any:
    """Call a function in this process, which has no servos that wait."""
    return work(*words, **named)


def serve(path: Path) -> None:
    """Run until SIGTERM; passes the rig's messages to standard error."""
    commands.MIN_HOLD_S = commands.MIN_RESUME_GAP_S = 0.0  # time is slow here
    # What takes time for the loop's sake is tested where it is done: shares of the processor,
    # files that are read in another process, and a file that is looked at twice a second.
    socket_server.EACH = socket_server.ALL = (1.0, 60.0)
    over: list[str] = []
    signal.signal(signal.SIGTERM, lambda *_: over.append("SIGTERM"))
    with ideal_buses():
        options = RunOptions(mock=True, fast=True, seed=0, scene="visitor")
        made = assemble(load_rig(str(path)), options)
    robot = made.robot

    def say(line: str) -> None:
        print(line, file=sys.stderr, flush=True)

    about = {"rig": str(path), "name": "my", "pid": os.getpid()}
    tuning = ParamStore(made.live_params, robot.command, str(path), elsewhere=here)
    live = LiveServer(robot, tuning, (ConfigError,), made.clock, about, say)

    def watch(tick: Tick) -> None:
        live.update(tick)
        for event in tick.events:
            say(event)
        time.sleep(PACE_S)

    robot.start(made.clock)
    live.open()
    print("open", flush=True)
    try:
        run_loop(robot, made.clock, made.loop, lambda _: over[0] if over else None, watch)
    finally:
        live.close()
        robot.stop()
        made.close()


class Running(NamedTuple):
    """A rig in another process."""

    process: subprocess.Popen[str]
    path: Path
    log: Path

    def hears(self, words: str) -> bool:
        """Wait for a message."""
        for _ in range(400):
            if words in self.log.read_text(encoding="utf-8"):
                return True
            time.sleep(0.05)
        return False


@contextlib.contextmanager
def a_rig() -> Iterator[Running]:
    folder = Path(tempfile.mkdtemp(prefix="gz-", dir="/tmp"))
    path, log = Path(shutil.copy(shipped_path("rigs", "desk"), folder / "my.yaml")), folder / "log"
    with log.open("w") as said:
        process = Branch(
            lambda: serve(path),
            stdout=subprocess.PIPE,
            stderr=said,
            text=True,
            env={**os.environ, "XDG_RUNTIME_DIR": str(folder)},
        )
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "open\n", log.read_text(encoding="utf-8")
            yield Running(process, path, log)
        finally:
            process.terminate()
            process.communicate(timeout=20.0)
            shutil.rmtree(folder)


@contextlib.contextmanager
def a_rig_beside() -> Iterator[subprocess.Popen[str]]:
    """A second one whose sockets are in the same folder."""
    path = Path(os.environ["XDG_RUNTIME_DIR"]) / "my.yaml"
    process = Branch(
        lambda: serve(path),
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env=dict(os.environ),
    )
    try:
        assert process.stdout is not None and process.stdout.readline() == "open\n"
        yield process
    finally:
        process.terminate()
        process.communicate(timeout=20.0)


RATE = "loop.rate_hz"
ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def rig() -> Iterator[Running]:
    with a_rig() as found:
        yield found


@pytest.fixture(autouse=True)
def as_before(rig: Running, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(rig.path.parent))
    yield
    with RobotClient.connect(rig.process.pid) as found:
        found.revert()
        found.resume(confirmed=True)
        found.look_freely()


class Done(NamedTuple):
    """Output of a command."""

    returncode: int
    stdout: str
    stderr: str


def gazerig(*words: str) -> Done:
    done = CliRunner().invoke(app, words, input="")
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    return Done(done.exit_code, done.stdout, done.stderr)


def held(key: str) -> Any:
    with RobotClient.connect() as rig:
        return rig.get(key)[key]


def test_get_shows_all_and_marks_what_is_not_saved() -> None:
    everything = gazerig("ctl", "get").stdout.splitlines()
    assert len(everything) > 200 and everything[0].split() == ["key", "value", "unit", "default"]
    assert gazerig("ctl", "set", RATE, "150").returncode == 0
    table = gazerig("ctl", "get", "loop").stdout.splitlines()
    (row,) = (line for line in table if RATE in line)
    assert row.split() == ["*", RATE, "150.0", "Hz", "200.0", "next", "start"]
    alone = gazerig("ctl", "get", RATE).stdout
    assert "control rate; 20 .. 1000 Hz; changes at the next start" in alone


def test_set_reads_values_as_the_yaml_does_and_tells_what_became_of_it() -> None:
    done = gazerig("ctl", "set", RATE, "150", "gaze.scanpath.model", "random")
    assert done.returncode == 0, done.stderr
    assert sorted(done.stdout.splitlines()) == [
        "gaze.scanpath.model = random",
        f"{RATE} = 150.0 (at the next start)",
    ]
    assert "already active" in gazerig("ctl", "set", RATE, "150.0").stderr
    assert "not saved yet: 2 values" in done.stderr


def test_what_takes_effect_later_is_said() -> None:
    done = gazerig("ctl", "set", "bus.port", "/dev/ttyUSB7")
    assert "bus.port = /dev/ttyUSB7 (at the next start)" in done.stdout


@pytest.mark.parametrize(
    ("words", "rule"),
    [
        ((RATE, "1e9"), "20 to 1000 Hz"),
        (("gaze.scanpath.model", "markof"), "did you mean 'markov'?"),
        ((RATE,), "a value is missing"),
        ((RATE, "100", RATE, "200"), "duplicate key"),
        ((RATE, "100\nmore: 1"), "more than one value"),
    ],
)
def test_what_is_wrong_is_refused_with_the_rule_and_exit_code_2(
    words: tuple[str, ...], rule: str
) -> None:
    done = gazerig("ctl", "set", *words)
    assert done.returncode == 2 and rule in done.stderr and "Traceback" not in done.stderr
    assert done.stdout == "" and held(RATE) == 200.0


def test_revert_tells_what_it_takes_back() -> None:
    gazerig("ctl", "set", RATE, "150")
    done = gazerig("ctl", "revert")
    assert f"{RATE} = 200.0" in done.stdout and held(RATE) == 200.0
    assert "1 value undone" in done.stderr


def test_stop_and_resume() -> None:
    done = gazerig("stop", "finger")
    assert done.returncode == 0 and "torque is off" in done.stderr
    with RobotClient.connect() as rig:
        assert rig.status()["stopped"] == "finger"
    unsure = gazerig("ctl", "resume")  # no person confirms that no hand is in it
    assert unsure.returncode != 0 and "no hand" in unsure.stdout + unsure.stderr
    with RobotClient.connect() as rig:
        assert rig.status()["stopped"] == "finger"
    assert gazerig("ctl", "resume", "--yes").returncode == 0
    assert "nothing to resume" in gazerig("ctl", "resume").stderr


def test_stop_stops_every_rig_that_runs() -> None:
    with a_rig_beside() as other:
        both = {rig.pid: rig for rig in connect_to_all()}
        assert len(both) == 2
        refused = gazerig("ctl", "get", RATE)
        assert refused.returncode == 2 and "--pid" in refused.stderr
        assert gazerig("stop").returncode == 0
        assert all(rig.status()["stopped"] for rig in both.values())
        for rig in both.values():
            rig.close()
        assert str(other.pid) in refused.stderr
        named = json.loads(gazerig("ctl", "rigs", "--json").stdout)
        assert [row["name"] for row in named] == ["my", "my"]
        assert {row["pid"] for row in named} == set(both)
        ambiguous = gazerig("ctl", "--rig", "my", "get", RATE)
        assert ambiguous.returncode == 2 and "2 rigs named my are running" in ambiguous.stderr
        assert gazerig("ctl", "--rig", str(other.pid), "get", RATE).returncode == 0
        unknown = gazerig("ctl", "get", RATE, "--rig", "eva")
        assert "no rig named eva is running: my (process " in unknown.stderr


def test_ask_lists_the_menus_and_chooses_from_them() -> None:
    with RobotClient.connect() as rig:
        present, *others = rig.menus()["conversation"]
    lines = gazerig("ctl", "ask").stdout.splitlines()
    assert any(line.startswith("behaviour: ") for line in lines)
    assert f"conversation: {present} (in force), {', '.join(others)}" in lines
    try:
        done = gazerig("ctl", "ask", "conversation", others[0])
        assert (done.returncode, done.stderr) == (0, f"conversation {others[0]} is active\n")
        (line,) = gazerig("ctl", "ask", "conversation").stdout.splitlines()
        assert line.startswith(f"conversation: {others[0]} (in force), ")
    finally:
        gazerig("ctl", "ask", "conversation", present)


def test_status_says_what_the_rig_does() -> None:
    said = gazerig("ctl", "status").stdout
    with RobotClient.connect() as rig:
        assert f"rig: {rig.status()['rig']}, process {rig.pid}\n" in said
    assert "looks at: " in said and "guard: " in said and "neck_yaw" in said
    assert "all saved" in said and "STOPPED" not in said
    gazerig("ctl", "set", RATE, "150")
    gazerig("stop", "finger")
    said = gazerig("ctl", "status").stdout
    assert "STOPPED, torque off: finger; gazerig ctl resume continues" in said
    assert "not saved: 1 value" in said and "said: stopped by gazerig stop (process" in said
    assert json.loads(gazerig("ctl", "status", "--json").stdout)["stopped"] == "finger"


def test_where_no_rig_runs_it_is_one_line_and_exit_code_2(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
        there_is_none()


def there_is_none() -> None:
    none = (2, "", "no rig is running: start one with gazerig run ...\n")
    for words in (("get",), ("set", RATE, "100"), ("stop",), ("look", "free"), ("save",),
                  ("ask",), ("status",)):  # fmt: skip
        assert gazerig("ctl", *words) == none, words
    assert gazerig("stop") == none
    done = gazerig("stop", "--pid", "1")
    assert done.stderr == "no rig of process 1 is running: start one with gazerig run ...\n"
