"""The command ``gazerig setup``: each servo gets its id, each channel is tried."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, NamedTuple

import typer

from gazerig.config.rig import BusConfig, Rig
from gazerig.config.schema import load_rig
from gazerig.drivers.bus.servo_models import servo_label
from gazerig.drivers.errors import DriverError, SetupError
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup import servo_setup
from gazerig.features.bringup.cli.ports import (
    MockOption,
    PortOption,
    YesOption,
    bus_label,
    progress,
    refuse_packages,
    rig_ports,
    setups_on,
    to_open,
    wipe,
)
from gazerig.features.bringup.cli.setup_boards import set_up_board, set_up_boards, write_settings
from gazerig.features.bringup.servo_families import ServoKind, kind_of
from gazerig.robot.app.bus_wiring import bus_names
from gazerig.robot.app.emulation import CHAINS
from gazerig.robot.cli.terminal import RigArgument, clear_errors, say
from gazerig.robot.model.joint import JointParams
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
    """Set id and baud rate of each servo, one connected at a time; test a Maestro's channels."""
    with clear_errors(rig, port, mock):
        model = load_rig(rig)
        refuse_packages(model, "setup")
        wanted = _known_joints(joint or list(model.names), model.names)
        left: list[str] = []
        for bus in bus_names(model):
            mine = [one for one in setups_on(model, bus) if one.name in wanted]
            if not mine:
                continue
            task = _Task(model, rig, bus, mine, port, mock, yes, settings)
            left += BOARDS.get(model.bus_named(bus).kind, _chain)(task)
        if left:
            say(f"skipped: {', '.join(left)}")
        say(f"done: {len(wanted) - len(left)} of {len(wanted)}. Next: gazerig doctor")


class _Task(NamedTuple):
    """Setting up the servos of one bus, as asked on the command line.

    named: the rig as it was named; setups: of the servos that are meant
    settings: file for what a Maestro must be set to
    """

    rig: Rig
    named: str
    bus: str
    setups: list[ServoConfig]
    port: str | None
    mock: bool
    yes: bool
    settings: Path | None

    @property
    def title(self) -> str:
        """Return the rig as it was named, with its bus where there are several."""
        several = len(bus_names(self.rig)) > 1
        return f"{self.named}, {bus_label(self.rig, self.bus)}" if several else self.named

    @property
    def joints(self) -> dict[str, JointParams]:
        """Return the joints of the servos that are meant."""
        return {one.name: self.rig.joints[one.name] for one in self.setups}

    @property
    def config(self) -> BusConfig:
        """Return the bus as the rig describes it."""
        return self.rig.bus_named(self.bus)


def _known_joints(names: list[str], known: tuple[str, ...]) -> tuple[str, ...]:
    for name in names:
        if name not in known:
            raise SetupError(f"--joint {name}: unknown; joints are {', '.join(known)}")
    return tuple(names)


# --- servos with ids


def _chain(task: _Task) -> list[str]:
    """Set the servos of one bus up; return the joints that were skipped."""
    count = len(task.setups)
    say(
        f"{task.title}: {count} of {len(task.rig.names)} servos to set up for {task.config.baud} "
        "bit/s. Switch the servo supply off before you plug or unplug one."
    )
    left = []
    for n, one in enumerate(task.setups, 1):
        say(f"{n} of {count}: connect the {one.model} of {servo_label(one)}, and no other servo")
        if not _step(task, one):
            left.append(one.name)
    return left


def _step(task: _Task, one: ServoConfig) -> bool:
    """Set one joint's servo up, again and again until it is done or skipped."""
    bus, kind, yes = task.bus, kind_of(one.model), task.yes
    # As it comes from the factory.
    spec = ServoSpec(FACTORY_ID, one.model, task.rig.joints[one.name].zero)
    fresh = {bus: CHAINS[kind.name]((spec,), kind.family.factory_baud)}
    while True:
        if not yes and not _go_on("   Enter: it is connected; s: skip this one; Ctrl-C: end "):
            return False
        try:
            with (
                rig_ports(task.rig, task.mock, task.port, fresh) as wired,
                to_open(wired.paths[bus]) as line,
            ):
                return _set_up(line, kind, one, task.config.baud, yes)
        except DriverError as error:
            if yes:
                raise
            say(f"   {error}")


def _set_up(line: BusPort, kind: ServoKind, wanted: ServoConfig, baud: int, yes: bool) -> bool:
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


def _maestro(task: _Task) -> list[str]:
    """Print what to set on a board and test its channels; return the joints that were skipped."""
    params, setups = task.config.maestro, task.setups
    say(f"{task.title}: a Pololu Maestro; {len(setups)} of its channels to try.")
    with rig_ports(task.rig, task.mock, task.port) as wired, to_open(wired.paths[task.bus]) as line:
        if task.settings is not None:
            every = setups_on(task.rig, task.bus)
            write_settings(task.settings, params, every, line.port_name)
        return set_up_board(line, params, setups, task.joints, task.yes)


def _pca9685(task: _Task) -> list[str]:
    """Print how boards are wired and test their channels; return the joints that were skipped."""
    params, setups, every = task.config.pca9685, task.setups, setups_on(task.rig, task.bus)
    key = f"buses.{task.bus}.pca9685" if task.bus else "bus.pca9685"
    say(f"{task.title}: PCA9685; {len(setups)} of its channels to try.")
    with rig_ports(task.rig, task.mock, task.port) as wired, to_open(wired.paths[task.bus]) as line:
        return set_up_boards(line, params, setups, task.joints, every, task.named, key, task.yes)


BOARDS: dict[str, Callable[[_Task], list[str]]] = {"maestro": _maestro, "pca9685": _pca9685}
"""Kinds of bus whose servos have no ids."""
