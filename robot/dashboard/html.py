"""Colours and small pieces of HTML and SVG that the page's panels share."""

from collections.abc import Iterable
from html import escape

GREEN, AMBER, ORANGE, RED, BLUE, GREY = (
    "#2b8a5a", "#d9830a", "#e8590c", "#c92a2a", "#1c7ed6", "#868e96",
)  # fmt: skip
PALE = "#dee2e6"
PALE_BLUE = "#74b0e4"
INK = "#343a40"

PHASES = {"fixate": GREEN, "saccade": ORANGE, "pursue": BLUE, "blink": GREY}
LEVELS = {"ok": GREEN, "limited": AMBER, "hold": ORANGE, "torque_off": RED, "stopped": RED}
PARTS = {
    "DN": "#8d6e63",
    "FL": "#9c36b5",
    "LE": "#1c7ed6",
    "M": "#e03131",
    "N": "#f08c00",
    "FR": "#6741d9",
    "RE": "#0c8599",
    "UP": "#5c940d",
}
"""A colour for every part of the face."""
TARGETS = {"face": "#4263eb", "hand": "#c2255c", "puppet": "#ae3ec9", "idle": "#adb5bd"}
OTHER_TARGET = "#2f9e44"

LINE_PX = 320
"""Width in which the panels are drawn; they are scaled to the width that there is."""


def frame(inner: str) -> str:
    """Return HTML with the panel's margins."""
    return f"<div style='padding:4px 12px;font-size:13px;line-height:1.5'>{inner}</div>"


def pill(text: str, colour: str) -> str:
    """Return words on a coloured ground."""
    return (
        f"<span style='background:{colour};color:#fff;border-radius:9px;padding:0 9px;"
        f"margin:1px 6px 1px 0;font-weight:600;display:inline-block'>{escape(text)}</span>"
    )


def heading(text: str, aside: str = "") -> str:
    """Return a line above a frame or table, with something smaller at its right end."""
    return (
        "<div style='font-size:12px;font-weight:600;margin-top:4px'>"
        f"<span style='float:right;font-weight:400;opacity:.7'>{escape(aside)}</span>"
        f"{escape(text)}</div>"
    )


def counted(n: int, what: str) -> str:
    """Return a number of things, e.g. "1 saccade", "2 saccades"."""
    return f"{n} {what}" if n == 1 else f"{n} {what}s"


def note(text: str) -> str:
    """Return a small line, for sources and explanations."""
    return f"<div style='font-size:11px;opacity:.75;line-height:1.35'>{escape(text)}</div>"


def svg(height: float, parts: Iterable[str]) -> str:
    """Return a drawing LINE_PX wide and as high as asked for, scaled to the panel's width."""
    return (
        f"<svg viewBox='0 0 {LINE_PX} {height:.0f}' width='100%' "
        f"style='display:block;font-family:inherit'>{''.join(parts)}</svg>"
    )


def box(x: float, y: float, width: float, height: float, colour: str, says: str = "") -> str:
    """Return a filled rectangle; ``says`` is shown under the mouse."""
    title = f"<title>{escape(says)}</title>" if says else ""
    return (
        f"<rect x='{x:.1f}' y='{y:.1f}' width='{max(width, 0.4):.1f}' height='{height:.1f}' "
        f"fill='{colour}'>{title}</rect>"
    )


def line(points: Iterable[tuple[float, float]], colour: str, wide: float = 1.0) -> str:
    """Return a line through points."""
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f"<polyline points='{path}' fill='none' stroke='{colour}' stroke-width='{wide}'/>"


def text(x: float, y: float, text: str, size: float = 10.0, anchor: str = "start") -> str:
    """Return words whose baseline begins, ends or is centred at a point."""
    return (
        f"<text x='{x:.1f}' y='{y:.1f}' font-size='{size}' text-anchor='{anchor}' "
        f"fill='currentColor'>{escape(text)}</text>"
    )
