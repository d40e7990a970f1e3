"""Draw docs/figures/stop.svg, the path of a STOP: python docs/figures/make_stop_picture.py."""

from html import escape
from pathlib import Path

PICTURE = Path(__file__).parent / "stop.svg"
WIDTH, HEIGHT = 946, 590
BOX_WIDTH, BOX_HEIGHT = 196, 46
COLUMNS = (12, 254, 496, 738)
"""Left edges: page, programs, signals, guardian."""

BOXES = {
    "page": (0, 40, "STOP button, space bar", "browser/stop.js"),
    "program": (1, 40, "gazerig stop, keys, Python", "RobotClient.stop"),
    "signal": (2, 40, "Ctrl-C, SIGTERM, SIGHUP", "Interrupts"),
    "death": (3, 40, "program killed, loop hangs", "guardian/heartbeat.py"),
    "door": (0, 116, "page process", "PageDoor, RigLink"),
    "server": (1, 116, "socket of the rig", "RemoteServer"),
    "loop": (2, 116, "control loop ends", "TickLoop.step"),
    "watch": (3, 116, "guardian process", "ProgramWatch"),
    "listener": (0, 192, "thread of the rig", "RemoteServer"),
    "handler": (1, 192, "thread of the client", "RequestHandler"),
    "park": (2, 192, "parking", "PowerDown, Robot.park"),
    "queue": (0.5, 286, "stops first, never refused", "CommandQueue.add"),
    "tick": (0.5, 362, "next tick, before reading", "CommandExecutor.execute"),
    "halt": (0.5, 438, "latch the stop", "StopControl.halt"),
    "end": (2, 438, "close the body", "Robot.stop, Body.stop"),
    "bus": (1, 524, "torque off on every port", "GuardedBus, PortBus"),
    "off": (2, 524, "write twice, read back", "switch_off"),
    "limp": (3, 524, "servos are limp", "no torque, no pulses"),
}
"""Name -> column, top edge, words, source."""

ARROWS = (
    *(("page", "door"), ("door", "listener"), ("listener", "queue")),
    *(("program", "server"), ("server", "handler"), ("handler", "queue")),
    *(("queue", "tick"), ("tick", "halt"), ("halt", "bus")),
    *(("signal", "loop"), ("loop", "park"), ("park", "end"), ("end", "bus")),
    *(("death", "watch"), ("watch", "limp"), ("bus", "off"), ("off", "limp")),
)


def place(name: str) -> tuple[float, float]:
    """Return the left and top edges of a box."""
    column, top, _, _ = BOXES[name]
    left = COLUMNS[0] + column * (COLUMNS[1] - COLUMNS[0])
    return left, top


def draw_box(name: str) -> str:
    """Return a box with its two lines of text."""
    left, top = place(name)
    _, _, words, source = BOXES[name]
    middle = left + BOX_WIDTH / 2
    return (
        f'<rect x="{left:g}" y="{top:g}" width="{BOX_WIDTH}" height="{BOX_HEIGHT}" rx="6"/>'
        f'<text x="{middle:g}" y="{top + 19:g}">{escape(words)}</text>'
        f'<text x="{middle:g}" y="{top + 36:g}" class="source">{escape(source)}</text>'
    )


def draw_arrow(start: str, end: str) -> str:
    """Return an arrow: to the right between boxes of one row, else down."""
    (left, top), (to_left, to_top) = place(start), place(end)
    if top == to_top:
        points = (left + BOX_WIDTH, top + BOX_HEIGHT / 2), (to_left - 2, top + BOX_HEIGHT / 2)
    else:
        points = (
            (left + BOX_WIDTH / 2, top + BOX_HEIGHT),
            (to_left + BOX_WIDTH / 2, to_top - 2),
        )
    (x0, y0), (x1, y1) = points
    return f'<line x1="{x0:g}" y1="{y0:g}" x2="{x1:g}" y2="{y1:g}"/>'


def main() -> None:
    """Write the picture."""
    style = (
        "text{font:13px sans-serif;text-anchor:middle;fill:#1d2733}"
        ".source{font:11.5px monospace;fill:#46586b}"
        "rect{fill:#eef3f8;stroke:#7d93a8}"
        "line{stroke:#46586b;stroke-width:1.5;marker-end:url(#head)}"
    )
    head = (
        '<marker id="head" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" '
        'orient="auto"><path d="M0 0 8 4 0 8z" fill="#46586b"/></marker>'
    )
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
        f'width="{WIDTH}" height="{HEIGHT}" role="img">',
        "<title>The path of a STOP from its four sources to the servos</title>",
        f"<style>{style}</style><defs>{head}</defs>",
        f'<rect width="{WIDTH}" height="{HEIGHT}" style="fill:#fff;stroke:none"/>',
        *(draw_arrow(*arrow) for arrow in ARROWS),
        *(draw_box(name) for name in BOXES),
        "</svg>",
    ]
    PICTURE.write_text("\n".join(parts) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
