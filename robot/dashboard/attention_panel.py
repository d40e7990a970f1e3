"""HTML of why the gaze is where it is: the winner, its salience by term, and the runners-up."""

from html import escape

from gazerig.gaze.types import Salience
from gazerig.robot.dashboard.html import PHASES, chip, heading, note, pill
from gazerig.robot.model.types import Snapshot

_TERMS = ("translation", "looming", "rotation", "onset", "rule")
_LEAST_FULL = 1.0
"""A bar as long as the panel stands for this salience, or for the highest where that is more."""


def winner(snapshot: Snapshot) -> str:
    """Return what is looked at, the reason, and what is in force."""
    return (
        f"<div class='big'>{escape(snapshot.target_name)}</div>"
        f"<div class='tall'>{escape(snapshot.why)}</div>"
        f"<div>{pill(snapshot.phase, PHASES.get(snapshot.phase, 'calm'))}{_in_force(snapshot)}</div>"
    )


def saliences(snapshot: Snapshot) -> str:
    """Return the saliences that were compared, term by term, the highest first."""
    return "" if snapshot.leader.led else _saliences(snapshot.saliences)


def _in_force(snapshot: Snapshot) -> str:
    named = (
        ("behaviour", snapshot.behaviour),
        ("character", snapshot.character),
        ("conversation", snapshot.conversation),
    )
    return "".join(chip(f"{what}: {name}") for what, name in named if name)


def _saliences(rows: tuple[Salience, ...]) -> str:
    if not rows:
        return note("nothing is salient: the gaze wanders by itself")
    full = max(_LEAST_FULL, *(_sum(one) for one in rows), rows[0].total)
    bars = "".join(_row(one, full, winner=row == 0) for row, one in enumerate(rows))
    keys = "".join(
        f"<span><span class='swatch term-{term}'></span>{term}</span>" for term in _TERMS
    )
    return (
        heading("salience, term by term", "habituation  total")
        + bars
        + f"<div class='key'>{keys}</div>"
        + note(
            "translation, looming and rotation are motion across, along and about the line of "
            "sight (Mitake et al., eq 1); onset is having just come into view, rule the "
            "behaviour's constant, habituation the share that it leaves"
        )
    )


def _row(salience: Salience, full: float, *, winner: bool) -> str:
    """Return one body: its name and figures above a bar of its terms."""
    bars = "".join(
        f"<div class='term-{term}' "
        f"style='width:{100.0 * max(0.0, getattr(salience, term)) / full:.1f}%'></div>"
        for term in _TERMS
    )
    figures = " ".join(
        f"{term} {getattr(salience, term):.2f}"
        for term in _TERMS
        if abs(getattr(salience, term)) >= 0.005
    )
    return (
        f"<div class='body{' first' if winner else ''}'>"
        f"<div><span>{escape(salience.kind)} {salience.id}</span>"
        f"<span>{salience.habituation:.2f} &times;&ensp;{salience.total:.2f}</span></div>"
        f"<div class='bar' aria-hidden='true'>{bars}</div>"
        f"<div class='small'>{figures}</div></div>"
    )


def _sum(salience: Salience) -> float:
    return sum(max(0.0, term) for term in salience[2:7])
