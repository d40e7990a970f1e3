"""The rig of a run with the options of the command line, and the record of both."""

from dataclasses import replace
from datetime import UTC, datetime
from typing import TypeVar

from gazerig.config.rig import Rig
from gazerig.config.save_text import params_text, tracks_text
from gazerig.config.schema import load_rig, load_rules, load_walk
from gazerig.drivers.errors import SetupError
from gazerig.gaze.oculomotor.saccade import SaccadeParams
from gazerig.gaze.scanpath.scanpath import ScanpathParams
from gazerig.params import choices_of
from gazerig.robot.recording.run_info import RunInfo, versions
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.rig_description import mesh_faults
from gazerig.robot.run.surroundings import scene_of

P = TypeVar("P", ScanpathParams, SaccadeParams)


def run_rig(options: RunOptions) -> Rig:
    """Return the rig of a run; its meshes are checked too.

    Raises:
        gazerig.config.load.ConfigError: rig, character, profile or rule set are invalid.
        SetupError: an option names an unknown model.
    """
    names = (options.rig, options.character, options.profile)
    return with_options(load_rig(*names, further=[mesh_faults]), options)


def with_options(rig: Rig, options: RunOptions) -> Rig:
    """Return the rig with the options of the command line.

    For a boxing match the action planner is enabled, and in a world the detection of red gloves,
    if the rig has the rules for it; otherwise the run is refused later.

    Raises:
        gazerig.config.load.ConfigError: the rule set is invalid.
        SetupError: an option names an unknown model.
    """
    gaze = rig.gaze
    if options.rules is not None:
        gaze = replace(gaze, top_down=load_rules(options.rules))
    if options.scanpath is not None:
        scanpath = _with_choice(gaze.scanpath, "model", options.scanpath, "--scanpath")
        gaze = replace(gaze, scanpath=scanpath)
    if options.saccade is not None:
        saccade = _with_choice(gaze.saccade, "profile", options.saccade, "--saccade")
        gaze = replace(gaze, saccade=saccade)
    rate_hz, level = options.rate, options.level
    if rate_hz is None and level is not None and level.rate_hz is not None:
        rate_hz = min(level.rate_hz, rig.loop.rate_hz)
    if rate_hz is not None:
        rig = replace(rig, loop=replace(rig.loop, rate_hz=rate_hz))
    scene = scene_of(options)
    if scene is not None and scene.behaviours and {*scene.behaviours} <= {*gaze.top_down.rules}:
        gaze = replace(gaze, top_down=replace(gaze.top_down, planner=True))
        if options.world is not None:
            rig = replace(rig, motion=replace(rig.motion, gloves=True))
    return replace(rig, gaze=gaze)


def _with_choice(params: P, key: str, value: str, option: str) -> P:
    """Replace one key that has choices by an option of the command line."""
    choices = choices_of(type(params), key)
    if value not in choices:
        raise SetupError(f"{option} {value}: unknown; available: {', '.join(choices)}")
    return replace(params, **{key: value})  # type: ignore[arg-type]


def run_info(rig: Rig, options: RunOptions) -> RunInfo:
    """Return the header of a run's recording."""
    eyes = f"world {options.world_name}{', no pictures' if options.no_pictures else ''}"
    if options.world is None:
        eyes = options.camera_source or f"scene {options.scene}"
    return RunInfo(
        rig=options.rig,
        profile=rig.profile,
        character=options.character or rig.character,
        config_yaml=params_text(rig),
        walk_yaml=params_text(load_walk(rig.gaze.scanpath.transition_matrix)),
        tracks_yaml=tracks_text(rig.track_files),
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
