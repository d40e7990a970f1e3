"""Commands that move the face of a rig in another terminal: tracks and speech."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from gazerig.drivers.sound.params import KINDS
from gazerig.robot.cli.options import PidOption
from gazerig.robot.cli.terminal import clear_errors, say
from gazerig.robot.model.commands import NO_TRACK, Play, Say, Tracks
from gazerig.robot.net.client import RobotClient

app = typer.Typer()


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
        typer.Argument(metavar="FILE | TEXT", help="A sound file, by its ending, or a text."),
    ],
    pid: PidOption = None,
) -> None:
    """Say a sound file or a text on the running head, with the mouth of a rig that has one."""
    with clear_errors(), RobotClient.connect(pid, "gazerig ctl say") as rig:
        if Path(what).suffix.lower() in KINDS and Path(what).is_file():
            what = str(Path(what).absolute())
        say(rig.send(Say(what)).text())


def _track_line(track: Mapping[str, Any]) -> str:
    head = f"{track['name']:<14}{track['description']}"
    if track["refused"]:
        return f"{head}; not on this rig: {track['refused']}"
    limited = track["limited"] and f"; {track['limited']}"
    return f"{head} ({track['duration_s']:.1f} s{limited})"
