"""The command ``gazerig scan``: lists the ports, and the servos that answer on one.

Nothing is changed and nothing moves. Reasons for the order and for what is sent:

- To a Maestro every byte from 80 on is a command, and FF moves a servo (FF, channel,
  target). Packets of smart servos begin with FF. So a port of Pololu's is searched for a
  Maestro only, and every other port is searched for one first. Queries to a Maestro
  contain no FF, so no servo can mistake them for the header of a packet. After an answer of a
  Maestro nothing else is sent.
- Dynamixel servos accept FF FF FD 00, STS servos FF FF, an id and a length of 2 or more. To
  an STS a Dynamixel packet has the id 253 and the length 0, which is invalid; to a Dynamixel an
  STS packet has no 00 behind FD, or no FD. Even a servo that accepted the other packets would
  only be pinged or read: nothing else is ever sent here.

A board that receives data but cannot answer (one wire, serial pins at another rate) is not
detected: with such a board on the line, specify the kind of servo.
"""

import contextlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, NamedTuple

import msgspec
import typer
from rich.table import Table

from gazerig.config.schema import load_rig
from gazerig.drivers.bus.servo_models import FAMILY_OF, US_STEPS, BusKind
from gazerig.drivers.errors import SetupError
from gazerig.drivers.maestro.board import USB_CHANNELS, DetectedMaestro, MaestroParams
from gazerig.drivers.maestro.board import probe as probe_maestro
from gazerig.drivers.pca9685.board import probe as probe_pca9685
from gazerig.drivers.serial.list_ports import POLOLU, SerialPort, is_i2c, serial_ports
from gazerig.drivers.serial.port import BusPort
from gazerig.features.bringup.cli import ports as bench
from gazerig.features.bringup.cli.ports import JsonOption, MockOption
from gazerig.features.bringup.servo_kinds import KINDS, servo_kind
from gazerig.features.bringup.servo_setup import Answers, search_rate
from gazerig.robot.cli.options import DEFAULT_RIG
from gazerig.robot.cli.terminal import FAULT, clear_errors, complete_suggestions, say

app = typer.Typer()

ORDER: tuple[BusKind, ...] = ("maestro", "dynamixel", "feetech")
"""Order of the search by kind; see above."""


class SearchRound(NamedTuple):
    """Result of the search for one kind at one baud rate.

    answers: of servos, None if the adaptor does not support the rate, or for a board
    board: a Maestro
    """

    kind: BusKind
    baud: int
    answers: Answers | None = None
    board: DetectedMaestro | None = None

    @property
    def has_answer(self) -> bool:
        """Return whether a servo of this kind has answered."""
        return self.board is not None or (self.answers is not None and bool(self.answers.found))


@app.command()
def scan(
    rig: Annotated[
        str | None,
        typer.Argument(
            metavar="RIG",
            help="Search the ports of this rig; default: the only port, with --mock rig desk.",
        ),
    ] = None,
    port: Annotated[str | None, typer.Option(help="Serial port; default: the only one.")] = None,
    kind: Annotated[
        str | None,
        typer.Option(
            help="dynamixel, feetech or maestro; default: one after the other until one answers. "
            "Required for a Maestro that cannot answer."
        ),
    ] = None,
    mock: MockOption = False,
    as_json: JsonOption = False,
) -> None:
    """List serial ports, and the servos that answer on one at any baud rate.

    Moves and changes nothing; only a Maestro's list of errors is cleared by asking for it.
    """
    with clear_errors(rig or DEFAULT_RIG, port, mock):
        kinds = [one for one in ORDER if kind in (None, one)]
        if not kinds:
            raise SetupError(f"--kind {kind}: not one of {', '.join(ORDER)}")
        found_ports = serial_ports()
        if not as_json:
            for bus in sorted(Path("/dev").glob("i2c-*")):
                say(f"I2C bus {bus}")
            for one in found_ports:
                alias = f", lasting name {one.by_id}" if one.by_id else ""
                usb = f" [{one.usb}]" if one.usb else ""
                say(f"port {one.device}: {one.description}{usb}{alias}")
        with _paths(rig, mock, port, found_ports) as paths:
            answered = [
                _search_i2c(path, as_json) if i2c else _search_port(path, kinds, as_json)
                for path, i2c in paths
            ]
    if not any(answered):
        raise typer.Exit(FAULT)


@contextlib.contextmanager
def _paths(
    rig: str | None, mock: bool, port: str | None, found: Sequence[SerialPort]
) -> Iterator[list[tuple[str, bool]]]:
    """Return the ports to search, a rig's or one, and whether each is an I2C bus."""
    if rig is None and not mock:
        path = port if port is not None else _only_port(found)
        yield [(path, is_i2c(path))]
        return
    model = load_rig(rig or DEFAULT_RIG)
    bench.refuse_packages(model, "scan")
    with bench.rig_ports(model, mock, port) as wired:
        yield [
            (path, model.bus_named(name).kind == "pca9685") for name, path in wired.paths.items()
        ]


def _only_port(ports: Sequence[SerialPort]) -> str:
    """Return the only port on USB; queries to unknown devices need a person's consent."""
    usb = [port for port in ports if port.usb]
    if len(usb) == 2 and usb[0].usb == usb[1].usb and usb[0].usb.startswith(POLOLU):
        usb = usb[:1]  # both ports of one Maestro: its Command Port is the first
    if len(usb) == 1:
        return usb[0].by_id or usb[0].device
    if usb:
        named = ", ".join(f"{port.by_id or port.device} ({port.description})" for port in usb)
        raise SetupError(f"which port? name it with --port: {named}")
    raise SetupError(
        "no serial port on USB: plug the adaptor in (its LED should light), or name a port "
        "with --port"
    )


def _search_i2c(path: str, as_json: bool) -> bool:
    """Search one I2C bus and show the results; return whether any board answered.

    A serial port is searched only if the user named it: for a Maestro such bytes are commands.
    """
    with bench.unopened_port(path) as line:
        found = [f"{address:#x}" for address in probe_pca9685(line)]
    if as_json:
        _print_json(path, (), [{"kind": "pca9685", "address": address} for address in found])
        return bool(found)
    lines = [f"PCA9685 at {address}, 16 channels" for address in found] or [
        "no PCA9685 answers from 0x40 to 0x77: has it its logic supply (VCC)? check SDA, SCL and "
        "ground"
    ]
    for text in lines:
        bench.console().print(f"{path}: {text}", markup=False)
    return bool(found)


def _print_json(path: str, servos: Sequence[object], boards: Sequence[object]) -> None:
    answer = {"port": path, "servos": servos, "boards": boards}
    print(msgspec.json.encode(answer).decode())


def _search_port(path: str, kinds: Sequence[BusKind], as_json: bool) -> bool:
    """Search one port and show the results; return whether a servo answered."""
    usb = bench.usb_id(path)
    if usb.startswith(POLOLU):
        kinds = [kind for kind in kinds if kind == "maestro"]
    if not kinds:
        raise SetupError(
            f"{path} is a board of Pololu: packets for servos would move what hangs on it; "
            "name the adaptor's port with --port, or ask with --kind maestro"
        )
    with bench.unopened_port(path) as line:
        rounds = list(search_bus(line, kinds))
        if not any(one.has_answer for one in rounds):
            # Ids that are far apart answer after a long silence; some do not answer a broadcast
            # ping.
            boards = [one for one in rounds if one.kind == "maestro"]
            servos = [kind for kind in kinds if kind != "maestro"]
            rounds = [*boards, *search_bus(line, servos, thorough=True)]
    bench.progress()
    _show(rounds, path, USB_CHANNELS.get(usb), as_json)
    return any(one.has_answer for one in rounds)


def search_bus(
    port: BusPort, kinds: Sequence[BusKind], thorough: bool = False
) -> Iterator[SearchRound]:
    """Search for one kind after the other at all its rates; end after the first that replies.

    thorough: wait longer for Dynamixel servos, and ping each STS id even if no servo answers a
        broadcast ping

    Raises:
        PortError: the port cannot be opened.
        BusLost: it has disappeared.
    """
    for kind in kinds:
        rounds: list[SearchRound] = []
        if kind == "maestro":
            baud = MaestroParams().baud
            # Every board has the first six channels; others might cause an error.
            board = probe_maestro(port, MaestroParams()) if port.setBaudRate(baud) else None
            rounds.append(SearchRound(kind, baud, board=board))
        else:
            family = KINDS[kind].family
            # The usual rate first, then that of the factory.
            for baud in dict.fromkeys((1_000_000, family.factory_baud, *family.baud_rates)):
                bench.progress(f"searching {kind} at {baud} bit/s")
                answers = search_rate(port, KINDS[kind], baud, thorough)
                rounds.append(SearchRound(kind, baud, answers))
        yield from rounds
        if any(one.has_answer for one in rounds):
            return


def _show(rounds: Sequence[SearchRound], where: str, channels: int | None, as_json: bool) -> None:
    searched = [(one.kind, one.baud, one.answers) for one in rounds if one.answers is not None]
    found = [(kind, servo) for kind, _, answers in searched for servo in answers.found]
    boards = [one.board for one in rounds if one.board is not None]
    if as_json:
        _print_json(where, [{"kind": kind, **servo._asdict()} for kind, servo in found], boards)
        return
    out = bench.console()
    if found:
        table = Table("id", "model", "firmware", "baud", "kind")
        for kind, servo in found:
            made = servo_kind(servo.model) if servo.model in FAMILY_OF else KINDS[kind]
            version = made.family.format_firmware(servo.firmware)
            table.add_row(str(servo.id), servo.model, version, str(servo.baud), made.title)
        out.print(table)
    lines: list[str] = []
    for board in boards:
        size = f"{channels} channels"
        if channels is None:
            size = "6 channels or more (asking for one too many would send all of them home)"
        pulses = enumerate(board.pulses)
        given = ", ".join(f"{n}: {pulse / US_STEPS:g} us" for n, pulse in pulses if pulse)
        lines += [
            f"{where}: Pololu Maestro: {size}, CRC {'on' if board.expects_crc else 'off'}",
            f"{where}: pulses: {given or 'none'} (channels 0..{len(board.pulses) - 1})",
            f"{where}: errors it held, cleared by asking: {', '.join(board.errors) or 'none'}",
            "nothing else was sent: packets for servos would move what hangs on the board",
        ]
    if found or not boards:
        rates: dict[BusKind, list[str]] = {}
        for kind, baud, _ in searched:
            rates.setdefault(kind, []).append(str(baud))
        named = "; ".join(
            f"searched {kind} at {', '.join(some)} bit/s" for kind, some in rates.items()
        )
        lines.append(f"{len(found)} servo{'s' if len(found) != 1 else ''} on {where}; {named}")
    for _, baud, answers in searched:
        lines += [
            f"two or more servos have id {servo_id} at {baud} bit/s: connect them one at a time and "
            "run gazerig setup RIG"
            for servo_id in answers.shared_ids
        ]
        if answers.junk and not answers.found and baud not in {servo.baud for _, servo in found}:
            lines.append(
                f"at {baud} bit/s only pieces came: a wrong rate, a loose plug, or two servos with "
                "one id"
            )
    if not found and not boards:
        lines.append(
            "no servo answers: is the servo supply on? does each servo's LED flash once when it "
            "comes on? is the first cable in the right plug of the adaptor? is another program "
            "using the port? a Maestro on USB: is it set to 'USB Dual Port', and is this the "
            "first of its two ports?"
        )
    for line in lines:
        out.print(complete_suggestions(line), markup=False)
