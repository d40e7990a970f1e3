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
    """Print the keys that a rig cannot reach or follow, how it plays a track, and how to use it.

    Raises:
        SetupError: the rig cannot play it.
    """
    for line in excess_lines(rig_name, str(path), found):
        say(line)
    fitted = found.fitted
    if fitted is None:
        raise SetupError(f"{path} is written, but {rig_name} cannot play it: {found.refused}")
    slower = (
        f", slower by {fitted.slowed_by:.2f} for {fitted.slow_joint}" if fitted.slow_joint else ""
    )
    smaller = "".join(f", {joint} {share:.0%} as far" for joint, share in fitted.reduced_joints)
    say(f"{path}: {fitted.track.duration_s:.1f} s on {rig_name}{slower}{smaller}")
    say(f"use it: track_files: [{path}] in the rig, then gazerig ctl play {path.stem}")


def excess_lines(rig_name: str, name: str, found: "RigTrack") -> list[str]:
    """Return one line for each key of a track that a rig cannot reach or follow, with a head."""
    if not found.excesses:
        return []
    head = f"{name}: {rig_name} cannot reach or follow {len(found.excesses)} keys as written:"
    return [head, *(f"  {one.text()}" for one in found.excesses)]
