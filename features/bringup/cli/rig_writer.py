"""Writing of calibrated values into the rig's YAML after a yes; comments are kept."""

from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any

import typer

from gazerig.config.load import find_file
from gazerig.config.save import propose, save
from gazerig.drivers.errors import SetupError
from gazerig.features.bringup.cli.prompts import TerminalPerson
from gazerig.robot.cli.terminal import say

OutOption = Annotated[
    Path | None, typer.Option(help="Copy a shipped rig to this file and write there.")
]
DryRunOption = Annotated[
    bool, typer.Option("--dry-run", help="Show the changes and write nothing.")
]


def refuse_unwritable(rig: str, out: Path | None) -> None:
    """Refuse a calibration whose result could not be written.

    Raises:
        gazerig.config.load.ConfigError, SetupError: with the reason and the remedy.
    """
    if out is None:
        save(find_file("rigs", rig), {}, datetime.now())
    elif out.exists():
        raise SetupError(f"--out {out}: there is such a file: give it as RIG instead")
    elif "/" in rig or rig.endswith((".yaml", ".yml")):
        raise SetupError(f"--out copies a shipped rig; {rig} is a file of yours: leave --out away")


def write_values(
    rig: str,
    values: Mapping[str, Any],
    out: Path | None,
    person: TerminalPerson,
    dry_run: bool = False,
) -> None:
    """Show old and new values; write them after a yes, and print the path of the old file.

    Args:
        rig: name of the rig on the command line.
        values: values by the dotted keys of the rig file.
        out: a copy of a shipped rig to write instead, None for the rig itself.
        person: answers the question.
        dry_run: write nothing.
    """
    file = find_file("rigs", rig)
    _, _, changes = propose(file, values)
    for change in changes:
        say(str(change))
    if not changes:
        say("everything is as the rig file says: nothing to write")
    elif not dry_run:
        if person.agrees(f"write these {len(changes)} values into {out or file}?"):
            saved = save(out or file, values, datetime.now(), source=out and file)
            say(f"written into {saved.path}; as it was: {saved.backup or rig}")
        else:
            say("nothing written")
