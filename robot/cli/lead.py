"""Commands that lead, stop and resume a rig which runs in another terminal."""

import contextlib
from collections.abc import Sequence
from math import inf
from typing import Annotated

import typer

from gazerig.drivers.errors import DriverError, SetupError
from gazerig.robot.cli.terminal import FAULT, clear_errors, say
from gazerig.robot.model.clock import RealClock
from gazerig.robot.remote.client import RobotClient, running

app = typer.Typer()
_LEADS_EVERY_S = 0.2
_NEGATIVE = {"ignore_unknown_options": True}
"""Click settings: -3 is a number, no option."""

PidOption = Annotated[
    int | None,
    typer.Option("--pid", metavar="N", help="Of several running rigs that of process N."),
]


@app.command(context_settings=_NEGATIVE)
def look(
    where: Annotated[
        list[str],
        typer.Argument(
            metavar="X Y Z | free", help="Metres ahead, left and up of the neck; or free."
        ),
    ],
    stay: Annotated[
        bool, typer.Option("--stay", help="Return at once; it looks there until: look free.")
    ] = False,
    seconds: Annotated[
        float | None, typer.Option(min=0.0, help="Look there for S seconds; else until Ctrl-C.")
    ] = None,
    pid: PidOption = None,
) -> None:
    """Make the running head look at a point while this command runs, or freely again."""
    with clear_errors():
        point = read_point(where)
        with RobotClient.connect(pid, "gazerig ctl look") as rig:
            if point is None:
                rig.look_freely()
                say("it looks freely")
                return
            reply = rig.look_at(*point, stay=stay)
            until = "gazerig ctl look free" if stay else _until(seconds)
            say(f"{reply.text()}, until: {until}")
            if not stay:
                _lead_on(rig, inf if seconds is None else seconds)


def _until(seconds: float | None) -> str:
    return "Ctrl-C" if seconds is None else f"{seconds:g} s have passed"


def _lead_on(rig: RobotClient, seconds: float) -> None:
    """Lead for so long, or until Ctrl-C or until another client leads; then end the lead."""
    clock = RealClock()
    end_s = clock.now_s() + seconds
    with contextlib.suppress(KeyboardInterrupt):
        while rig.leads and clock.now_s() < end_s:
            clock.sleep_until(min(end_s, clock.now_s() + _LEADS_EVERY_S))
    if rig.leads:
        rig.look_freely()
        say("it looks freely")
        return
    now = rig.status()
    stopped = f"it was stopped: {now['stopped']}" if now["stopped"] else "it looks freely"
    say(f"led by {now['led']}" if now["led"] else stopped)


@app.command()
def stop(
    why: Annotated[str, typer.Argument(help="Reason, for the log.")] = "gazerig stop",
    pid: PidOption = None,
) -> None:
    """Torque off at once, of every rig that runs here; nothing parks, the programs go on."""
    with clear_errors():
        rigs = running(pid, "gazerig stop")
        if not rigs:
            RobotClient.connect(pid)  # says why there is none
        failed = False
        for rig in rigs:
            try:
                with rig:
                    rig.stop(why)
            except DriverError as error:
                failed = True
                say(f"{rig.pid}: NOT KNOWN TO HAVE STOPPED, press the emergency stop: {error}")
            else:
                say(f"{rig.pid}: torque is off; gazerig ctl resume goes on")
    if failed:
        raise typer.Exit(FAULT)


@app.command()
def resume(
    yes: Annotated[
        bool, typer.Option("--confirm", "--yes", help="No hand is in the mechanism, do not ask.")
    ] = False,
    pid: PidOption = None,
) -> None:
    """Switch the torque on again after a stop, where the joints are, and go on slowly."""
    with clear_errors(), RobotClient.connect(pid, "gazerig ctl resume") as rig:
        now = rig.status()
        if not now["stopped"]:
            say("it was not stopped: nothing to resume")
            return
        if not yes:
            say(f"stopped: {now['stopped']}")
            typer.confirm("The torque goes on and the head moves. Is no hand in it?", abort=True)
        rig.resume(confirmed=True)
        say("torque is on; it goes on slowly")


def read_point(coordinates: Sequence[str]) -> tuple[float, float, float] | None:
    """Read X Y Z in metres, or "free" as None.

    Raises:
        SetupError: it is neither.
    """
    if list(coordinates) == ["free"]:
        return None
    try:
        x, y, z = map(float, coordinates)
    except ValueError:
        raise SetupError(
            f"{' '.join(coordinates)}: give X Y Z in metres (ahead, left, up), or free"
        ) from None
    return x, y, z
