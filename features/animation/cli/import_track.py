"""The command import: an animation of another program becomes a track in YAML."""

import re
from pathlib import Path
from typing import Annotated

import typer

from gazerig.config.schema import load_rig
from gazerig.robot.cli.options import FolderOption, print_track_fit
from gazerig.robot.cli.terminal import ForceOption, RigArgument, clear_errors, say

app = typer.Typer()


@app.command("import")
def import_track(
    rig: RigArgument,
    *,
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE",
            help="glTF, JSON of Blender's add-on Servo Animation or of Bottango, or CSV.",
        ),
    ],
    name: Annotated[
        str, typer.Argument(metavar="NAME", help="Name of the track; default: that of the file.")
    ] = "",
    clip: Annotated[
        str, typer.Option("--clip", metavar="NAME", help="Animation, of a file with several.")
    ] = "",
    joints: Annotated[
        list[str] | None,
        typer.Option(
            "--map",
            metavar="NAME=JOINT",
            help="Joint of a name in the file; NAME=-JOINT turns it round. Repeatable.",
        ),
    ] = None,
    degrees: Annotated[
        float | None,
        typer.Option(
            metavar="CENTRE",
            help="Servo positions are degrees, straight ahead is CENTRE; default: steps or us.",
        ),
    ] = None,
    fps: Annotated[
        float | None,
        typer.Option(min=1.0, max=1000.0, help="Frames per second, for tables of frame numbers."),
    ] = None,
    owns: Annotated[
        bool | None,
        typer.Option(
            "--owns/--over-gaze",
            help="Give the angles of its joints (default, not of tables), or add motion to gaze.",
        ),
    ] = None,
    folder: FolderOption = Path("."),
    force: ForceOption = False,
) -> None:
    """Import an animation of another program as a track in YAML."""
    with clear_errors(rig):
        from gazerig.features.animation.animation import joint_map
        from gazerig.features.animation.animation_file import read_animation
        from gazerig.robot.run.track_file import write_track

        loaded = load_rig(rig)
        found = read_animation(
            file, loaded, joint_map(loaded, joints or []), fps=fps, clip=clip, centre_deg=degrees
        )
        for note in found.notes:
            say(f"{file}: {note}")
        called = name or re.sub(r"[^a-z0-9]+", "_", file.stem.lower()).strip("_")
        path = folder / f"{called}.yaml"
        reply = write_track(
            loaded,
            path,
            found.series,
            f"from {file.name}",
            force=force,
            tolerance_deg=0.3,  # servos show no less
            owned=found.poses if owns is None else owns,
        )
        print_track_fit(loaded.name, path, reply)
