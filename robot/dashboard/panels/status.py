"""Short messages about faults of the rig, empty without any."""

from html import escape

from gazerig.robot.dashboard.widgets.html import LEVELS, banner, count_text, note
from gazerig.robot.model.types import Snapshot

_REASONS_SHOWN = 4
_STANDS_STILL = {
    "hold": "guard: hold - joints are held where they are",
    "torque_off": "guard: torque off - joints are released",
}
OLD_FRAME_S = 0.5
"""Age from which a frame is old, s; the guard stops the neck at three times that."""


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
    for other in snapshot.others:
        if other.level in _STANDS_STILL:
            said += banner(f"{other.name}: {other.headline}", LEVELS[other.level])
    return said


def other_heads(snapshot: Snapshot) -> str:
    """Return the activity of the other heads of the same world, one line each."""
    return "".join(one_line(f"{other.name}: {other.headline}") for other in snapshot.others)


def silence() -> str:
    """Return a message that the rig sends no data."""
    return note("silent: the rig has sent nothing for a second; the page shows the last data")


def group_reasons(reasons: tuple[str, ...]) -> str:
    """Return each reason once, with its first joint and the number of others.

    For example "too fast (neck_yaw, +2)": a short limitation must not move the elements below it.
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
    """Return text that is cut at the panel's edge, with all of it as tooltip."""
    said = escape(text)
    return f"<div class='line' title='{said}'>{said}</div>"


def without_feedback(snapshot: Snapshot) -> str:
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
        f"<div class='warn'>{len(estimated)} of "
        f"{count_text(len(snapshot.joints), 'joint')} without feedback: {where}</div>"
    )
