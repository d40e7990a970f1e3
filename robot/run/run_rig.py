"""The rig of a run with the options of the command line, its scene, and the record of both."""

from dataclasses import replace
from datetime import UTC, datetime
from typing import TypeVar

from gazerig.config.rig import Rig
from gazerig.config.save_text import params_text, tracks_text
from gazerig.config.schema import load_rig, load_rules, load_walk
from gazerig.drivers.errors import SetupError
from gazerig.gaze.attention.top_down import TopDownParams
from gazerig.gaze.oculomotor.saccade import SaccadeParams
from gazerig.gaze.scanpath.scanpath import ScanpathParams
from gazerig.params import choices_of, unknown_text
from gazerig.robot.recording.run_info import RunInfo, versions
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.scene_files import load_scene
from gazerig.robot.run.surroundings import surroundings
from gazerig.sim_mock.scenes.scene import Scene

P = TypeVar("P", ScanpathParams, SaccadeParams)


def run_rig(options: RunOptions) -> Rig:
    """Return the rig of a run; its meshes are checked too.

    Raises:
        gazerig.config.load.ConfigError: rig, character, profile or rule set are invalid.
        SetupError: an option names an unknown model.
    """
    names = (options.rig, options.character, options.profile)
    return with_options(load_rig(*names), options)


def with_options(rig: Rig, options: RunOptions) -> Rig:
    """Return the rig with the options of the command line.

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
    return with_surroundings(replace(rig, gaze=gaze), options)


def _with_choice(params: P, key: str, value: str, option: str) -> P:
    """Replace one key that has choices by an option of the command line."""
    choices = choices_of(type(params), key)
    if value not in choices:
        raise SetupError(unknown_text(option, value, choices))
    return replace(params, **{key: value})  # type: ignore[arg-type]


def scene_of(rig: Rig, options: RunOptions) -> Scene | None:
    """Return the requested scene, None if the camera has another source.

    Raises:
        gazerig.config.load.ConfigError: its script has faults.
        SetupError: the scene is unknown, or the rig has no rule for a behaviour that its action
            planner needs in it.
    """
    if options.scene is None:
        return None
    scene = load_scene(options.scene, options.seed)
    refuse_missing_rules(rig.gaze.top_down, scene, f"--scene {options.scene}")
    return scene


def refuse_missing_rules(rules: TopDownParams, scene: Scene, option: str) -> None:
    """Reject a scene whose planner needs behaviours without rules.

    Raises:
        SetupError: the message names them.
    """
    missing = [b for b in scene.behaviours if b not in rules.rules]
    if missing:
        raise SetupError(
            f"{option}: the rig has no rule for {', '.join(missing)}; "
            "add it under gaze.top_down.rules"
        )


def with_surroundings(rig: Rig, options: RunOptions) -> Rig:
    """Return the rig with the settings of a boxing match, if the surroundings are one.

    The action planner is enabled, and in a world also the detection of red gloves. Rules that lack
    a behaviour are not changed: ``scene_of`` rejects the scene.
    """
    scene: Scene | None = None
    if options.scene is not None:
        scene = load_scene(options.scene, options.seed)
    elif options.world is not None:
        scene = surroundings(options.world).scene(options)
    rules = rig.gaze.top_down
    if scene is None or not scene.behaviours or not {*scene.behaviours} <= rules.rules.keys():
        return rig
    planning = replace(rules, planner=True)
    rig = replace(rig, gaze=replace(rig.gaze, top_down=planning))
    return rig if options.world is None else replace(rig, motion=replace(rig.motion, gloves=True))


def run_info(rig: Rig, options: RunOptions) -> RunInfo:
    """Return the header of a run's recording."""
    eyes = options.camera_source or f"scene {options.scene}"
    if options.camera_source is None and options.world is not None:
        eyes = f"world {options.world_name}{', no pictures' if options.no_pictures else ''}"
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
