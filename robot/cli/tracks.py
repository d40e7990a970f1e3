"""Command import-track, and the output of commands that write a track."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gazerig.config.schema import load_rig
from gazerig.robot.cli.rig_command import RigCommand
from gazerig.robot.cli.terminal import ForceOption, RigArgument, clear_errors, say

if TYPE_CHECKING:
    from gazerig.robot.model.track_fit import FittedTrack

app = typer.Typer()

FolderOption = Annotated[Path, typer.Option("--folder", help="Folder for the track's file.")]


@app.command("import-track", cls=RigCommand)
def import_track(
    rig: RigArgument = "desk",
    *,
    table: Annotated[Path, typer.Argument(metavar="CSV", help="Key frames: time, joint, angle.")],
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the track.")],
    fps: Annotated[
        float | None,
        typer.Option(min=1.0, max=1000.0, help="Frames per second, for frame numbers."),
    ] = None,
    folder: FolderOption = Path("."),
    force: ForceOption = False,
) -> None:
    """Import key frames of an animation program as a track in YAML."""
    with clear_errors(rig):
        from gazerig.robot.app.track_file import read_table, track_text, write_track

        loaded = load_rig(rig)
        text = track_text(loaded, read_table(table, fps), f"from {table.name}")
        print_track_fit(loaded.name, *write_track(loaded, name, text, folder, force))


def print_track_fit(rig_name: str, path: Path, fitted: "FittedTrack") -> None:
    """Print how a rig plays a written track, and how to use it."""
    slower = (
        f", slower by {fitted.slowed_by:.2f} for {fitted.slow_joint}" if fitted.slow_joint else ""
    )
    smaller = "".join(f", {joint} {share:.0%} as far" for joint, share in fitted.reduced_joints)
    say(f"{path}: {fitted.track.duration_s:.1f} s on {rig_name}{slower}{smaller}")
    say(f"use it: track_files: [{path}] in the rig, then gazerig ctl play {path.stem}")
