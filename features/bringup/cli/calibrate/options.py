"""The options of the command calibrate joints: values and help texts."""

from pathlib import Path
from typing import Annotated

import typer

from gazerig.features.bringup.cli.calibrate.joint import ActuationMode, ZeroReference

Joint = Annotated[
    list[str] | None, typer.Option(metavar="NAME", help="This joint (again: more); else all.")
]
TurnedBy = Annotated[
    ActuationMode, typer.Option(help="Turned by hand, torque off, or gently by itself.")
]
Margin = Annotated[
    float, typer.Option(metavar="DEG", min=0.0, max=20.0, help="Kept from each end.")
]
Zero = Annotated[
    ZeroReference, typer.Option(help="With --by motion: zero half-way, or where a person puts it.")
]
Strength = Annotated[
    float, typer.Option(min=0.05, max=1.0, help="With --by motion: share of full strength.")
]
ClearOffset = Annotated[
    bool, typer.Option("--clear-offset", help="Set the offset in a servo to 0 first.")
]
SetMiddle = Annotated[
    bool,
    typer.Option("--set-middle", help="Feetech: make the middle of its travel 2048 first."),
]
Pulses = Annotated[
    str, typer.Option(metavar="US:US", help="Hobby servos: never narrower or wider pulses.")
]
More = Annotated[
    int, typer.Option(min=0, max=5, help="Push rods: places between each two you mark.")
]
Answers = Annotated[Path | None, typer.Option(help="File with one answer a line; empty is Enter.")]
