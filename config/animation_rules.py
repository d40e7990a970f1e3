"""Rules of a rig's expressions and levels: joints, ranges, and speeds that the joints can do."""

from collections.abc import Iterable
from typing import NamedTuple

from gazerig.config.rig import Rig
from gazerig.gaze.minimum_jerk import PEAK_ACCELERATION, PEAK_SPEED
from gazerig.robot.model.kinematics import LIDS, NECK
from gazerig.robot.model.types import GAZE_JOINTS

EYES = tuple(name for name in GAZE_JOINTS if name not in (*NECK, *LIDS))


class _KeyedMove(NamedTuple):
    """The widest move of a joint that a table can ask for, in degrees."""

    key: str
    joint: str
    span_deg: float
    time_s: float


def expressions(rig: Rig) -> Iterable[tuple[str, str]]:
    """Find expressions that the joints cannot do."""
    ends: dict[str, tuple[float, float]] = {}
    widest: dict[str, str] = {}
    for name, angles in rig.expressions.items():
        for joint, angle in angles.items():
            key = f"expressions.{name}.{joint}"
            if fault := _joint_fault(rig, joint) or _range_fault(rig, joint, angle):
                yield key, fault
                continue
            low, high = ends.get(joint, (0.0, 0.0))
            if not low <= angle <= high:
                ends[joint], widest[joint] = (min(low, angle), max(high, angle)), key
    for joint, (low, high) in ends.items():
        move = _KeyedMove(widest[joint], joint, high - low, rig.expression_blend_s)
        yield from _too_fast(rig, move, "expression_blend_s")


def levels(rig: Rig) -> Iterable[tuple[str, str]]:
    """Find levels that their joint cannot do."""
    for name, level in rig.levels.items():
        if fault := _joint_fault(rig, level.joint):
            yield f"levels.{name}.joint", fault
            continue
        ends = {"low_deg": level.low_deg, "high_deg": level.high_deg}
        faults = {end: _range_fault(rig, level.joint, angle) for end, angle in ends.items()}
        yield from ((f"levels.{name}.{end}", fault) for end, fault in faults.items() if fault)
        span = abs(level.high_deg - level.low_deg)
        key = f"levels.{name}.smoothing_ms"
        yield from _too_fast(rig, _KeyedMove(key, level.joint, span, level.smoothing_ms / 1e3), key)


def _joint_fault(rig: Rig, joint: str) -> str:
    """Return why a joint cannot be moved beside gaze, "" where it can."""
    free = [name for name in rig.names if name not in EYES]
    if joint in EYES:
        return f"gaze alone turns the eyes; what can be moved here is {', '.join(free)}"
    if joint not in rig.joints:
        return f"no joint {joint!r}; there is {', '.join(free)}"
    return ""


def _range_fault(rig: Rig, joint: str, angle: float) -> str:
    """Return why an angle cannot be added to a joint, "" where it can."""
    params = rig.joints[joint]
    if joint in LIDS:
        shut, wide = rig.lid_joints.ends_deg(joint)
        if shut is None or wide is None:
            return ""  # said where the ends are missing
        if abs(angle) <= abs(wide - shut):
            return ""
        return (
            f"{angle:g} deg is more than the lid's whole way of {abs(wide - shut):g} deg "
            f"from open at {wide:g} to shut at {shut:g}"
        )
    if params.min_deg <= angle <= params.max_deg:
        return ""
    return f"{angle:g} deg is outside the joint's range {params.min_deg:g}..{params.max_deg:g}"


def _too_fast(rig: Rig, move: _KeyedMove, key: str) -> Iterable[tuple[str, str]]:
    """Find a minimum-jerk move that is faster or more abrupt than the joint can be."""
    joint = rig.joints[move.joint]
    speed = PEAK_SPEED * move.span_deg / move.time_s
    accel = PEAK_ACCELERATION * move.span_deg / move.time_s**2
    slowest = max(
        PEAK_SPEED * move.span_deg / joint.max_speed_deg_s,
        (PEAK_ACCELERATION * move.span_deg / joint.max_accel_deg_s2) ** 0.5,
    )
    least = f"{slowest * 1e3:.0f} ms" if key.endswith("_ms") else f"{slowest:.2f} s"
    if speed > joint.max_speed_deg_s:
        limit = f"{speed:.0f} deg/s, its limit is max_speed_deg_s {joint.max_speed_deg_s:g}"
    elif accel > joint.max_accel_deg_s2:
        limit = f"{accel:.0f} deg/s2, its limit is max_accel_deg_s2 {joint.max_accel_deg_s2:g}"
    else:
        return
    yield (
        move.key,
        f"{move.joint} would move {move.span_deg:g} deg within {move.time_s:g} s: {limit}; "
        f"{key.rpartition('.')[2]} of {least} or more would do",
    )
