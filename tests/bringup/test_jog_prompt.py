"""A servo steered at a terminal: keys as they are pressed, lines of a file, and numbers."""

import time
from pathlib import Path

import pytest
from command_line import answers_in
from commands_started import OnTerminal

from gazerig.config.schema import load_rig
from gazerig.features.bringup.calibration.linkage_calibration import HobbyMarker
from gazerig.features.bringup.cli.jog_prompt import TerminalJogger
from gazerig.features.bringup.cli.prompts import Lines


class Servo(HobbyMarker):
    """Records its calls."""

    def __init__(self) -> None:
        self.reported: list[tuple[str, float]] = []

    def move_by_us(self, us: float) -> None:
        self.reported.append(("by", us))

    def nudge(self, us: float) -> None:
        self.reported.append(("nudge", us))

    def move_to_us(self, us: float) -> None:
        self.reported.append(("to", us))

    def live(self) -> str:
        return "here"


def person(tmp_path: Path, *lines: str) -> TerminalJogger:
    return TerminalJogger(Lines(Path(answers_in(tmp_path, *lines))), lambda: None, False)


def test_lines_move_a_servo_until_enter(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    servo = Servo()
    person(tmp_path, "+40", "-12.5", "1480", "left", "nan", "").steer("move it", servo)
    assert servo.reported == [("by", 40.0), ("by", -12.5), ("to", 1480.0)]
    assert capsys.readouterr().err.count("moves it by so many us") == 2


def test_keys_steer_a_hobby_servo_at_the_terminal(rigs: dict[str, str]) -> None:
    rig = rigs["maker"]
    words = (rig, "--mock", "--yes", "--joint", "eyes_tilt", "--more", "0", "--margin", "0")
    with OnTerminal("calibrate", *words) as terminal:
        terminal.reads("shall it begin? [1510]")
        terminal.types(b"\n")
        terminal.reads("straight ahead, then press Enter")
        terminal.reads("1510 us")
        terminal.reads("step 10 us")
        terminal.types(b"\x1b[A\x1b[C")  # a larger step, then one of those to the right
        terminal.reads("1530 us")
        terminal.types(b"\r")
        terminal.reads("to its UPPER end")
        terminal.reads("step 10 us")
        terminal.types(b"\x1b[A\x1b[Ad")
        terminal.reads("1580 us")
        terminal.types(b"\r")
        terminal.reads("eyes_tilt at 1580 us: how many degrees (UPPER is +)?")
        terminal.types(b"8\n")
        terminal.reads("to its LOWER end")
        terminal.reads("step 10 us")
        terminal.types(b"\x1b[A\x1b[Aa")
        terminal.reads("1530 us")
        time.sleep(0.6)  # a key that is held down runs no farther ahead than its pulse
        terminal.types(b"a")
        terminal.reads("1480 us")
        terminal.types(b"\r")
        terminal.reads("at 1480 us: how many degrees")
        terminal.types(b"-7\n")
        terminal.reads("written into")
    assert load_rig(rig).joints["eyes_tilt"].transmission_points == (
        (-7, 1480),
        (0, 1530),
        (8, 1580),
    )
