"""Texts about one tick: target, control, guard, percept."""

from collections.abc import Callable, Collection
from typing import Literal

from gazerig.drivers.process.host_lateness import LATE_COMPUTER
from gazerig.drivers.types import BusHealth
from gazerig.gaze.angles import norm, sub
from gazerig.gaze.types import PART_NAMES, Target, body_name
from gazerig.robot.loop.tick import Tick
from gazerig.robot.model.control_source import (
    ControlSource,
    control_source,
)
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


def tick_control_source(tick: Tick) -> ControlSource:
    """Return the source of control of the head."""
    return control_source(tick.stopped, tick.parking, tick.client_control, tick.tracks)


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
