"""HTML of the present target: the reason, and the salience of all candidates by term."""

from html import escape

from gazerig.gaze.types import Salience, body_name
from gazerig.robot.dashboard.widgets.html import PHASES, chip, heading, note, pill
from gazerig.robot.model.types import Snapshot

_TERMS = ("translation", "looming", "rotation", "onset", "rule")
_BECAUSE = {
    "translation": "moves",
    "looming": "comes nearer or goes away",
    "rotation": "turns",
    "onset": "has just come into view",
}
"""Term of the salience -> property of the body, as text."""
_LEAST_TOLD, _SHARE_TOLD = 0.005, 0.1
"""Smallest salience, and smallest share of the largest, of terms in the text."""
_LEAST_FULL = 1.0
"""Salience of a bar as wide as the panel; the highest salience if that is larger."""


def target_text(snapshot: Snapshot) -> str:
    """Return the target, the reason, and the present behaviour and plan as HTML."""
    talk = snapshot.talk.state
    named = (
        ("behaviour", snapshot.behaviour),
        ("plan", snapshot.plan.partition(":")[0]),
        ("character", snapshot.character),
        ("conversation", snapshot.conversation if talk == "idle" else talk),
    )
    chips = " ".join(chip(f"{what}: {name}") for what, name in named if name)
    return (
        f"<div class='big'>{escape(snapshot.target_name)}</div>"
        f"<div class='tall'>{escape(reason_text(snapshot))}</div>"
        f"<div class='in-force'>{pill(snapshot.phase, PHASES.get(snapshot.phase, 'calm'))} "
        f"{chips}</div>"
    )


def reason_text(snapshot: Snapshot) -> str:
    """Return the reason for the target as text, e.g. "because it moves (translation 0.38)".

    During manual control, or without saliences, return the rig's own reason.
    """
    if snapshot.control_source.overrides_gaze or not snapshot.saliences:
        return snapshot.why
    first = snapshot.saliences[0]
    most = max(first.translation, first.looming, first.rotation, first.onset)
    moves = ", ".join(
        f"{words} ({term} {getattr(first, term):.2f})"
        for term, words in _BECAUSE.items()
        if getattr(first, term) >= max(_LEAST_TOLD, _SHARE_TOLD * most)
    )
    action, _, because = snapshot.plan.partition(": ")
    named = action or snapshot.behaviour
    behaviour = f"behaviour {named}" if named else "behaviour"
    planned = f": {because}" if because else ""
    if first.rule < _LEAST_TOLD:
        return f"because it {moves}" if moves else snapshot.why
    if not moves:
        return f"because the {behaviour} asks for it ({first.rule:.2f}){planned}"
    return f"because it {moves}, and the {behaviour} adds {first.rule:.2f}{planned}"


def salience_bars(snapshot: Snapshot) -> str:
    """Return the saliences by term as HTML, the highest first."""
    if snapshot.control_source.overrides_gaze:
        return ""
    rows = snapshot.saliences
    if not rows:
        return note("nothing is salient: the gaze wanders")
    sums = [sum(max(0.0, getattr(one, term)) for term in _TERMS) for one in rows]
    full = max(_LEAST_FULL, *sums, rows[0].total)
    bars = "".join(_row(one, full, winner=row == 0) for row, one in enumerate(rows))
    keys = "".join(
        f"<span><span class='swatch term-{term}'></span>{term}</span>" for term in _TERMS
    )
    return (
        heading("salience, term by term", "habituation  total")
        + f"<div class='rows'>{bars}</div>"
        + f"<div class='key'>{keys}</div>"
        + note(
            "translation, looming and rotation are motion across, along and about the line of "
            "sight (Mitake et al., eq 1); onset is having just come into view, rule the "
            "behaviour's constant, habituation the share that it leaves"
        )
    )


def _row(salience: Salience, full: float, *, winner: bool) -> str:
    """Return the row of one body: its name and values above a bar of its terms."""
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
        f"<div><span>{escape(body_name(salience.kind, salience.id))}</span>"
        f"<span>{salience.habituation:.2f} &times;&ensp;{salience.total:.2f}</span></div>"
        f"<div class='bar' aria-hidden='true'>{bars}</div>"
        f"<div class='small'>{figures}</div></div>"
    )
