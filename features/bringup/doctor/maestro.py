"""What is wrong with a Maestro and the channels of a rig, as far as its serial line tells.

Nothing moves. The board clears its error register when it tells it, so what it held is
among the findings. What a board does not tell is said as a note, with what to set in Pololu's
program. Source: Pololu Maestro User's Guide (0J40), sections 4.b, 4.e, 5.a and 5.e.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from gazerig.drivers.bus.servo_models import servo_label
from gazerig.drivers.errors import PortError
from gazerig.drivers.hobby_board.models import US_STEPS
from gazerig.drivers.maestro.commands import MICRO, MOST_INPUT
from gazerig.drivers.maestro.line import MaestroLink
from gazerig.drivers.maestro.params import MaestroParams
from gazerig.drivers.maestro.probe import USB_CHANNELS, DetectedMaestro, probe
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.doctor.board import WHERE, BoardRules, examine
from gazerig.features.bringup.doctor.diagnostics import BOARD, Diagnostic, Fix, Level
from gazerig.features.bringup.maestro_settings import FACTORY_US, wide_range

SCRIPT = "script"
"""In place of a register: the board's own script runs (1) or not (0)."""

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


RULES = BoardRules(
    most_input=MOST_INPUT,
    left_on="gazerig home ends with its pulses off; for good set 'On startup or error' to Off in "
    "Pololu's program",
    outside="switch the servo supply off; set 'On startup or error' to Off in Pololu's program",
    notes=(
        Diagnostic(
            "note",
            "its channels' own ranges and its serial timeout cannot be read over the serial line",
            WHERE,
            "gazerig setup lists what to set in Pololu's program, and tries the ranges out with "
            "the servo supply off; without a timeout servos hold when the program or the cable dies",
        ),
    ),
)


def visit(
    port: BusPort, params: MaestroParams, setups: Sequence[ServoConfig], usb: str
) -> list[Diagnostic]:
    """Read and check everything that a board reports; nothing moves.

    Args:
        port: opened here.
        params: how the rig says that it wants to be spoken to.
        setups: the servos of the rig.
        usb: vendor and product id of its port, "" unless on USB.

    Raises:
        PortError: the port cannot be opened.
        BusLost: it has gone away.
    """
    found, size = probe(port, params), USB_CHANNELS.get(usb)
    if found is None:
        return [_mute(params, size is not None)]
    channels = size or params.channels
    pulses = _pulses(
        MaestroLink(port, _spoken(params, found)), setups, channels, found, size is not None
    )
    crc = "on" if found.crc else "off"
    named = f"{channels} channels{'' if size else ' assumed'}"
    well = f"answers in the {' and the '.join(found.forms)} form, CRC {crc}, {named}, no script"
    own = [*_speech(params, found, size), *_state(found)]
    judged = examine(RULES, setups, pulses, channels, own, well)
    return [*judged[:-1], *_wide_ranges(setups), judged[-1]]


def _pulses(
    line: MaestroLink,
    setups: Sequence[ServoConfig],
    channels: int,
    found: DetectedMaestro,
    sized: bool,
) -> dict[int, int | None]:
    """Read the pulses of a rig's channels.

    A channel that is not there is an error to a board, on which it sends all channels home:
    those that cannot be there are not asked for, nor, while any gives pulses, those beyond
    the six that every board has, unless its size is known.
    """
    pulses: dict[int, int | None] = {}
    sure = MICRO if any(found.pulses) and not sized else channels
    for channel in sorted(setup.id for setup in setups):
        if sure <= channel < channels:
            continue
        silent = None in pulses.values()
        heard = None if silent or channel >= channels else line.pulses((channel,))
        pulses[channel] = None if heard is None else heard[0]
    if None in pulses.values():
        # What it did not understand is in its register now, and is no fault.
        line.greet()
    return pulses


def _spoken(params: MaestroParams, found: DetectedMaestro) -> MaestroParams:
    """Return how to speak to a board that was found, whatever the rig says."""
    form = params.protocol if params.protocol in found.forms else found.forms[0]
    return replace(params, protocol=form, crc=found.crc)


def _mute(params: MaestroParams, on_usb: bool) -> Diagnostic:
    port = (
        "the first of its two ports (the Command Port), and set it to 'USB Dual Port' in Pololu's"
    )
    cure = f"take {port} program"
    if not on_usb:
        pins = f"on its serial pins check TX, RX, ground and {params.baud} bit/s"
        cure = f"has it power? on USB {cure}; {pins}"
    return Diagnostic("error", f"no Maestro answers at {params.baud} bit/s", WHERE, cure)


def _speech(
    params: MaestroParams, found: DetectedMaestro, size: int | None
) -> Iterator[Diagnostic]:
    """Judge how it wants to be spoken to."""
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
    if size is not None and size != params.channels:
        yield Diagnostic(
            "error",
            f"has {size} channels, the YAML says {params.channels}",
            WHERE,
            f"write bus.maestro.channels: {size}",
        )


def _state(found: DetectedMaestro) -> Iterator[Diagnostic]:
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


def _wide_ranges(setups: Sequence[ServoConfig]) -> Iterator[Diagnostic]:
    """Return the joints whose range a new board's own limits would cut."""
    for setup in setups:
        if wide_range(setup) is None:
            continue
        low, high = wide_range(setup) or FACTORY_US
        yield Diagnostic(
            "note",
            f"goes to {setup.min_steps / US_STEPS:g}..{setup.max_steps / US_STEPS:g} us, beyond "
            f"the {FACTORY_US[0]}..{FACTORY_US[1]} us of a new board, which cuts goals silently",
            servo_label(setup),
            f"set its Min to {low} and its Max to {high} in Pololu's program",
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
    line = MaestroLink(port, _spoken(params, found))
    line.send(line.speech.stop_script())
    return "" if line.ask(line.speech.script_status(), 1) == b"\1" else "it runs on"
