"""The state of the rig in a few lines, with faults emphasised."""

from html import escape

from gazerig.robot.dashboard.html import (
    AMBER,
    GREY,
    LEVELS,
    ORANGE,
    PHASES,
    RED,
    counted,
    frame,
    pill,
)
from gazerig.robot.model.types import Snapshot

_REASONS_SHOWN = 4
OLD_FRAME_S = 0.5
"""From this age on a frame is called old: the guard stops the neck at three times that."""


def status(snapshot: Snapshot) -> str:
    """Return what the rig does and what is wrong with it."""
    pills = (
        pill(snapshot.phase, PHASES.get(snapshot.phase, GREY))
        + (pill(snapshot.behaviour, GREY) if snapshot.behaviour else "")
        + (pill(snapshot.character, GREY) if snapshot.character else "")
        + f"<span style='float:right'>{snapshot.rate_hz:.0f} Hz</span>"
    )
    return frame(
        f"{_guard(snapshot)}{_old_frame(snapshot.frame_age_s)}"
        f"<div style='font-size:17px;font-weight:600'>{escape(snapshot.target_name)}</div>"
        f"<div style='opacity:.8;min-height:1.5em'>{escape(snapshot.why)}</div>"
        f"<div style='margin:6px 0'>{pills}</div>{_without_feedback(snapshot)}"
        f"<div style='opacity:.8'>{_one_line(snapshot.health)}</div>"
        f"<div style='opacity:.8'>{_one_line(snapshot.perception)}</div>"
    )


def silence() -> str:
    """Return a message that the rig sends nothing any more."""
    return frame(
        f"{pill('silent', GREY)}<div style='margin-top:6px'>nothing has come from the rig "
        "for a second; what is shown is the last that was seen</div>"
    )


def _guard(snapshot: Snapshot) -> str:
    """Return what the guard does; joints that are held are emphasised."""
    if snapshot.stopped:
        return _banner(f"STOPPED: {snapshot.stopped}; torque is off", (), RED)
    colour = LEVELS[snapshot.level]
    if snapshot.level in ("hold", "torque_off"):
        return _banner("guard: " + snapshot.level.replace("_", " "), snapshot.reasons, colour)
    return (
        f"<div style='display:flex;height:1.7em'>{pill(f'guard: {snapshot.level}', colour)}"
        f"<span style='color:{AMBER};min-width:0'>{_one_line(drawn_together(snapshot.reasons))}"
        "</span></div>"
    )


def drawn_together(reasons: tuple[str, ...]) -> str:
    """Return each reason once, with its first joint and the number of others.

    For example "too fast (neck_yaw, +2)": a limitation that lasts a moment must not move the
    image down under the user's finger.
    """
    joints: dict[str, list[str]] = {}
    for reason in reasons:
        joint, _, why = reason.partition(": ")
        joints.setdefault(why, []).append(joint)
    return ", ".join(
        f"{why} ({named[0]}{f', +{len(named) - 1}' if len(named) > 1 else ''})"
        for why, named in joints.items()
    )


def _one_line(text: str) -> str:
    """Cut words at the panel's edge; the mouse shows all of them."""
    said = escape(text)
    cut = "overflow:hidden;text-overflow:ellipsis;white-space:nowrap"
    return f"<div title='{said}' style='{cut}'>{said}</div>"


def _banner(text: str, reasons: tuple[str, ...], colour: str) -> str:
    return (
        f"<div style='background:{colour};color:#fff;border-radius:6px;padding:6px 10px;"
        f"margin-bottom:6px'><div style='font-size:16px;font-weight:700'>{escape(text)}</div>"
        f"{_reasons(reasons)}</div>"
    )


def _old_frame(age_s: float | None) -> str:
    if age_s is None or age_s < OLD_FRAME_S:
        return ""
    return _banner(f"the frame is {age_s:.1f} s old", (), ORANGE)


def _without_feedback(snapshot: Snapshot) -> str:
    """Return the number of joints without position feedback, "" if all are measured."""
    estimated = snapshot.estimated
    if not estimated:
        return ""
    torque = dict(zip(snapshot.joints, snapshot.servos.torque, strict=False))
    without_torque = sum(not torque.get(joint, True) for joint in estimated)
    where = "shown where they should be"
    if without_torque:  # a finger moves them, and no sensor sees it
        where += f"; {'all' if without_torque == len(estimated) else without_torque} without torque: may be anywhere"
    return (
        f"<div style='color:{AMBER}'>{len(estimated)} of "
        f"{counted(len(snapshot.joints), 'joint')} without feedback: {where}</div>"
    )


def _reasons(reasons: tuple[str, ...]) -> str:
    shown = "".join(f"<div>{escape(reason)}</div>" for reason in reasons[:_REASONS_SHOWN])
    more = len(reasons) - _REASONS_SHOWN
    return shown + (f"<div>and {more} more</div>" if more > 0 else "")
