"""Command emulate: servos on a pseudo-terminal, which any program can open."""

import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace

import typer

from gazerig.config.schema import load_rig
from gazerig.drivers.bus.servo_models import BusKind
from gazerig.drivers.errors import SetupError
from gazerig.robot.app.run_bus import emulated_lines
from gazerig.robot.cli import emulate_options as options
from gazerig.robot.cli.rig_command import RigCommand
from gazerig.robot.cli.terminal import clear_errors
from gazerig.sim_mock.device_cases import CASES
from gazerig.sim_mock.device_spec import EXAMPLE, line_of
from gazerig.sim_mock.devices import BAUDS, CHANNELS, Emulated, MaestroLine, Pca9685Line, PluginLine
from gazerig.sim_mock.pty.line import BusSettings
from gazerig.sim_mock.pty.server import ServerSettings, run
from gazerig.sim_mock.pty.server import say as say_line

app = typer.Typer()

_KNOWN_BY: dict[BusKind, str] = {
    "dynamixel": "servos know",
    "feetech": "STS servos support",
}
"""Text before the supported baud rates of smart servos."""


@app.command(cls=RigCommand)
def emulate(
    rig: options.Rig = None,
    servos: options.Servos = None,
    maestro: options.Maestro = None,
    pca9685: options.Pca9685 = None,
    link: options.Link = None,
    baud: options.Baud = None,
    any_baud: options.AnyBaud = False,
    wire_time: options.WireTime = False,
    turnaround_us: options.TurnaroundUs = 0.0,
    firmware: options.Firmware = None,
    crc: options.Crc = False,
    case: options.Case = None,
    until_eof: options.UntilEof = False,
) -> None:
    """Emulate servos on a pseudo-terminal; print its path as JSON and accept fault commands.

    Type `help` for the commands; Ctrl-C ends it.
    """
    with clear_errors(rig):
        if sum(one is not None for one in (servos, maestro, pca9685, rig)) != 1:
            raise SetupError(
                f"name a rig, or its servos: --servos {EXAMPLE}, --maestro 12 or --pca9685 0x40"
            )
        if maestro is not None and firmware is not None:
            raise SetupError("--firmware: a Maestro does not report its version on this line")
        if maestro is None and crc:
            raise SetupError("--crc: only with --maestro")
        if servos is not None:
            devices: Mapping[str, Emulated] = {"": line_of(servos, firmware, options.DEFAULT_BAUD)}
        elif maestro is not None:
            if maestro not in CHANNELS:
                sizes = ", ".join(map(str, CHANNELS))
                raise SetupError(f"--maestro {maestro}: a board has {sizes} channels")
            devices = {"": MaestroLine(maestro, crc)}
        elif pca9685 is not None:
            devices = {"": _parse_boards(pca9685)}
        else:
            devices = _rig_devices(rig or "", firmware)
        several = len(devices) > 1
        if baud is not None and several:
            raise SetupError("--baud: the buses of this rig have their own rates; see its file")
        buses = [
            BusSettings(
                _set_baud(device, baud, any_baud),
                name if several else None,
                wire_time,
                turnaround_us,
                None if link is None else f"{link}-{name}" if name else str(link),
            )
            for name, device in devices.items()
        ]
        served = ServerSettings(_apply_choices(buses, case or []), until_eof)
        try:
            run(served, _print_answer if sys.stdout.isatty() else say_line, heed_ctrl_c=True)
        except ValueError as error:
            raise SetupError(str(error)) from None


def _parse_boards(text: str) -> Pca9685Line:
    try:
        return Pca9685Line(tuple(int(one, 16) for one in text.split(",")))
    except ValueError:
        raise SetupError(
            f"--pca9685 {text}: not addresses in hexadecimal, such as 0x40 or 0x40,0x41"
        ) from None


def _rig_devices(name: str, firmware: int | None) -> dict[str, Emulated]:
    """Return the devices on every bus of a rig by the bus's name, "" for a single bus."""
    lines = emulated_lines(load_rig(name))
    for bus, line in lines.items():
        if firmware is not None and not isinstance(line, MaestroLine | Pca9685Line | PluginLine):
            servos = tuple(servo._replace(firmware=firmware) for servo in line.servos)
            lines[bus] = replace(line, servos=servos)
    return lines if len(lines) > 1 else dict(zip(("",), lines.values(), strict=True))


def _set_baud(device: Emulated, baud: int | None, any_baud: bool) -> Emulated:
    """Return a device with another baud rate; None keeps its own rate."""
    if isinstance(device, MaestroLine | Pca9685Line | PluginLine):
        return device
    known = BAUDS[device.kind]
    if baud is not None and baud not in known:
        rates = ", ".join(map(str, known))
        raise SetupError(f"--baud {baud}: {_KNOWN_BY[device.kind]} {rates}")
    if baud is None and not any_baud:
        return device
    return replace(device, baud=None if any_baud else baud)


def _apply_choices(buses: Sequence[BusSettings], given: Sequence[str]) -> tuple[BusSettings, ...]:
    """Return every bus with the settings that its kind supports."""
    known = {case: None for bus in buses for case in CASES.get(bus.device.kind, {})}
    choices = {}
    for text in given:
        name, _, value = text.partition("=")
        if not name or not value:
            raise SetupError(f"--set {text}: not CASE=VALUE; cases: {', '.join(known)}")
        if name.replace("_", "-") not in known:
            raise SetupError(f"--set {text}: unknown case; available: {', '.join(known)}")
        choices[name.replace("_", "-")] = value
    return tuple(
        replace(
            bus, choices={k: v for k, v in choices.items() if k in CASES.get(bus.device.kind, {})}
        )
        for bus in buses
    )


def _print_answer(line: str) -> None:
    """Print an answer; on a terminal, long texts are printed as they are, not as JSON."""
    answer = json.loads(line)
    text = answer.get("ok", answer.get("error", ""))
    print(text if "\n" in text else line, flush=True)
