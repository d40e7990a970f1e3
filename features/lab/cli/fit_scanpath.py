"""The command fit-scanpath."""

from pathlib import Path
from typing import Annotated

import typer

from gazerig.robot.cli.terminal import ForceOption, clear_errors, say

app = typer.Typer()


@app.command("fit-scanpath")
def fit_scanpath(
    recording: Annotated[Path, typer.Argument(help="CSV of gaze samples or labelled fixations.")],
    parts: Annotated[
        Path | None, typer.Option(help="YAML of part rectangles, needed for samples.")
    ] = None,
    out: Annotated[Path, typer.Option(help="YAML to write.")] = Path("walk.yaml"),
    smoothing: Annotated[
        str, typer.Option(help="Smoothing: laplace, bootstrap or none.")
    ] = "laplace",
    seed: Annotated[int, typer.Option(min=0, help="Seed of the bootstrap.")] = 0,
    force: ForceOption = False,
) -> None:
    """Fit a walk over the face to an eye-tracker recording; write it as YAML for gazerig run."""
    with clear_errors():
        from gazerig.config.load import load
        from gazerig.features.lab.analysis import fit_scanpath as fitting
        from gazerig.features.lab.analysis.fixations import PartBoxes

        boxes = load(parts, PartBoxes) if parts is not None else None
        say(fitting.fit_to_recording(recording, boxes, out, smoothing, seed, force))
