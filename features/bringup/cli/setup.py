"""The command ``gazerig setup``: each servo gets its id and baud rate."""

from collections.abc import Sequence
from typing import Annotated

import typer

from gazerig.config.rig import Rig
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
    unopened_port,
)
from gazerig.features.bringup.servo_kinds import KINDS, servo_kind
from gazerig.robot.cli.terminal import RigArgument, clear_errors, confirm, finish_lines, say
from gazerig.robot.run.emulated import CHAINS
from gazerig.robot.run.rig_limits import bus_names
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
    """Set id and baud rate of the servos, connected one at a time, or of a spare in its chain."""
    with clear_errors(rig, port, mock):
        model = load_rig(rig)
        refuse_packages(model, "setup")
        wanted = joint or list(model.names)
        for name in wanted:
            if name not in model.names:
                named = ", ".join(model.names)
                raise SetupError(f"--joint {name}: unknown; joints are {named}")
        done: set[str] = set()
        for bus in bus_names(model):
            mine = [one for one in setups_on(model, bus) if one.name in wanted]
            if mine and model.bus_named(bus).kind in KINDS:
                done |= _set_up_chain(model, bus, mine, port, mock, yes)
            elif mine:
                say(
                    f"{bus_label(model, bus)}: channels of a board have no ids; gazerig doctor RIG "
                    "checks the board, gazerig jog shows which servo is on which channel"
                )
                done |= {one.name for one in mine}
        left = [name for name in wanted if name not in done]
        if left:
            say(f"skipped: {', '.join(left)}")
        say(f"done: {len(wanted) - len(left)} of {len(wanted)}. Next: gazerig doctor RIG")


def _set_up_chain(
    rig: Rig, bus: str, setups: Sequence[ServoConfig], port: str | None, mock: bool, yes: bool
) -> set[str]:
    """Set the servos of one bus up, each until it is done or skipped; return the joints done."""
    baud, count, done = rig.bus_named(bus).section.baud, len(setups), set[str]()
    say(
        f"{bus_label(rig, bus)}: {count} of {len(rig.names)} servos to set up for {baud} bit/s. "
        "Switch the servo supply off before you plug or unplug one. A new servo in the place of "
        "the only missing one may be set up in the chain."
    )
    for n, wanted in enumerate(setups, 1):
        if wanted.name in done:
            continue
        # Factory settings.
        kind, zero = servo_kind(wanted.model), rig.joints[wanted.name].zero
        spec = ServoSpec(servo_setup.FACTORY_ID, wanted.model, zero)
        fresh = {bus: CHAINS[kind.name]((spec,), kind.family.factory_baud)}
        say(
            f"{n} of {count}: connect the {wanted.model} of {servo_label(wanted)}, and no other servo"
        )
        while yes or not _press_enter().lower().startswith("s"):
            try:
                with (
                    rig_ports(rig, mock, port, fresh) as wired,
                    unopened_port(wired.paths[bus]) as line,
                ):
                    done |= _set_up(line, wanted, setups, setups_on(rig, bus), baud, yes)
                break
            except DriverError as error:
                if yes:
                    raise
                say(f"   {error}")
    return done


def _press_enter() -> str:
    """Wait for Enter; return the text typed before it."""
    finish_lines()
    question = "   Enter: it is connected; s: skip this one; Ctrl-C: end "
    answer = typer.prompt(question, default="", show_default=False, prompt_suffix="", err=True)
    return str(answer)


def _set_up(
    line: BusPort,
    wanted: ServoConfig,
    setups: Sequence[ServoConfig],
    chain: Sequence[ServoConfig],
    baud: int,
    yes: bool,
) -> set[str]:
    """Give the new servo its id and baud rate; return the joints that are done then."""
    kind, names = servo_kind(wanted.model), {wanted.name}
    answers = servo_setup.search_all(line, kind, baud, progress)
    spare = servo_setup.find_spare(line, kind, chain, baud, answers)
    progress()
    if spare is not None and spare[1] in setups:
        (found, wanted), names = spare, {one.name for one in chain}
        say(
            f"   all others of the chain answer, so it is for {servo_label(wanted)}; its zero is "
            f"another: then gazerig calibrate RIG --joint {wanted.name}"
        )
    else:
        found = servo_setup.find_alone(answers, line.port_name)
    label = servo_label(wanted)
    firmware = kind.family.format_firmware(found.firmware)
    say(f"   found: {found.model}, firmware {firmware}, id {found.id} at {found.baud} bit/s")
    servo_setup.refuse_model(found, kind, wanted, line.port_name)
    question = f"   give it id {wanted.id} and {baud} bit/s?"
    if not yes and not confirm(question, default=True, err=True):
        return set()
    after, changes = servo_setup.assign_servo(line, kind, found, wanted, baud, progress)
    progress()
    done = "; ".join(changes) or "nothing to change"
    say(f"   {label}: {done}; answers as id {after.id} at {after.baud} bit/s")
    return names
