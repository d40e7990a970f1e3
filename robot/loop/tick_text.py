"""Texts about one tick: target, control, guard, percept."""

from collections.abc import Callable, Collection
from math import degrees
from typing import Literal, NamedTuple

from gazerig.drivers.process.host_lateness import LATE_COMPUTER
from gazerig.drivers.types import BusHealth
from gazerig.gaze.angles import norm, sub
from gazerig.gaze.types import ORDERED, PART_NAMES, Target, body_name
from gazerig.robot.loop.tick import Tick
from gazerig.robot.model.control_source import (
    ControlSource,
    control_sentence,
    control_source,
    control_title,
)
from gazerig.robot.model.kinematics import gaze_error
from gazerig.robot.model.types import GuardResult


def perception_text(tick: Tick) -> str:
    """Return age of the frame, camera conditions and distances of faces.

    e.g. "frame 63 ms old | face 1 at 0.98 m by camera, +- 1 cm"
    """
    if tick.percept is None:
        return "no frame yet"
    parts = [f"frame {1e3 * tick.percept.age_s(tick.t_s):.0f} ms old", *camera_conditions(tick)]
    head = tick.pose.p_world_head_m
    for face in tick.percept.faces:
        parts.append(
            f"face {face.id} at {norm(sub(face.p_world_m, head)):.2f} m by {face.distance_from}, "
            f"+- {100.0 * face.along_sd_m:.0f} cm"
            + (", looks at the head" if face.looks_at_head else "")
            + (", speaks" if face.speaks else "")
        )
    return " | ".join(parts)


def camera_conditions(tick: Tick) -> tuple[str, ...]:
    """Return the conditions that impair the camera, each with its remedy."""
    return tick.detections.conditions if tick.detections is not None else ()


def target_name(target: Target) -> str:
    """Return a target's name for users, e.g. "face 3: left eye"."""
    kind = "motion" if target.kind == "thing" else target.kind
    name = body_name(kind, target.id)
    return name if target.part is None else f"{name}: {PART_NAMES[target.part]}"


class Activity(NamedTuple):
    """The head's present activity as text.

    Attributes:
        headline: One sentence.
        target: Gaze target, or the source of control.
        reason: Reason for it.
        phase: Phase of the eyes; "held" while joints are held, "stopped", "parking".
    """

    headline: str
    target: str
    reason: str
    phase: str


def tick_control_source(tick: Tick) -> ControlSource:
    """Return the source of control of the head."""
    return control_source(tick.stopped, tick.parking, tick.client_control, tick.tracks)


def head_activity(tick: Tick) -> Activity:
    """Return the head's activity; while a client is in control, only that."""
    leads = tick_control_source(tick)
    phase: str = "blink" if tick.gaze.blink else tick.gaze.phase
    said = control_sentence(leads, tick.t_s)
    found = tick.guard_result
    if found.level == "torque_off" and leads.kind not in ("stopped", "parking"):
        limp = f"the torque is off: {' and '.join(found.critical_reasons[:1]) or 'guard'}"
        return Activity(limp, target_name(tick.target), limp, phase)
    if leads.overrides_gaze:
        phase = {"joint": "held", "stopped": "stopped", "parking": "parking"}.get(leads.kind, phase)
        distance = _distance_text(tick) if leads.kind in ("person", "pointer") else ""
        return Activity(said + distance, control_title(leads), said + distance, phase)
    looks = _gaze_text(tick.target)
    headline = f"{said}, and {looks}" if leads.kind == "track" else looks
    return Activity(headline, target_name(tick.target), tick.target.why, phase)


def _gaze_text(target: Target) -> str:
    """Return the gaze's activity as the predicate of a sentence about the head."""
    match target.kind:
        case "rest":
            return "looks ahead: nobody is visible"
        case "glance":
            return "looks around: nobody is visible"
        case "search":
            return "looks for a person who has left"
        case "away":
            return "looks away for a moment"
        case "face":
            part = f" ({PART_NAMES[target.part]})" if target.part is not None else ""
            return f"looks at person {target.id}{part}"
        case "thing":
            return "looks at a moving object"
        case kind if kind == ORDERED:
            return "looks at its point"
        case kind:
            return f"looks at a {kind}"


def _distance_text(tick: Tick) -> str:
    """Return the gaze's distance from the chosen point, "" if it reaches the point."""
    limited = tick.gaze.limited
    if tick.target.kind != ORDERED or not limited:
        return ""
    error = degrees(gaze_error(tick.target.p_world_m, tick.pose))
    ends = (
        f"{one.axis} {degrees(one.done_rad):.0f} of {degrees(one.asked_rad):.0f} deg"
        for one in limited
    )
    return f"; {error:.0f} deg off: {', '.join(ends)}"


def guard_text(guard_result: GuardResult) -> str:
    """Return the guard's effect on the desired angles, e.g. "limited (neck_yaw: too fast, +2)"."""
    if not guard_result.reasons:
        return guard_result.level.replace("_", " ")
    more = f", +{len(guard_result.reasons) - 1}" if len(guard_result.reasons) > 1 else ""
    return f"{guard_result.level.replace('_', ' ')} ({guard_result.reasons[0]}{more})"


def health_text(health: BusHealth) -> str:
    """Return the state of the bus, e.g. "bus: timeout 3 times"; lateness is not counted."""
    errors = [
        f"{kind} {n} time{'s' if n > 1 else ''}"
        for kind, n in sorted(health.errors.items())
        if n and kind != LATE_COMPUTER
    ]
    return f"bus: {', '.join(errors)}" if errors else "bus ok"


Basis = Literal["measured", "partly estimated", "estimated"]

ESTIMATED = "estimated from commands and known servo speeds, not measured"


def estimated_joints(tick: Tick) -> tuple[str, ...]:
    """Return the joints whose servos have no feedback."""
    has_feedback = tick.joints.measured
    if not has_feedback:
        return ()
    return tuple(
        [n for n, one in zip(tick.guard_result.joints, has_feedback, strict=True) if not one]
    )


def basis_of(
    joints: Collection[str], estimated: Collection[str], counts: Callable[[str], bool]
) -> Basis:
    """Return whether a figure is measured or estimated.

    Args:
        joints: Joints of the rig.
        estimated: Joints without feedback.
        counts: Returns whether the figure depends on a joint of this name.
    """
    hidden = [counts(name) for name in estimated]
    if not any(hidden):
        return "measured"
    whole = sum(hidden) == sum(counts(name) for name in joints)
    return "estimated" if whole else "partly estimated"
