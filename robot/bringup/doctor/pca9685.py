"""What is wrong with PCA9685 boards and the channels of a rig, as far as their registers tell.

Registers are read, nothing is written and nothing moves. Boards keep no errors. Source: NXP,
PCA9685 data sheet, rev. 4.
"""

from collections.abc import Iterator, Sequence

from gazerig.drivers.errors import PortError, ServoMissing
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.hobby_board.models import US_STEPS
from gazerig.drivers.pca9685.board import Pca9685Board
from gazerig.drivers.pca9685.params import Pca9685Params
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_models import servo_label
from gazerig.drivers.types import ServoSetup
from gazerig.robot.bringup.doctor.diagnostics import Diagnostic

WHERE = "the board"


def visit(port: BusPort, params: Pca9685Params, setups: Sequence[ServoSetup]) -> list[Diagnostic]:
    """Ask the boards of one bus for all they tell and judge it; nothing moves.

    Raises:
        PortError: the port cannot be opened.
        BusLost: it has gone away.
    """
    if not port.setBaudRate(params.baud):
        raise PortError(f"{port.port_name} cannot run at {params.baud} bit/s: name its port")
    board = Pca9685Board(port, params)
    findings, fitting = [], []
    for setup in setups:
        try:
            params.check(setup)
            fitting.append(setup)
        except ValueError as error:
            what = str(error).removeprefix(f"channel {setup.id}: ")
            findings.append(
                Diagnostic("error", what, servo_label(setup), "correct its id or range in the YAML")
            )
    try:
        pulses = board.find(fitting, EventLog())
    except ServoMissing as error:
        what, _, remedy = str(error).removeprefix(f"{port.port_name}: ").partition(": ")
        return [*findings, Diagnostic("error", what, WHERE, remedy)]
    for setup, pulse in zip(fitting, pulses, strict=True):
        findings += _pulse(setup, pulse)
    if not findings:
        findings.append(Diagnostic("ok", _well(params, pulses), WHERE))
    return [*findings, *_untold()]


def _well(params: Pca9685Params, pulses: Sequence[int]) -> str:
    named = " and ".join(f"{address:#x}" for address in params.addresses)
    given = sum(1 for pulse in pulses if pulse)
    return f"answers at {named}; pulses on {given} of {len(pulses)} channels"


def _pulse(setup: ServoSetup, pulse: int) -> Iterator[Diagnostic]:
    if not pulse:
        return
    at = f"gets pulses of {pulse / US_STEPS:g} us though no program runs it"
    low, high = setup.min_steps / US_STEPS, setup.max_steps / US_STEPS
    if setup.min_steps <= pulse <= setup.max_steps:
        remedy = "gazerig home ends with its pulses off"
        yield Diagnostic("warn", at, servo_label(setup), remedy)
    else:
        remedy = f"switch the servo supply off, then gazerig reboot {setup.name} ends its pulses"
        what = f"{at}, outside its range {low:g}..{high:g} us"
        yield Diagnostic("error", what, servo_label(setup), remedy)


def _untold() -> Iterator[Diagnostic]:
    """Say what no board tells, and what to do about it."""
    yield Diagnostic(
        "note",
        "hobby servos tell nothing: position, load, temperature and supply cannot be examined",
        "the servos",
    )
    yield Diagnostic(
        "note",
        "has no watchdog: when the cable or the computer dies it goes on with its last pulses",
        WHERE,
        "keep the switch of the servo supply at hand",
    )
