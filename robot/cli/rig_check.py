"""Command check, for files of rigs; no hardware is used."""

import typer

from gazerig.robot.cli.terminal import RigArgument, clear_errors, say

app = typer.Typer()


@app.command()
def check(rig: RigArgument = "desk") -> None:
    """Check a rig's YAML and list all faults at once; no servo is contacted."""
    with clear_errors(rig):
        lines = (check_line(rig), *unit_lines(rig), *weight_lines(rig), *track_lines(rig))
        for line in lines:
            say(line)


def check_line(rig: str) -> str:
    """Load a rig and return one line of success.

    Raises:
        ConfigError: lists every fault of its files.
    """
    from gazerig.config.rig import Rig
    from gazerig.config.schema import load_rig
    from gazerig.robot.run.rig_description import mesh_faults

    found: Rig = load_rig(rig, further=[mesh_faults])
    return f"{rig}: valid: rig {found.name!r}, {len(found.joints)} joints, profile {found.profile}"


_SMALLEST_DEG = 4.0
"""Larger than pi: ranges of joints in radians are within."""


def unit_lines(rig: str) -> list[str]:
    """Return a hint for ranges that look like radians.

    Raises:
        ConfigError: the rig is invalid.
    """
    from gazerig.config.schema import load_rig
    from gazerig.robot.run.track_file import radians_hint

    loaded = load_rig(rig)
    ends = [end for one in loaded.joints.values() for end in (one.min_deg, one.max_deg)]
    hint = radians_hint(ends, _SMALLEST_DEG)
    return [f"{rig}: min_deg and max_deg of all joints: {hint}"] if hint else []


def weight_lines(rig: str) -> list[str]:
    """Return what the neck of a good rig holds at rest.

    Raises:
        ConfigError: the rig is not good.
    """
    from gazerig.config.schema import load_rig
    from gazerig.robot.run.rig_weight import weight_findings

    return [f"{rig}: {finding}" for finding in weight_findings(load_rig(rig))]


def track_lines(rig: str) -> list[str]:
    """Return how a good rig plays each of its own tracks.

    Raises:
        ConfigError: the rig is not good.
    """
    from gazerig.config.load import find_file
    from gazerig.config.schema import load_rig
    from gazerig.config.tracks import load_track
    from gazerig.robot.model.track_fit import TrackRefused
    from gazerig.robot.run.track_file import fit_to_rig

    loaded, lines = load_rig(rig), []
    for file in loaded.track_files:
        path = find_file("tracks", file)
        try:
            lines.append(f"{file}: {fit_to_rig(loaded, path.stem, load_track(path)).text()}")
        except TrackRefused as refused:
            lines.append(f"{file}: {loaded.name} cannot play it: {refused}")
    return lines
