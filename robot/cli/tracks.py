"""Output of commands that write a track."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gazerig.drivers.errors import SetupError
from gazerig.robot.cli.terminal import say

if TYPE_CHECKING:
    from gazerig.robot.app.track_file import RigTrack

FolderOption = Annotated[Path, typer.Option("--folder", help="Folder for the track's file.")]


def print_track_fit(rig_name: str, path: Path, found: "RigTrack") -> None:
    """Print how a rig plays a track, and how to use it.

    Raises:
        SetupError: the rig cannot play it.
    """
    if found.fitted is None:
        raise SetupError(f"{path} is written, but {rig_name} cannot play it: {found.refused}")
    say(fit_text(rig_name, str(path), found))
    say(f"use it: track_files: [{path}] in the rig, then gazerig ctl play {path.stem}")


def fit_text(rig_name: str, name: str, found: "RigTrack") -> str:
    """Return how a rig plays a track, or the reason why it cannot, in one line."""
    fitted = found.fitted
    if fitted is None:
        return f"{name}: {rig_name} cannot play it: {found.refused}"
    slower = (
        f", slower by {fitted.slowed_by:.2f} for {fitted.slow_joint}" if fitted.slow_joint else ""
    )
    smaller = "".join(f", {joint} {share:.0%} as far" for joint, share in fitted.reduced_joints)
    return f"{name}: {fitted.track.duration_s:.1f} s on {rig_name}{slower}{smaller}"
