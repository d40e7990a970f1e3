"""The models of gaze/ with a rig's parameters."""

from typing import NamedTuple

import numpy as np

from gazerig.config.rig import Rig
from gazerig.drivers.errors import PluginError
from gazerig.drivers.plugins import ATTENTION, AttentionPlugin, create, find, is_ours, load
from gazerig.gaze.lids.lids import Lids
from gazerig.gaze.oculomotor.drift import Drift
from gazerig.gaze.oculomotor.head import HeadModel
from gazerig.gaze.oculomotor.oculomotor import Oculomotor
from gazerig.gaze.oculomotor.pursuit import Pursuit
from gazerig.gaze.oculomotor.saccade import SaccadeModel
from gazerig.robot.loop.chooser import RuleChooser, TargetChooser
from gazerig.robot.model.kinematics import Kinematics
from gazerig.robot.run.rig_limits import eye_limits, head_limits, lid_ends


def kinematics_and_oculomotor(rig: Rig, seed: int) -> tuple[Kinematics, Oculomotor]:
    """Return a rig's geometry and its oculomotor model, for gaze without a camera."""
    lid_rng, landing_rng, head_rng, drift_rng = (
        np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(4)
    )
    kinematics = rig_kinematics(rig)
    lids = Lids(rig.gaze.lids, lid_rng)
    moves = motion_models(rig, head_rng, drift_rng)
    return kinematics, oculomotor(rig, kinematics, moves, lids, landing_rng)


def rig_kinematics(rig: Rig) -> Kinematics:
    """Return a rig's geometry."""
    return Kinematics(rig.geometry, rig.joints, lid_ends(rig))


class MotionModels(NamedTuple):
    """Models of eye and head movements."""

    saccade: SaccadeModel
    pursuit: Pursuit
    head: HeadModel
    drift: Drift


def motion_models(
    rig: Rig, head_rng: np.random.Generator, drift_rng: np.random.Generator
) -> MotionModels:
    """Return the models of eye and head movements."""
    gaze = rig.gaze
    return MotionModels(
        SaccadeModel(gaze.saccade),
        Pursuit(gaze.pursuit),
        HeadModel(gaze.head, *head_limits(rig), head_rng),
        Drift(gaze.drift, drift_rng),
    )


def oculomotor(
    rig: Rig,
    kinematics: Kinematics,
    moves: MotionModels,
    lids: Lids,
    landing_rng: np.random.Generator,
) -> Oculomotor:
    """Compose the models with the narrower of the rig's and the profile's ranges."""
    return Oculomotor(
        rig.gaze.oculomotor,
        kinematics,
        eye_limits(rig),
        moves.saccade,
        moves.pursuit,
        moves.head,
        lids,
        landing_rng,
        moves.drift,
    )


def target_chooser(rig: Rig, own: TargetChooser) -> TargetChooser:
    """Return the chooser of the target: the rig's attention, or a package's rule before it.

    Args:
        rig: Its ``gaze.chooser`` selects the rule.
        own: the rig's own attention.

    Raises:
        SetupError: the rule cannot be created.
    """
    name = rig.gaze.chooser
    if is_ours(ATTENTION, name):
        return own
    part = load(ATTENTION, name, AttentionPlugin)
    rule = create(ATTENTION, name, part, rig.gaze.plugins[name])
    label = find(ATTENTION, name).label
    if not callable(getattr(rule, "choose", None)):
        raise PluginError(f"{label} created a {type(rule).__name__}, which has no method choose")
    return RuleChooser(rule, own, label)
