"""The command calibrate joints: zero, sign and range of each joint, as its servo permits."""

import contextlib
from collections.abc import Callable, Iterator, Sequence
from enum import StrEnum
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
    Value,
    rig_changes,
)
from gazerig.features.bringup.calibration.joint_procedure import (
    calibrate_by_hand,
    calibrate_by_motion,
)
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


class ActuationMode(StrEnum):
    """Source of the motion of a joint."""

    hand = "hand"
    motion = "motion"


class CalibrationJob(NamedTuple):
    """Context of a calibration, without the joint."""

    rig: Rig
    wire: RigPorts
    by: ActuationMode
    margin_deg: float
    set_middle: bool
    person: TerminalPerson
    stopped: Callable[[], str | None]


def calibrate_joints(
    rig: RigArgument = "desk",
    joint: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="This joint only; repeatable.")
    ] = None,
    by: Annotated[
        ActuationMode,
        typer.Option(help="By hand with the torque off, or by gentle motion of the servo."),
    ] = ActuationMode.hand,
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
        _refuse_impossible(loaded, names, by, set_middle)
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
        wanted, refused = dict[str, Value](), list[str]()
        try:
            with rig_ports(loaded, mock, port) as wire:
                job = CalibrationJob(loaded, wire, by, margin, set_middle, person, stopped)
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


def _refuse_impossible(rig: Rig, names: Sequence[str], by: ActuationMode, set_middle: bool) -> None:
    """Refuse options that the servos of these joints do not support."""
    models = {name: rig.joints[name].model_facts for name in names}
    hobby = [name for name, facts in models.items() if not facts.measures_position]
    if by is ActuationMode.motion and len(hobby) == len(names):
        raise SetupError(
            f"--by motion: hobby servos do not report their position ({', '.join(hobby)}), so no "
            "stop can be found: leave --by away and steer them yourself"
        )
    others = [
        name
        for name in names
        if name in hobby or servo_kind(rig.joints[name].model).set_middle is None
    ]
    if set_middle and others:
        raise SetupError(
            f"--set-middle: only Feetech STS servos can be set so, not that of {', '.join(others)}: "
            "choose joints with --joint"
        )


def _calibrate(job: CalibrationJob, name: str) -> Calibration | LinkageFit:
    """Calibrate one joint; in all cases its torque is off at the end."""
    joint, person = job.rig.joints[name], job.person
    bus, clock = joint.bus, RealClock()
    # It switches this servo off if this program dies or hangs.
    plan = release_plan(job.rig, bus, job.wire.paths[bus])
    guardian = Guardian((plan._replace(ids=(joint.id,)),))
    person.hand = None
    if not joint.model_facts.measures_position:
        config = job.rig.bus_named(bus)
        params = config.maestro if config.kind == "maestro" else config.pca9685
        line = port_at_path(job.wire.paths[bus], on_traffic=guardian.beat)
        hobby = HobbyServoAccess(name, joint, line, params, clock, job.stopped, person, guardian)
        with _torque_off_after(hobby.who, hobby.disable, job.stopped):
            return calibrate_by_marks(hobby, person, job.margin_deg)
    with open_port(job.rig, job.wire, bus, guardian) as port:
        single = SmartServoAccess(name, joint, port, clock, job.stopped, guardian)
        if (buses := job.wire.buses) is not None:
            person.hand = lambda steps: buses.command(f"turn {joint.id} {steps}", bus)
        with _torque_off_after(single.who, single.disable_torque, job.stopped):
            return _calibrate_smart_servo(single, job)


def _calibrate_smart_servo(single: SmartServoAccess, job: CalibrationJob) -> Calibration:
    person, by_motion = job.person, job.by is ActuationMode.motion
    if single.joint.transmission_points:
        raise CalibrationRefused(
            f"{single.name}: its push rod has measured places: read steps with gazerig monitor at "
            "some angles, and write them into transmission_points"
        )
    single.check()
    if job.set_middle:
        single.disable_torque()
        person.wait(
            f"turn {single.name} to the middle of its travel, then press Enter",
            lambda: f"{single.name}: step {single.position()[0]}",
        )
        say(
            f"{single.who}: its place is 2048 now (offset {single.set_middle()}); until this "
            "calibration is written the rig file's zero is wrong by that"
        )
    if not by_motion:
        return calibrate_by_hand(single, person, job.margin_deg)
    # A heavy head must not move on its own without a confirmation.
    asked = (
        f"{single.name} will move on its own, and sink when the torque goes off: hold the head. "
        "Go on?"
    )
    if "neck" in single.name.split("_") and not person.agrees(asked):
        raise CalibrationRefused(f"{single.name}: left out as you asked")
    return calibrate_by_motion(single, person, job.margin_deg)


@contextlib.contextmanager
def _torque_off_after(
    who: str, torque_off: Callable[[], None], stopped: Callable[[], str | None]
) -> Iterator[None]:
    """Switch the torque off after the block in all cases; nothing is printed on success."""
    with PowerDown(
        None,
        torque_off,
        lambda line: say(f"{who}: {line}"),
        Interrupts.from_stop(stopped),
        left=": cut the servo power",
        quiet=True,
    ) as way_out:
        way_out.switch_on(lambda: None)  # what follows does it, at a time of its own
        yield
