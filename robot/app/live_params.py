"""Application of changed parameters to the running parts, between two ticks and without a jump.

Each part has a ``retune`` that takes its parameters and keeps its state. Only parts whose
parameters differ are changed. A parameter that cannot change during a run (see
gazerig.config.parameters) keeps its value until the next start.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

from gazerig.config.faults import ConfigError, ConfigFault
from gazerig.config.parameters import LIVE_LIMITS, apply_changes, differences, start_note
from gazerig.config.rig import Rig
from gazerig.config.schema import load_walk
from gazerig.drivers.types import Camera
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
from gazerig.gaze.scanpath.scanpath import Scanpath, Walk
from gazerig.gaze.track.animation import Animation
from gazerig.robot.app.rig_limits import (
    eye_limits,
    head_limits,
    lid_spans,
    limits,
)
from gazerig.robot.app.rig_weight import rest_park_pose
from gazerig.robot.control.body import Body
from gazerig.robot.control.track_choices import TrackChoices
from gazerig.robot.model.commands import Tune, Value
from gazerig.robot.model.frames import CameraMount, CameraParams
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.kinematics import Kinematics
from gazerig.robot.model.loop_params import LoopParams
from gazerig.robot.model.types import JointAngles
from gazerig.robot.perception.perception import Perception
from gazerig.robot.perception.tracker import Tracker
from gazerig.robot.safety.guard import Guard


class Components(NamedTuple):
    """The parts of a running robot that have parameters."""

    body: Body
    guard: Guard
    kinematics: Kinematics
    camera: Camera
    mount: CameraMount
    perception: Perception
    tracker: Tracker
    attention: Attention
    bottom_up: BottomUp
    top_down: TopDown
    idle: Idle
    scanpath: Scanpath
    conversation: ConversationGaze
    oculomotor: Oculomotor
    saccade: SaccadeModel
    pursuit: Pursuit
    head: HeadModel
    drift: Drift
    lids: Lids
    animation: Animation
    tracks: TrackChoices


class _PreparedChange(NamedTuple):
    """A rig that was checked before it is applied.

    changes: differences from ``base``; walk: scanpath of the rig, None if unchanged
    """

    changes: tuple[tuple[str, Value], ...]
    base: Rig
    rig: Rig
    walk: Walk | None


_ALIKE = (
    "bottom_up", "top_down", "attention", "idle", "saccade", "pursuit", "drift", "lids",
)  # fmt: skip
"""Sections of the gaze parameters whose part of the same name needs no other parameters."""


class LiveParams:
    """Applies changes to the parts of a robot; a gazerig.robot.control.loop.Robot's ``tune``.

    rig: the present rig
    """

    def __init__(self, parts: Components, rig: Rig, placed: Callable[[], CameraParams]) -> None:
        """Remember the parts.

        placed: returns the present lens and placement of the camera
        """
        self.rig = rig
        self.parts = parts
        self._placed = placed
        self._started = rig
        self._walk = load_walk(rig.gaze.scanpath.transition_matrix)
        self._ready: dict[int, _PreparedChange] = {}

    @property
    def loop(self) -> LoopParams:
        """Return the present rate of the loop."""
        return self.rig.loop

    @property
    def park_rad(self) -> JointAngles:
        """Return the pose for parking, before torque is switched off."""
        return rest_park_pose(self.rig)

    @property
    def camera(self) -> CameraParams:
        """Return the present lens and placement of the camera."""
        return self._placed()

    @property
    def horizontal_field_deg(self) -> float:
        """Return the present field of view of the camera."""
        return self.camera.horizontal_field_deg

    def prepare(self, base: Rig, rig: Rig) -> Tune:
        """Return the command that changes one rig into another, which is checked; for any thread.

        The tick that applies it need not check it. base: the present rig when the command arrives

        Raises:
            gazerig.config.load.ConfigError: the walk that the rig names is invalid.
        """
        command = Tune(tuple(differences(base, rig).items()))
        self._ready[id(command.changes)] = _prepare_change(command, base, rig)
        return command

    def __call__(self, command: Tune, t_s: float) -> tuple[str, ...]:
        """Apply a change from this tick on; return a description of the changes.

        A change that was not prepared is checked here; an invalid one changes nothing.
        """
        ready = self._ready.pop(id(command.changes), None)
        if ready is None or ready.changes is not command.changes or ready.base is not self.rig:
            try:
                ready = _prepare_change(
                    command, self.rig, apply_changes(self.rig, dict(command.changes))
                )
            except ConfigError as error:
                return tuple(f"not tuned: {line}" for line in str(error).splitlines())
        before, self.rig = self.rig, ready.rig
        walk = ready.walk or self._walk
        new, parts, was, now = ready.rig, self.parts, before.gaze, ready.rig.gaze
        for name in _ALIKE:
            if getattr(now, name) != getattr(was, name):
                getattr(parts, name).retune(getattr(now, name))
        looks_away = now.looks_away, now.aversion, now.conversation
        if looks_away != (was.looks_away, was.aversion, was.conversation):
            parts.conversation.retune(*looks_away)
        if now.scanpath != was.scanpath or walk != self._walk:
            parts.scanpath.retune(now.scanpath, walk)
        bounds = (new.joints, new.ranges) != (before.joints, before.ranges)
        if now.oculomotor != was.oculomotor or (bounds and eye_limits(new) != eye_limits(before)):
            parts.oculomotor.retune(now.oculomotor, eye_limits(new))
        if now.head != was.head or (bounds and head_limits(new) != head_limits(before)):
            parts.head.retune(now.head, *head_limits(new))
        parts.tracks.retune(lid_spans(new), now.oculomotor.eye_lag_ms / 1e3)
        self._walk = walk
        said = self._apply_to_machine(before, new)
        return (*(f"tuned: {k} = {v}{start_note(k)}" for k, v in command.changes), *said)

    def _apply_to_machine(self, old: Rig, new: Rig) -> tuple[str, ...]:
        parts = self.parts
        said: tuple[str, ...] = ()
        if (new.joints, new.guard) != (old.joints, old.guard):
            said = self._apply_joints(old, new)
        if new.ranges != old.ranges:
            parts.guard.start_gently()  # desired angles jump
        if new.loop.rate_hz != old.loop.rate_hz:
            parts.guard.set_period(1.0 / new.loop.rate_hz)
        parts.tracker.params = new.tracker
        return said

    def _apply_joints(self, old: Rig, new: Rig) -> tuple[str, ...]:
        """Apply joint limits to body and guard.

        Returns the changes that are applied at the next setup of the servos.
        """
        parts, joints, before = self.parts, self._with_limits(new), self._with_limits(old)
        gentle_deg_s = new.guard.soft_start_speed_deg_s
        others = (joints, gentle_deg_s) != (before, old.guard.soft_start_speed_deg_s)
        if others:
            parts.body.retune(joints, gentle_deg_s)
        if new.guard != old.guard or limits(joints) != limits(before):
            parts.guard.retune(new.guard, limits(joints))
        if not others:
            return ()
        more = [
            name
            for name, desired, most in zip(
                parts.body.names, limits(joints), parts.body.configured_limits(), strict=True
            )
            if desired.low_rad < most.low_rad - 1e-6
            or desired.high_rad > most.high_rad + 1e-6
            or desired.speed_rad_s > most.speed_rad_s + 1e-6
        ]
        if not more:
            return ()
        return (f"{', '.join(more)}: the full range and speed apply after a stop and a resume",)

    def _with_limits(self, rig: Rig) -> dict[str, JointParams]:
        """Return the joints of the start with the limits of a rig."""
        return {
            name: replace(first, **{key: getattr(rig.joints[name], key) for key in LIVE_LIMITS})
            for name, first in self._started.joints.items()
        }


def _prepare_change(command: Tune, base: Rig, rig: Rig) -> _PreparedChange:
    """Build a checked change, with a new face walk if that has changed.

    Raises:
        ConfigError: a joint is gone, or the walk is invalid.
    """
    if gone := ", ".join(base.joints.keys() - rig.joints.keys()):
        rule = f"{gone}: a running head keeps its joints: end it, then start it with this file"
        raise ConfigError([ConfigFault("", None, "joints", "", rule)])
    name = rig.gaze.scanpath.transition_matrix
    walk = load_walk(name) if name != base.gaze.scanpath.transition_matrix else None
    return _PreparedChange(command.changes, base, rig, walk)
