"""Command check, for files of rigs; no hardware is used."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import typer

from gazerig.robot.cli.terminal import RigArgument, clear_errors, say

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
        for line in _track_lines(loaded):
            say(line)


def good_text(name: str, rig: "Rig") -> str:
    """Return one line about a rig without faults."""
    return f"{name}: valid: rig {rig.name!r}, {len(rig.joints)} joints, profile {rig.profile}"


def _track_lines(rig: "Rig") -> Iterator[str]:
    """Return how a rig plays each of its own tracks."""
    from gazerig.config.load import find_file
    from gazerig.config.tracks import load_track
    from gazerig.robot.model.reply import TrackReply
    from gazerig.robot.model.track_fit import TrackRefused
    from gazerig.robot.run.rig_limits import limits, track_fit

    for file in rig.track_files:
        path = find_file("tracks", file)
        try:
            motion = track_fit(rig).motion(load_track(path), limits(rig.joints))
            reply = TrackReply(path.stem, motion.duration_s, motion.limited)
            yield f"{file}: {reply.text()}"
        except TrackRefused as refused:
            yield f"{file}: {rig.name} cannot play it: {refused}"
