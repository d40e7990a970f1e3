"""What is wrong with PCA9685 boards and the channels of a rig, as far as their registers tell.

Registers are read, nothing is written and nothing moves. Boards keep no errors. Source: NXP,
PCA9685 data sheet, rev. 4.
"""

from collections.abc import Sequence

from gazerig.drivers.bus.servo_models import servo_label
from gazerig.drivers.errors import PortError, ServoMissing
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.pca9685.board import Pca9685Board
from gazerig.drivers.pca9685.params import Pca9685Params
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.doctor.board import WHERE, BoardRules, examine
from gazerig.features.bringup.doctor.diagnostics import Diagnostic

RULES = BoardRules(
    most_input=0,
    left_on="gazerig home ends with its pulses off",
    outside="switch the servo supply off, then gazerig reboot {name} ends its pulses",
    notes=(
        Diagnostic(
            "note",
            "has no watchdog: when the cable or the computer dies it goes on with its last pulses",
            WHERE,
            "keep the switch of the servo supply at hand",
        ),
    ),
)


def visit(port: BusPort, params: Pca9685Params, setups: Sequence[ServoConfig]) -> list[Diagnostic]:
    """Read and check everything that the boards of one bus report; nothing moves.

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
    named = " and ".join(f"{address:#x}" for address in params.addresses)
    asked = dict(zip((setup.id for setup in fitting), pulses, strict=True))
    return examine(RULES, fitting, asked, params.channels, findings, f"answers at {named}")
