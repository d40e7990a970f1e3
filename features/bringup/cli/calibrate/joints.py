"""The command calibrate joints: zero, sign and range of each joint, found and written down."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from gazerig.config.rig import Rig
from gazerig.config.save import propose, rig_file
from gazerig.config.schema import load_rig
from gazerig.drivers.errors import SetupError
from gazerig.features.bringup.calibration.endstop_search import StopSearchParams
from gazerig.features.bringup.calibration.joint_calibration import Value, changes
from gazerig.features.bringup.calibration.smart_servo_access import CalibrationStopped
from gazerig.features.bringup.cli.calibrate.joint import (
    ActuationMode,
    CalibrationJob,
    CalibrationOptions,
    ZeroReference,
    measure,
    refuse_impossible,
)
from gazerig.features.bringup.cli.jog_prompt import TerminalJogger
from gazerig.features.bringup.cli.ports import MockOption, PortOption, refuse_packages, rig_ports
from gazerig.features.bringup.cli.prompts import Lines
from gazerig.features.bringup.cli.rig_writer import (
    AllYesOption,
    DryRunOption,
    OutOption,
    difference_table,
    refuse_unwritable,
    write_values,
)
from gazerig.robot.cli.terminal import FAULT, RigArgument, clear_errors, say, signals
from gazerig.robot.model.coupling_params import pairs_of, partners

JointOption = Annotated[
    list[str] | None, typer.Option(metavar="NAME", help="This joint (again: more); else all.")
]
TurnedByOption = Annotated[
    ActuationMode, typer.Option(help="Turned by hand, torque off, or gently by itself.")
]
MarginOption = Annotated[
    float, typer.Option(metavar="DEG", min=0.0, max=20.0, help="Kept from each end.")
]
ZeroOption = Annotated[
    ZeroReference, typer.Option(help="With --by motion: zero half-way, or where a person puts it.")
]
StrengthOption = Annotated[
    float, typer.Option(min=0.05, max=1.0, help="With --by motion: share of full strength.")
]
ClearOffsetOption = Annotated[
    bool, typer.Option("--clear-offset", help="Set the offset in a servo to 0 first.")
]
SetMiddleOption = Annotated[
    bool,
    typer.Option("--set-middle", help="Feetech: make the middle of its travel 2048 first."),
]
PulsesOption = Annotated[
    str, typer.Option(metavar="US:US", help="Hobby servos: never narrower or wider pulses.")
]
MoreOption = Annotated[
    int, typer.Option(min=0, max=5, help="Push rods: places between each two you mark.")
]
AnswersOption = Annotated[
    Path | None, typer.Option(help="File with one answer a line; empty is Enter.")
]


def calibrate_joints(
    rig: RigArgument = "desk",
    joint: JointOption = None,
    by: TurnedByOption = ActuationMode.hand,
    margin: MarginOption = 2.0,
    zero: ZeroOption = ZeroReference.middle,
    strength: StrengthOption = 0.3,
    clear_offset: ClearOffsetOption = False,
    set_middle: SetMiddleOption = False,
    pulses: PulsesOption = "500:2500",
    more: MoreOption = 1,
    out: OutOption = None,
    dry_run: DryRunOption = False,
    yes: AllYesOption = False,
    answers: AnswersOption = None,
    mock: MockOption = False,
    port: PortOption = None,
) -> None:
    """Find zero, sign and range of each joint and write them into the rig's YAML.

    Hobby servos report no position: you steer them by eye, and type the angles of some places.
    """
    with clear_errors(rig, port, mock), signals() as stopped:
        loaded = load_rig(rig)
        refuse_packages(loaded, "calibrate joints")
        names = _names(loaded, joint)
        search = StopSearchParams(strength=strength)
        span_us = _span(pulses)
        how = CalibrationOptions(by, margin, zero, search, clear_offset, set_middle, span_us, more)
        if dry_run and (clear_offset or set_middle):
            option = "--clear-offset" if clear_offset else "--set-middle"
            raise SetupError(f"--dry-run and {option} exclude each other: that is a write")
        if not dry_run:
            refuse_unwritable(rig, out)
            if out is None:
                _refuse_long_lists(rig, loaded, names)
        refuse_impossible(loaded, names, how)
        person = TerminalJogger(Lines(answers), stopped, yes)
        try:
            with rig_ports(loaded, mock, port) as wire:
                found, refused = measure(CalibrationJob(loaded, wire, how, person, stopped), names)
            if found:
                wanted: dict[str, Value] = {}
                for name, made in found.items():
                    wanted |= changes(name, loaded.joints[name], made, loaded.park_deg)
                Console().print(difference_table(rig, loaded, wanted))
                if not dry_run:
                    write_values(rig, wanted, out, person)
        except CalibrationStopped as why:
            say(f"stopped by {why}: nothing written")
            raise typer.Exit(FAULT) from None
    if refused:
        say(f"not calibrated: {', '.join(refused)}")
        raise typer.Exit(FAULT)


_BY_LEVEL = (
    "set zero_step of both by hand, to what gazerig monitor shows while their horns are at 0 deg "
    "(of a differential: while the head is level)"
)


def _names(rig: Rig, asked: list[str] | None) -> tuple[str, ...]:
    """Return the joints to calibrate, in the order of the rig."""
    for name in asked or ():
        if name not in rig.joints:
            raise SetupError(f"--joint {name}: no such joint; there is {', '.join(rig.names)}")
    coupled = partners(pairs_of(rig.couplings))
    for name in rig.names:
        if name in coupled and (not asked or name in asked):
            text = f"{name} is moved together with {coupled[name]} by two servos: {_BY_LEVEL}"
            if asked:
                raise SetupError(text)
            say(f"left out: {text}")
    return tuple(name for name in rig.names if name not in coupled and (not asked or name in asked))


def _refuse_long_lists(rig: str, loaded: Rig, names: tuple[str, ...]) -> None:
    """Refuse before anything moves if places could not be written into the file.

    Raises:
        gazerig.config.load.ConfigError: a linkage is spread over several lines, which are kept.
    """
    joints = [
        n
        for n in names
        if loaded.joints[n].transmission_points or not loaded.joints[n].facts.measured
    ]
    propose(rig_file(rig), {f"joints.{name}.transmission_points": ((0, 0),) for name in joints})


def _span(pulses: str) -> tuple[float, float]:
    """Read --pulses.

    Raises:
        SetupError: these are no two numbers.
    """
    low, _, high = pulses.partition(":")
    try:
        return float(low), float(high)
    except ValueError:
        raise SetupError(f"--pulses {pulses}: two pulse widths in us, e.g. 900:2100") from None
