"""The command calibrate joints: zero, sign and range of each joint, as its servo permits."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated

import typer

from gazerig.config.load import find_file
from gazerig.config.rig import Rig
from gazerig.config.save import propose
from gazerig.config.schema import load_rig
from gazerig.drivers.errors import ServoFault, ServoMissing, SetupError
from gazerig.drivers.serial.port import port_at_path
from gazerig.features.bringup.calibration.hobby_calibration import (
    HobbyServoAccess,
    calibrate_by_marks,
)
from gazerig.features.bringup.calibration.joint_calibration import (
    Calibration,
    CalibrationRefused,
    LinkageFit,
    rig_changes,
)
from gazerig.features.bringup.calibration.joint_procedure import calibrate_by_hand
from gazerig.features.bringup.calibration.smart_servo_access import (
    CalibrationStopped,
    SmartServoAccess,
)
from gazerig.features.bringup.cli.ports import (
    MockOption,
    PortOption,
    RigPorts,
    YesOption,
    open_port,
    refuse_packages,
    rig_ports,
)
from gazerig.features.bringup.cli.prompts import Lines, TerminalPerson
from gazerig.features.bringup.cli.rig_writer import (
    DryRunOption,
    OutOption,
    refuse_unwritable,
    write_values,
)
from gazerig.features.bringup.servo_kinds import servo_kind
from gazerig.robot.cli.terminal import FAULT, RigArgument, clear_errors, record_signals, say
from gazerig.robot.guardian.guardian import Guardian
from gazerig.robot.loop.power_down import Interrupts, PowerDown
from gazerig.robot.model.clock import RealClock
from gazerig.robot.run.buses import release_plan


def calibrate_joints(
    rig: RigArgument = "desk",
    joint: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="This joint only; repeatable.")
    ] = None,
    margin: Annotated[
        float, typer.Option(metavar="DEG", min=0.0, max=20.0, help="Margin kept from each end.")
    ] = 2.0,
    set_middle: Annotated[
        bool,
        typer.Option("--set-middle", help="Feetech: store the middle of the travel as 2048 first."),
    ] = False,
    out: OutOption = None,
    dry_run: DryRunOption = False,
    yes: YesOption = False,
    answers: Annotated[
        Path | None, typer.Option(help="File with one answer per line; empty is Enter.")
    ] = None,
    mock: MockOption = False,
    port: PortOption = None,
) -> None:
    """Find zero, sign and range of each joint and write them into the rig's YAML.

    Hobby servos report no position: you steer them by eye, and type the angles of some places.
    """
    with clear_errors(rig, port, mock), record_signals() as stopped:
        loaded = load_rig(rig)
        refuse_packages(loaded, "calibrate joints")
        names = _names(loaded, joint)
        _refuse_impossible(loaded, names, set_middle)
        if dry_run and set_middle:
            raise SetupError("--dry-run and --set-middle exclude each other: that is a write")
        if not dry_run:
            refuse_unwritable(rig, out)
            if out is None:
                # A linkage on several lines of the file cannot be rewritten: the lines are kept.
                points = {
                    f"joints.{one}.transmission_points": ((0, 0),)
                    for one in names
                    if not loaded.joints[one].model_facts.measures_position
                }
                propose(find_file("rigs", rig), points)
        person = TerminalPerson(Lines(answers), stopped, yes)
        wanted, refused = dict[str, object](), list[str]()
        try:
            with rig_ports(loaded, mock, port) as wire:
                for name in names:
                    try:
                        found = (
                            _calibrate_smart(loaded, wire, name, person, margin, set_middle)
                            if loaded.joints[name].model_facts.measures_position
                            else _calibrate_hobby(loaded, wire, name, person, margin, stopped)
                        )
                        wanted |= rig_changes(name, loaded.joints[name], found, loaded.park_deg)
                    except (CalibrationRefused, ServoMissing, ServoFault) as error:
                        refused.append(name)
                        say(f"refused: {error}")
            if len(refused) < len(names):
                write_values(rig, wanted, out, person, dry_run)
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
    pairs = [pair.joints for pair in rig.couplings.values()]
    coupled = dict([*pairs, *[(second, first) for first, second in pairs]])
    for name in rig.names:
        if name in coupled and (not asked or name in asked):
            text = f"{name} is moved together with {coupled[name]} by two servos: {_BY_LEVEL}"
            if asked:
                raise SetupError(text)
            say(f"left out: {text}")
    return tuple(name for name in rig.names if name not in coupled and (not asked or name in asked))


def _refuse_impossible(rig: Rig, names: Sequence[str], set_middle: bool) -> None:
    """Refuse an option that the servos of these joints do not support."""
    joints = [rig.joints[name] for name in names]
    if set_middle and not all(
        one.model_facts.measures_position and servo_kind(one.model).set_middle for one in joints
    ):
        raise SetupError(
            "--set-middle: only Feetech STS servos can be set so: choose joints with --joint"
        )


def _calibrate_hobby(
    rig: Rig,
    wire: RigPorts,
    name: str,
    person: TerminalPerson,
    margin_deg: float,
    stopped: Callable[[], str | None],
) -> LinkageFit:
    """Calibrate a hobby servo; in all cases its pulses are off at the end."""
    joint = rig.joints[name]
    config, path = rig.bus_named(joint.bus), wire.paths[joint.bus]
    # It stops this servo's pulses if this program dies or hangs.
    guardian = Guardian((release_plan(rig, joint.bus, path)._replace(ids=(joint.id,)),))
    params = config.maestro if config.kind == "maestro" else config.pca9685
    line = port_at_path(path, on_traffic=guardian.beat)
    hobby = HobbyServoAccess(name, joint, line, params, RealClock(), stopped, person, guardian)
    # Nothing is printed on success.
    with PowerDown(
        None,
        hobby.disable,
        lambda text: say(f"{hobby.who}: {text}"),
        Interrupts.from_stop(stopped),
        left=": cut the servo power",
        quiet=True,
    ) as power:
        power.switch_on(lambda: None)  # what follows does it, at a time of its own
        return calibrate_by_marks(hobby, person, margin_deg)


def _calibrate_smart(
    rig: Rig,
    wire: RigPorts,
    name: str,
    person: TerminalPerson,
    margin_deg: float,
    set_middle: bool,
) -> Calibration:
    """Calibrate a smart servo by hand; its torque is off."""
    joint = rig.joints[name]
    if joint.transmission_points:
        raise CalibrationRefused(
            f"{name}: its push rod has measured places: read steps with gazerig monitor at "
            "some angles, and write them into transmission_points"
        )
    with open_port(rig, wire, joint.bus) as port:
        single = SmartServoAccess(name, joint, port, RealClock().now_s)
        if (buses := wire.buses) is not None:
            person.hand = lambda steps: buses.command(f"turn {joint.id} {steps}", joint.bus)
        single.check()
        if set_middle:
            single.disable_torque()
            person.wait(
                f"turn {name} to the middle of its travel, then press Enter",
                lambda: f"{name}: step {single.position()[0]}",
            )
            say(
                f"{single.who}: its place is 2048 now (offset {single.set_middle()}); until this "
                "calibration is written the rig file's zero is wrong by that"
            )
        return calibrate_by_hand(single, person, margin_deg)
