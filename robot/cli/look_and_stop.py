"""Commands that move, stop and resume a rig in another terminal."""

import contextlib
from collections.abc import Sequence
from math import inf, radians
from typing import Annotated

import typer
from msgspec import structs

from gazerig.drivers.errors import DriverError, SetupError
from gazerig.robot.cli.terminal import FAULT, clear_errors, confirm, say
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.commands import (
    FAR_M,
    Look,
    LookAt,
    LookAtDirection,
    LookAtInHead,
    LookAtPerson,
    LookAtPixel,
)
from gazerig.robot.net.client import RobotClient, connect_to_all

app = typer.Typer()
_LEADS_EVERY_S = 0.2
_NEGATIVE = {"ignore_unknown_options": True}
"""Click settings: -3 is a number, not an option."""

PidOption = Annotated[
    str | None,
    typer.Option(
        "--rig",
        "--pid",
        metavar="NAME|N",
        help="Name or process id of the rig, if several run.",
    ),
]


@app.command(context_settings=_NEGATIVE)
def look(
    where: Annotated[
        list[str],
        typer.Argument(
            metavar="X Y Z | person N | pixel X Y | direction YAW PITCH | free",
            help="Metres ahead, left and up of the neck; a person's number; a pixel of the frame; "
            "degrees to the left and up; or free.",
        ),
    ],
    head: Annotated[
        bool,
        typer.Option("--head", help="X Y Z or YAW PITCH are relative to the present head pose."),
    ] = False,
    distance: Annotated[
        float | None, typer.Option(metavar="M", help="Distance of a pixel or direction, metres.")
    ] = None,
    stay: Annotated[
        bool,
        typer.Option("--stay", help="Return immediately; the head looks there until: look free."),
    ] = False,
    seconds: Annotated[
        float | None,
        typer.Option(min=0.0, help="Look there for S seconds; otherwise until Ctrl-C."),
    ] = None,
    pid: PidOption = None,
) -> None:
    """Make the running head look at a target while this command runs, or look freely again."""
    with clear_errors():
        command = read_look(where, head, distance)
        with RobotClient.connect(pid, "gazerig ctl look") as rig:
            if command == LookAt(None):
                rig.look_freely()
                say("it looks freely")
                return
            reply = rig.send(structs.replace(command, stay=stay))
            until = "Ctrl-C" if seconds is None else f"{seconds:g} s have passed"
            say(f"{reply.text()}, until: {'gazerig ctl look free' if stay else until}")
            if stay:
                return
            # Until Ctrl-C or until another client controls the gaze.
            clock = RealClock()
            end_s = clock.now_s() + (inf if seconds is None else seconds)
            with contextlib.suppress(KeyboardInterrupt):
                while rig.in_control and clock.now_s() < end_s:
                    clock.sleep_until(min(end_s, clock.now_s() + _LEADS_EVERY_S))
            if rig.in_control:
                rig.look_freely()
                say("it looks freely")
                return
            now = rig.status()
            stopped = f"it was stopped: {now['stopped']}" if now["stopped"] else "it looks freely"
            say(f"controlled by {now['controlled_by']}" if now["controlled_by"] else stopped)


@app.command()
def stop(
    why: Annotated[str, typer.Argument(help="Reason for the log.")] = "gazerig stop",
    pid: PidOption = None,
) -> None:
    """Switch the torque of every running rig off at once; nothing parks, the programs continue."""
    with clear_errors():
        rigs = connect_to_all(pid, "gazerig stop")
        if not rigs:
            RobotClient.connect(pid)  # raises the reason
        failed = False
        for rig in rigs:
            try:
                with rig:
                    rig.stop(why)
            except DriverError as error:
                failed = True
                say(f"{rig.pid}: NOT KNOWN TO HAVE STOPPED, press the emergency stop: {error}")
            else:
                say(f"{rig.pid}: torque is off; gazerig ctl resume continues")
    if failed:
        raise typer.Exit(FAULT)


@app.command()
def resume(
    yes: Annotated[
        bool, typer.Option("--confirm", "--yes", help="Do not ask: no hand is in the mechanism.")
    ] = False,
    pid: PidOption = None,
) -> None:
    """Switch the torque on again after a stop, at the present pose, and continue slowly."""
    with clear_errors(), RobotClient.connect(pid, "gazerig ctl resume") as rig:
        now = rig.status()
        if not now["stopped"]:
            say("it was not stopped: nothing to resume")
            return
        if not yes:
            say(f"stopped: {now['stopped']}")
            confirm(
                "Torque will be switched on and the head will move. Is no hand in the mechanism?",
                abort=True,
            )
        rig.resume(confirmed=True)
        say("torque is on; it continues slowly")


def read_look(words: Sequence[str], head: bool = False, distance_m: float | None = None) -> Look:
    """Return the gaze target of the arguments.

    Args:
        words: X Y Z in metres, "person" N, "pixel" X Y, "direction" YAW PITCH in degrees, "free".
        head: Whether a point or direction is relative to the present head pose.
        distance_m: Distance of a pixel or direction.

    Raises:
        SetupError: the words are not a target.
    """
    kind, numbers = (words[0], words[1:]) if words[0] in _NUMBERS else ("point", words)
    try:
        found = tuple(map(float, numbers))
        if len(found) != _NUMBERS[kind] or (kind == "person" and found[0] % 1.0):
            raise ValueError
    except ValueError:
        raise SetupError(
            f"{' '.join(words)}: give X Y Z in metres (ahead, left, up), person N, pixel X Y, "
            "direction YAW PITCH in degrees (left, up), or free"
        ) from None
    if kind == "free":
        return LookAt(None)
    if kind == "person":
        return LookAtPerson(int(found[0]))
    if kind == "pixel":
        return LookAtPixel((found[0], found[1]), distance_m)
    if kind == "direction":
        angles = (radians(found[0]), radians(found[1]))
        far_m = FAR_M if distance_m is None else distance_m
        return LookAtDirection(angles, "head" if head else "world", far_m)
    point = (found[0], found[1], found[2])
    return LookAtInHead(point) if head else LookAt(point)


_NUMBERS = {"point": 3, "person": 1, "pixel": 2, "direction": 2, "free": 0}
"""Kinds of targets, and the number of their numbers."""
