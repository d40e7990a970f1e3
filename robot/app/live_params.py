"""Application of changed parameters to the running parts, between two ticks and without a jump.

Each part has a ``retune`` that takes its parameters and keeps its state. Only parts whose
parameters differ are changed. A parameter that cannot change during a run (see
gazerig.config.parameters) keeps its value until the next start.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

from gazerig.config.faults import ConfigError, ConfigFault
from gazerig.config.parameters import apply_changes, differences, start_note
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
from gazerig.robot.app.camera_factory import retune_camera
from gazerig.robot.app.rig_limits import (
    eye_limits,
    face_parts_m,
    head_limits,
    lid_ends,
    lid_spans,
    limits,
)
from gazerig.robot.app.rig_weight import rest_park_pose
from gazerig.robot.control.body import Body
from gazerig.robot.control.track_choices import TrackChoices
from gazerig.robot.model.commands import Tune, Value
from gazerig.robot.model.coupling_params import coupled_pairs, joint_partners
from gazerig.robot.model.frames import CameraMount, CameraParams, MountedOn
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


class CameraPlacement(NamedTuple):
    """Assumed placement of the camera, which may be fixed although the rig's moves."""

    camera: Callable[[Rig], CameraParams]
    mount: MountedOn


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

    def __init__(self, parts: Components, rig: Rig, placed: CameraPlacement) -> None:
        self.rig = rig
        self.parts = parts
        self._placed = placed
        self._started = rig
        self._coupled = joint_partners(coupled_pairs(rig.couplings))
        self._walk = load_walk(rig.gaze.scanpath.transition_matrix)
        self._ready: dict[int, _PreparedChange] = {}

    @property
    def loop(self) -> LoopParams:
        """Return the present rate and time for parking."""
        return self.rig.loop

    @property
    def park_rad(self) -> JointAngles:
        """Return the pose for parking, before torque is switched off."""
        return rest_park_pose(self.rig)

    @property
    def camera(self) -> CameraParams:
        """Return the present lens and placement of the camera."""
        return self._placed.camera(self.rig)

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
        bends = (new.geometry, new.lid_joints) != (old.geometry, old.lid_joints)
        if bends:
            parts.kinematics.retune(new.geometry, lid_ends(new))
        said: tuple[str, ...] = ()
        if (new.joints, new.guard) != (old.joints, old.guard):
            said = self._apply_joints(old, new)
        if bends or new.ranges != old.ranges:
            parts.guard.start_gently()  # desired angles jump
        if new.loop.rate_hz != old.loop.rate_hz:
            parts.guard.set_period(1.0 / new.loop.rate_hz)
        if new.tracker != old.tracker:
            parts.tracker.retune(new.tracker)
        placed, was_placed = self._placed.camera(new), self._placed.camera(old)
        if placed != was_placed:
            parts.mount.retune(replace(placed, mount=self._placed.mount))
        if (placed, new.face_parts_mm) != (was_placed, old.face_parts_mm):
            parts.perception.retune(placed.horizontal_field_deg, face_parts_m(new), placed.lens)
        camera = retune_camera(parts.camera, old, new, placed)
        return (*said, camera) if camera else said

    def _apply_joints(self, old: Rig, new: Rig) -> tuple[str, ...]:
        """Apply joint limits to body and guard; the guard gets the present angles of the joints.

        Returns the changes that are applied at the next setup of the servos.
        """
        parts, joints, before = self.parts, self._keep_servos(new), self._keep_servos(old)
        gentle_deg_s = new.guard.soft_start_speed_deg_s
        others = (joints, gentle_deg_s) != (before, old.guard.soft_start_speed_deg_s)
        if others:
            for i, (factor, offset_rad) in parts.body.retune(joints, gentle_deg_s).items():
                parts.guard.rescale_joint(i, factor, offset_rad)
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

    def _keep_servos(self, rig: Rig) -> dict[str, JointParams]:
        """Return the joints with the servos for which the bus was opened."""
        return {
            name: _keep_servo_of(rig.joints[name], first, name in self._coupled)
            for name, first in self._started.joints.items()
        }


_OF_THE_SERVO = ("id", "model", "firmware_min", "bus", "transmission_points", "servo_speed_deg_s")
"""Fields of a joint that cannot change after the bus was opened."""


_OF_A_PAIR = ("sign", "ratio", "zero_step")
"""Further fields that cannot change if two servos move two joints together."""


def _keep_servo_of(joint: JointParams, first: JointParams, coupled: bool) -> JointParams:
    """Return a joint with the servo of another; the same object if it is unchanged."""
    keys = (*_OF_THE_SERVO, *_OF_A_PAIR) if coupled else _OF_THE_SERVO
    kept = {key: getattr(first, key) for key in keys}
    if all(getattr(joint, key) == value for key, value in kept.items()):
        return joint
    return replace(joint, **kept)


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
