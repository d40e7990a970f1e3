"""Writing of calibrated values into the rig's YAML after a yes; comments are kept."""

from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from gazerig.config.load import find_file
from gazerig.config.rig import Rig
from gazerig.config.save import save
from gazerig.drivers.errors import SetupError
from gazerig.features.bringup.cli.prompts import TerminalPerson
from gazerig.robot.cli.console import Console
from gazerig.robot.cli.terminal import say

OutOption = Annotated[
    Path | None, typer.Option(help="Copy a shipped rig to this file and write there.")
]
DryRunOption = Annotated[
    bool, typer.Option("--dry-run", help="Show the changes and write nothing.")
]
AllYesOption = Annotated[bool, typer.Option("--yes", help="Answer yes to every question.")]


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
    rig: str, values: Mapping[str, Any], out: Path | None, person: TerminalPerson
) -> None:
    """Write values after a yes, and print the path of the old file.

    Args:
        rig: name of the rig on the command line.
        values: values by the dotted keys of the rig file.
        out: a copy of a shipped rig to write instead, None for the rig itself.
        person: answers the question.
    """
    if not values:
        say("everything is as the rig file says: nothing to write")
        return
    file = find_file("rigs", rig)
    where = out or file
    if not person.agrees(f"write these {len(values)} values into {where}?"):
        say("nothing written")
        return
    saved = save(where, values, datetime.now(), source=out and file)
    for change in saved.changes:
        say(str(change))
    if not saved.changes:
        say(f"everything is as {saved.path} says: nothing to write")
    else:
        say(f"written into {saved.path}; as it was: {saved.backup or rig}")


def show_and_write(
    rig: str,
    loaded: Rig,
    changes: Mapping[str, Any],
    out: Path | None,
    dry_run: bool,
    person: TerminalPerson,
) -> None:
    """Show old and new values side by side; write them after a yes, but not with ``dry_run``.

    loaded: rig with the old values; see ``write_values`` for the others
    """
    table = Table(caption=f"what was found, against {rig}")
    for name in ("key", "old", "new"):
        table.add_column(name, justify="left" if name == "key" else "right", no_wrap=True)
    for key, new in changes.items():
        old: Any = loaded
        for step in key.split("."):
            old = old.get(step, "-") if isinstance(old, Mapping) else getattr(old, step, "-")
        style = "bold" if key.endswith("sign") else None
        table.add_row(key, _text(old), _text(new), style=style)
    Console().print(table)
    if not dry_run:
        write_values(rig, changes, out, person)


def _text(value: Any) -> str:
    """Format a value; the positions of a linkage are on separate lines."""
    if not isinstance(value, tuple):
        return f"{value}"
    if any(isinstance(one, tuple) for one in value):
        return "\n".join(f"{angle:g} deg: {at:g}" for angle, at in value)
    return " ".join(f"{v:g}" for v in value)
