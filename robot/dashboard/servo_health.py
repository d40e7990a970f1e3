"""The machine's health: guard, loop and frame in a few lines, every servo in a table."""

from html import escape
from typing import Literal

from gazerig.robot.dashboard.html import AMBER, GREEN, GREY, LEVELS, RED, frame, heading, note, pill
from gazerig.robot.dashboard.status import OLD_FRAME_S
from gazerig.robot.model.types import LoopFigures, Servos, Snapshot

Strain = Literal["", "near", "over"]
"""How a figure stands to its limit."""

_OLD_S = 0.15
_HARD_LOAD = 0.9
_LATE_SHARE = 0.5
_GROUNDS: dict[Strain, str] = {
    "": "",
    "near": f"background:{AMBER};color:#fff",
    "over": f"background:{RED};color:#fff;font-weight:700",
}  # noqa: E501
_TABLE = "width:100%;font-size:12px;border-collapse:collapse;line-height:1.55"
_RIGHT = "text-align:right;padding:0 4px"
_NOTHING = "text-align:center;padding:0 4px;opacity:.6;font-style:italic"

NO_FEEDBACK = "no feedback"
"""Said in the place of figures that a servo does not tell."""


def health(snapshot: Snapshot) -> str:
    """Return everything of the machine's health."""
    level = "stopped" if snapshot.stopped else snapshot.level
    reasons = (snapshot.stopped,) if snapshot.stopped else snapshot.reasons
    said = "".join(f"<div>{escape(reason)}</div>" for reason in reasons)
    return frame(
        f"<div style='min-height:3em'>{pill(f'guard: {level}', LEVELS[level])}{said}</div>"
        + heading("servos")
        + servo_table(snapshot.servos, snapshot.joints, snapshot.estimated)
        + heading("loop and frame")
        + _timing(snapshot.timing)
        + _frame(snapshot.frame_age_s)
        + f"<div>{escape(snapshot.health)}</div>"
        + f"<div style='opacity:.8;font-size:12px'>{escape(snapshot.perception)}</div>"
    )


def servo_table(servos: Servos, joints: tuple[str, ...], estimated: tuple[str, ...] = ()) -> str:
    """Return a row a joint: temperature, load, voltage, ticks without an answer, faults.

    estimated: joints whose servos tell nothing
    """
    if not servos.age_s:
        return note("nothing is known of the servos yet")
    names = ("", "&deg;C", "load", "V", "silent", "")
    head = "".join(f"<th style='font-weight:400;opacity:.7;{_RIGHT}'>{name}</th>" for name in names)
    rows = "".join(_row(servos, i, name, name in estimated) for i, name in enumerate(joints))
    explained = (
        "amber: the guard slows the joint down; red: it stands still, or the servo is silent or "
        "at fault. silent: ticks without an answer"
    )
    if estimated:
        explained += (
            f". {NO_FEEDBACK}: the servo tells nothing, neither where it is nor how it does; a "
            "joint that jams or a rod that came off is not noticed"
        )
    return f"<table style='{_TABLE}'><tr>{head}</tr>{rows}</table>{note(explained)}"


def _row(servos: Servos, i: int, joint: str, estimated: bool) -> str:
    silent = servos.unanswered[i] if servos.unanswered else None
    late: Strain = "over" if servos.age_s[i] > _OLD_S else ""
    figures = f"<td colspan='3' style='{_NOTHING}'>{NO_FEEDBACK}</td>"
    said = _said(servos, i)
    colour = RED if said != "torque off" else GREY
    more = f"<div style='color:{colour};font-weight:600;font-size:11px'>{escape(said)}</div>"
    return (
        f"<tr style='border-top:1px solid #8882'><td>{escape(joint.replace('_', ' '))}"
        f"{more if said else ''}</td>{figures if estimated else _figures(servos, i)}"
        f"{_cell('-' if silent is None else str(silent), late)}<td></td></tr>"
    )


def _figures(servos: Servos, i: int) -> str:
    """Return temperature, load and voltage."""
    warmth, load, volts = (
        _at(servos.temperature_c, i),
        _at(servos.load, i),
        _at(servos.voltage_v, i),
    )
    return (
        _cell("-" if warmth is None else f"{warmth:.0f}", strain_of_heat(servos, i))
        + _cell("-" if load is None else f"{100.0 * load:+.0f} %", strain_of_load(servos, i))
        + _cell("-" if volts is None else f"{volts:.1f}", strain_of_voltage(servos, i))
    )


def _said(servos: Servos, i: int) -> str:
    """Return what is wrong with a servo."""
    if servos.fault and servos.fault[i]:
        return servos.fault[i]
    if servos.age_s[i] > _OLD_S:
        return f"silent for {min(servos.age_s[i], 999.0):.1f} s"
    return "torque off" if servos.torque and not servos.torque[i] else ""


def strain_of_heat(servos: Servos, i: int) -> Strain:
    """Return how a servo's temperature stands to what the guard bears."""
    warmth, limits = _at(servos.temperature_c, i), servos.limits
    if warmth is None or limits is None:
        return ""
    return "over" if warmth >= limits.hot_c[i] else "near" if warmth >= limits.warm_c[i] else ""


def strain_of_load(servos: Servos, i: int) -> Strain:
    """Return how a servo's load stands to what may last."""
    load, limits = _at(servos.load, i), servos.limits
    if load is None or limits is None:
        return ""
    return "over" if abs(load) >= _HARD_LOAD else "near" if abs(load) > limits.heavy[i] else ""


def strain_of_voltage(servos: Servos, i: int) -> Strain:
    """Return how a servo's voltage stands to its own limits."""
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
    head = "".join(f"<th style='font-weight:400;opacity:.7;{_RIGHT}'>{name}</th>" for name in names)
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
    return f"<table style='{_TABLE}'><tr>{head}</tr><tr>{''.join(cells)}</tr></table>{note(said)}"


def _frame(age_s: float | None) -> str:
    if age_s is None:
        return "<div>no frame yet</div>"
    colour = AMBER if age_s >= OLD_FRAME_S else GREEN
    return f"<div>frame <b style='color:{colour}'>{1e3 * age_s:.0f} ms</b> old</div>"


def _cell(text: str, strain: Strain) -> str:
    return f"<td style='{_RIGHT};{_GROUNDS[strain]}'>{text}</td>"


def _at(column: tuple[float | None, ...], i: int) -> float | None:
    return column[i] if column else None
