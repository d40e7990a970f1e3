"""Application of changed parameters to the running parts, between two ticks and without a jump.

Each part has a ``retune`` that takes its parameters and keeps its state. Only parts whose
parameters differ are changed. A key that a running rig does not apply (see
gazerig.config.parameters) keeps its value until the next start.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

from gazerig.config.faults import ConfigError
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
from gazerig.robot.loop.body import Body
from gazerig.robot.loop.track_choices import TrackChoices
from gazerig.robot.model.commands import Tune, Value
from gazerig.robot.model.frames import CameraMount, CameraParams
from gazerig.robot.model.kinematics import Kinematics
from gazerig.robot.model.types import JointAngles
from gazerig.robot.perception.perception import Perception
from gazerig.robot.run.rig_limits import (
    eye_limits,
    head_limits,
    limits,
)
from gazerig.robot.run.rig_weight import rest_park_pose
from gazerig.robot.safety.guard import Guard


class Components(NamedTuple):
    """The parts of a running robot that have parameters."""

    body: Body
    guard: Guard
    kinematics: Kinematics
    camera: Camera
    mount: CameraMount
    perception: Perception
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


def rig_in_effect(running: Rig, wanted: Rig) -> Rig:
    """Return a running rig with those values of another that it applies before its next start."""
    joints = {
        name: replace(joint, **{key: getattr(wanted.joints[name], key) for key in LIVE_LIMITS})
        for name, joint in running.joints.items()
        if name in wanted.joints
    }
    return replace(
        running,
        character=wanted.character,
        ranges=wanted.ranges,
        gaze=replace(wanted.gaze, chooser=running.gaze.chooser, plugins=running.gaze.plugins),
        guard=wanted.guard,
        sound=replace(running.sound, device=wanted.sound.device),
        joints={**running.joints, **joints},
    )


class LiveParams:
    """Applies changes to the parts of a robot; a gazerig.robot.loop.loop.Robot's ``tune``.

    rig: the rig in effect

    Args:
        parts: The parts.
        rig: The rig at the start.
        camera: Returns the present lens and placement of the camera.
    """

    def __init__(self, parts: Components, rig: Rig, camera: Callable[[], CameraParams]) -> None:
        self.rig = rig
        self.parts = parts
        self._camera = camera
        self._walk = load_walk(rig.gaze.scanpath.transition_matrix)
        self._ready: dict[int, _PreparedChange] = {}

    @property
    def park_rad(self) -> JointAngles:
        """Return the pose for parking, before torque is switched off."""
        return rest_park_pose(self.rig)

    @property
    def camera(self) -> CameraParams:
        """Return the present lens and placement of the camera."""
        return self._camera()

    @property
    def horizontal_field_deg(self) -> float:
        """Return the present field of view of the camera."""
        return self.camera.horizontal_field_deg

    def prepare(self, base: Rig, rig: Rig) -> Tune:
        """Return the command that changes one rig in effect into another; for any thread.

        The tick that applies it need not check it. base: the rig in effect when it arrives

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
                wanted = apply_changes(self.rig, dict(command.changes))
                ready = _prepare_change(command, self.rig, rig_in_effect(self.rig, wanted))
            except ConfigError as error:
                return tuple(f"not tuned: {line}" for line in str(error).splitlines())
        before, self.rig = self.rig, ready.rig
        self._apply_to_gaze(before, ready.rig, ready.walk or self._walk)
        said = self._apply_to_machine(before, ready.rig)
        return (
            *(f"tuned: {key} = {value}{start_note(key)}" for key, value in command.changes),
            *said,
        )

    def _apply_to_gaze(self, old: Rig, new: Rig, walk: Walk) -> None:
        parts, was, now = self.parts, old.gaze, new.gaze
        for name in _ALIKE:
            if getattr(now, name) != getattr(was, name):
                getattr(parts, name).retune(getattr(now, name))
        looks_away = now.looks_away, now.aversion, now.conversation
        if looks_away != (was.looks_away, was.aversion, was.conversation):
            parts.conversation.retune(*looks_away)
        if now.scanpath != was.scanpath or walk != self._walk:
            parts.scanpath.retune(now.scanpath, walk)
        self._walk = walk
        bounds = (new.joints, new.ranges) != (old.joints, old.ranges)
        if now.oculomotor != was.oculomotor or bounds:
            parts.oculomotor.retune(now.oculomotor, eye_limits(new))
        if now.head != was.head or bounds:
            parts.head.retune(now.head, *head_limits(new))
        parts.tracks.latency_s = now.oculomotor.eye_lag_ms / 1e3

    def _apply_to_machine(self, old: Rig, new: Rig) -> tuple[str, ...]:
        """Apply limits of joints and guard.

        Returns the changes that are applied at the next setup of the servos.
        """
        parts = self.parts
        gentle_deg_s = new.guard.soft_start_speed_deg_s
        set_up = new.joints != old.joints or gentle_deg_s != old.guard.soft_start_speed_deg_s
        if set_up:
            parts.body.retune(new.joints, gentle_deg_s)
        if set_up or new.guard != old.guard:
            parts.guard.retune(new.guard, limits(new.joints))
        if new.ranges != old.ranges:
            parts.guard.start_gently()  # desired angles jump
        more = [
            name
            for name, desired, most in zip(
                parts.body.names, limits(new.joints), parts.body.configured_limits(), strict=True
            )
            if desired.low_rad < most.low_rad - 1e-6
            or desired.high_rad > most.high_rad + 1e-6
            or desired.speed_rad_s > most.speed_rad_s + 1e-6
        ]
        if not (set_up and more):
            return ()
        return (f"{', '.join(more)}: the full range and speed apply after a stop and a resume",)


def _prepare_change(command: Tune, base: Rig, rig: Rig) -> _PreparedChange:
    """Build a checked change, with a new face walk if that has changed.

    Raises:
        ConfigError: the walk is invalid.
    """
    name = rig.gaze.scanpath.transition_matrix
    walk = load_walk(name) if name != base.gaze.scanpath.transition_matrix else None
    return _PreparedChange(command.changes, base, rig, walk)
