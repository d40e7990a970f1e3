"""What is wrong with a Maestro and the channels of a rig, as far as its serial line tells.

Nothing moves. The board clears its error register when it tells it, so what it held is
among the findings. What a board does not tell is said as a note, with what to set in Pololu's
program. Source: Pololu Maestro User's Guide (0J40), sections 4.b, 4.e, 5.a and 5.e.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from gazerig.drivers.errors import PortError
from gazerig.drivers.hobby_board.models import US_STEPS
from gazerig.drivers.maestro.commands import MICRO, MOST_INPUT
from gazerig.drivers.maestro.line import Line
from gazerig.drivers.maestro.params import MaestroParams
from gazerig.drivers.maestro.probe import USB_CHANNELS, MaestroFound, probe
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_models import servo_label
from gazerig.drivers.types import ServoSetup
from gazerig.robot.bringup.doctor.diagnostics import BOARD, Diagnostic, Fix, Level
from gazerig.robot.bringup.maestro_settings import FACTORY_US, wide_range

WHERE = "the board"
SCRIPT = "script"
"""In place of a register: the board's own script runs (1) or not (0)."""

UNASKED = "was not asked: others give pulses, and were it not there, the board would send them home"
TIMEOUT = "serial timeout"
CURES = {
    "serial signal error": "something was sent at another baud rate, or the line is disturbed: "
    "compare bus.maestro.baud with Pololu's program, check ground and cable",
    "serial overrun": "the board could not follow: restart it, and report it if it comes again",
    "serial buffer full": "too much was sent at once: is another program using the board?",
    "serial CRC error": "check bytes were wrong: set bus.maestro.crc as 'Enable CRC' in Pololu's "
    "program, check the cable",
    "serial protocol error": "it was sent what it does not know: another program, another protocol "
    "or a disturbed line",
    TIMEOUT: "no commands came for longer than its timeout, so its channels went home, as they "
    "should while no program runs",
    "script stack error": "its script is at fault: delete it in Pololu's program",
    "script call stack error": "its script is at fault: delete it in Pololu's program",
    "script program counter error": "its script is at fault: delete it in Pololu's program",
}


@dataclass(frozen=True)
class Board:
    """A board as found, and what the rig says of it.

    found: None where none answers; usb: vendor and product id of its port, "" unless on USB
    pulses: by channel, quarter microseconds, None where it kept silent; channels that were
        not asked are missing
    """

    params: MaestroParams
    setups: Sequence[ServoSetup]
    found: MaestroFound | None
    usb: str
    pulses: Mapping[int, int | None]

    @property
    def size(self) -> int | None:
        """Return its number of channels, None where it is not known."""
        return USB_CHANNELS.get(self.usb)


def visit(
    port: BusPort, params: MaestroParams, setups: Sequence[ServoSetup], usb: str
) -> list[Diagnostic]:
    """Ask a board for all it tells and judge it; nothing moves.

    Raises:
        PortError: the port cannot be opened.
        BusLost: it has gone away.
    """
    return examine(take(port, params, setups, usb))


def take(port: BusPort, params: MaestroParams, setups: Sequence[ServoSetup], usb: str) -> Board:
    """Ask a board for all it tells.

    A channel that is not there is an error to a board, on which it sends all channels home:
    those that cannot be there are not asked for, nor, while any gives pulses, those beyond
    the six that every board has, unless its size is known.

    Raises:
        PortError: the port cannot be opened.
        BusLost: it has gone away.
    """
    found = probe(port, params)
    if found is None:
        return Board(params, setups, None, usb, {})
    line, size = Line(port, _spoken(params, found)), USB_CHANNELS.get(usb, params.channels)
    pulses: dict[int, int | None] = {}
    sure = MICRO if any(found.pulses) and usb not in USB_CHANNELS else size
    for channel in sorted(setup.id for setup in setups):
        if sure <= channel < size:
            continue
        silent = None in pulses.values()
        heard = None if silent or channel >= size else line.pulses((channel,))
        pulses[channel] = None if heard is None else heard[0]
    if None in pulses.values():
        # What it did not understand is in its register now, and is no fault.
        line.greet()
    return Board(params, setups, found, usb, pulses)


def _spoken(params: MaestroParams, found: MaestroFound) -> MaestroParams:
    """Return how to speak to a board that was found, whatever the rig says."""
    form = params.protocol if params.protocol in found.forms else found.forms[0]
    return replace(params, protocol=form, crc=found.crc)


def examine(board: Board) -> list[Diagnostic]:
    """Judge a board: all that is wrong; one finding says it where it is well."""
    if board.found is None:
        return [_mute(board)]
    findings = [*_speech(board, board.found), *_state(board.found), *_channels(board)]
    if not any(finding.level in ("warn", "error") for finding in findings):
        findings.insert(0, Diagnostic("ok", _well(board, board.found), WHERE))
    return [*findings, *_untold(board)]


def _well(board: Board, found: MaestroFound) -> str:
    size = f"{board.size} channels" if board.size else f"{board.params.channels} channels assumed"
    given = sum(1 for pulse in board.pulses.values() if pulse)
    return (
        f"answers in the {' and the '.join(found.forms)} form, CRC {'on' if found.crc else 'off'}, "
        f"{size}, no script; pulses on {given} of {len(board.pulses)} channels"
    )


def _mute(board: Board) -> Diagnostic:
    params = board.params
    if board.usb in USB_CHANNELS:
        cure = (
            "take the first of its two ports (the Command Port), and set it to 'USB Dual Port' in "
            "Pololu's program"
        )
    else:
        cure = (
            "has it power? on USB take the first of its two ports and set it to 'USB Dual Port' "
            f"in Pololu's program; on its serial pins check TX, RX, ground and {params.baud} bit/s"
        )
    return Diagnostic("error", f"no Maestro answers at {params.baud} bit/s", WHERE, cure)


def _speech(board: Board, found: MaestroFound) -> Iterator[Diagnostic]:
    """Judge how it wants to be spoken to."""
    params = board.params
    if params.protocol not in found.forms:
        number = (
            f"its device number is not {params.device}; " if params.protocol == "pololu" else ""
        )
        yield Diagnostic(
            "error",
            f"answers the {found.forms[0]} form only, the YAML says {params.protocol}",
            WHERE,
            f"{number}write bus.maestro.protocol: {found.forms[0]}, or set the device number",
        )
    if found.crc != params.crc:
        says = "wants a check byte (CRC) after every command" if found.crc else "wants no CRC"
        yield Diagnostic(
            "error",
            f"{says}, the YAML says crc: {str(params.crc).lower()}",
            WHERE,
            f"write bus.maestro.crc: {str(found.crc).lower()}, or change 'Enable CRC' in Pololu's "
            "program",
        )
    if board.size is not None and board.size != params.channels:
        yield Diagnostic(
            "error",
            f"has {board.size} channels, the YAML says {params.channels}",
            WHERE,
            f"write bus.maestro.channels: {board.size}",
        )


def _state(found: MaestroFound) -> Iterator[Diagnostic]:
    """Judge its errors and its script."""
    for name in found.errors:
        cure = CURES.get(name, "look it up in Pololu's guide")
        # Where a timeout is set every pause between two programs is one.
        level: Level = "note" if name == TIMEOUT else "warn"
        yield Diagnostic(level, f"held an error, cleared now: {name}", WHERE, cure)
    if found.script:
        yield Diagnostic(
            "warn",
            "runs a script of its own, which may move servos against the program",
            WHERE,
            "gazerig doctor --fix stops it; for good delete it in Pololu's program",
            (Fix(BOARD, SCRIPT, 0, 1),),
        )


def _channels(board: Board) -> Iterator[Diagnostic]:
    """Judge every channel of the rig."""
    size = board.size or board.params.channels
    for setup in board.setups:
        pulse, where = board.pulses.get(setup.id), servo_label(setup)
        if setup.id >= size:
            says, cure = f"the board has channels 0..{size - 1} only", "correct its id in the YAML"
        elif setup.id not in board.pulses:
            yield Diagnostic("note", UNASKED, where, "let all servos go limp and look again")
            continue
        elif pulse is None:
            says = "the board does not answer about this channel"
            cure = "has it so many channels? correct its id, or bus.maestro.channels"
        elif 0 < pulse <= MOST_INPUT:
            says, cure = "is an input", "set its channel to Servo in Pololu's program"
        elif pulse:
            yield from _pulse(setup, pulse, where)
            continue
        else:
            continue
        yield Diagnostic("error", says, where, cure)


def _pulse(setup: ServoSetup, pulse: int, where: str) -> Iterator[Diagnostic]:
    at = f"gets pulses of {pulse / US_STEPS:g} us though no program runs it"
    low, high = setup.min_steps / US_STEPS, setup.max_steps / US_STEPS
    if setup.min_steps <= pulse <= setup.max_steps:
        yield Diagnostic(
            "warn", at, where, "gazerig home ends with its pulses off; for good set 'On startup "
            "or error' to Off in Pololu's program",
        )  # fmt: skip
    else:
        yield Diagnostic(
            "error",
            f"{at}, outside its range {low:g}..{high:g} us",
            where,
            "switch the servo supply off; set 'On startup or error' to Off in Pololu's program",
        )


def _untold(board: Board) -> Iterator[Diagnostic]:
    """Say what no board tells, and what to do about it."""
    yield Diagnostic(
        "note",
        "hobby servos tell nothing: position, load, temperature and supply cannot be examined",
        "the servos",
    )
    wide = [setup for setup in board.setups if wide_range(setup)]
    for setup in wide:
        low, high = wide_range(setup) or FACTORY_US
        yield Diagnostic(
            "note",
            f"goes to {setup.min_steps / US_STEPS:g}..{setup.max_steps / US_STEPS:g} us, beyond "
            f"the {FACTORY_US[0]}..{FACTORY_US[1]} us of a new board, which cuts goals silently",
            servo_label(setup),
            f"set its Min to {low} and its Max to {high} in Pololu's program",
        )
    yield Diagnostic(
        "note",
        "its channels' own ranges and its serial timeout cannot be read over the serial line",
        WHERE,
        "gazerig setup lists what to set in Pololu's program, and tries the ranges out with the "
        "servo supply off; without a timeout servos hold when the program or the cable dies",
    )


def apply_fix(port: BusPort, params: MaestroParams, fix: Fix) -> str:
    """Stop the board's script; return "" or why it was not done. Nothing moves.

    Raises:
        PortError: the port cannot be opened.
        BusLost: it has gone away.
    """
    found = probe(port, params)
    if found is None:
        raise PortError(f"{port.port_name}: no Maestro answers: gazerig doctor names the cure")
    line = Line(port, _spoken(params, found))
    line.send(line.speech.stop_script())
    return "" if line.ask(line.speech.script_status(), 1) == b"\1" else "it runs on"
