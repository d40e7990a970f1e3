"""A servo steered at a terminal: keys as they are pressed, lines of a file, and numbers."""

import time
from pathlib import Path
from typing import Any

import pytest
from command_line import answers_in
from commands_started import OnTerminal
from stand_in import StandIn

from gazerig.config.schema import load_rig
from gazerig.features.bringup.cli.prompts import Lines, TerminalPerson


def test_lines_move_a_servo_until_enter(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    moves: list[float] = []
    servo: Any = StandIn()
    servo.place_us = 1500.0
    servo.aim = moves.append
    servo.live = lambda: "here"
    lines = answers_in(tmp_path, "+40", "-12.5", "1480", "left", "nan", "")
    TerminalPerson(Lines(Path(lines)), lambda: None, False).steer("move it", servo)
    assert moves == [1540.0, 1487.5, 1480.0]
    assert capsys.readouterr().err.count("moves it by so many us") == 2


def test_keys_steer_a_hobby_servo_at_the_terminal(rigs: dict[str, str]) -> None:
    rig = rigs["maker"]
    words = (rig, "--mock", "--yes", "--joint", "eyes_tilt", "--margin", "0")
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
        # Half-way between each two marks, with the angle that it proposes.
        terminal.reads("eyes_tilt at 1505 us: how many degrees")
        terminal.types(b"-3\n")
        terminal.reads("eyes_tilt at 1555 us: how many degrees")
        terminal.types(b"\n")
        terminal.reads("written into")
    points = load_rig(rig).joints["eyes_tilt"].transmission_points
    assert points == ((-7, 1480), (-3, 1505), (0, 1530), (4, 1555), (8, 1580))
