"""The options of the command sweep that run does not have, with their help."""

from pathlib import Path
from typing import Annotated

import typer

from gazerig.robot.app.options import BUSES

_MOST_SEEDS, _MOST_POINTS, _MOST_JOBS = 10_000, 100_000, 512

Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUES",
        help="A key of the rig's YAML and what it takes: LOW:HIGH:STEPS or A,B,C; with --samples "
        "or --fit also LOW:HIGH. Repeat it for more keys.",
    ),
]
Seeds = Annotated[
    int, typer.Option(min=1, max=_MOST_SEEDS, help="Runs at each point, each with a seed.")
]
FirstSeed = Annotated[int, typer.Option(min=0, help="The first of them, and of the samples.")]
Seconds = Annotated[
    float | None, typer.Option(min=0.1, help="Length of a run; default: the scene's round.")
]
Samples = Annotated[
    int | None,
    typer.Option(
        min=2,
        max=_MOST_POINTS,
        help="A Latin hypercube of N points instead of a grid; with --fit, points to try (60).",
    ),
]
Fit = Annotated[
    bool,
    typer.Option(
        "--fit", help="Search for the values with the fewest measures outside people's bands."
    ),
]
Out = Annotated[
    Path | None, typer.Option(help="Folder; default: sweep-RIG-SCENE or fit-RIG-SCENE.")
]
Jobs = Annotated[
    int | None, typer.Option(min=1, max=_MOST_JOBS, help="Processes; default: one a processor.")
]
Show = Annotated[
    list[str] | None,
    typer.Option(
        metavar="MEASURE", help="Draw this one; default: those that respond most. Repeatable."
    ),
]
Bus = Annotated[str, typer.Option(help=f"Servos: {' or '.join(BUSES)}.")]
