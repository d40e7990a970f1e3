"""The command ``gazerig setup``: each servo gets its id, each channel its person's look."""

from pathlib import Path
from typing import Annotated

import typer

from gazerig.config.schema import Rig, load_rig
from gazerig.drivers.errors import DriverError, SetupError
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_models import HOBBY_KINDS, servo_label
from gazerig.drivers.types import ServoSetup
from gazerig.robot.app.bus_wiring import bus_names
from gazerig.robot.bringup import servo_setup as servo_setup
from gazerig.robot.bringup.servo_families import KINDS
from gazerig.robot.bringup.servo_family import ServoKind
from gazerig.robot.cli.ports import MockOption, PortOption, bus_label, setups_on, wires
from gazerig.robot.cli.progress import YesOption, progress, to_open, wipe
from gazerig.robot.cli.setup_maestro import set_up_board, write_settings
from gazerig.robot.cli.setup_pca9685 import set_up_boards
from gazerig.robot.cli.terminal import RigArgument, clear_errors, say
from gazerig.sim_mock.devices import DynamixelLine, Emulated, FeetechLine
from gazerig.sim_mock.smart_servo.physics import ServoSpec

app = typer.Typer()

FACTORY_ID = 1


@app.command()
def setup(
    rig: RigArgument = "desk",
    joint: Annotated[
        list[str] | None, typer.Option("--joint", "--only", help="This joint only; repeatable.")
    ] = None,
    port: PortOption = None,
    mock: MockOption = False,
    yes: YesOption = False,
    settings: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write a Maestro's settings as a file of Pololu's."),
    ] = None,
) -> None:
    """Give each servo its id and baud rate, one connected at a time; try a Maestro's channels."""
    with clear_errors(rig, port, mock):
        model = load_rig(rig)
        wanted = _known_joints(joint or list(model.names), model.names)
        left: list[str] = []
        for bus in bus_names(model):
            mine = [one for one in setups_on(model, bus) if one.name in wanted]
            if not mine:
                continue
            if model.bus_named(bus).kind in HOBBY_KINDS:
                left += _board(model, rig, bus, mine, port, mock, yes, settings)
            else:
                left += _chain(model, rig, bus, mine, port, mock, yes)
        if left:
            say(f"skipped: {', '.join(left)}")
        say(f"done: {len(wanted) - len(left)} of {len(wanted)}. Next: gazerig doctor")


def _known_joints(names: list[str], known: tuple[str, ...]) -> tuple[str, ...]:
    for name in names:
        if name not in known:
            raise SetupError(f"--joint {name}: unknown; joints are {', '.join(known)}")
    return tuple(names)


def _where(rig: Rig, bus: str) -> str:
    """Name a bus where there are several."""
    return f", {bus_label(rig, bus)}" if len(bus_names(rig)) > 1 else ""


# --- servos with ids


def _chain(
    rig: Rig,
    title: str,
    bus: str,
    setups: list[ServoSetup],
    port: str | None,
    mock: bool,
    yes: bool,
) -> list[str]:
    """Set the servos of one bus up; gives the joints that were skipped."""
    say(
        f"{title}{_where(rig, bus)}: {len(setups)} of {len(rig.names)} servos to set up for "
        f"{rig.bus_named(bus).baud} bit/s. Switch the servo supply off before you plug or "
        "unplug one."
    )
    left = []
    for n, one in enumerate(setups, 1):
        say(
            f"{n} of {len(setups)}: connect the {one.model} of {servo_label(one)}, and no "
            f"other servo"
        )
        if not _step(rig, bus, one, port, mock, yes):
            left.append(one.name)
    return left


def _step(rig: Rig, bus: str, one: ServoSetup, port: str | None, mock: bool, yes: bool) -> bool:
    """Set one joint's servo up, again and again until it is done or skipped."""
    kind = KINDS[rig.bus_named(bus).kind]
    fresh = {bus: _fresh(rig, one, kind)}
    while True:
        if not yes and not _go_on("   Enter: it is connected; s: skip this one; Ctrl-C: end "):
            return False
        try:
            with (
                wires(rig, mock, port, fresh) as wired,
                to_open(wired.paths[bus]) as line,
            ):
                return _set_up(line, kind, one, rig.bus_named(bus).baud, yes)
        except DriverError as error:
            if yes:
                raise
            say(f"   {error}")


def _fresh(rig: Rig, one: ServoSetup, kind: ServoKind) -> Emulated:
    """Return a servo as it comes from the factory."""
    spec = (ServoSpec(FACTORY_ID, one.model, rig.joints[one.name].zero),)
    if kind.name == "feetech":
        return FeetechLine(spec, kind.family.factory_baud)
    return DynamixelLine(spec, kind.family.factory_baud)


def _set_up(line: BusPort, kind: ServoKind, wanted: ServoSetup, baud: int, yes: bool) -> bool:
    found = servo_setup.find_alone(line, kind, servo_setup.search_order(kind, baud), progress)
    wipe()
    firmware = kind.family.version(found.firmware)
    say(f"   found: {found.model}, firmware {firmware}, id {found.id} at {found.baud} bit/s")
    servo_setup.refuse_model(found, kind, wanted, line.port_name)
    question = f"   give it id {wanted.id} and {baud} bit/s?"
    if not yes and not typer.confirm(question, default=True, err=True):
        return False
    result = servo_setup.assign(line, kind, found, wanted, baud, progress)
    wipe()
    done = "; ".join(result.done) or "nothing to change"
    say(
        f"   {servo_label(wanted)}: {done}; answers as id {result.now.id} at "
        f"{result.now.baud} bit/s"
    )
    return True


def _go_on(question: str) -> bool:
    """Wait for Enter; False where the person skips."""
    return (
        not typer.prompt(question, default="", show_default=False, prompt_suffix="", err=True)
        .lower()
        .startswith("s")
    )


# --- channels of a board


def _board(
    rig: Rig,
    title: str,
    bus: str,
    setups: list[ServoSetup],
    port: str | None,
    mock: bool,
    yes: bool,
    settings: Path | None,
) -> list[str]:
    """Say what to set on a board and try its channels; gives the joints that were skipped."""
    config = rig.bus_named(bus)
    title_of = {"maestro": "a Pololu Maestro", "pca9685": "PCA9685"}[config.kind]
    say(f"{title}{_where(rig, bus)}: {title_of}; {len(setups)} of its channels to try.")
    with (
        wires(rig, mock, port) as wired,
        to_open(wired.paths[bus]) as line,
    ):
        joints = {one.name: rig.joints[one.name] for one in setups}
        every = setups_on(rig, bus)
        if config.kind == "pca9685":
            key = f"buses.{bus}.pca9685" if bus else "bus.pca9685"
            return set_up_boards(line, config.pca9685, setups, joints, every, title, key, yes)
        if settings is not None:
            write_settings(settings, config.maestro, every, line.port_name)
        return set_up_board(line, config.maestro, setups, joints, yes)
