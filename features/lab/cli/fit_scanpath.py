"""The command fit-scanpath."""

from pathlib import Path
from typing import Annotated

import typer

from gazerig.drivers.errors import SetupError
from gazerig.robot.cli.terminal import ForceOption, clear_errors, say

app = typer.Typer()


@app.command("fit-scanpath")
def fit_scanpath(
    recording: Annotated[
        Path, typer.Argument(help="Gaze samples or fixations: CSV, or an export of Tobii or Neon.")
    ],
    parts: Annotated[
        Path | None, typer.Option(help="YAML of part rectangles, needed for samples.")
    ] = None,
    columns: Annotated[
        list[str] | None,
        typer.Option(
            "--map",
            metavar="NAME=COLUMN",
            help="A column of the file as time, x, y, start, duration or part, e.g. "
            "time=Clock[us]. Repeatable.",
        ),
    ] = None,
    out: Annotated[Path, typer.Option(help="YAML to write.")] = Path("walk.yaml"),
    smoothing: Annotated[str, typer.Option(help="Smoothing: laplace or none.")] = "laplace",
    force: ForceOption = False,
) -> None:
    """Fit a walk over the face to an eye-tracker recording; write it as YAML for gazerig run."""
    with clear_errors():
        from gazerig.features.lab.analysis.eye_tracker_csv import NAMES
        from gazerig.features.lab.analysis.fit_scanpath import PartBoxes, fit_to_recording

        mapping = dict(text.partition("=")[::2] for text in columns or ())
        for name, column in mapping.items():
            if name not in NAMES or not column:
                raise SetupError(
                    f"--map {name}={column}: not NAME=COLUMN; names: {', '.join(NAMES)}"
                )
        boxes = PartBoxes.read(parts) if parts is not None else None
        say(fit_to_recording(recording, boxes, out, smoothing, mapping, force))
