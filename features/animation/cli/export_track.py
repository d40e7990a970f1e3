"""The command export-track: a track as an animation of the rig's glTF model."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from gazerig.config.schema import load_rig
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import refuse_existing, write_file
from gazerig.robot.cli.rig_command import RigCommand
from gazerig.robot.cli.terminal import ForceOption, RigArgument, clear_errors, say

app = typer.Typer()


@app.command("export-track", cls=RigCommand)
def export_track(
    rig: RigArgument = "desk",
    *,
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of a track of the rig.")],
    out: Annotated[Path, typer.Argument(metavar="OUT", help="File to write, ending with .glb.")],
    fps: Annotated[float, typer.Option(min=1.0, max=1000.0, help="Keys per second.")] = 60.0,
    force: ForceOption = False,
) -> None:
    """Export a track as an animation of the rig's glTF model, for Blender and browsers."""
    with clear_errors(rig):
        from gazerig.config.tracks import tracks_of
        from gazerig.features.animation.gltf_writer import animated_gltf
        from gazerig.robot.app.rig_description import description_of
        from gazerig.robot.app.rig_limits import animation_tables, lid_spans
        from gazerig.robot.model.track_fit import TrackFit, TrackRefused, track_motions

        refuse_existing(out, force=force)
        loaded = load_rig(rig)
        known = tracks_of(loaded.track_files)
        if name not in known:
            raise SetupError(f"no track {name!r}; available: {', '.join(known)}")
        try:
            made = track_motions(known[name], loaded.names, 0, animation_tables(loaded))
        except TrackRefused as refused:
            raise SetupError(f"{name}: {refused}") from None
        description = description_of(loaded)
        awake = {joint.name: joint.awake_rad for joint in description.joints}
        times_s = np.append(
            np.arange(0.0, made.motion.duration_s - 0.5 / fps, 1.0 / fps), made.motion.duration_s
        )
        angles = TrackFit(loaded.names, lid_spans(loaded)).joint_angles(
            np.array([awake[joint] for joint in loaded.names]), made.motion, times_s
        )
        moved = {
            joint: column
            for joint, column in zip(loaded.names, angles.T, strict=True)
            if np.ptp(column) > 1e-6
        }
        write_file(out, animated_gltf(description, name, times_s, moved), force)
        say(f"{out}: {name}, {times_s[-1]:.1f} s, {len(moved)} joints, {fps:g} keys a second")
