"""The options of all commands that write what they found into a rig's YAML."""

from pathlib import Path
from typing import Annotated

import typer

OutOption = Annotated[
    Path | None, typer.Option(help="Copy a shipped rig to this file and write there.")
]
DryRunOption = Annotated[
    bool, typer.Option("--dry-run", help="Show what would change, write nothing.")
]
AllYesOption = Annotated[bool, typer.Option("--yes", help="Answer every yes or no with yes.")]
