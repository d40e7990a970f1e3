"""The rig of a run with the options of the command line, and the record of both."""

from dataclasses import replace
from datetime import UTC, datetime

from gazerig.config.load import find_file
from gazerig.config.parameters import apply_changes
from gazerig.config.rig import Rig
from gazerig.config.save import params_text
from gazerig.config.schema import load_rig, load_rules, load_walk
from gazerig.robot.model.commands import Value
from gazerig.robot.recording.run_info import RunInfo, versions
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.surroundings import scene_of


def run_rig(options: RunOptions) -> Rig:
    """Return the rig of a run.

    Raises:
        gazerig.config.load.ConfigError: rig, character, profile, rule set or an option are invalid.
        SetupError: the scene or world is unknown.
    """
    names = (options.rig, options.character, options.profile)
    return with_options(load_rig(*names), options)


def with_options(rig: Rig, options: RunOptions) -> Rig:
    """Return the rig with the options of the command line.

    For a boxing match the action planner is enabled, and in a world the detection of red gloves,
    if the rig has the rules for it; otherwise the run is refused later.

    Raises:
        gazerig.config.load.ConfigError: the rule set, or the value of an option, is invalid.
        SetupError: the scene or world is unknown.
    """
    if options.rules is not None:
        gaze = replace(rig.gaze, top_down=load_rules(options.rules))
        rig = replace(rig, gaze=gaze)
    rate_hz, level = options.rate, options.level
    if rate_hz is None and level is not None and level.rate_hz is not None:
        rate_hz = min(level.rate_hz, rig.loop.rate_hz)
    changes: dict[str, Value] = {
        "gaze.scanpath.model": options.scanpath,
        "loop.rate_hz": rate_hz,
    }
    scene = scene_of(options)
    if scene is not None and scene.behaviours and {*scene.behaviours} <= {*rig.gaze.top_down.rules}:
        changes["gaze.top_down.planner"] = True
        changes["motion.gloves"] = True if options.world is not None else None
    wanted = {key: value for key, value in changes.items() if value is not None}
    return apply_changes(rig, wanted) if wanted else rig


def run_info(rig: Rig, options: RunOptions) -> RunInfo:
    """Return the header of a run's recording."""
    tracks = [find_file("tracks", name) for name in rig.track_files]
    eyes = f"world {options.world_name}{', no pictures' if options.no_pictures else ''}"
    if options.world is None:
        eyes = options.camera_source or f"scene {options.scene}"
    return RunInfo(
        rig=options.rig,
        profile=rig.profile,
        character=options.character or rig.character,
        config_yaml=params_text(rig),
        walk_yaml=params_text(load_walk(rig.gaze.scanpath.transition_matrix)),
        tracks={path.stem: path.read_text("utf-8") for path in tracks},
        seed=options.seed,
        rate_hz=rig.loop.rate_hz,
        started_utc=datetime.now(UTC),
        scene=options.scene or options.world_name,
        eyes=eyes,
        mock=options.mock,
        fast=options.fast,
        bus=options.bus or "emulated",
        pictures_hz=options.record_pictures,
        versions=versions(),
    )
