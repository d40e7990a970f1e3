"""Command kinds: a list of buses, cameras, detectors and rules with their packages."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from gazerig.drivers.errors import PluginError
from gazerig.drivers.plugins import (
    GROUPS,
    Plugin,
    Registration,
    folder_of,
    name_conflicts,
    registrations,
)
from gazerig.robot.cli.console import Console
from gazerig.robot.cli.terminal import clear_errors

app = typer.Typer()


@app.command()
def kinds(
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """List buses, cameras, detectors, rules, tracks and rigs, of this program and of packages."""
    with clear_errors():
        rows = [_part_row(one) for group in GROUPS for one in registrations(group)]
        taken = [line for group in GROUPS for line in name_conflicts(group)]
        if as_json:
            print(json.dumps({"kinds": rows, "left_out": taken}))
            return
        table = Table("name", "group", "maker", "abilities", "proven")
        for row in rows:
            abilities = row["fault"] or ", ".join(row["abilities"])
            maker = f"{row['package']} {row['version']}".rstrip()
            table.add_row(row["name"], row["group"], maker, abilities, row["proven"])
        Console().print(table)
        for line in taken:
            print(line)


def _part_row(found: Registration) -> dict[str, Any]:
    """Return the row of a part; a part that cannot be loaded has a fault."""
    row: dict[str, Any] = {
        "name": found.name, "group": GROUPS[found.group], "package": found.package,
        "version": found.version, "abilities": [], "evidence": {}, "proven": "", "fault": "",
    }  # fmt: skip
    try:
        part = found.load()
        if isinstance(part, Plugin):
            row["abilities"] = list(part.abilities)
            row["evidence"], row["proven"] = asdict(part.evidence), part.evidence.describe()
        elif isinstance(part, str | Path) or hasattr(part, "__path__"):
            row["abilities"] = sorted(file.stem for file in folder_of(found).glob("*.yaml"))
    except PluginError as error:
        row["fault"] = str(error)
    return row
