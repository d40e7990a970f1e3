"""Bring-up commands: scan, doctor, setup, reboot. They print and ask; the work is elsewhere."""

import contextlib
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from config.schema import Rig, load_rig
from drivers.dynamixel_scan import COMMON_FIRST, FACTORY_BAUD, Round
from drivers.dynamixel_scan import scan as scan_port
from drivers.dynamixel_table import BAUD_RATES
from drivers.errors import DriverError, SetupError
from drivers.serial_port import BlockingPort
from drivers.serial_ports import Host, SerialPort, serial_ports
from drivers.types import ServoSetup
from robot.bringup import checkup as checkup
from robot.bringup import servo_reboot as servo_reboot
from robot.bringup import servo_setup as servo_setup
from robot.bringup.doctor_patient import name_servo
from robot.bringup.doctor_port import name_ports
from robot.bringup.findings import Finding, worst
from robot.bringup.servo_report import as_plain, grouped, remarks, servo_plain, summed_up
from robot.cli.terminal import FAULT, RigArgument, clear_errors, say, status
from robot.cli.wires import MockOption, PortOption, wires
from robot.clock import RealClock
from sim_mock.emulated import DynamixelLine
from sim_mock.servo_physics import ServoSpec

app = typer.Typer()
host = Host()
"""Where this computer tells about its ports."""

FACTORY_ID = 1
STYLES = {"ok": "green", "note": "cyan", "warn": "yellow", "error": "bold red"}

YesOption = Annotated[bool, typer.Option("--yes", help="Yes to every question.")]
JsonOption = Annotated[bool, typer.Option("--json", help="One line of JSON instead of words.")]


@contextlib.contextmanager
def open_port(
    rig: Rig,
    port: str | None,
    mock: bool,
    servos: Sequence[ServoSpec] | None = None,
    baud: int | None = None,
) -> Iterator[BlockingPort]:
    """Give the port to use, closed again at the end; options as for cli_wires.wires."""
    devices = None if servos is None else {"": DynamixelLine(tuple(servos), baud)}
    with wires(rig, mock, port, devices) as wire:
        line = BlockingPort(wire.paths[""])
        try:
            yield line
        finally:
            line.closePort()


def rig_setups(rig: Rig) -> list[ServoSetup]:
    """Give what the bus must know of a rig's servos."""
    return [rig.joints[name].setup(name) for name in rig.names]


def console() -> Console:
    """Give the place for results; long lines are the terminal's business."""
    return Console(soft_wrap=True, highlight=False)


def progress(line: str) -> None:
    """Show what is being done, on a terminal only."""
    if sys.stderr.isatty():
        status(line)


def wipe() -> None:
    """Take the progress line away."""
    if sys.stderr.isatty():
        status("")


# --- scan


@app.command()
def scan(
    port: Annotated[str | None, typer.Option(help="Serial port; default: the only one.")] = None,
    bauds: Annotated[str, typer.Option(help="all, or bit/s: 1000000,57600")] = "all",
    thorough: Annotated[
        bool, typer.Option("--thorough", help="Wait 0.8 s at every baud rate, as the SDK does.")
    ] = False,
    mock: MockOption = False,
    rig: Annotated[str, typer.Option(help="With --mock: the rig whose servos.")] = "desk",
    as_json: JsonOption = False,
) -> None:
    """List serial ports, and the servos on one at every baud rate. Changes nothing."""
    with clear_errors():
        rates = parse_bauds(bauds)
        found_ports = serial_ports(host)
        if not as_json:
            _show_ports(found_ports)
        model = load_rig(rig)
        device = port if mock or port is not None else _only_port(found_ports)
        with open_port(model, device, mock) as wires:
            rounds = _scan(wires, rates, thorough)
            if not thorough and not any(one.found for one in rounds):
                # Ids that lie far apart answer after a long silence.
                rounds = _scan(wires, rates, True)
        _show_servos(rounds, wires.port_name, as_json)
    if not any(one.found for one in rounds):
        raise typer.Exit(FAULT)


def parse_bauds(text: str) -> tuple[int, ...]:
    """Read --bauds.

    Raises:
        drivers.errors.SetupError: it holds what no servo can be set to.
    """
    if text == "all":
        return COMMON_FIRST
    rates = [int(word) if word.strip().isdecimal() else -1 for word in text.split(",")]
    if not set(rates) <= set(BAUD_RATES):
        known = ", ".join(map(str, BAUD_RATES))
        raise SetupError(f"--bauds {text}: not all or some of {known}, with commas between")
    return tuple(rates)


def _only_port(ports: Sequence[SerialPort]) -> str:
    """Give the one port on USB; asking strange devices needs a person's word."""
    usb = [port for port in ports if port.usb]
    if len(usb) == 1:
        return usb[0].by_id or usb[0].device
    if usb:
        raise SetupError(f"which port? name it with --port: {name_ports(usb)}")
    raise SetupError(
        "no serial port on USB: plug the adaptor in (its LED should light), or name a port "
        "with --port"
    )


def _scan(wires: BlockingPort, rates: Sequence[int], thorough: bool) -> list[Round]:
    rounds = []
    errors = Console(stderr=True)
    with Progress(console=errors, transient=True, disable=not errors.is_terminal) as bar:
        task = bar.add_task("asking", total=len(rates))
        for result in scan_port(wires, rates, thorough):
            rounds.append(result)
            bar.update(task, advance=1, description=f"asked at {result.baud} bit/s")
    return rounds


def _show_ports(ports: Sequence[SerialPort]) -> None:
    for port in ports:
        alias = f", lasting name {port.by_id}" if port.by_id else ""
        say(f"port {port.device}: {port.description}{f' [{port.usb}]' if port.usb else ''}{alias}")


def _show_servos(rounds: Sequence[Round], where: str, as_json: bool) -> None:
    found = [servo for one in rounds for servo in one.found]
    if as_json:
        print(json.dumps({"port": where, "servos": [servo_plain(servo) for servo in found]}))
        return
    out = console()
    if found:
        table = Table("id", "model", "firmware", "baud")
        for servo in found:
            table.add_row(str(servo.id), servo.model, str(servo.firmware), str(servo.baud))
        out.print(table)
    for line in remarks(rounds, found, where):
        out.print(line)


# --- doctor


@app.command()
def doctor(
    rig: RigArgument = "desk",
    port: PortOption = None,
    mock: MockOption = False,
    fix: Annotated[
        bool, typer.Option("--fix", help="Mend what is safe; torque stays off, nothing moves.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Examine port and servos against the rig's YAML; every finding comes with its cure."""
    with clear_errors():
        model = load_rig(rig)
        setups, baud = rig_setups(model), model.bus.dynamixel.baud
        tell = (lambda _: None) if as_json else _tell
        with open_port(model, port, mock) as wires:
            findings = checkup.check_all(wires, setups, baud, host, progress)
            wipe()
            show_findings(findings, tell)
            if fix:
                _fix(wires, findings, baud, tell)
                tell("after that:")
                findings = checkup.check_all(wires, setups, baud, host, progress)
                wipe()
                show_findings(findings, tell)
        if as_json:
            print(json.dumps([as_plain(finding) for finding in findings]))
        tell(summed_up(findings, rig, fix))
    if worst(findings) == "error":
        raise typer.Exit(FAULT)


def _tell(line: str) -> None:
    """Print a line of the doctor's; all of it goes the same way, so that its order stays."""
    level, space, rest = line.partition(" ")
    out = console()
    if level in STYLES:
        out.print(f"[{STYLES[level]}]{level:5}[/]", end=space)
        out.print(rest, markup=False)
    else:
        out.print(line, markup=False)


def _fix(
    wires: BlockingPort, findings: Sequence[Finding], baud: int, tell: Callable[[str], None]
) -> None:
    """Mend what can be, and say each thing."""
    done = checkup.mend_latency(wires.port_name, host)
    if any(finding.fixes for finding in findings):
        wires.setBaudRate(baud)
        done += checkup.mend(wires, findings)
        wires.closePort()
    for one in done:
        tell(str(one))
    if not done:
        tell("nothing that --fix may mend")


def show_findings(findings: Sequence[Finding], tell: Callable[[str], None]) -> None:
    """Tell findings, the worst first, the same one at several servos once."""
    for level, where, what, cure in grouped(findings):
        tell(f"{level} {where}: {what}")
        if cure:
            tell(f"      -> {cure}")


# --- setup


@app.command()
def setup(
    rig: RigArgument = "desk",
    joint: Annotated[
        list[str] | None, typer.Option("--joint", "--only", help="This joint only; repeatable.")
    ] = None,
    port: PortOption = None,
    mock: MockOption = False,
    yes: YesOption = False,
) -> None:
    """Give each servo its id and baud rate, one servo connected at a time, told in steps."""
    with clear_errors():
        model = load_rig(rig)
        names = _known_joints(joint or model.names, model.names)
        say(
            f"{rig}: {len(names)} of {len(model.names)} servos to set up for "
            f"{model.bus.dynamixel.baud} bit/s. Switch the servo supply off before you plug or "
            "unplug one."
        )
        left = []
        for i, name in enumerate(names):
            say(f"{i + 1} of {len(names)}: {_connect(model, name)}")
            if not _step(model, name, port, mock, yes):
                left.append(name)
        if left:
            say(f"skipped: {', '.join(left)}")
        say(f"done: {len(names) - len(left)} of {len(names)}. Next: gazerig doctor {rig}")


def _known_joints(names: Sequence[str], known: Sequence[str]) -> tuple[str, ...]:
    for name in names:
        if name not in known:
            raise SetupError(f"--joint {name}: unknown; joints are {', '.join(known)}")
    return tuple(names)


def _connect(rig: Rig, name: str) -> str:
    joint = rig.joints[name]
    return f"connect the {joint.model} of {name_servo(joint.setup(name))}, and no other servo"


def _step(rig: Rig, name: str, port: str | None, mock: bool, yes: bool) -> bool:
    """Set one joint's servo up, again and again until it is done or skipped."""
    joint = rig.joints[name]
    # A servo as it comes from the factory.
    fresh = [ServoSpec(FACTORY_ID, joint.model, joint.zero)]
    while True:
        if not yes and not _go_on("   Enter: it is connected; s: skip this one; Ctrl-C: end "):
            return False
        try:
            with open_port(rig, port, mock, fresh, FACTORY_BAUD) as wires:
                return _set_up(wires, joint.setup(name), rig.bus.dynamixel.baud, yes)
        except DriverError as error:
            if yes:
                raise
            say(f"   {error}")


def _set_up(wires: BlockingPort, wanted: ServoSetup, baud: int, yes: bool) -> bool:
    found = servo_setup.find_alone(wires, servo_setup.search_order(baud), progress)
    wipe()
    say(f"   found: {found.model}, firmware {found.firmware}, id {found.id} at {found.baud} bit/s")
    servo_setup.refuse_model(found, wanted, wires.port_name)
    question = f"   give it id {wanted.id} and {baud} bit/s?"
    if not yes and not typer.confirm(question, default=True, err=True):
        return False
    result = servo_setup.assign(wires, found, wanted, baud, progress)
    wipe()
    done = "; ".join(result.done) or "nothing to change"
    say(
        f"   {name_servo(wanted)}: {done}; answers as id {result.now.id} at {result.now.baud} bit/s"
    )
    return True


def _go_on(question: str) -> bool:
    """Wait for Enter; False where the person skips."""
    return (
        not typer.prompt(question, default="", show_default=False, prompt_suffix="", err=True)
        .lower()
        .startswith("s")
    )


# --- reboot


@app.command()
def reboot(
    servos: Annotated[list[str], typer.Argument(metavar="ID...", help="Servo ids or joints.")],
    port: PortOption = None,
    rig: Annotated[str, typer.Option(help="The rig whose port and baud rate.")] = "desk",
    mock: MockOption = False,
    yes: YesOption = False,
) -> None:
    """Restart servos, which clears latched errors; their torque is off afterwards."""
    with clear_errors():
        model = load_rig(rig)
        baud = model.bus.dynamixel.baud
        wanted = [_servo_id(model, text) for text in servos]
        with open_port(model, port, mock) as wires:
            wires.setBaudRate(baud)
            again = [_reboot(wires, model, servo_id, baud, yes) for servo_id in wanted]
    if any(again):
        raise typer.Exit(FAULT)


def _servo_id(rig: Rig, text: str) -> int:
    """Read a servo id or the name of a joint."""
    if text in rig.joints:
        return rig.joints[text].id
    if text.isdecimal() and int(text) <= 252:
        return int(text)
    raise SetupError(f"{text}: neither an id from 0 to 252 nor a joint ({', '.join(rig.names)})")


def _reboot(wires: BlockingPort, rig: Rig, servo_id: int, baud: int, yes: bool) -> bool:
    """Restart one servo; tells whether it has latched an error again."""
    names = [f"{name} (servo {servo_id})" for name in rig.names if rig.joints[name].id == servo_id]
    name = names[0] if names else f"servo {servo_id}"
    servo_reboot.present(wires, servo_id, baud)
    before = servo_reboot.standing(wires, servo_id)
    say(f"{name}: {before}")
    limp = f"{name} goes limp: hold what it carries. Restart it?"
    if before.torque and not yes and not typer.confirm(limp, err=True):
        say(f"{name}: left as it is")
        return False
    result = servo_reboot.restart(wires, servo_id, baud, RealClock().sleep_until)
    say(f"{name}: back after {result.away_s:.1f} s: {result.after}")
    if result.after.errors:
        say(f"{name}: the cause is still there: gazerig doctor names the cure")
    return bool(result.after.errors)
