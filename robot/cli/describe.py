"""Command describe: a rig as files for robot simulators and viewers."""

from pathlib import Path
from typing import Annotated

import typer

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import make_folder, refuse_existing, write_file
from gazerig.robot.cli.terminal import ForceOption, RigArgument, clear_errors, say

app = typer.Typer()


@app.command()
def describe(
    rig: RigArgument = "desk",
    out: Annotated[
        Path | None,
        typer.Argument(
            help="Folder to write to; default: the rig's name with _description, in this folder."
        ),
    ] = None,
    force: ForceOption = False,
) -> None:
    """Write a rig as a robot description: MJCF, URDF and glTF with meshes."""
    with clear_errors(rig):
        from gazerig.config.schema import load_rig
        from gazerig.robot.description.export import description_files
        from gazerig.robot.run.rig_description import description_of

        description = description_of(load_rig(rig))
        name = description.name
        folder = out or Path(f"{name}_description")
        if folder.exists() and not folder.is_dir():
            raise SetupError(f"{folder} is a file: name a folder to write to")
        make_folder(folder)
        files = {folder / path: data for path, data in description_files(description).items()}
        refuse_existing(*files, force=force)
        for parent in {path.parent for path in files}:
            make_folder(parent)
        for path, data in files.items():
            write_file(path, data, force)
        say(f"{folder / name}.xml: a separate MuJoCo model, to be added to a world")
        scene = folder / "scene.xml"
        say(f"{scene}: the same on a table: python -m mujoco.viewer --mjcf={scene}")
        say(f"{folder / name}.urdf: for RViz, Foxglove and other simulators")
        say(f"{folder / name}.glb: for browsers and Blender")
