"""The command ``gazerig ctl fault``: faults of the emulated servos of a running rig."""

from typing import Annotated

import typer

from gazerig.robot.cli.look_and_stop import PidOption
from gazerig.robot.cli.terminal import clear_errors
from gazerig.robot.net.client import RobotClient

app = typer.Typer()
_NEGATIVE = {"ignore_unknown_options": True}
"""Click settings: -3 is a number, not an option."""


@app.command(context_settings=_NEGATIVE)
def fault(
    words: Annotated[
        list[str],
        typer.Argument(
            metavar="COMMAND", help="A fault as in gazerig emulate; help lists all faults."
        ),
    ],
    pid: PidOption = None,
) -> None:
    """Inject a fault into the emulated servos, or push the head in a world."""
    with clear_errors(), RobotClient.connect(pid, "gazerig ctl fault") as rig:
        print(rig.fault(" ".join(words)))
