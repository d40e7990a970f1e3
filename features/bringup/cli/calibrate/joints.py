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
from gazerig.features.bringup.calibration.endstop_search import StopSearchParams
from gazerig.features.bringup.calibration.hobby_access import HobbyServoAccess
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
from gazerig.features.bringup.calibration.linkage_calibration import (
    HandMarker,
    HobbyMarker,
    calibrate_by_marks,
)
from gazerig.features.bringup.calibration.smart_servo_access import (
    CalibrationStopped,
    SmartServoAccess,
)
from gazerig.features.bringup.cli.jog_prompt import TerminalJogger
from gazerig.features.bringup.cli.ports import (
    MockOption,
    PortOption,
    RigPorts,
    open_port,
    refuse_packages,
    rig_ports,
)
from gazerig.features.bringup.cli.prompts import Lines
from gazerig.features.bringup.cli.rig_writer import (
    AllYesOption,
    DryRunOption,
    OutOption,
    refuse_unwritable,
    show_and_write,
)
from gazerig.features.bringup.servo_kinds import KINDS, servo_kind
from gazerig.robot.app.bus_wiring import bus_names, joints_on, release_plan
from gazerig.robot.cli.terminal import FAULT, RigArgument, clear_errors, record_signals, say
from gazerig.robot.control.interrupts import Interrupts
from gazerig.robot.control.power_down import PowerDown
from gazerig.robot.guardian.guardian import Guardian
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.coupling import joint_partners

JointMove = Calibration | LinkageFit


class ActuationMode(StrEnum):
    """Source of the motion of a joint."""

    hand = "hand"
    motion = "motion"


class ZeroReference(StrEnum):
    """Source of the zero after the stops were found by motion."""

    middle = "middle"
    person = "person"


class CalibrationOptions(NamedTuple):
    """Options of a calibration on the command line.

    pulses_us: permitted range of the pulses of hobby servos
    extra_marks: number of positions of a linkage between two marks
    """

    actuation: ActuationMode
    margin_deg: float
    zero: ZeroReference
    search: StopSearchParams
    clear_offset: bool
    set_middle: bool
    pulses_us: tuple[float, float]
    extra_marks: int


class CalibrationJob(NamedTuple):
    """Context of a calibration, without the joints."""

    rig: Rig
    wire: RigPorts
    options: CalibrationOptions
    operator: TerminalJogger
    stopped: Callable[[], str | None]


def measure(
    bench: CalibrationJob, names: Sequence[str]
) -> tuple[dict[str, JointMove], tuple[str, ...]]:
    """Calibrate one joint after the other, bus by bus; return results and refused joints.

    Raises:
        SetupError: a port cannot be opened, or there are no answers left.
        CalibrationStopped: the user or the system requested the end.
    """
    found: dict[str, JointMove] = {}
    refused: list[str] = []
    for bus in bus_names(bench.rig):
        for name in (name for name in joints_on(bench.rig, bus) if name in names):
            try:
                measured = bench.rig.joints[name].model_facts.measures_position
                calibrate = _calibrate_smart_servo if measured else _calibrate_hobby_servo
                found[name] = calibrate(bench, name, bus)
            except (CalibrationRefused, ServoMissing, ServoFault) as error:
                refused.append(name)
                say(f"refused: {error}")
    # In the order of the rig, independent of the names of the buses.
    return {name: found[name] for name in names if name in found}, tuple(refused)


def refuse_impossible(rig: Rig, names: Sequence[str], how: CalibrationOptions) -> None:
    """Refuse options that the servos of these joints do not support.

    Raises:
        SetupError: names the joints, and the alternatives.
    """
    without_feedback = [
        name for name in names if not rig.joints[name].model_facts.measures_position
    ]
    if how.actuation is ActuationMode.motion and len(without_feedback) == len(names):
        raise SetupError(
            f"--by motion: hobby servos do not report their position ({', '.join(without_feedback)}), so no "
            "stop can be found: leave --by away and steer them yourself"
        )
    able = [kind for kind in KINDS.values() if kind.set_middle is not None]
    other = [
        name
        for name in names
        if not rig.joints[name].model_facts.measures_position
        or servo_kind(rig.joints[name].model).set_middle is None
    ]
    if how.set_middle and other:
        titles = " and ".join(kind.title for kind in able)
        raise SetupError(
            f"--set-middle: only {titles} servos can be set so, not that of {', '.join(other)}: "
            "choose joints with --joint"
        )
    if how.clear_offset and len(without_feedback) == len(names):
        raise SetupError("--clear-offset: hobby servos have no offset: leave it away")
    low, high = how.pulses_us
    least, most = 500.0, 2500.0
    if not least <= low < high <= most:
        raise SetupError(f"--pulses {low:g}:{high:g}: must ascend within {least:g}:{most:g} us")


def _calibrate_smart_servo(bench: CalibrationJob, name: str, bus: str) -> JointMove:
    guardian, joint, person = _guardian(bench, name, bus), bench.rig.joints[name], bench.operator
    with open_port(bench.rig, bench.wire, bus, guardian) as port:
        single = SmartServoAccess(name, joint, port, RealClock(), bench.stopped, guardian)
        person.hand = None
        if (buses := bench.wire.buses) is not None:
            person.hand = lambda steps: buses.command(f"turn {joint.id} {steps}", bus)
        with _torque_off_after(single.who, single.disable_torque, bench.stopped):
            return _calibrate(single, bench.options, person)


def _guardian(bench: CalibrationJob, name: str, bus: str) -> Guardian:
    """Return the guardian that switches one joint's servo off if this program dies or hangs."""
    plan = release_plan(bench.rig, bus, bench.wire.paths[bus])
    return Guardian((plan._replace(ids=(bench.rig.joints[name].id,)),))


def _calibrate(
    single: SmartServoAccess, how: CalibrationOptions, person: TerminalJogger
) -> JointMove:
    if how.clear_offset:
        was = single.clear_offset()
        if was:
            say(f"{single.who}: its offset {was} -> 0; {_VOID}")
    single.check()
    if how.set_middle:
        single.disable_torque()
        person.wait(
            f"turn {single.name} to the middle of its travel, then press Enter",
            lambda: f"{single.name}: step {single.position()[0]}",
        )
        say(f"{single.who}: its place is 2048 now (offset {single.set_middle()}); {_VOID}")
    if single.joint.transmission_points:
        if how.actuation is ActuationMode.motion:
            raise CalibrationRefused(
                f"{single.name}: its push rod has measured places (transmission_points), which motion cannot "
                "find: --by hand"
            )
        return calibrate_by_marks(
            HandMarker(single, person), person, how.margin_deg, how.extra_marks
        )
    if how.actuation is ActuationMode.hand:
        return calibrate_by_hand(single, person, how.margin_deg)
    # A heavy head must not move on its own without a confirmation.
    asked = (
        f"{single.name} will move on its own, and sink when the torque goes off: hold the head. "
        "Go on?"
    )
    if "neck" in single.name.split("_") and not person.agrees(asked):
        raise CalibrationRefused(f"{single.name}: left out as you asked")
    return calibrate_by_motion(single, person, how.margin_deg, how.search, how.zero.value)


_VOID = "until this calibration is written the rig file's zero is wrong by that"


def _calibrate_hobby_servo(bench: CalibrationJob, name: str, bus: str) -> JointMove:
    config = bench.rig.bus_named(bus)
    guardian = _guardian(bench, name, bus)
    port = port_at_path(bench.wire.paths[bus], on_traffic=guardian.beat)
    joint, how, person = bench.rig.joints[name], bench.options, bench.operator
    params = config.maestro if config.kind == "maestro" else config.pca9685
    hobby = HobbyServoAccess(
        name, joint, port, params, RealClock(), bench.stopped, how.pulses_us, guardian
    )
    person.hand = None
    with _torque_off_after(hobby.who, hobby.disable, bench.stopped):
        return calibrate_by_marks(
            HobbyMarker(hobby, person), person, how.margin_deg, how.extra_marks
        )


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
    zero: Annotated[
        ZeroReference,
        typer.Option(help="With --by motion: zero in the middle, or set by hand."),
    ] = ZeroReference.middle,
    strength: Annotated[
        float,
        typer.Option(min=0.05, max=1.0, help="With --by motion: drive as a share of the full one."),
    ] = 0.3,
    clear_offset: Annotated[
        bool, typer.Option("--clear-offset", help="Set the servo's own offset to 0 first.")
    ] = False,
    set_middle: Annotated[
        bool,
        typer.Option("--set-middle", help="Feetech: store the middle of the travel as 2048 first."),
    ] = False,
    pulses: Annotated[
        str, typer.Option(metavar="US:US", help="Hobby servos: shortest and longest pulse, us.")
    ] = "500:2500",
    more: Annotated[
        int, typer.Option(min=0, max=5, help="Push rods: positions between each two marks.")
    ] = 1,
    out: OutOption = None,
    dry_run: DryRunOption = False,
    yes: AllYesOption = False,
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
        search = StopSearchParams(strength=strength)
        span_us = _span(pulses)
        how = CalibrationOptions(by, margin, zero, search, clear_offset, set_middle, span_us, more)
        if dry_run and (clear_offset or set_middle):
            option = "--clear-offset" if clear_offset else "--set-middle"
            raise SetupError(f"--dry-run and {option} exclude each other: that is a write")
        if not dry_run:
            refuse_unwritable(rig, out)
            if out is None:
                # A linkage on several lines of the file cannot be rewritten: the lines are kept.
                behind_rods = [
                    one
                    for one in names
                    if loaded.joints[one].transmission_points
                    or not loaded.joints[one].model_facts.measures_position
                ]
                propose(
                    find_file("rigs", rig),
                    {f"joints.{one}.transmission_points": ((0, 0),) for one in behind_rods},
                )
        refuse_impossible(loaded, names, how)
        person = TerminalJogger(Lines(answers), stopped, yes)
        try:
            with rig_ports(loaded, mock, port) as wire:
                found, refused = measure(CalibrationJob(loaded, wire, how, person, stopped), names)
            if found:
                wanted: dict[str, Value] = {}
                for name, made in found.items():
                    wanted |= rig_changes(name, loaded.joints[name], made, loaded.park_deg)
                show_and_write(rig, loaded, wanted, out, dry_run, person)
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


def _span(pulses: str) -> tuple[float, float]:
    """Read --pulses."""
    low, _, high = pulses.partition(":")
    try:
        return float(low), float(high)
    except ValueError:
        raise SetupError(f"--pulses {pulses}: two pulse widths in us, e.g. 900:2100") from None
