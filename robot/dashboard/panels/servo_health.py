"""Health of the rig: alarms, guard, loop and frame in a few lines, every servo in a table."""

from html import escape
from typing import Literal

from gazerig.robot.dashboard.widgets.html import LEVELS, banner, count_text, heading, note, pill
from gazerig.robot.model.types import LoopFigures, Servos, Snapshot

Strain = Literal["", "near", "over"]
"""Relation of a value to its limit."""

_OLD_S = 0.15
_HARD_LOAD = 0.9
_LATE_SHARE = 0.5

NO_FEEDBACK = "no feedback"
"""Text instead of values that a servo does not report."""


def health_table(snapshot: Snapshot) -> str:
    """Return the health of the rig as HTML."""
    # Without the frame's age, which has its own line.
    first, _, others = snapshot.perception.partition(" | ")
    perception = others if first.startswith(("frame ", "no frame")) else snapshot.perception
    age_s = snapshot.frame_age_s
    frame = "<div>no frame yet</div>"
    if age_s is not None:
        kind = " class='warn'" if age_s >= OLD_FRAME_S else ""
        frame = f"<div>frame <b{kind}>{1e3 * age_s:.0f} ms</b> old</div>"
    return (
        guard_text(snapshot)
        + heading("servos")
        + no_feedback_note(snapshot)
        + servo_table(snapshot.servos, snapshot.joints, snapshot.estimated)
        + f"<div>{escape(snapshot.health)}</div>"
        + heading("loop")
        + _timing(snapshot.timing)
        + heading("camera")
        + frame
        + f"<div>{escape(perception)}</div>"
    )


def guard_text(snapshot: Snapshot) -> str:
    """Return the guard's action and reasons as HTML of constant height."""
    level = "stopped" if snapshot.stopped else snapshot.level
    if snapshot.stopped:
        said = f"<div>{escape(snapshot.stopped)}</div>"
    elif level in ("hold", "torque_off"):
        said = "".join(f"<div>{escape(reason)}</div>" for reason in snapshot.reasons)
    else:
        said = one_line(group_reasons(snapshot.reasons))
    words = f"guard: {level.replace('_', ' ')}"
    return f"<div class='stay'>{pill(words, LEVELS[level])}{said}</div>"


def servo_table(servos: Servos, joints: tuple[str, ...], estimated: tuple[str, ...] = ()) -> str:
    """Return one row for each joint: temperature, load, voltage, unanswered ticks, faults.

    estimated: joints whose servos report nothing
    """
    if not servos.age_s:
        return note("no data of the servos yet")
    names = ("joint", "&deg;C", "load", "V", "silent")
    head = "".join(f"<th scope='col'>{name}</th>" for name in names)
    rows = "".join(_row(servos, i, name, name in estimated) for i, name in enumerate(joints))
    explained = (
        "amber: the guard slows the joint down; red: the joint is stopped, or the servo is silent or "
        "at fault. silent: ticks without an answer"
    )
    if estimated:
        explained += (
            f". {NO_FEEDBACK}: the servo reports neither position nor load; a joint that "
            "jams or a rod that came off is not noticed"
        )
    return (
        f"<div class='scroll'><table><thead><tr>{head}</tr></thead>"
        f"<tbody>{rows}</tbody></table></div>{note(explained)}"
    )


def _row(servos: Servos, i: int, joint: str, estimated: bool) -> str:
    silent = servos.unanswered[i] if servos.unanswered else None
    late: Strain = "over" if servos.age_s[i] > _OLD_S else ""
    figures = f"<td colspan='3' class='nothing'>{NO_FEEDBACK}</td>"
    if not estimated:
        warmth, load = _value_at(servos.temperature_c, i), _value_at(servos.load, i)
        volts = _value_at(servos.voltage_v, i)
        figures = (
            _cell("-" if warmth is None else f"{warmth:.0f}", strain_of_heat(servos, i))
            + _cell("-" if load is None else f"{100.0 * load:+.0f} %", strain_of_load(servos, i))
            + _cell("-" if volts is None else f"{volts:.1f}", strain_of_voltage(servos, i))
        )
    said = "torque off" if servos.torque and not servos.torque[i] else ""
    if joint in servos.limp:
        said = "limp, as idle"
    if servos.fault and servos.fault[i]:
        said = servos.fault[i]
    elif late:
        said = f"silent for {min(servos.age_s[i], 999.0):.1f} s"
    more = f"<div class='{'fault' if said not in ('torque off', 'limp, as idle') else 'quiet'}'>{escape(said)}</div>"
    return (
        f"<tr><th scope='row'>{escape(joint.replace('_', ' '))}"
        f"{more if said else ''}</th>{figures}"
        f"{_cell('-' if silent is None else str(silent), late)}</tr>"
    )


def strain_of_heat(servos: Servos, i: int) -> Strain:
    """Return the relation of a servo's temperature to the limits of the guard."""
    warmth, limits = _value_at(servos.temperature_c, i), servos.limits
    if warmth is None or limits is None:
        return ""
    return "over" if warmth >= limits.hot_c[i] else "near" if warmth >= limits.warm_c[i] else ""


def strain_of_load(servos: Servos, i: int) -> Strain:
    """Return the relation of a servo's load to its continuous limit."""
    load, limits = _value_at(servos.load, i), servos.limits
    if load is None or limits is None:
        return ""
    return "over" if abs(load) >= _HARD_LOAD else "near" if abs(load) > limits.heavy[i] else ""


def strain_of_voltage(servos: Servos, i: int) -> Strain:
    """Return the relation of a servo's voltage to its limits."""
    volts, limits = _value_at(servos.voltage_v, i), servos.limits
    if volts is None or limits is None:
        return ""
    return "" if limits.low_v[i] <= volts <= limits.high_v[i] else "near"


def _timing(timing: LoopFigures | None) -> str:
    """Return the timing of the loop."""
    if timing is None:
        return note("the loop's times are not known yet")
    period_ms = 1e3 / timing.rate_hz if timing.rate_hz > 0.0 else 0.0
    late: Strain = "near" if timing.worst_ms > _LATE_SHARE * period_ms else ""
    over: Strain = "near" if timing.overruns else ""
    names = ("rate", "p50", "p99", "worst", "overruns")
    head = "".join(f"<th scope='col'>{name}</th>" for name in names)
    cells = (
        _cell(f"{timing.rate_hz:.1f} Hz", ""),
        _cell(f"{timing.p50_ms:.2f} ms", ""),
        _cell(f"{timing.p99_ms:.2f} ms", ""),
        _cell(f"{timing.worst_ms:.2f} ms", late),
        _cell(str(timing.overruns), over),
    )
    said = (
        f"off the slots, over the last {timing.over_s:.0f} s; "
        f"{timing.overruns_ever} slots overrun since the start"
    )
    return (
        f"<div class='scroll'><table><thead><tr>{head}</tr></thead>"
        f"<tbody><tr>{''.join(cells)}</tr></tbody></table></div>{note(said)}"
    )


def _cell(text: str, strain: Strain) -> str:
    return f"<td class='{strain}'>{text}</td>" if strain else f"<td>{text}</td>"


def _value_at(column: tuple[float | None, ...], i: int) -> float | None:
    return column[i] if column else None


_REASONS_SHOWN = 4
_STANDS_STILL = {
    "hold": "guard: hold - joints are held where they are",
    "torque_off": "guard: torque off - joints are released",
}
OLD_FRAME_S = 0.5
"""Age above which a frame is old, s; the guard stops the neck at three times that age."""


def alarms(snapshot: Snapshot) -> str:
    """Return banners for held joints and an old frame, "" without faults.

    The stop button shows that the rig is stopped.
    """
    said, kind = "", LEVELS[snapshot.level]
    if not snapshot.stopped and snapshot.level in ("hold", "torque_off"):
        reasons = snapshot.reasons
        more = len(reasons) - _REASONS_SHOWN
        said += banner(
            _STANDS_STILL[snapshot.level],
            kind,
            reasons[:_REASONS_SHOWN] + ((f"and {more} more",) if more > 0 else ()),
        )
    if snapshot.frame_age_s is not None and snapshot.frame_age_s >= OLD_FRAME_S:
        said += banner(f"the frame is {snapshot.frame_age_s:.1f} s old", "hold")
    return said


def no_data_text() -> str:
    """Return a message that the rig sends no data."""
    return note("silent: the rig has sent nothing for a second; the page shows the last data")


def group_reasons(reasons: tuple[str, ...]) -> str:
    """Return each reason once, with its first joint and the number of others.

    For example "too fast (neck_yaw, +2)": the text stays short, so that a brief limitation does not
    move the elements below it.
    """
    joints: dict[str, list[str]] = {}
    for reason in reasons:
        joint, _, why = reason.partition(": ")
        joints.setdefault(why, []).append(joint)
    return ", ".join(
        f"{why} ({named[0]}{f', +{len(named) - 1}' if len(named) > 1 else ''})"
        for why, named in joints.items()
    )


def one_line(text: str) -> str:
    """Return text that is cut off at the panel's edge, with the full text as tooltip."""
    said = escape(text)
    return f"<div class='line' title='{said}'>{said}</div>"


def no_feedback_note(snapshot: Snapshot) -> str:
    """Return the number of joints without position feedback, "" if all are measured."""
    estimated = snapshot.estimated
    if not estimated:
        return ""
    torque = dict(zip(snapshot.joints, snapshot.servos.torque, strict=False))
    without_torque = sum(not torque.get(joint, True) for joint in estimated)
    where = "shown where they should be"
    if without_torque:  # a finger can move them without being measured
        where += f"; {'all' if without_torque == len(estimated) else without_torque} without torque: may be anywhere"
    return (
        f"<div class='warn'>{len(estimated)} of "
        f"{count_text(len(snapshot.joints), 'joint')} without feedback: {where}</div>"
    )
