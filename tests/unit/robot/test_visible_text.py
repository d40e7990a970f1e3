"""Control characters of names are shown on the terminal, and never executed."""

import io
import json
from typing import Any

import pytest
from command_line import typed
from rich.console import Console as RichConsole

from gazerig.drivers.process.visible_text import VisibleStream, visible
from gazerig.robot.cli.progress import Console
from gazerig.robot.cli.terminal import run_app

START = "from gazerig.robot.cli.entry_point import main; main()"
EVIL = "\x1b]0;owned\x07\x1b[31mred\x1b[2J"


def test_control_characters_are_shown_and_all_other_text_stays():
    assert visible("Grüße, 日本\n\tx\r\n") == "Grüße, 日本\n\tx\r\n"
    assert visible("a\x1b[31m\r\x07\x7f\x9b\u202e\udcff") == (
        r"a\x1b[31m\x0d\x07\u007f\u009b\u202e\udcff"
    )
    assert visible(visible(EVIL)) == visible(EVIL)
    assert json.loads(visible(json.dumps({EVIL: "\x7f\x9b"}, ensure_ascii=False))) == {
        EVIL: "\x7f\x9b"
    }


def test_what_rich_sends_stays_and_what_a_name_holds_does_not():
    raw = io.StringIO()
    stream: Any = VisibleStream(raw)
    for kind in (RichConsole, Console):
        kind(file=stream, force_terminal=True, width=200).print(
            EVIL, style="red", highlight=False, markup=False
        )
    print(EVIL, file=stream)
    theirs, ours, printed = raw.getvalue().splitlines()
    assert r"\x1b]0;owned" in theirs
    assert ours == f"\x1b[31m{visible(EVIL)}\x1b[0m"
    assert printed == visible(EVIL)


@pytest.mark.parametrize(
    "words",
    [
        ("check", f"/nowhere/{EVIL}.yaml"),
        ("import", "desk", f"/nowhere/{EVIL}.csv"),
        ("rerun", f"/nowhere/{EVIL}.mcap"),
        ("run", "--mock", "--no-page", "--video", f"/nowhere/{EVIL}.avi"),
        (EVIL,),
        ("run", f"--{EVIL}"),
    ],
)
def test_names_in_errors_are_shown(words, capfd):
    typed(*words)
    out, err = capfd.readouterr()
    assert r"\x1b" in out + err
    assert not set(out + err) & {"\x1b", "\x07"}, out + err


def test_what_a_command_prints_is_shown(capfd):
    with pytest.raises(SystemExit):
        run_app(lambda words: print(*words), [EVIL], "")
    assert capfd.readouterr().out == f"{visible(EVIL)}\n"
