"""Commands check and describe, for files of rigs; no hardware is used."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import make_folder, refuse_existing, write_file
from gazerig.params import unknown_text
from gazerig.robot.cli.terminal import ForceOption, RigArgument, clear_errors, say

if TYPE_CHECKING:
    from gazerig.config.rig import Rig

app = typer.Typer()


@app.command()
def check(rig: RigArgument = "desk") -> None:
    """Check a rig's YAML and list all faults at once; no servo is contacted."""
    with clear_errors(rig):
        from gazerig.config.schema import load_rig
        from gazerig.robot.run.rig_description import neck_loads

        loaded = load_rig(rig)
        say(good_text(rig, loaded))
        for joint, load, remedy in neck_loads(loaded):
            say(f"{rig}: {joint}: {load}{remedy and f'; {remedy}'}")
        for line in (*_track_lines(loaded), *_schedule_lines(rig, loaded)):
            say(line)


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


def good_text(name: str, rig: "Rig") -> str:
    """Return one line about a rig without faults."""
    return f"{name}: valid: rig {rig.name!r}, {len(rig.joints)} joints, profile {rig.profile}"


def _track_lines(rig: "Rig") -> Iterator[str]:
    """Return how a rig plays each of its own tracks."""
    from gazerig.config.load import find_file
    from gazerig.config.tracks import load_track
    from gazerig.robot.model.commands import Play
    from gazerig.robot.run.rig_limits import limits, track_fit

    for file in rig.track_files:
        path = find_file("tracks", file)
        try:
            order, track = Play(path.stem), load_track(path)
            motion = track_fit(rig).motion(track, limits(rig.joints), order)
            yield f"{file}: {motion.state.text()}"
        except ValueError as refused:
            yield f"{file}: {rig.name} cannot play it: {refused}"


def _schedule_lines(name: str, rig: "Rig") -> Iterator[str]:
    """Return which tracks of the schedule are not there yet."""
    from gazerig.config.load import shipped_names

    known = sorted({*shipped_names("tracks"), *[Path(file).stem for file in rig.track_files]})
    for track in rig.schedule:
        if track not in known:
            yield f"{name}: schedule: {unknown_text('track', track, known)}"
