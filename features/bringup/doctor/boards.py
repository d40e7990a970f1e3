"""Faults of a board of hobby servos and the channels of a rig; nothing moves.

A Maestro clears its error register when it is read, so the stored errors are among the findings.
Settings that cannot be read over its serial line are a note with the setting for Pololu's program.
A PCA9685 keeps no errors; its registers are read, nothing is written. Sources: Pololu Maestro
User's Guide (0J40), sections 4.b, 4.e, 5.a and 5.e; NXP, PCA9685 data sheet, rev. 4.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import ceil, floor

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
from gazerig.features.bringup.doctor.diagnostics import ADVICE, Diagnostic, has_fault

WHERE = "the board"
BOARDS = ADVICE.boards

_FACTORY_US = (992, 2000)
"""Range of every channel of a new Maestro."""
_UNIT_US = 16
"""A Maestro keeps the ends of a range in multiples of this."""


def _examine_channels(
    make: str,
    setups: Sequence[ServoConfig],
    pulses: Mapping[int, int | None],
    channels: int,
    own: Sequence[Diagnostic],
    well: str,
) -> list[Diagnostic]:
    """Return all findings about a board that answers.

    Args:
        make: "maestro" or "pca9685".
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
        facts = {"us": (pulse or 0) / US_STEPS, "last": channels - 1}
        facts |= {"low": setup.min_steps / US_STEPS, "high": setup.max_steps / US_STEPS}
        name = ""
        if setup.id >= channels:
            name = "beyond"
        elif setup.id not in pulses:
            name = "not read"
        elif pulse is None:
            name = "silent"
        elif make == "maestro" and 0 < pulse <= MOST_INPUT:
            name = "input"
        elif pulse:
            name = "left on" if setup.min_steps <= pulse <= setup.max_steps else "outside"
        if name:
            findings.append(BOARDS[name].at(where, **facts))
    if not has_fault(findings):
        given = sum(1 for pulse in pulses.values() if pulse)
        text = f"{well}; pulses on {given} of {len(pulses)} channels"
        findings.insert(0, Diagnostic("ok", text, WHERE))
    return [*findings, BOARDS["no feedback"].at("the servos"), BOARDS[make].at(WHERE)]


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
        return [BOARDS["mute"].at(WHERE)]
    channels = size or params.channels
    line = MaestroBoard(port, replace(params, crc=found.expects_crc))
    pulses = _read_pulses(line, setups, channels, found, size is not None)
    crc, wanted = ("on" if on else "off" for on in (found.expects_crc, params.crc))
    own = []
    if crc != wanted:
        own.append(BOARDS["crc"].at(WHERE, found=crc, wanted=str(params.crc).lower()))
    if size is not None and size != params.channels:
        own.append(BOARDS["size"].at(WHERE, size=size, channels=params.channels))
    for error in found.errors:
        # If a timeout is set, every pause between two programs causes it.
        advice = BOARDS["timeout" if error == "serial timeout" else "error"]
        own.append(advice.at(WHERE, error=error, remedy=ADVICE.maestro[error]))
    for setup in setups:
        low, high = setup.min_steps / US_STEPS, setup.max_steps / US_STEPS
        if low < _FACTORY_US[0] or high > _FACTORY_US[1]:
            least, most = _UNIT_US * floor(low / _UNIT_US), _UNIT_US * ceil(high / _UNIT_US)
            facts = {"low": low, "high": high, "least": least, "most": most}
            own.append(BOARDS["wide range"].at(servo_label(setup), **facts))
    assumed = "" if size else " assumed"
    well = f"answers, CRC {crc}, {channels} channels{assumed}"
    return _examine_channels("maestro", setups, pulses, channels, own, well)


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
        BusLost: the port has disappeared.
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
    well = f"answers at {params.address:#x}"
    return _examine_channels("pca9685", fitting, read, params.channels, findings, well)
