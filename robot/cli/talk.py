"""Command that reports the state of a conversation to a rig in another terminal."""

from enum import StrEnum
from typing import Annotated, cast, get_args

import typer

from gazerig.robot.cli.look_and_stop import PidOption
from gazerig.robot.cli.terminal import clear_errors, say
from gazerig.robot.model.commands import Talk, TalkOrder
from gazerig.robot.net.client import RobotClient

app = typer.Typer()
_State = StrEnum("_State", {name: name for name in get_args(TalkOrder)})  # type: ignore[misc]


@app.command()
def talk(
    state: Annotated[_State, typer.Argument(help="What the voice agent does from now on.")],
    person: Annotated[
        int | None, typer.Option(metavar="N", help="Number of the partner or addressee.")
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(metavar="S", help="speaking: time until the planned end.")
    ] = None,
    text: Annotated[
        str,
        typer.Option(help="speaking: the text; without --seconds the end is estimated from it."),
    ] = "",
    pid: PidOption = None,
) -> None:
    """Report what a voice agent does, so that the running head looks as a partner; idle ends it."""
    with clear_errors(), RobotClient.connect(pid, "gazerig ctl talk") as rig:
        order = cast(TalkOrder, state.value)
        rig.send(Talk(order, person, seconds, text, stay=True))
        now = rig.status()
        said, ends_s = now["conversation"], now["conversation"]["ends_s"]
        planned = "" if ends_s is None else f", planned end in {ends_s - now['t_s']:.1f} s"
        say(f"conversation: {said['state']}{planned}")
