"""The gaze models of a rig, with its parameters."""

from collections.abc import Mapping

import numpy as np

from gazerig.config.rig import Rig
from gazerig.config.schema import load_walk
from gazerig.drivers.plugins import ATTENTION, AttentionPlugin, create, find, is_ours, load
from gazerig.gaze.attention.attention import Attention
from gazerig.gaze.attention.bottom_up import BottomUp
from gazerig.gaze.attention.conversation import ConversationGaze
from gazerig.gaze.attention.idle import Idle
from gazerig.gaze.attention.top_down import TopDown
from gazerig.gaze.lids.lids import Lids
from gazerig.gaze.oculomotor.drift import Drift
from gazerig.gaze.oculomotor.head import HeadModel
from gazerig.gaze.oculomotor.oculomotor import Oculomotor
from gazerig.gaze.oculomotor.pursuit import Pursuit
from gazerig.gaze.oculomotor.saccade import SaccadeModel
from gazerig.gaze.scanpath.scanpath import Scanpath
from gazerig.gaze.track.animation import Animation
from gazerig.robot.loop.chooser import RuleChooser, TargetChooser
from gazerig.robot.model.kinematics import Kinematics
from gazerig.robot.model.types import further_joints
from gazerig.robot.run.rig_limits import eye_limits, faces, head_limits, lid_ends

_DRAWS = (
    "scanpath", "lids", "camera", "idle", "aversion", "endpoint", "reaction", "head", "drift",
    "stays", "turns",
)  # fmt: skip
"""What draws random numbers; a new name goes to the end, so that the others keep theirs."""
_ALIKE = (
    "bottom_up", "top_down", "attention", "idle", "saccade", "pursuit", "drift", "lids",
)  # fmt: skip
"""Sections of the gaze parameters whose model of the same name needs no other parameters."""


def random_generators(seed: int) -> dict[str, np.random.Generator]:
    """Return one generator for each model, so that none depends on the draws of another."""
    seeds = np.random.SeedSequence(seed).spawn(len(_DRAWS))
    return dict(zip(_DRAWS, map(np.random.default_rng, seeds), strict=True))


def rig_kinematics(rig: Rig) -> Kinematics:
    """Return a rig's geometry."""
    return Kinematics(rig.geometry, rig.joints, lid_ends(rig))


class GazeModels:
    """All models from percept to gaze, from attention to lids.

    Raises:
        gazerig.config.load.ConfigError: the walk that the rig names is invalid.
    """

    def __init__(self, rig: Rig, random: Mapping[str, np.random.Generator]) -> None:
        gaze = rig.gaze
        self.walk = load_walk(gaze.scanpath.transition_matrix)
        self.kinematics = rig_kinematics(rig)
        self.bottom_up, self.top_down = BottomUp(gaze.bottom_up), TopDown(gaze.top_down)
        self.idle = Idle(gaze.idle, random["idle"])
        self.attention = Attention(
            gaze.attention, self.bottom_up, self.top_down, self.idle, random["reaction"],
            random["stays"],
        )  # fmt: skip
        self.conversation = ConversationGaze(
            gaze.looks_away, gaze.aversion, gaze.conversation, self.attention, random["aversion"],
            random["turns"],
        )  # fmt: skip
        self.scanpath = Scanpath(gaze.scanpath, self.walk, random["scanpath"])
        self.saccade, self.pursuit = SaccadeModel(gaze.saccade), Pursuit(gaze.pursuit)
        self.head = HeadModel(gaze.head, *head_limits(rig), random["head"])
        self.drift, self.lids = Drift(gaze.drift, random["drift"]), Lids(gaze.lids, random["lids"])
        self.oculomotor = Oculomotor(
            gaze.oculomotor, self.kinematics, eye_limits(rig), self.saccade, self.pursuit,
            self.head, self.lids, random["endpoint"], self.drift,
        )  # fmt: skip
        self.animation = Animation(further_joints(rig.joints), faces(rig))
        self.animation.tracks.latency_s = gaze.oculomotor.eye_lag_ms / 1e3

    def retune(self, old: Rig, new: Rig) -> None:
        """Take changed parameters over between two ticks; every model keeps its state.

        Raises:
            gazerig.config.load.ConfigError: the new walk is invalid; nothing has changed.
        """
        was, now, walk = old.gaze, new.gaze, self.walk
        if now.scanpath.transition_matrix != was.scanpath.transition_matrix:
            self.walk = load_walk(now.scanpath.transition_matrix)
        for name in _ALIKE:
            if getattr(now, name) != getattr(was, name):
                getattr(self, name).retune(getattr(now, name))
        looks_away = now.looks_away, now.aversion, now.conversation
        if looks_away != (was.looks_away, was.aversion, was.conversation):
            self.conversation.retune(*looks_away)
        if now.scanpath != was.scanpath or self.walk != walk:
            self.scanpath.retune(now.scanpath, self.walk)
        bounds = (new.joints, new.ranges) != (old.joints, old.ranges)
        if now.oculomotor != was.oculomotor or bounds:
            self.oculomotor.retune(now.oculomotor, eye_limits(new))
        if now.head != was.head or bounds:
            self.head.retune(now.head, *head_limits(new))


def with_rule(rig: Rig, own: TargetChooser) -> TargetChooser:
    """Return the rig's own attention, behind the rule of a package that the rig selects.

    Raises:
        SetupError: the rule cannot be created.
    """
    name = rig.gaze.chooser
    if is_ours(ATTENTION, name):
        return own
    rule = create(ATTENTION, name, load(ATTENTION, name, AttentionPlugin), rig.gaze.plugins[name])
    label = find(ATTENTION, name).label
    return RuleChooser(rule, own, label)
