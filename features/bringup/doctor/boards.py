"""Faults of a board of hobby servos and the channels of a rig; nothing moves.

A Maestro clears its error register when it is read, so the stored errors are among the findings.
Settings that cannot be read over its serial line are a note with the setting for Pololu's program.
A PCA9685 keeps no errors; its registers are read, nothing is written. Sources: Pololu Maestro
User's Guide (0J40), sections 4.b, 4.e, 5.a and 5.e; NXP, PCA9685 data sheet, rev. 4.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from gazerig.drivers.bus.servo_models import US_STEPS, servo_label
from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.maestro.board import (
    MICRO,
    MOST_INPUT,
    USB_CHANNELS,
    DetectedMaestro,
    MaestroBoard,
    MaestroParams,
    probe,
)
from gazerig.drivers.pca9685.board import Pca9685Board, Pca9685Params
from gazerig.drivers.serial.port import BusPort, open_port
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.doctor.diagnostics import Advice, Diagnostic
from gazerig.features.bringup.maestro_settings import FACTORY_US, wide_range

WHERE = "the board"

TIMEOUT = "serial timeout"
_BAD_SCRIPT = "its script is at fault: delete it in Pololu's program"
# fmt: off
CURES = {
    "serial signal error": "something was sent at another baud rate, or the line is disturbed: "
        "check ground and cable",
    "serial overrun": "the board could not follow: restart it, and report it if it comes again",
    "serial buffer full": "too much was sent at once: is another program using the board?",
    "serial CRC error": "check bytes were wrong: set bus.maestro.crc as 'Enable CRC' in Pololu's "
        "program, check the cable",
    "serial protocol error":
        "it was sent what it does not know: another program, another protocol or a disturbed line",
    TIMEOUT: "no commands came for longer than its timeout, so its channels went home, as they "
        "should while no program runs",
    "script stack error": _BAD_SCRIPT,
    "script call stack error": _BAD_SCRIPT,
    "script program counter error": _BAD_SCRIPT,
}
# fmt: on

# fmt: off
ADVICE = {
    "no feedback": Advice("note",
        "hobby servos report nothing: position, load, temperature and supply cannot be examined"),
    "beyond": Advice("error", "the board has channels 0..{last} only",
        "correct its id in the YAML"),
    "not read": Advice("note",
        "was not read: others give pulses, and if it did not exist, the board would send them home",
        "stop the pulses of all servos and look again"),
    "silent": Advice("error", "the board does not answer about this channel",
        "does the board have this channel? correct its id, or bus.maestro.channels"),
    "input": Advice("error", "is an input", "set its channel to Servo in Pololu's program"),
    "left on": Advice("warn", "gets pulses of {us:g} us though no program runs it", "{remedy}"),
    "outside": Advice("error", "gets pulses of {us:g} us though no program runs it, outside its "
        "range {low:g}..{high:g} us", "{remedy}"),
    "mute": Advice("error", "no Maestro answers", "has it power? take the first of its two USB ports "
        "(the Command Port), and set it to 'USB Dual Port' in Pololu's program"),
    "CRC": Advice("error", "wants a check byte (CRC) after every command, the YAML says crc: false",
        "write bus.maestro.crc: true, or change 'Enable CRC' in Pololu's program"),
    "no CRC": Advice("error", "wants no CRC, the YAML says crc: true",
        "write bus.maestro.crc: false, or change 'Enable CRC' in Pololu's program"),
    "size": Advice("error", "has {size} channels, the YAML says {params.channels}",
        "write bus.maestro.channels: {size}"),
    "timeout": Advice("note", "held an error, cleared now: {error}", "{cure}"),
    "error": Advice("warn", "held an error, cleared now: {error}", "{cure}"),
    "wide range": Advice("note", "goes to {low:g}..{high:g} us, beyond the "
        "{factory[0]}..{factory[1]} us of a new board, which cuts goals silently",
        "set its Min to {range[0]} and its Max to {range[1]} in Pololu's program"),
}
# fmt: on


class BoardRules(NamedTuple):
    """Rules that differ between makes.

    highest_input: a channel with at most this pulse is an input; 0: the board has no inputs
    left_on_remedy, outside_range_remedy: remedies for pulses inside and outside a joint's range
        that no program sends; {name} is the joint
    note: properties that no board of the make reports
    """

    highest_input: int
    left_on_remedy: str
    outside_range_remedy: str
    note: Advice


MAESTRO = BoardRules(
    highest_input=MOST_INPUT,
    left_on_remedy="gazerig jog ends with its pulses off; for good set 'On startup or error' to Off in "
    "Pololu's program",
    outside_range_remedy="switch the servo supply off; set 'On startup or error' to Off in Pololu's program",
    note=Advice(
        "note",
        "its channels' own ranges and its serial timeout cannot be read over the serial line",
        "gazerig setup lists what to set in Pololu's program, and tries the ranges out with "
        "the servo supply off; without a timeout servos hold when the program or the cable dies",
    ),
)
PCA9685 = BoardRules(
    highest_input=0,
    left_on_remedy="gazerig jog ends with its pulses off",
    outside_range_remedy="switch the servo supply off, then the board's power off and on",
    note=Advice(
        "note",
        "has no watchdog: when the cable or the computer dies it goes on with its last pulses",
        "keep the switch of the servo supply at hand",
    ),
)


def examine_channels(
    rules: BoardRules,
    setups: Sequence[ServoConfig],
    pulses: Mapping[int, int | None],
    channels: int,
    own: Sequence[Diagnostic],
    well: str,
) -> list[Diagnostic]:
    """Return all findings about a board that answers.

    Args:
        rules: rules of its make.
        setups: the servos of the rig.
        pulses: pulses by channel, quarter microseconds, 0 for none, None without an answer;
            channels that were not read are missing.
        channels: number of its channels.
        own: other findings, specific to the make.
        well: description of a healthy board.
    """
    findings = list(own)
    for setup in setups:
        pulse, where = pulses.get(setup.id), servo_label(setup)
        if setup.id >= channels:
            findings.append(ADVICE["beyond"].at(where, last=channels - 1))
        elif setup.id not in pulses:
            findings.append(ADVICE["not read"].at(where))
        elif pulse is None:
            findings.append(ADVICE["silent"].at(where))
        elif 0 < pulse <= rules.highest_input:
            findings.append(ADVICE["input"].at(where))
        elif pulse:
            us, low, high = (one / US_STEPS for one in (pulse, setup.min_steps, setup.max_steps))
            inside = low <= us <= high
            remedy = (rules.left_on_remedy if inside else rules.outside_range_remedy).format(
                name=setup.name
            )
            advice = ADVICE["left on" if inside else "outside"]
            findings.append(advice.at(where, us=us, low=low, high=high, remedy=remedy))
    if not any(finding.level in ("warn", "error") for finding in findings):
        given = sum(1 for pulse in pulses.values() if pulse)
        well = f"{well}; pulses on {given} of {len(pulses)} channels"
        findings.insert(0, Diagnostic("ok", well, WHERE))
    return [*findings, ADVICE["no feedback"].at("the servos"), rules.note.at(WHERE)]


# --- Maestro


def examine_maestro(
    port: BusPort, params: MaestroParams, setups: Sequence[ServoConfig], usb: str
) -> list[Diagnostic]:
    """Read and check all values that a board reports; nothing moves.

    Args:
        port: port, which is opened here.
        params: settings of the board according to the rig.
        setups: the servos of the rig.
        usb: vendor and product id of its port, "" unless on USB.

    Raises:
        PortError: the port cannot be opened.
        BusLost: it has disappeared.
    """
    found, size = probe(port, params), USB_CHANNELS.get(usb)
    if found is None:
        return [ADVICE["mute"].at(WHERE)]
    channels = size or params.channels
    line = MaestroBoard(port, replace(params, crc=found.expects_crc))
    pulses = _read_pulses(line, setups, channels, found, size is not None)
    crc = "on" if found.expects_crc else "off"
    named = f"{channels} channels{'' if size else ' assumed'}"
    well = f"answers, CRC {crc}, {named}"
    own = []
    if found.expects_crc != params.crc:
        own.append(ADVICE["CRC" if found.expects_crc else "no CRC"].at(WHERE))
    if size is not None and size != params.channels:
        own.append(ADVICE["size"].at(WHERE, size=size, params=params))
    for error in found.errors:
        # If a timeout is set, every pause between two programs causes it.
        advice = ADVICE["timeout" if error == TIMEOUT else "error"]
        cure = CURES.get(error, "look it up in Pololu's guide")
        own.append(advice.at(WHERE, error=error, cure=cure))
    findings = examine_channels(MAESTRO, setups, pulses, channels, own, well)
    wide = [
        ADVICE["wide range"].at(
            servo_label(setup),
            low=setup.min_steps / US_STEPS,
            high=setup.max_steps / US_STEPS,
            factory=FACTORY_US,
            range=limits,
        )
        for setup in setups
        if (limits := wide_range(setup)) is not None
    ]
    return [*findings[:-1], *wide, findings[-1]]


def _read_pulses(
    line: MaestroBoard,
    setups: Sequence[ServoConfig],
    channels: int,
    found: DetectedMaestro,
    sized: bool,
) -> dict[int, int | None]:
    """Read the pulses of a rig's channels.

    A query for a channel that the board does not have is an error, and the board then sends all
    channels home. So impossible channels are not read. While any channel gives pulses and the size
    of the board is not known, channels beyond the six of every board are not read either.
    """
    pulses: dict[int, int | None] = {}
    sure = MICRO if any(found.pulses) and not sized else channels
    for channel in sorted(setup.id for setup in setups):
        if sure <= channel < channels:
            continue
        silent = None in pulses.values()
        heard = None if silent or channel >= channels else line.read_pulses((channel,))
        pulses[channel] = None if heard is None else heard[0]
    if None in pulses.values():
        # The unknown channel has now set an error in its register, which is not a fault.
        line.read_errors()
    return pulses


# --- PCA9685


def examine_pca9685(
    port: BusPort, params: Pca9685Params, setups: Sequence[ServoConfig]
) -> list[Diagnostic]:
    """Read and check all values that the boards of one bus report; nothing moves.

    Raises:
        PortError: the port cannot be opened.
        BusLost: it has disappeared.
    """
    board = Pca9685Board(port, params)
    open_port(port, params.baud)
    findings, fitting = [], []
    for setup in setups:
        try:
            params.check_servo(setup)
            fitting.append(setup)
        except ValueError as error:
            what = str(error).removeprefix(f"channel {setup.id}: ")
            findings.append(
                Diagnostic("error", what, servo_label(setup), "correct its id or range in the YAML")
            )
    try:
        pulses = board.find(fitting)
    except ServoMissing as error:
        what, _, remedy = str(error).removeprefix(f"{port.port_name}: ").partition(": ")
        return [*findings, Diagnostic("error", what, WHERE, remedy)]
    read = dict(zip((setup.id for setup in fitting), pulses, strict=True))
    return examine_channels(
        PCA9685, fitting, read, params.channels, findings, f"answers at {params.address:#x}"
    )
