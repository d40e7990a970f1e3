"""Output of commands that write a track."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gazerig.robot.cli.terminal import say

if TYPE_CHECKING:
    from gazerig.robot.model.reply import TrackReply

FolderOption = Annotated[Path, typer.Option("--folder", help="Folder for the track's file.")]


def print_track_fit(rig_name: str, path: Path, reply: "TrackReply") -> None:
    """Print how a rig plays a track, and how to use it."""
    say(f"{path}: on {rig_name} {reply.text()}")
    say(f"use it: in a folder tracks/ beside the rig's file, gazerig ctl play {path.stem} finds it")
