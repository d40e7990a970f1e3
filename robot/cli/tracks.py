"""Output of commands that write a track."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gazerig.robot.cli.terminal import say

if TYPE_CHECKING:
    from gazerig.robot.model.track_fit import FittedTrack

FolderOption = Annotated[Path, typer.Option("--folder", help="Folder for the track's file.")]


def print_track_fit(rig_name: str, path: Path, fitted: "FittedTrack") -> None:
    """Print how a rig plays a written track, and how to use it."""
    slower = (
        f", slower by {fitted.slowed_by:.2f} for {fitted.slow_joint}" if fitted.slow_joint else ""
    )
    smaller = "".join(f", {joint} {share:.0%} as far" for joint, share in fitted.reduced_joints)
    say(f"{path}: {fitted.track.duration_s:.1f} s on {rig_name}{slower}{smaller}")
    say(f"use it: track_files: [{path}] in the rig, then gazerig ctl play {path.stem}")
