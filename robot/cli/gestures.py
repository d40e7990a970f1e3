"""The command import-gesture, and how a command writes a gesture."""

from pathlib import Path
from typing import Annotated

import typer

from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.robot.cli.rig_command import RigCommand
from gazerig.robot.cli.terminal import ForceOption, RigArgument, clear_errors, say

app = typer.Typer()

FolderOption = Annotated[Path, typer.Option("--folder", help="Where the gesture's file goes.")]


@app.command("import-gesture", cls=RigCommand)
def import_gesture(
    rig: RigArgument = "desk",
    *,
    table: Annotated[Path, typer.Argument(metavar="CSV", help="Key frames: time, joint, angle.")],
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the gesture.")],
    fps: Annotated[
        float | None, typer.Option(min=1.0, max=1000.0, help="Frames a second, for frame numbers.")
    ] = None,
    folder: FolderOption = Path("."),
    force: ForceOption = False,
) -> None:
    """Make a gesture of key frames from an animation program, as YAML that rigs take."""
    with clear_errors(rig):
        from gazerig.robot.app.gesture_file import gesture_text
        from gazerig.robot.app.key_frame_table import read_table

        loaded = load_rig(rig)
        text = gesture_text(loaded, read_table(table, fps), f"from {table.name}")
        finish(loaded, name, text, folder, force)


def finish(rig: Rig, name: str, text: str, folder: Path, force: bool) -> None:
    """Write a gesture, and print how this rig performs it and how to use it."""
    from gazerig.robot.app.gesture_file import write_gesture

    path, fitted = write_gesture(rig, name, text, folder, force)
    slower = (
        f", slower by {fitted.slowed_by:.2f} for {fitted.slow_joint}" if fitted.slow_joint else ""
    )
    smaller = "".join(f", {joint} {share:.0%} as far" for joint, share in fitted.smaller)
    say(f"{path}: {fitted.played.duration_s:.1f} s on {rig.name}{slower}{smaller}")
    say(f"use it: gesture_files: [{path}] in the rig, then gazerig ctl play {name}")
