"""The command ``gazerig setup``: each servo gets its id, each board its settings."""

from collections.abc import Callable, Collection
from typing import Annotated

import typer

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
    clear_progress,
    progress,
    refuse_packages,
    rig_ports,
    setups_on,
    unopened_port,
)
from gazerig.features.bringup.cli.setup_boards import (
    SetupTask,
    press_enter,
    set_up_maestro,
    set_up_pca9685,
)
from gazerig.features.bringup.servo_kinds import ServoKind, servo_kind
from gazerig.robot.app.bus_wiring import bus_names
from gazerig.robot.app.run_bus import CHAINS
from gazerig.robot.cli.terminal import RigArgument, clear_errors, confirm, say
from gazerig.sim_mock.smart_servo.physics import ServoSpec

app = typer.Typer()


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
    """Set id and baud rate of the servos, connected one at a time; print a board's settings."""
    with clear_errors(rig, port, mock):
        model = load_rig(rig)
        refuse_packages(model, "setup")
        wanted = joint or list(model.names)
        for name in wanted:
            if name not in model.names:
                named = ", ".join(model.names)
                raise SetupError(f"--joint {name}: unknown; joints are {named}")
        left: list[str] = []
        for bus in bus_names(model):
            mine = [one for one in setups_on(model, bus) if one.name in wanted]
            if mine:
                task = SetupTask(model, rig, bus, mine, port, mock, yes)
                if set_up_board := BOARDS.get(model.bus_named(bus).kind):
                    set_up_board(task)
                else:
                    left += _set_up_chain(task)
        if left:
            say(f"skipped: {', '.join(left)}")
        say(f"done: {len(wanted) - len(left)} of {len(wanted)}. Next: gazerig doctor")


BOARDS: dict[str, Callable[[SetupTask], None]] = {
    "maestro": set_up_maestro,
    "pca9685": set_up_pca9685,
}
"""Kinds of bus whose servos have no ids."""


def _set_up_chain(task: SetupTask) -> list[str]:
    """Set the servos of one bus up; return the joints that were skipped."""
    count = len(task.setups)
    say(
        f"{task.title}: {count} of {len(task.rig.names)} servos to set up for {task.config.section.baud} "
        "bit/s. Switch the servo supply off before you plug or unplug one. A new servo in the place "
        "of the only missing one may be set up in the chain."
    )
    done: set[str] = set()
    for n, one in enumerate(task.setups, 1):
        if one.name not in done:
            label = servo_label(one)
            say(f"{n} of {count}: connect the {one.model} of {label}, and no other servo")
            done.update(_set_up_joint(task, one))
    return [one.name for one in task.setups if one.name not in done]


def _set_up_joint(task: SetupTask, one: ServoConfig) -> Collection[str]:
    """Set one joint's servo up; repeat until it is done or skipped; return the joints done."""
    kind = servo_kind(one.model)
    # Factory settings.
    spec = ServoSpec(servo_setup.FACTORY_ID, one.model, task.rig.joints[one.name].zero)
    fresh = {task.bus: CHAINS[kind.name]((spec,), kind.family.factory_baud)}
    question = "   Enter: it is connected; s: skip this one; Ctrl-C: end "
    while True:
        if not task.yes and press_enter(question).lower().startswith("s"):
            return ()
        try:
            with (
                rig_ports(task.rig, task.mock, task.port, fresh) as wired,
                unopened_port(wired.paths[task.bus]) as line,
            ):
                return _set_up(line, kind, one, task)
        except DriverError as error:
            if task.yes:
                raise
            say(f"   {error}")


def _set_up(
    line: BusPort, kind: ServoKind, wanted: ServoConfig, task: SetupTask
) -> Collection[str]:
    """Give the new servo its id and baud rate; return the joints that are done, () if skipped."""
    baud, chain = task.config.section.baud, setups_on(task.rig, task.bus)
    order = servo_setup.search_order(kind, baud)
    answers = servo_setup.search_rates(line, kind, order, progress, thorough=True)
    clear_progress()
    spare = servo_setup.find_spare(line, kind, chain, baud, answers.found)
    joints = [wanted.name]
    if spare is None or spare[1] not in task.setups:
        found = servo_setup.find_alone(answers, line.port_name)
    else:
        found, wanted = spare
        joints = [one.name for one in chain]
    firmware = kind.family.format_firmware(found.firmware)
    say(f"   found: {found.model}, firmware {firmware}, id {found.id} at {found.baud} bit/s")
    if len(joints) > 1:
        say(
            f"   all others of the chain answer, so it is for {servo_label(wanted)}; its zero is "
            f"another: then gazerig calibrate --joint {wanted.name}"
        )
    servo_setup.refuse_model(found, kind, wanted, line.port_name)
    question = f"   give it id {wanted.id} and {baud} bit/s?"
    if not task.yes and not confirm(question, default=True, err=True):
        return ()
    result = servo_setup.assign_servo(line, kind, found, wanted, baud, progress)
    clear_progress()
    done = "; ".join(result.changes) or "nothing to change"
    say(
        f"   {servo_label(wanted)}: {done}; answers as id {result.after.id} at "
        f"{result.after.baud} bit/s"
    )
    return joints
