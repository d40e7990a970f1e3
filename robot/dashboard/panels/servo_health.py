"""Health of the rig: guard, loop and frame in a few lines, every servo in a table."""

from html import escape
from typing import Literal

from gazerig.robot.dashboard.panels.status import (
    OLD_FRAME_S,
    group_reasons,
    one_line,
    without_feedback,
)
from gazerig.robot.dashboard.widgets.html import LEVELS, heading, note, pill
from gazerig.robot.model.types import LoopFigures, Servos, Snapshot

Strain = Literal["", "near", "over"]
"""Relation of a value to its limit."""

_OLD_S = 0.15
_HARD_LOAD = 0.9
_LATE_SHARE = 0.5

NO_FEEDBACK = "no feedback"
"""Text in the place of values that a servo does not report."""


def health(snapshot: Snapshot) -> str:
    """Return the health of the rig as HTML."""
    return (
        guard(snapshot)
        + heading("servos")
        + without_feedback(snapshot)
        + servo_table(snapshot.servos, snapshot.joints, snapshot.estimated)
        + f"<div>{escape(snapshot.health)}</div>"
        + heading("loop")
        + _timing(snapshot.timing)
        + heading("camera")
        + _frame(snapshot.frame_age_s)
        + f"<div>{escape(_without_frame_age(snapshot.perception))}</div>"
    )


def guard(snapshot: Snapshot) -> str:
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
        warmth, load = _at(servos.temperature_c, i), _at(servos.load, i)
        volts = _at(servos.voltage_v, i)
        figures = (
            _cell("-" if warmth is None else f"{warmth:.0f}", strain_of_heat(servos, i))
            + _cell("-" if load is None else f"{100.0 * load:+.0f} %", strain_of_load(servos, i))
            + _cell("-" if volts is None else f"{volts:.1f}", strain_of_voltage(servos, i))
        )
    said = "torque off" if servos.torque and not servos.torque[i] else ""
    if servos.fault and servos.fault[i]:
        said = servos.fault[i]
    elif late:
        said = f"silent for {min(servos.age_s[i], 999.0):.1f} s"
    more = f"<div class='{'fault' if said != 'torque off' else 'quiet'}'>{escape(said)}</div>"
    return (
        f"<tr><th scope='row'>{escape(joint.replace('_', ' '))}"
        f"{more if said else ''}</th>{figures}"
        f"{_cell('-' if silent is None else str(silent), late)}</tr>"
    )


def strain_of_heat(servos: Servos, i: int) -> Strain:
    """Return the relation of a servo's temperature to the limits of the guard."""
    warmth, limits = _at(servos.temperature_c, i), servos.limits
    if warmth is None or limits is None:
        return ""
    return "over" if warmth >= limits.hot_c[i] else "near" if warmth >= limits.warm_c[i] else ""


def strain_of_load(servos: Servos, i: int) -> Strain:
    """Return the relation of a servo's load to its continuous limit."""
    load, limits = _at(servos.load, i), servos.limits
    if load is None or limits is None:
        return ""
    return "over" if abs(load) >= _HARD_LOAD else "near" if abs(load) > limits.heavy[i] else ""


def strain_of_voltage(servos: Servos, i: int) -> Strain:
    """Return the relation of a servo's voltage to its limits."""
    volts, limits = _at(servos.voltage_v, i), servos.limits
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


def _without_frame_age(perception: str) -> str:
    """Return the text about perception without the frame's age, which has its own line."""
    first, _, others = perception.partition(" | ")
    return others if first.startswith(("frame ", "no frame")) else perception


def _frame(age_s: float | None) -> str:
    if age_s is None:
        return "<div>no frame yet</div>"
    kind = " class='warn'" if age_s >= OLD_FRAME_S else ""
    return f"<div>frame <b{kind}>{1e3 * age_s:.0f} ms</b> old</div>"


def _cell(text: str, strain: Strain) -> str:
    return f"<td class='{strain}'>{text}</td>" if strain else f"<td>{text}</td>"


def _at(column: tuple[float | None, ...], i: int) -> float | None:
    return column[i] if column else None
