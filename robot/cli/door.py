"""Command door: a neighbour such as a voice assistant takes part with the running head."""

from typing import Annotated

import typer

from gazerig.drivers.errors import SetupError
from gazerig.drivers.plugins import DOOR, registrations
from gazerig.errors import Error
from gazerig.robot.cli.terminal import clear_errors, say
from gazerig.robot.run.doors import load_door

app = typer.Typer()


@app.command()
def door(
    name: Annotated[str | None, typer.Argument(help="Name of the door.")] = None,
    address: Annotated[
        str, typer.Argument(metavar="ADDRESS", help="Address of the neighbour; see docs/talk.md.")
    ] = "",
    bind: Annotated[
        str,
        typer.Option(
            metavar="HOST:PORT", help="Where to listen; the usual port on this computer only."
        ),
    ] = "",
    addressed: Annotated[
        bool,
        typer.Option("--addressed", help="Let it listen, without a wake word, when looked at."),
    ] = False,
    head: Annotated[
        str | None,
        typer.Option(
            "--head",
            "--rig",
            "--pid",
            metavar="NAME|N",
            help="Name or process id of the head, if several run.",
        ),
    ] = None,
) -> None:
    """Let a voice assistant or agent take part with the running head; without a name, list all."""
    with clear_errors():
        if name is None:
            for one in registrations(DOOR):
                print(f"{one.name:<16} {load_door(one.name).summary}")
            return
        try:
            load_door(name).run(head, address, bind, say, addressed=addressed)
        except SetupError:
            raise
        except Error as error:
            raise SetupError(str(error)) from error
