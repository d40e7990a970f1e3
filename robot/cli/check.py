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
        from gazerig.robot.run.rig_description import weight_findings

        loaded = load_rig(rig)
        say(good_text(rig, loaded))
        for finding in weight_findings(loaded):
            say(f"{rig}: {finding}")
        for line in _track_lines(loaded):
            say(line)


def good_text(name: str, rig: "Rig") -> str:
    """Return one line about a rig without faults."""
    return f"{name}: valid: rig {rig.name!r}, {len(rig.joints)} joints, profile {rig.profile}"


def _track_lines(rig: "Rig") -> Iterator[str]:
    """Return how a rig plays each of its own tracks."""
    from gazerig.config.load import find_file
    from gazerig.config.tracks import load_track
    from gazerig.robot.model.track_fit import TrackRefused
    from gazerig.robot.run.track_file import fit_to_rig

    for file in rig.track_files:
        path = find_file("tracks", file)
        try:
            yield f"{file}: {fit_to_rig(rig, path.stem, load_track(path)).text()}"
        except TrackRefused as refused:
            yield f"{file}: {rig.name} cannot play it: {refused}"
