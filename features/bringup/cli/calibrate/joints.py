"""The command calibrate joints: zero, sign and range of each joint, as its servo permits."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, NamedTuple

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
from gazerig.robot.app.bus_wiring import release_plan
from gazerig.robot.cli.terminal import FAULT, RigArgument, clear_errors, record_signals, say
from gazerig.robot.control.interrupts import Interrupts
from gazerig.robot.control.power_down import PowerDown
from gazerig.robot.guardian.guardian import Guardian
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.coupling import joint_partners


class CalibrationJob(NamedTuple):
    """Context of a calibration, without the joint."""

    rig: Rig
    wire: RigPorts
    margin_deg: float
    set_middle: bool
    person: TerminalPerson
    stopped: Callable[[], str | None]


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
                job = CalibrationJob(loaded, wire, margin, set_middle, person, stopped)
                for name in names:
                    try:
                        found = _calibrate(job, name)
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
    coupled = joint_partners(rig.couplings.values())
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


def _calibrate(job: CalibrationJob, name: str) -> Calibration | LinkageFit:
    """Calibrate one joint; in all cases its torque is off at the end."""
    joint, person = job.rig.joints[name], job.person
    bus, clock = joint.bus, RealClock()
    person.hand = None
    if joint.model_facts.measures_position:
        with open_port(job.rig, job.wire, bus) as port:
            if (buses := job.wire.buses) is not None:
                person.hand = lambda steps: buses.command(f"turn {joint.id} {steps}", bus)
            return _calibrate_smart_servo(SmartServoAccess(name, joint, port, clock.now_s), job)
    # It stops this servo's pulses if this program dies or hangs.
    plan = release_plan(job.rig, bus, job.wire.paths[bus])
    guardian = Guardian((plan._replace(ids=(joint.id,)),))
    config = job.rig.bus_named(bus)
    params = config.maestro if config.kind == "maestro" else config.pca9685
    line = port_at_path(job.wire.paths[bus], on_traffic=guardian.beat)
    hobby = HobbyServoAccess(name, joint, line, params, clock, job.stopped, person, guardian)
    # Nothing is printed on success.
    with PowerDown(
        None,
        hobby.disable,
        lambda text: say(f"{hobby.who}: {text}"),
        Interrupts.from_stop(job.stopped),
        left=": cut the servo power",
        quiet=True,
    ) as power:
        power.switch_on(lambda: None)  # what follows does it, at a time of its own
        return calibrate_by_marks(hobby, person, job.margin_deg)


def _calibrate_smart_servo(single: SmartServoAccess, job: CalibrationJob) -> Calibration:
    if single.joint.transmission_points:
        raise CalibrationRefused(
            f"{single.name}: its push rod has measured places: read steps with gazerig monitor at "
            "some angles, and write them into transmission_points"
        )
    single.check()
    if job.set_middle:
        single.disable_torque()
        job.person.wait(
            f"turn {single.name} to the middle of its travel, then press Enter",
            lambda: f"{single.name}: step {single.position()[0]}",
        )
        say(
            f"{single.who}: its place is 2048 now (offset {single.set_middle()}); until this "
            "calibration is written the rig file's zero is wrong by that"
        )
    return calibrate_by_hand(single, job.person, job.margin_deg)
