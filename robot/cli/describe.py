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
    """Write a rig as a robot description: MJCF, URDF and glTF, with meshes."""
    with clear_errors(rig):
        from gazerig.config.schema import load_rig
        from gazerig.robot.description.files import description_files, file_name
        from gazerig.robot.run.rig_description import description_of

        loaded = load_rig(rig)
        description = description_of(loaded)
        folder = out or Path(f"{file_name(description.name)}_description")
        if folder.exists() and not folder.is_dir():
            raise SetupError(f"{folder} is a file: name a folder to write to")
        make_folder(folder)
        files = description_files(description)
        paths = {folder / name: data for name, data in files.items()}
        refuse_existing(*paths, force=force)
        for path in {path.parent for path in paths}:
            make_folder(path)
        for path, data in paths.items():
            write_file(path, data, force)
        for path in paths:
            hint = _HINTS.get("scene" if path.stem.startswith("scene") else path.suffix)
            if hint is not None:
                say(f"{path}: {hint.format(path)}")
        say(f"{folder / 'meshes'}: {sum('/' in name for name in files)} files")


_HINTS = {
    ".xml": "a separate MuJoCo model, to be added to a world",
    "scene": "the same on a table: python -m mujoco.viewer --mjcf={}",
    ".urdf": "for RViz, Foxglove and other simulators",
    ".glb": "for browsers and Blender",
}
"""How to open each file, by its ending."""
