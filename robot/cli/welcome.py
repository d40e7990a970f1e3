"""Next steps: shown for ``gazerig`` without arguments."""

from collections.abc import Iterable
from pathlib import Path

from gazerig.drivers.serial.list_ports import SerialPort

_BEGIN = (
    ("gazerig run --mock", "see a head look at a visitor in your browser; no hardware needed"),
    ("gazerig report --scene face-to-face", "how human that gaze is, as one HTML file"),
    ("gazerig new my.yaml", "a rig file of your own, from four questions"),
)


def next_steps(ports: Iterable[SerialPort], rigs: Iterable[Path], running: bool) -> str:
    """Return what makes sense now, as lines.

    ports: serial ports of this computer; rigs: rig files in this folder
    running: a rig runs on this computer already
    """
    usb = [port for port in ports if port.usb]
    own = next(iter(sorted(rigs)), None)
    lines = ["gazerig makes an animatronic head look at people. What next?", ""]
    if running:
        lines += _block(
            "A rig is running here:",
            (
                ("gazerig ctl get", "every parameter, and what is not saved yet"),
                ("gazerig ctl set gaze.blink... VALUE", "change one; gazerig ctl save keeps it"),
                ("gazerig stop", "torque off at once"),
            ),
        )
    lines += _block("Without hardware:", _BEGIN)
    if usb and own is None:
        lines += _block(
            f"A servo adapter is there ({usb[0].by_id or usb[0].device}):",
            (
                (f"gazerig scan --port {usb[0].device}", "which servos answer; changes nothing"),
                ("gazerig new my.yaml", "a rig file of your own, from four questions"),
            ),
        )
    elif own is not None:
        lines += _block(
            f"With your rig {own}:",
            (
                (f"gazerig check {own}", "is the file good?"),
                (
                    f"gazerig doctor {own}",
                    "are port and servos as it says? every fault with a cure",
                ),
                (f"gazerig run {own} --oak", "go"),
            ),
        )
    else:
        lines += ["No USB serial adapter is plugged in; docs/start.md tells which fit.", ""]
    lines.append("All commands: gazerig --help    one of them, with examples: gazerig run --help")
    return "\n".join(lines)


def _block(title: str, commands: Iterable[tuple[str, str]]) -> list[str]:
    rows = tuple(commands)
    width = max(len(command) for command, _ in rows)
    return [title, *(f"  {command:{width}}  {what}" for command, what in rows), ""]
