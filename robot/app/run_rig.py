"""The rig of a run: its YAML, with what the command line says otherwise."""

from dataclasses import replace
from typing import TypeVar

from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig, load_rules
from gazerig.drivers.errors import SetupError
from gazerig.gaze.oculomotor.saccade import SaccadeParams
from gazerig.gaze.scanpath.scanpath import ScanpathParams
from gazerig.params import choices_of
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.rig_description import mesh_faults
from gazerig.robot.app.run_scene import for_surroundings

P = TypeVar("P", ScanpathParams, SaccadeParams)


def run_rig(options: RunOptions) -> Rig:
    """Return the rig of a run, with the meshes that it names looked at, too.

    Raises:
        gazerig.config.load.ConfigError: rig, character, profile or rule set are at fault.
        SetupError: there is no such model.
    """
    names = (options.rig, options.character, options.profile)
    return with_options(load_rig(*names, further=[mesh_faults]), options)


def with_options(rig: Rig, options: RunOptions) -> Rig:
    """Return the rig with what the command line says otherwise.

    Raises:
        gazerig.config.load.ConfigError: the rule set is at fault.
        SetupError: there is no such model.
    """
    gaze = rig.gaze
    if options.rules is not None:
        gaze = replace(gaze, top_down=load_rules(options.rules))
    if options.scanpath is not None:
        scanpath = _chosen(gaze.scanpath, "model", options.scanpath, "--scanpath")
        gaze = replace(gaze, scanpath=scanpath)
    if options.saccade is not None:
        saccade = _chosen(gaze.saccade, "profile", options.saccade, "--saccade")
        gaze = replace(gaze, saccade=saccade)
    return for_surroundings(replace(rig, gaze=gaze), options)


def _chosen(params: P, key: str, value: str, option: str) -> P:
    """Replace one key that has choices, as an option of the command line asks.

    Raises:
        SetupError: the value is none of the choices.
    """
    choices = choices_of(type(params), key)
    if value not in choices:
        raise SetupError(f"{option} {value}: unknown; there is {', '.join(choices)}")
    return replace(params, **{key: value})  # type: ignore[arg-type]
