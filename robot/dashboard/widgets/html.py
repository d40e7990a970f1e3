"""Small pieces of HTML and SVG that the page's panels share.

Their CSS classes have colours in browser/panels.css, so that they fit both themes.
"""

from collections.abc import Iterable
from html import escape

PHASES = {"fixate": "ok", "saccade": "saccade", "pursue": "pursue", "blink": "calm"}
LEVELS = {
    "ok": "ok", "limited": "near", "hold": "hold", "torque_off": "alarm", "stopped": "alarm",
}  # fmt: skip
"""Names of colours of the gaze's phases and of the guard's levels."""
TARGETS = ("face", "hand", "puppet", "idle")
OTHER_TARGET = "other"
"""Names of colours of targets."""

LINE_PX = 320
"""Width in which drawings are made; they are scaled to the panel."""

LETTER_PX = 13.2
"""Font size in a drawing: 13 px in the narrowest drawer."""


def pill(text: str, kind: str = "") -> str:
    """Return text on a coloured background; kind: name of the colour."""
    return f"<span class='pill-word {escape(kind)}'>{escape(text)}</span>"


def chip(text: str) -> str:
    """Return text in a frame."""
    return f"<span class='chip'>{escape(text)}</span>"


def banner(text: str, kind: str, reasons: Iterable[str] = ()) -> str:
    """Return an emphasised message, with its reasons below."""
    lines = "".join(f"<div>{escape(reason)}</div>" for reason in reasons)
    return f"<div class='banner {escape(kind)}'><b>{escape(text)}</b>{lines}</div>"


def heading(text: str, aside: str = "") -> str:
    """Return a heading for a drawing or table, with smaller text at its right end."""
    return f"<div class='heading'>{escape(text)}<span>{escape(aside)}</span></div>"


def count_text(n: int, what: str) -> str:
    """Return a number of things, e.g. "1 saccade", "2 saccades"."""
    return f"{n} {what}" if n == 1 else f"{n} {what}s"


def note(text: str) -> str:
    """Return text in small type, for sources and explanations."""
    return f"<div class='note'>{escape(text)}</div>"


def svg(height: float, parts: Iterable[str], says: str) -> str:
    """Return a drawing of width LINE_PX, scaled to the panel; says: its text description."""
    return (
        f"<svg viewBox='0 0 {LINE_PX} {height:.0f}' role='img' aria-label='{escape(says)}'>"
        f"{''.join(parts)}</svg>"
    )


def box(x: float, y: float, width: float, height: float, colour: str, says: str = "") -> str:
    """Return a filled rectangle; colour: a name of panels.css; says: its tooltip."""
    title = f"<title>{escape(says)}</title>" if says else ""
    return (
        f"<rect x='{x:.1f}' y='{y:.1f}' width='{max(width, 0.4):.1f}' height='{height:.1f}' "
        f"fill='var(--{escape(colour)})'>{title}</rect>"
    )


def line(points: Iterable[tuple[float, float]], kind: str, dash: str = "") -> str:
    """Return a line through points; kind: grid, axis or mean."""
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    dashed = f" stroke-dasharray='{dash}'" if dash else ""
    return f"<polyline points='{path}' fill='none' class='svg-{kind}'{dashed}/>"


def text(x: float, y: float, text: str, anchor: str = "start", size: float = LETTER_PX) -> str:
    """Return text with a baseline that starts, ends or is centred at a point."""
    return (
        f"<text x='{x:.1f}' y='{y:.1f}' font-size='{size}' text-anchor='{anchor}' "
        f"class='svg-text'>{escape(text)}</text>"
    )
