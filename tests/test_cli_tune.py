"""Tuning a running rig from a shell: gazerig ctl get, set, save ... on a rig in another process."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from tuned_rig import Running, a_rig, a_rig_beside
from typer.testing import CliRunner

from gazerig.robot.cli.tune import app
from gazerig.robot.remote.client import RobotClient, connect_to_all

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
