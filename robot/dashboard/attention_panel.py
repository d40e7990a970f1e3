"""HTML of why the gaze is where it is: the winner, its salience by term, and the runners-up."""

from html import escape

from gazerig.gaze.types import Salience
from gazerig.robot.dashboard.html import BLUE, GREY, PALE, TARGETS, frame, heading, note, pill
from gazerig.robot.model.types import Snapshot

_TERMS = ("translation", "looming", "rotation", "onset", "rule")
_COLOURS = dict(zip(_TERMS, ("#4dabf7", "#845ef7", "#22b8cf", "#ff922b", "#37b24d"), strict=True))
_LEAST_FULL = 1.0
"""A bar as long as the panel stands for this salience, or for the highest where that is more."""


def winner(snapshot: Snapshot) -> str:
    """Return what is looked at, the reason, and what is in force."""
    return frame(
        f"<div style='font-size:15px;font-weight:600'>{escape(snapshot.target_name)}</div>"
        f"<div style='min-height:1.5em'>{escape(snapshot.why)}</div>"
        f"<div style='margin-top:4px'>{_in_force(snapshot)}</div>"
    )


def saliences(snapshot: Snapshot) -> str:
    """Return the saliences that were compared, term by term, the highest first."""
    return frame(_saliences(snapshot.saliences))


def _in_force(snapshot: Snapshot) -> str:
    named = (
        ("behaviour", snapshot.behaviour, BLUE),
        ("character", snapshot.character, GREY),
        ("conversation", snapshot.conversation, GREY),
    )
    return "".join(pill(f"{what}: {name}", colour) for what, name, colour in named if name)


def _saliences(rows: tuple[Salience, ...]) -> str:
    if not rows:
        return note("nothing is salient: the gaze wanders by itself")
    full = max(_LEAST_FULL, *(_sum(one) for one in rows), rows[0].total)
    bars = "".join(_row(one, full, winner=row == 0) for row, one in enumerate(rows))
    keys = "".join(
        f"<span style='white-space:nowrap;margin-right:8px'><span style='color:{colour}'>"
        f"&#9632;</span> {term}</span>"
        for term, colour in _COLOURS.items()
    )
    return (
        heading("salience, term by term", "habituation  total")
        + bars
        + f"<div style='font-size:11px;margin-top:4px'>{keys}</div>"
        + note(
            "translation, looming and rotation are motion across, along and about the line of "
            "sight (Mitake et al., eq 1); onset is having just come into view, rule the "
            "behaviour's constant, habituation the share that it leaves"
        )
    )


def _row(salience: Salience, full: float, *, winner: bool) -> str:
    """Return one body: its name and figures above a bar of its terms."""
    bars = "".join(
        f"<div title='{term} {getattr(salience, term):.2f}' style='background:{_COLOURS[term]};"
        f"width:{100.0 * max(0.0, getattr(salience, term)) / full:.1f}%'></div>"
        for term in _TERMS
    )
    figures = " ".join(
        f"{term} {getattr(salience, term):.2f}"
        for term in _TERMS
        if abs(getattr(salience, term)) >= 0.005
    )
    weight, edge = ("700", TARGETS["face"]) if winner else ("400", "transparent")
    return (
        f"<div style='border-left:3px solid {edge};padding-left:6px;margin:5px 0'>"
        f"<div style='font-weight:{weight}'>{escape(salience.kind)} {salience.id}"
        f"<span style='float:right'>{salience.habituation:.2f} &times;&ensp;{salience.total:.2f}</span></div>"
        f"<div style='display:flex;height:8px;background:{PALE}'>{bars}</div>"
        f"<div style='font-size:11px;opacity:.75'>{figures}</div></div>"
    )


def _sum(salience: Salience) -> float:
    return sum(max(0.0, term) for term in salience[2:7])
