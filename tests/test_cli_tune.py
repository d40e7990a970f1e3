"""Tuning a running rig from a shell: gazerig ctl get, set, save ... on a rig in another process."""

import contextlib
import io
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from tuned_rig import Running, a_rig, a_rig_beside
from typer.testing import CliRunner

from gazerig.config.parameters import parameters
from gazerig.config.schema import load_rig
from gazerig.robot.cli.entry_point import main as quick_main
from gazerig.robot.cli.steer import END, run_steering
from gazerig.robot.cli.tune import app, state_lines
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.parameter import Parameter
from gazerig.robot.remote.client import RobotClient, connect_to_all
from gazerig.robot.remote.steering import STOP, Steering, Stick

GAZERIG = (
    "import sys; sys.argv[0] = 'gazerig'; from gazerig.robot.cli.entry_point import main; main()"
)
SPEED = "gaze.saccade.max_speed_deg_s"
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
    """Run a command in this process, which takes a tenth of the time."""
    done = CliRunner().invoke(app, words, input="")
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    return Done(done.exit_code, done.stdout, done.stderr)


def whole_gazerig(*words: str, **environ: str) -> Done:
    """Run a command as a shell does."""
    done = subprocess.run(
        [sys.executable, "-c", GAZERIG, *words],
        capture_output=True,
        text=True,
        env={**os.environ, **environ},
        timeout=60.0,
        stdin=subprocess.DEVNULL,
    )
    return Done(done.returncode, done.stdout, done.stderr)


def held(key: str) -> Any:
    with RobotClient.connect() as rig:
        return rig.get(key)[key]


def test_get_shows_all_and_marks_what_is_not_saved() -> None:
    everything = gazerig("ctl", "get").stdout.splitlines()
    assert len(everything) > 300 and everything[0].split() == ["key", "value", "unit", "default"]
    assert gazerig("ctl", "set", RATE, "150").returncode == 0
    table = gazerig("ctl", "get", "loop").stdout.splitlines()
    (row,) = (line for line in table if RATE in line)
    assert row.split() == ["*", RATE, "150.0", "Hz", "200.0"]
    (other,) = (line for line in table if "loop.park_s" in line)
    assert not other.startswith("*")
    alone = gazerig("ctl", "get", RATE).stdout
    assert "control rate; 20 .. 1000 Hz; changes at the next tick" in alone


def test_get_differs_and_json() -> None:
    assert gazerig("ctl", "get", "--differs").stdout.splitlines()[1:] == []
    gazerig("ctl", "set", RATE, "150", "park_deg.neck_pitch", "-3")
    rows = gazerig("ctl", "get", "--differs").stdout.splitlines()[1:]
    assert [row.split()[1] for row in rows] == ["park_deg.neck_pitch", RATE]
    assert json.loads(gazerig("ctl", "get", RATE, "--json").stdout) == {RATE: 150.0}


def test_set_reads_values_as_the_yaml_does_and_tells_what_became_of_it() -> None:
    done = gazerig("ctl", "set", RATE, "150", "gaze.scanpath.model", "random")
    assert done.returncode == 0, done.stderr
    assert sorted(done.stdout.splitlines()) == [
        "gaze.scanpath.model = random",
        f"{RATE} = 150.0",
    ]
    assert "already active" in gazerig("ctl", "set", RATE, "150.0").stderr
    assert "not saved yet: 2 values" in done.stderr


def test_what_takes_effect_later_is_said() -> None:
    done = gazerig("ctl", "set", "bus.port", "/dev/ttyUSB7")
    assert "bus.port = /dev/ttyUSB7 (next start: " in done.stdout


@pytest.mark.parametrize(
    ("words", "rule"),
    [
        ((RATE, "1e9"), "above 1000"),
        ((RATE, "fast"), "wanted a number"),
        ((RATE, ".nan"), "finite number"),
        (("loop.rate", "100"), "unknown key"),
        (("gaze.scanpath.model", "markof"), "did you mean 'markov'?"),
        ((RATE,), "a value is missing"),
        ((RATE, "100", RATE, "200"), "duplicate key"),
        ((RATE, "[1"), "not valid YAML"),
        ((RATE, "100\nmore: 1"), "more than one value"),
    ],
)
def test_what_is_wrong_is_refused_with_the_rule_and_exit_code_2(
    words: tuple[str, ...], rule: str
) -> None:
    done = gazerig("ctl", "set", *words)
    assert done.returncode == 2 and rule in done.stderr and "Traceback" not in done.stderr
    assert done.stdout == "" and held(RATE) == 200.0


def test_every_rule_is_listed_and_no_value_taken() -> None:
    done = gazerig("ctl", "set", RATE, "1e9", "gaze.scanpath.model", "markof", "loop.park_s", "2")
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 2
    assert held("loop.park_s") == 4.0


def test_save_keeps_comments_and_the_old_file(rig: Running) -> None:
    before = rig.path.read_text(encoding="utf-8")
    gazerig("ctl", "set", RATE, "150")
    done = gazerig("ctl", "save")
    assert f"{RATE}: 200.0 -> 150.0" in done.stdout and str(rig.path) in done.stderr
    assert load_rig(str(rig.path)).loop.rate_hz == 150.0
    kept = [line for line in before.splitlines() if line.lstrip().startswith("#")]
    assert all(line in rig.path.read_text(encoding="utf-8") for line in kept)
    (backup,) = rig.path.parent.glob("my.yaml.bak-*")
    assert backup.read_text(encoding="utf-8") == before and str(backup) in done.stderr
    assert "nothing to save" in gazerig("ctl", "save").stderr
    backup.unlink()
    gazerig("ctl", "set", RATE, "200")
    gazerig("ctl", "save")


def test_save_takes_a_path_from_the_folder_it_is_typed_in(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    with a_rig() as rig, monkeypatch.context() as patch:
        patch.setenv("XDG_RUNTIME_DIR", str(rig.path.parent))
        patch.chdir(tmp_path)
        gazerig("ctl", "set", RATE, "150")
        assert gazerig("ctl", "save", "other.yaml").returncode == 0
        other = tmp_path / "other.yaml"
        assert load_rig(str(other)).loop.rate_hz == 150.0
        assert load_rig(str(rig.path)).loop.rate_hz == 200.0
        # The copy is the rig's file from now on and is watched.
        text = other.read_text(encoding="utf-8")
        other.write_text(text.replace("rate_hz: 150", "rate_hz: 160"), encoding="utf-8")
        assert rig.hears("other.yaml was edited: its values are applied"), rig.log.read_text()
        assert held(RATE) == 160.0


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


def test_look_and_character() -> None:
    done = gazerig("ctl", "look", "1", "-0.2", "0.3", "--stay")
    assert done.returncode == 0 and "it looks there, until: gazerig ctl look free" in done.stderr
    with RobotClient.connect() as rig:
        assert rig.status()["why"].endswith("makes it look at 1 -0.2 0.3")
    assert gazerig("ctl", "look", "free").returncode == 0
    done = gazerig("ctl", "look", "there")
    assert done.returncode == 2 and "X Y Z in metres" in done.stderr
    assert gazerig("ctl", "character", "shy").returncode == 0
    done = gazerig("ctl", "character", "brave")
    assert done.returncode == 2 and "brave" in done.stderr


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


@pytest.mark.parametrize(
    ("words", "rule"),
    [
        (("moods",), "moods: not a menu of this rig; available: behaviour"),
        (("moods", "glad"), "no menu 'moods'"),
        (("conversation", "shout"), "shout"),
    ],
)
def test_what_cannot_be_asked_for_is_refused_with_what_can(
    words: tuple[str, ...], rule: str
) -> None:
    done = gazerig("ctl", "ask", *words)
    assert done.returncode == 2 and rule in done.stderr and "Traceback" not in done.stderr


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


def test_a_rig_that_has_just_begun_or_is_held_up_says_so() -> None:
    begun = {"rig": "desk", "pid": 7, "ticks": 0, "stopped": "", "said": []}
    assert state_lines(begun) == ["rig: desk, process 7", "it has just started: nothing is "
                                  "known yet"]  # fmt: skip
    with RobotClient.connect() as rig:
        now = rig.status()
    assert not any("held up" in line for line in state_lines({**now, "age_s": 0.1}))
    talk = {"state": "speaking", "partner": 2, "who": "an agent"}
    talks = state_lines({**now, "conversation": talk})
    assert "conversation: speaking with person 2, reported by an agent" in talks
    assert "the loop is delayed: the following data are 2.5 s old" in state_lines(
        {**now, "age_s": 2.5}
    )


def test_a_file_edited_by_hand_is_read_again(rig: Running) -> None:
    before = rig.path.read_text(encoding="utf-8")
    rig.path.write_text(before.replace("rate_hz: 200", "rate_hz: 160"), encoding="utf-8")
    assert rig.hears("my.yaml was edited: its values are applied")
    assert held(RATE) == 160.0
    wrong = before.replace("rate_hz: 200.0", "rate_hz: 2e6") + "nonsense: 1\n"
    rig.path.write_text(wrong, encoding="utf-8")
    assert rig.hears("but has errors; the previous values stay")
    said = rig.log.read_text(encoding="utf-8")
    assert "is above 1000" in said and "nonsense" in said
    assert held(RATE) == 160.0
    rig.path.write_text(before, encoding="utf-8")
    for _ in range(200):
        if held(RATE) == 200.0:
            return
        time.sleep(0.05)
    pytest.fail("the good file was not read again")


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
    assert whole_gazerig("stop") == none
    done = gazerig("stop", "--pid", "1")
    assert done.stderr == "no rig of process 1 is running: start one with gazerig run ...\n"


def completing(words: tuple[str, ...]) -> dict[str, str]:
    """Return a shell's completions of a command."""
    return {
        "_GAZERIG_COMPLETE": "complete_bash",
        "COMP_WORDS": " ".join(("gazerig", *words)),
        "COMP_CWORD": str(len(words)),
    }


def completed(*words: str) -> list[str]:
    """Complete in this process."""
    said = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(said):
        for name, value in completing(words).items():
            patch.setenv(name, value)
        patch.setattr(sys, "argv", ["gazerig"])
        patch.setattr(sys.modules["__main__"], "__package__", None)  # or it is "python -m pytest"
        with pytest.raises(SystemExit):
            quick_main()
    return said.getvalue().split()


def test_a_shell_completes_keys_and_the_values_that_there_are() -> None:
    keys = ["loop.rate_hz", "loop.park_s"]
    assert whole_gazerig(**completing(("ctl", "get", "loop."))).stdout.split() == keys
    assert completed("ctl", "get", "loop.") == keys
    assert RATE in completed("ctl", "set", "loop.r")
    assert completed("ctl", "set", "gaze.scanpath.model", "") == list(
        next(k for k in knobs_of_desk() if k.key == "gaze.scanpath.model").choices
    )
    assert RATE in completed("ctl", "set", "loop.park_s", "2", "loop.r")
    assert "shy" in completed("ctl", "character", "s")
    assert completed("ctl", "ask", "beh") == ["behaviour"]
    assert "listen" in completed("ctl", "ask", "conversation", "")


def test_without_a_rig_a_shell_completes_keys_of_the_shipped_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
        assert completed("ctl", "get", "loop.") == ["loop.rate_hz", "loop.park_s"]


def knobs_of_desk() -> tuple[Parameter, ...]:
    desk = load_rig("desk")
    return parameters(desk, desk)


class _Turns:
    """Controls that hold a stick for some turns, let go, play and stop."""

    def __init__(self, rig: RobotClient, seen: list[str]) -> None:
        self._rig, self._seen, self._turn = rig, seen, 0

    def update(self, steering: Steering, now_s: float) -> tuple[str, ...]:
        self._turn += 1
        self._seen.append(str(self._rig.status()["control_text"]))
        steering.stick(Stick(1.0, 0.0) if self._turn < 5 else Stick())
        return {6: ("nod",), 8: (STOP,), 9: (END,)}.get(self._turn, ())


def test_steer_leads_a_running_rig_and_lets_go() -> None:
    seen: list[str] = []
    with RobotClient.connect(who="gazerig ctl steer") as rig:
        run_steering(rig, _Turns(rig, seen), Steering(), RealClock(), lambda line: None)
        assert rig.status()["stopped"]
    assert "steer" in seen[2] and "steer" in seen[4]
    assert "steer" not in seen[0] and "steer" not in seen[6]


def test_steer_needs_a_terminal_or_a_gamepad() -> None:
    done = gazerig("ctl", "steer")
    assert done.returncode == 2 and "run this in one, or use --gamepad" in done.stderr
    done = gazerig("ctl", "steer", "--keyboard", "--gamepad")
    assert done.returncode == 2 and "use only one of --keyboard and --gamepad" in done.stderr
