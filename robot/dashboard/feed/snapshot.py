"""Snapshot of a tick for people: texts and shapes of the page."""

from collections import Counter, deque
from dataclasses import replace
from math import degrees
from typing import NamedTuple

import numpy as np

from gazerig.drivers.types import BusHealth
from gazerig.gaze.angles import angle_between
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.types import GazeState, Vec3
from gazerig.robot.control.loop_timing import busy_text
from gazerig.robot.control.tick import Tick, cyclopean_direction
from gazerig.robot.control.tick_text import (
    head_activity,
    health_text,
    perception_text,
    tick_control_source,
)
from gazerig.robot.description.build import RigShape
from gazerig.robot.model.control_source import playing
from gazerig.robot.model.frames import CameraMount
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.kinematics import Kinematics
from gazerig.robot.model.types import (
    CommandedPose,
    JointState,
    Level,
    LoopFigures,
    SeenBlink,
    SeenBody,
    SeenCamera,
    SeenEvent,
    SeenSaccade,
    ServoLimits,
    Servos,
    Snapshot,
    Trail,
)
from gazerig.robot.safety.health import HOT_C, LASTING_LOAD, VOLTAGE_MARGIN_V, WARM_C

_TICKS_KEPT = 600
"""Largest number of waiting ticks: those of three seconds, for a delayed reader."""
_TRAIL_S = 0.0095
"""Joints are shown 100 times a second; a little less than 10 ms, for rounding's sake."""
_LOWER_LIDS = frozenset(("left_lower_lid", "right_lower_lid"))
_GRAVITY: dict[Level, int] = {"ok": 0, "limited": 1, "hold": 2, "torque_off": 3}


class ShownRig(NamedTuple):
    """Geometry of a rig as it is shown.

    shape: geometry of all its parts; None if only its kinematics are known
    """

    kinematics: Kinematics
    limits: tuple[JointLimit, ...]
    mount: CameraMount
    horizontal_rad: float
    shape: RigShape | None = None


class RunState(NamedTuple):
    """State of a run that ticks do not contain.

    errors: errors of the bus, by kind; behaviour, conversation, character: the present ones
    scene_start_s: start of a simulated scene or world, None before it and without one
    timing: the loop's own figures; None: unknown. In the page's own
        figures, ticks that a busy page did not accept would appear late.
    expression: the present one, "" without any
    """

    errors: dict[str, int]
    behaviour: str
    conversation: str
    character: str
    scene_start_s: float | None = None
    timing: LoopFigures | None = None
    expression: str = ""


class EyeMovements:
    """Finds the saccades and blinks that the models have made, in consecutive ticks."""

    def __init__(self) -> None:
        self._last: Tick | None = None
        self._onset: tuple[float, Vec3] | None = None
        self._shut_s: float | None = None

    def update(self, tick: Tick) -> list[SeenEvent]:
        """Return the movements that have ended with this tick."""
        found: list[SeenEvent] = []
        gaze, last, self._last = tick.gaze, self._last, tick
        is_other = last is not None and gaze.saccades != last.gaze.saccades
        if self._onset is not None and (is_other or gaze.phase != "saccade"):
            onset_s, before = self._onset
            moved_deg = degrees(angle_between(before, cyclopean_direction(tick)))
            found.append(SeenSaccade(onset_s, tick.t_s - onset_s, moved_deg))
            self._onset = None
        if self._onset is None and gaze.phase == "saccade":
            self._onset = tick.t_s, cyclopean_direction(tick)
        if gaze.blink and self._shut_s is None:
            self._shut_s = tick.t_s
        elif not gaze.blink and self._shut_s is not None:
            found.append(SeenBlink(self._shut_s, tick.t_s - self._shut_s))
            self._shut_s = None
        return found


class SnapshotBuilder:
    """Creates snapshots of a running rig, with all events since the previous one.

    ``update`` only stores the tick; ``build`` does the work.
    """

    def __init__(self, rig: ShownRig | None = None) -> None:
        self.rig = rig
        self._ticks: deque[Tick] = deque(maxlen=_TICKS_KEPT)
        self._newest: Tick | None = None
        self._begin()

    def _begin(self) -> None:
        self._trail_s = -np.inf
        self._movements = EyeMovements()
        self._unanswered: Counter[str] = Counter()

    def update(self, tick: Tick) -> None:
        """Add a tick."""
        self._ticks.append(tick)

    def build(self, state: RunState, detector: str = "") -> Snapshot | None:
        """Return a snapshot of the newest tick, None before the first.

        detector: detector of faces and people, "" if none runs
        """
        trail: list[Trail] = []
        events: list[SeenEvent] = []
        worst: Level = "ok"
        while self._ticks:
            tick = self._ticks.popleft()
            if self._newest is not None and tick.t_s < self._newest.t_s:
                self._begin()
            self._newest = tick
            if tick.joints.missing:
                self._unanswered.update(tick.joints.missing)
            events += self._movements.update(tick)
            if tick.t_s - self._trail_s >= _TRAIL_S:
                self._trail_s = tick.t_s
                trail.append(_trail(tick))
            if _GRAVITY[tick.guard_result.level] > _GRAVITY[worst]:
                worst = tick.guard_result.level
        if self._newest is None:
            return None
        track = playing(self._newest.tracks)
        busy = busy_text(state.timing)
        seen = perception_text(self._newest)
        plain = snapshot(self._newest, self.rig)
        reasons = plain.reasons
        others = tuple([reason for reason in reasons if not reason.endswith(": stale joints")])
        if busy and len(others) < len(reasons):
            reasons = (*others, busy)  # old readings are due to a busy computer
        return replace(
            plain,
            health=health_text(BusHealth(0, 0, state.errors)),
            perception=" | ".join(filter(None, (seen, detector))),
            behaviour=state.behaviour,
            character=state.character,
            conversation=state.conversation,
            servos=plain.servos._replace(
                unanswered=tuple([self._unanswered[name] for name in plain.joints])
            ),
            timing=state.timing,
            busy=busy,
            reasons=reasons,
            worst=worst,
            trail=tuple(trail),
            events=tuple(events),
            expressed=(track.name if track is not None else "", state.expression),
        )


def snapshot(tick: Tick, rig: ShownRig | None = None) -> Snapshot:
    """Return the snapshot of a single tick, without the state that it does not contain.

    rig: geometry of the rig, for the commanded pose, the camera and the servos' limits
    """
    pose, percept, target = tick.pose, tick.percept, tick.target
    does, leads = head_activity(tick), tick_control_source(tick)
    joints, measured = joint_names(tick, rig), tick.joints.measured
    pivot = None
    if rig is not None:
        pivot = rig.kinematics.body_volumes(pose.R_world_head, pose.p_world_head_m)[0].start_m
    return Snapshot(
        t_s=tick.t_s,
        measured_rad=tick.joints.position_rad,
        desired_rad=tick.desired_rad,
        R_world_head=pose.R_world_head,
        p_world_head_m=pose.p_world_head_m,
        p_world_eyes_m=(pose.p_world_eye_left_m, pose.p_world_eye_right_m),
        gaze_world=(line_of_sight(pose, True), line_of_sight(pose, False)),
        lids=(pose.lid_left, pose.lid_right),
        p_world_target_m=tick.gaze.gaze_point_world_m,
        target_name=does.target,
        why=does.reason,
        phase=does.phase,
        level=tick.guard_result.level,
        reasons=tick.guard_result.reasons,
        faces=percept.faces if percept is not None else (),
        bodies=_bodies(tick),
        saliences=() if leads.overrides_gaze else target.saliences,
        plan="" if leads.overrides_gaze else target.plan,
        commanded_rad=tick.guard_result.command_rad,
        target_kind=leads.kind if leads.overrides_gaze else target.kind,
        target_part=None if leads.overrides_gaze else target.part,
        stopped=tick.stopped,
        control_source=leads,
        headline=does.headline,
        frame_age_s=percept.age_s(tick.t_s) if percept is not None else None,
        commanded_pose=_commanded_pose(tick, rig) if rig is not None else None,
        camera=_camera(tick, rig) if rig is not None else None,
        servos=_servos(tick, rig),
        worst=tick.guard_result.level,
        trail=(_trail(tick),),
        joints=joints,
        estimated=tuple(
            [name for name, is_measured in zip(joints, measured, strict=True) if not is_measured]
            if measured
            else ()
        ),
        lower_lids=_lower_lids(pose, joints),
        tracks=tick.tracks,
        talk=tick.conversation,
        p_world_pivot_m=pivot,
    )


def joint_names(tick: Tick, rig: ShownRig | None = None) -> tuple[str, ...]:
    """Return the names of the joints; a recording without names has numbers."""
    names = tick.guard_result.joints or (rig.kinematics.names if rig is not None else ())
    count = len(tick.joints.position_rad)
    return names if len(names) == count else tuple(f"joint {i + 1}" for i in range(count))


def _lower_lids(pose: GazeState, names: tuple[str, ...]) -> tuple[float, float] | None:
    return None if _LOWER_LIDS.isdisjoint(names) else (pose.lower_left, pose.lower_right)


def _bodies(tick: Tick) -> tuple[SeenBody, ...]:
    """Return targets without a visible face: moving objects and people who are turned away."""
    if tick.percept is None:
        return ()
    bodies = tick.percept.bodies
    faces = {face.id for face in tick.percept.faces}
    return tuple(
        SeenBody(
            bodies.ids[i],
            "person" if kind == "face" else kind,
            tuple(bodies.p_world_m[i].tolist()),
            float(bodies.radius_m[i]),
        )
        for i, kind in enumerate(bodies.kinds)
        if bodies.ids[i] not in faces
    )


def _commanded_pose(tick: Tick, rig: ShownRig) -> CommandedPose:
    """Return the pose of head and eyes at the desired angles."""
    at_rest = (0.0,) * len(tick.desired_rad)
    pose: GazeState = rig.kinematics.forward(JointState(tick.desired_rad, at_rest, at_rest, ()))
    return CommandedPose(
        pose.R_world_head,
        pose.p_world_head_m,
        (pose.p_world_eye_left_m, pose.p_world_eye_right_m),
        (line_of_sight(pose, True), line_of_sight(pose, False)),
        (pose.lid_left, pose.lid_right),
        _lower_lids(pose, rig.kinematics.names),
    )


def _camera(tick: Tick, rig: ShownRig) -> SeenCamera | None:
    """Return the pose of the camera, None before its first frame, whose shape it needs."""
    found = tick.detections
    if found is None:
        return None
    R, p = rig.mount.pose(tick.pose.R_world_head, tick.pose.p_world_head_m)
    horizontal_rad = rig.horizontal_rad
    if found.lens is not None:
        horizontal_rad = float(2.0 * np.arctan(0.5 * found.width_px / found.lens.fx_px))
    return SeenCamera(R, p, horizontal_rad, found.width_px / found.height_px)


def _servos(tick: Tick, rig: ShownRig | None) -> Servos:
    joints, limits = tick.joints, None
    if rig is not None:
        of_joints = rig.limits
        limits = ServoLimits(
            tuple([limit.hottest_c - WARM_C for limit in of_joints]),
            tuple([limit.hottest_c - HOT_C for limit in of_joints]),
            tuple([limit.lowest_v + VOLTAGE_MARGIN_V for limit in of_joints]),
            tuple([limit.highest_v - VOLTAGE_MARGIN_V for limit in of_joints]),
            (LASTING_LOAD,) * len(of_joints),
        )
    return Servos(
        joints.temperature_c,
        joints.voltage_v,
        joints.load,
        joints.torque,
        joints.fault,
        tuple([tick.t_s - at_s for at_s in joints.measured_s]),
        (),
        limits,
        tick.guard_result.limp,
    )


def _trail(tick: Tick) -> Trail:
    return Trail(
        tick.t_s, tick.desired_rad, tick.guard_result.command_rad, tick.joints.position_rad
    )
