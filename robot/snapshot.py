"""One tick in the words and shapes that people are shown: the page's snapshot, status words."""

import numpy as np

from drivers.types import BusHealth
from gaze.angles import norm, sub
from gaze.field_of_view import line_of_sight
from gaze.types import PART_NAMES, Target, Vec3
from robot.head_turn_residual import ResidualFigures
from robot.loop import Tick
from robot.types import SeenBody, SeenFace, Snapshot, Verdict


def snapshot(tick: Tick, rate_hz: float, health: str, behaviour: str, seeing: str = "") -> Snapshot:
    """Give what the page is shown of a tick."""
    pose, percept, target = tick.pose, tick.percept, tick.target
    faces = percept.faces if percept is not None else ()
    bodies = percept.bodies if percept is not None else None
    return Snapshot(
        t_s=tick.t_s,
        measured_rad=tick.joints.position_rad,
        wish_rad=tick.wish_rad,
        R_world_head=pose.R_world_head,
        p_world_head_m=pose.p_world_head_m,
        p_world_eyes_m=(pose.p_world_eye_left_m, pose.p_world_eye_right_m),
        gaze_world=(line_of_sight(pose, True), line_of_sight(pose, False)),
        lids=(pose.lid_left, pose.lid_right),
        p_world_target_m=tick.gaze.gaze_point_world_m,
        target_name=target_name(target),
        why=target.why,
        phase="blink" if tick.gaze.blink else tick.gaze.phase,
        level=tick.verdict.level,
        reasons=tick.verdict.reasons,
        faces=tuple(
            SeenFace(face.id, face.p_world_m, face.R_world_face, face.parts_world_m)
            for face in faces
        ),
        bodies=()
        if bodies is None
        else tuple(
            SeenBody(bodies.ids[i], kind, _vec(bodies.p_world_m[i]), float(bodies.radius_m[i]))
            for i, kind in enumerate(bodies.kinds)
            if kind != "face"
        ),
        rate_hz=rate_hz,
        health=health,
        behaviour=behaviour,
        pulls=target.pulls,
        seeing=seeing,
    )


def seeing_words(tick: Tick, residual: ResidualFigures) -> str:
    """Say how old the picture is, how far faces are and by what, and what the head's turn leaves.

    e.g. "picture 63 ms old | face 1 at 0.98 m by camera, +- 1 cm | still things seem to move
    0.3 deg/s while the head turns"
    """
    if tick.percept is None:
        return "no picture yet"
    parts = [f"picture {1e3 * tick.percept.age_s(tick.t_s):.0f} ms old"]
    head = tick.pose.p_world_head_m
    for face in tick.percept.faces:
        by = f" by {face.distance_from}" if face.distance_from else ""
        parts.append(
            f"face {face.id} at {norm(sub(face.p_world_m, head)):.2f} m{by}, "
            f"+- {100.0 * face.along_sd_m:.0f} cm"
        )
    if residual.speed_deg_s is not None:
        parts.append(
            f"still things seem to move {residual.speed_deg_s:.1f} deg/s while the head turns"
        )
    return " | ".join(parts)


def target_name(target: Target) -> str:
    """Give a target's name for people, e.g. "face 3: left eye"."""
    name = target.kind if target.id < 0 else f"{target.kind} {target.id}"
    return name if target.part is None else f"{name}: {PART_NAMES[target.part]}"


def verdict_words(verdict: Verdict) -> str:
    """Say what the guard made of the wish, e.g. "limited (neck_yaw: too fast, +2)"."""
    if not verdict.reasons:
        return verdict.level
    more = f", +{len(verdict.reasons) - 1}" if len(verdict.reasons) > 1 else ""
    return f"{verdict.level} ({verdict.reasons[0]}{more})"


def health_words(health: BusHealth) -> str:
    errors = sum(health.errors.values())
    if errors == 0:
        return "bus ok"
    return "bus: " + ", ".join(f"{n} {kind}" for kind, n in sorted(health.errors.items()) if n)


def _vec(row: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> Vec3:
    x, y, z = row.tolist()
    return (x, y, z)
