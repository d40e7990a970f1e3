"""Commands that move the face of a rig in another terminal: tracks and speech."""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from gazerig.drivers.sound.params import KINDS
from gazerig.robot.cli.options import PidOption
from gazerig.robot.cli.terminal import clear_errors, say
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.commands import NO_TRACK, Play, Say, SayPiece, Tracks
from gazerig.robot.net.client import RobotClient

app = typer.Typer()
_PIECE_S = 0.04


@app.command()
def play(
    track: Annotated[
        str | None,
        typer.Argument(help="A track, e.g. nod; none ends all tracks; without it, all are listed."),
    ] = None,
    pid: PidOption = None,
) -> None:
    """Play a track on the running head, or list all tracks with their fit to this rig."""
    with clear_errors(), RobotClient.connect(pid, "gazerig ctl play") as rig:
        if track is None:
            for one in rig.ask(Tracks(), tuple[dict[str, Any], ...]):
                say(_track_line(one))
            return
        say(rig.send(Play("" if track == NO_TRACK else track)).text())


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
        say(rig.send(Say(what)).text())


def _track_line(track: Mapping[str, Any]) -> str:
    head = f"{track['name']:<14}{track['description']}"
    if track["refused"]:
        return f"{head}; not on this rig: {track['refused']}"
    limited = track["limited"] and f"; {track['limited']}"
    return f"{head} ({track['duration_s']:.1f} s{limited})"
