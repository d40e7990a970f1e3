"""The command calibrate joints: zero, sign and range of each joint, found and written down."""

import contextlib
from collections.abc import Callable, Iterator, Mapping
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import Annotated, NamedTuple

import typer
from rich.console import Console
from rich.table import Table

from config.save import copy_shipped, rig_file, save_rig
from config.schema import Rig, load_rig
from drivers.errors import DriverError, ServoFault, ServoMissing, SetupError
from robot.bringup.single_joint import SingleJoint, Stopped
from robot.calibrate.calibrating import by_hand, by_motion
from robot.calibrate.calibration import Calibration, CalibrationRefused, changes
from robot.calibrate.stop_search import StopSearchParams
from robot.cli.person import Lines, TerminalPerson
from robot.cli.terminal import FAULT, RigArgument, clear_errors, say, signals
from robot.cli.wires import MockOption, PortOption, Wires, registers, wires
from robot.clock import RealClock


class By(StrEnum):
    """Who turns the joint."""

    hand = "hand"
    motion = "motion"


class ZeroBy(StrEnum):
    """Who says where straight ahead is, after the stops were found by motion."""

    middle = "middle"
    person = "person"


def calibrate_joints(
    rig: RigArgument = "desk",
    joint: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="This joint (again: more); else all.")
    ] = None,
    by: Annotated[By, typer.Option(help="Turned by hand, torque off, or gently by itself.")] = (
        By.hand
    ),
    margin: Annotated[
        float, typer.Option(metavar="DEG", min=0.0, max=20.0, help="Kept from each end.")
    ] = 2.0,
    zero: Annotated[
        ZeroBy, typer.Option(help="With --by motion: zero half-way, or where a person puts it.")
    ] = ZeroBy.middle,
    strength: Annotated[
        float, typer.Option(min=0.05, max=1.0, help="With --by motion: share of full strength.")
    ] = 0.3,
    clear_offset: Annotated[
        bool, typer.Option("--clear-offset", help="Set a servo's Homing Offset to 0 first.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option(help="Copy a shipped rig to this file and write there.")
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Show what would change, write nothing.")
    ] = False,
    yes: Annotated[bool, typer.Option("--yes", help="Answer every yes or no with yes.")] = False,
    answers: Annotated[
        Path | None, typer.Option(help="File with one answer a line; empty is Enter.")
    ] = None,
    mock: MockOption = False,
    port: PortOption = None,
) -> None:
    """Find zero, sign and range of each joint and write them into the rig's YAML."""
    with clear_errors(), signals() as stopped:
        loaded = load_rig(rig)
        names = _names(loaded, joint)
        if dry_run and clear_offset:
            raise SetupError("--dry-run and --clear-offset exclude each other: that is a write")
        if not dry_run:
            refuse_unwritable(rig, out)
        how = _How(by, margin, zero, StopSearchParams(strength=strength), clear_offset)
        person = TerminalPerson(Lines(answers), stopped, yes)
        try:
            with wires(loaded, mock, port) as wire:
                found, refused = _measure(loaded, names, how, wire, person, stopped)
            if found:
                wanted = _wanted(loaded, found)
                Console().print(_table(rig, wanted))
                if not dry_run:
                    _write(rig, wanted, out, person)
        except Stopped as why:
            say(f"stopped by {why}: nothing written")
            raise typer.Exit(FAULT) from None
    if refused:
        say(f"not calibrated: {', '.join(refused)}")
        raise typer.Exit(FAULT)


class _How(NamedTuple):
    """How to calibrate, as asked on the command line."""

    by: By
    margin_deg: float
    zero: ZeroBy
    search: StopSearchParams
    clear_offset: bool


def _measure(
    rig: Rig,
    names: tuple[str, ...],
    how: _How,
    wire: Wires,
    person: TerminalPerson,
    stopped: Callable[[], str | None],
) -> tuple[dict[str, Calibration], list[str]]:
    """Calibrate one joint after the other; gives what was found and which were refused."""
    found: dict[str, Calibration] = {}
    refused: list[str] = []
    with registers(wire.paths[""], rig.bus.baud) as (regs, _):
        for name in names:
            single = SingleJoint(name, rig.joints[name], regs, RealClock(), stopped)
            person.hand = _hand(wire, single.joint.id)
            try:
                with _let_go_after(single):
                    found[name] = _measure_one(single, how, person)
            except (CalibrationRefused, ServoMissing, ServoFault) as error:
                refused.append(name)
                say(f"refused: {error}")
    return found, refused


def _measure_one(single: SingleJoint, how: _How, person: TerminalPerson) -> Calibration:
    if how.clear_offset:
        _clear_offset(single)
    single.check()
    if how.by is By.hand:
        return by_hand(single, person, how.margin_deg)
    _warn_of_neck(single.name, person)
    return by_motion(single, person, how.margin_deg, how.search, how.zero.value)


def _names(rig: Rig, asked: list[str] | None) -> tuple[str, ...]:
    """Give the joints to calibrate, in the order of the rig."""
    for name in asked or ():
        if name not in rig.joints:
            raise SetupError(f"--joint {name}: no such joint; there is {', '.join(rig.names)}")
    return tuple(name for name in rig.names if not asked or name in asked)


def refuse_unwritable(rig: str, out: Path | None) -> None:
    """Find out before anything is calibrated that nothing could be written.

    Raises:
        config.load.ConfigError, drivers.errors.SetupError: why, and what to do.
    """
    if out is None:
        save_rig(rig, {}, datetime.now())
    elif out.exists():
        raise SetupError(f"--out {out}: there is such a file: give it as RIG instead")
    elif "/" in rig or rig.endswith((".yaml", ".yml")):
        raise SetupError(f"--out copies a shipped rig; {rig} is a file of yours: leave --out away")


def _hand(wire: Wires, servo_id: int) -> Callable[[int], None] | None:
    """Give what turns an emulated servo by some steps; None on real wires."""
    if wire.buses is None:
        return None

    def turn(steps: int) -> None:
        wire.command(f"turn {servo_id} {steps}", "")

    return turn


@contextlib.contextmanager
def _let_go_after(single: SingleJoint) -> Iterator[None]:
    """Take the torque away however the block ends."""
    try:
        yield
    finally:
        try:
            single.let_go()
        except DriverError as error:
            say(f"{single.who}: torque-off could not be confirmed ({error})")


def _clear_offset(single: SingleJoint) -> None:
    was = single.clear_offset()
    if was:
        say(
            f"{single.who}: Homing Offset {was} -> 0; until this calibration is written "
            "the rig file's zero is wrong by that"
        )


def _warn_of_neck(name: str, person: TerminalPerson) -> None:
    """Ask before something as heavy as a head moves by itself.

    Raises:
        robot.calibrate.calibration.CalibrationRefused: the answer was no.
    """
    if not name.startswith("neck"):
        return
    asked = f"{name} will move by itself, and sink when the torque goes off: hold the head. Go on?"
    if not person.agrees(asked):
        raise CalibrationRefused(f"{name}: left out as you wished")


def _wanted(rig: Rig, found: Mapping[str, Calibration]) -> dict[str, tuple[object, int | float]]:
    """Give key -> old and new value for all joints found."""
    wanted: dict[str, tuple[object, int | float]] = {}
    for name, made in found.items():
        for key, value in changes(name, rig.joints[name], made, rig.park_deg).items():
            wanted[key] = (_old(rig, key), value)
    return wanted


def _old(rig: Rig, key: str) -> object:
    """Follow a dotted key through mappings and attributes."""
    value: object = rig
    for step in key.split("."):
        value = value[step] if isinstance(value, Mapping) else getattr(value, step)
    return value


def _table(rig: str, wanted: Mapping[str, tuple[object, int | float]]) -> Table:
    table = Table(caption=f"what was found, against {rig}")
    for name in ("key", "old", "new"):
        table.add_column(name, justify="left" if name == "key" else "right", no_wrap=True)
    for key, (old, new) in wanted.items():
        table.add_row(key, f"{old}", f"{new}", style="bold" if key.endswith("sign") else None)
    return table


def _write(
    rig: str,
    wanted: Mapping[str, tuple[object, int | float]],
    out: Path | None,
    person: TerminalPerson,
) -> None:
    """Write what differs after a yes, and say where the old file is."""
    if not wanted:
        say("everything is as the rig file says: nothing to write")
        return
    where = rig_file(rig) if out is None else out
    if not person.agrees(f"write these {len(wanted)} values into {where}?"):
        say("nothing written")
        return
    if out is not None:
        copy_shipped(rig, out)
    saved = save_rig(where, {key: new for key, (_, new) in wanted.items()}, datetime.now())
    for change in saved.changes:
        say(str(change))
    say(f"written into {saved.path}; as it was: {saved.backup}")
