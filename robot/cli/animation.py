"""Commands that move the face of a rig in another terminal: expressions, levels, tracks."""

import contextlib
import sys
from collections.abc import Mapping
from math import inf
from pathlib import Path
from typing import Annotated, Any

import typer

from gazerig.drivers.sound.params import KINDS
from gazerig.gaze.track.track import MAX_COUNT, MAX_SPEED, MIN_SPEED
from gazerig.robot.cli.options import PidOption
from gazerig.robot.cli.terminal import clear_errors, say
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.commands import (
    NO_TRACK,
    Express,
    Play,
    ReadMenus,
    Say,
    SayPiece,
    SetLevel,
    Tracks,
)
from gazerig.robot.net.client import RobotClient

app = typer.Typer()
_PIECE_S = 0.04
_SET_EVERY_S = 0.1
"""Interval of setting; a level that is not set for half a second falls to 0."""


@app.command()
def express(
    expression: Annotated[
        str | None,
        typer.Argument(help="Name in the rig's table; without it, all expressions are listed."),
    ] = None,
    strength: Annotated[
        float,
        typer.Option(
            "--strength", min=0.0, max=1.0, help="Strength: 1 as in the table, 0 no effect."
        ),
    ] = 1.0,
    pid: PidOption = None,
) -> None:
    """Move the running head's face to an expression, or list the expressions."""
    with clear_errors(), RobotClient.connect(pid, "gazerig ctl express") as rig:
        if expression is None:
            there = rig.ask(ReadMenus(), dict[str, tuple[str, ...]]).get("expression", ())
            say(", ".join(there) or "this rig has no table expressions")
            return
        rig.send(Express(expression, strength))
        say(f"{expression} is active" + (f", strength {strength:g}" if strength != 1.0 else ""))


@app.command()
def level(
    name: Annotated[str, typer.Argument(help="A level of the rig's table, such as mouth.")],
    value: Annotated[float, typer.Argument(min=0.0, max=1.0)],
    seconds: Annotated[
        float, typer.Option(min=0.0, help="Keep it for S seconds; otherwise until Ctrl-C.")
    ] = inf,
    pid: PidOption = None,
) -> None:
    """Set a level, such as the opening of a jaw, while this command runs; then it falls to 0."""
    clock = RealClock()
    end_s = clock.now_s() + seconds
    with clear_errors(), RobotClient.connect(pid, "gazerig ctl level") as rig:
        with contextlib.suppress(KeyboardInterrupt):
            while True:
                rig.send(SetLevel(name, value))
                if clock.now_s() >= end_s:
                    break
                clock.sleep_until(min(end_s, clock.now_s() + _SET_EVERY_S))
        rig.send(SetLevel(name, 0.0))


@app.command()
def play(
    track: Annotated[
        str | None, typer.Argument(help="A track, e.g. nod; none ends all tracks.")
    ] = None,
    speed: Annotated[
        float,
        typer.Option(
            "--speed", min=MIN_SPEED, max=MAX_SPEED, help="Speed factor; 1 is the original speed."
        ),
    ] = 1.0,
    count: Annotated[
        int,
        typer.Option(
            "--count",
            min=0,
            max=MAX_COUNT,
            help="Number of repetitions; 0: as the track defines.",
        ),
    ] = 0,
    start: Annotated[
        str, typer.Option("--from", metavar="S|CUE", help="Start at a time or a cue.")
    ] = "0",
    loop: Annotated[bool, typer.Option("--loop", help="Repeat it until it is ended.")] = False,
    listed: Annotated[bool, typer.Option("--list", help="List the tracks.")] = False,
    pid: PidOption = None,
) -> None:
    """Play a track on the running head, or list all tracks with their fit to this rig."""
    with clear_errors(), RobotClient.connect(pid, "gazerig ctl play") as rig:
        if track is None or listed:
            for one in rig.ask(Tracks(), tuple[dict[str, Any], ...]):
                say(_track_line(one))
            return
        from_s: float | str = start
        with contextlib.suppress(ValueError):
            from_s = float(start)
        name = "" if track == NO_TRACK else track
        say(rig.send(Play(name, speed, count, from_s, loop)).text())


@app.command(name="say")
def say_aloud(
    what: Annotated[
        str,
        typer.Argument(
            metavar="FILE | TEXT | -",
            help="A sound file, by its ending, a text, or - for samples from standard input: "
            "signed, 16 bits, one channel.",
        ),
    ],
    volume: Annotated[float, typer.Option(min=0.0, max=1.0, help="Factor on the volume.")] = 1.0,
    rate: Annotated[int, typer.Option(help="Rate of the samples from standard input, Hz.")] = 16000,
    pid: PidOption = None,
) -> None:
    """Say a sound file or a text on the running head, with the mouth of a rig that has one."""
    with clear_errors(), RobotClient.connect(pid, "gazerig ctl say") as rig:
        if what == "-":
            clock = RealClock()
            while piece := sys.stdin.buffer.read(2 * round(_PIECE_S * rate)):
                waits_s = rig.ask(SayPiece(piece, rate), float) - 1.0
                clock.sleep_until(clock.now_s() + max(0.0, waits_s))
            rig.ask(SayPiece(b"", rate, last=True), float)
            return
        if Path(what).suffix.lower() in KINDS and Path(what).is_file():
            what = str(Path(what).absolute())
        say(rig.send(Say(what, volume)).text())


def _track_line(track: Mapping[str, Any]) -> str:
    """Return one line about a track."""
    head = f"{track['name']:<14}{track['description']}"
    if track["refused"]:
        return f"{head}; not on this rig: {track['refused']}"
    slower = f", slower by {track['slowed_by']:.2f}" if track["slowed_by"] > 1.0 else ""
    return f"{head} ({track['duration_s']:.1f} s{slower})"
