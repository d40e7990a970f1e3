"""Commands that move the face of a rig in another terminal: expressions, levels, gestures."""

import contextlib
import sys
from collections.abc import Iterator, Mapping
from math import inf
from typing import Annotated, Any

import typer

from gazerig.drivers.errors import SetupError
from gazerig.gaze.gesture.gesture import MAX_COUNT, MAX_SPEED, MIN_SPEED
from gazerig.robot.cli.look_and_stop import PidOption
from gazerig.robot.cli.terminal import clear_errors, say
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.commands import NO_GESTURE
from gazerig.robot.remote.client import RobotClient

app = typer.Typer()
_SET_EVERY_S = 0.1
"""A level falls to 0 when it is not set for half a second."""


@app.command()
def express(
    expression: Annotated[
        str | None, typer.Argument(help="One of the rig's table; without it, all are listed.")
    ] = None,
    strength: Annotated[
        float, typer.Option("--strength", min=0.0, max=1.0, help="1 as in the table, 0 none of it.")
    ] = 1.0,
    pid: PidOption = None,
) -> None:
    """Move the running head's face to an expression, or list the expressions."""
    with clear_errors(), RobotClient.connect(pid, "gazerig ctl express") as rig:
        if expression is None:
            there = rig.menus().get("expression", ())
            say(", ".join(there) or "this rig has no table expressions")
            return
        rig.express(expression, strength)
        say(f"{expression} is in force" + (f", strength {strength:g}" if strength != 1.0 else ""))


@app.command()
def level(
    name: Annotated[str, typer.Argument(help="A level of the rig's table, such as mouth.")],
    value: Annotated[str, typer.Argument(metavar="0..1 | -", help="Or - to read values by line.")],
    seconds: Annotated[
        float | None, typer.Option(min=0.0, help="Keep it for S seconds; else until Ctrl-C.")
    ] = None,
    pid: PidOption = None,
) -> None:
    """Set a level, such as a jaw by loudness, while this command runs; then it falls to 0."""
    with clear_errors():
        values = (
            (_number(line) for line in sys.stdin if line.strip())
            if value == "-"
            else _repeat_value(_number(value), seconds)
        )
        with RobotClient.connect(pid, "gazerig ctl level") as rig:
            with contextlib.suppress(KeyboardInterrupt):
                for one in values:
                    rig.set_level(name, one)
            rig.set_level(name, 0.0)


@app.command()
def play(
    gesture: Annotated[
        str | None, typer.Argument(help="A gesture, e.g. nod; none ends the one under way.")
    ] = None,
    speed: Annotated[
        float, typer.Option("--speed", min=MIN_SPEED, max=MAX_SPEED, help="1 as it was written.")
    ] = 1.0,
    count: Annotated[
        int, typer.Option("--count", min=0, max=MAX_COUNT, help="How often; 0 as it says.")
    ] = 0,
    listed: Annotated[bool, typer.Option("--list", help="List the gestures there are.")] = False,
    pid: PidOption = None,
) -> None:
    """Play a gesture on the running head, or list all gestures with their fit to this rig."""
    with clear_errors(), RobotClient.connect(pid, "gazerig ctl play") as rig:
        if gesture is None or listed:
            for one in rig.gestures():
                say(_gesture_line(one))
            return
        say(rig.play("" if gesture == NO_GESTURE else gesture, speed, count).text())


def _gesture_line(gesture: Mapping[str, Any]) -> str:
    """Return one line about a gesture."""
    head = f"{gesture['name']:<14}{gesture['description']}"
    if gesture["refused"]:
        return f"{head}; not on this rig: {gesture['refused']}"
    slower = f", slower by {gesture['slowed_by']:.2f}" if gesture["slowed_by"] > 1.0 else ""
    return f"{head} ({gesture['duration_s']:.1f} s{slower})"


def _repeat_value(value: float, seconds: float | None) -> Iterator[float]:
    """Repeat a value for a time, often enough to keep it."""
    clock = RealClock()
    end_s = clock.now_s() + (inf if seconds is None else seconds)
    yield value
    while (now_s := clock.now_s()) < end_s:
        clock.sleep_until(min(end_s, now_s + _SET_EVERY_S))
        yield value


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0.0 <= value <= 1.0:
        raise SetupError(f"{text.strip()!r:.40} is no level: give a number 0..1")
    return value
