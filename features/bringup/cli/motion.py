"""The command jog: one joint moved slowly, without a camera."""

import contextlib
import select
import sys
from collections.abc import Iterable, Iterator
from math import inf
from typing import Annotated

import typer

from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.features.bringup.cli.manual_session import holding_rig, holding_text
from gazerig.features.bringup.cli.ports import MockOption, PortOption, confirm_safe, rig_ports
from gazerig.features.bringup.manual_control import (
    PASSING,
    JogParams,
    ManualControl,
    MoveResult,
    Step,
    refuse_angle,
)
from gazerig.robot.app.rig_limits import limits
from gazerig.robot.cli.rig_command import RigCommand
from gazerig.robot.cli.terminal import FAULT, RigArgument, clear_errors, record_signals, say, status
from gazerig.robot.control.event_text import group_events

app = typer.Typer()

# A number below zero is an argument, not an option.
_NEGATIVE = {"ignore_unknown_options": True}

SpeedOption = Annotated[
    float, typer.Option(metavar="DEG_S", min=0.5, max=200.0, help="Top speed on the way.")
]
HoldOption = Annotated[
    bool, typer.Option("--hold", help="Stay there with torque on until Enter or Ctrl-C.")
]
YesOption = Annotated[
    bool, typer.Option("--yes", help="Hobby servos: do not ask; no hand is in the mechanism.")
]
NoParkOption = Annotated[
    bool,
    typer.Option(
        "--no-park", help="Switch the torque off at the present pose, without parking first."
    ),
]


@app.command(cls=RigCommand, context_settings=_NEGATIVE)
def jog(
    rig: RigArgument = "desk",
    *,
    joint: Annotated[str, typer.Argument(metavar="JOINT", help="A joint, e.g. neck_yaw.")],
    deg: Annotated[float, typer.Argument(metavar="DEG", help="Joint angle in degrees.")],
    speed: SpeedOption = 20.0,
    seconds: Annotated[float, typer.Option(min=0.0, help="Stay there for S seconds.")] = 1.0,
    hold: HoldOption = False,
    no_park: NoParkOption = False,
    yes: YesOption = False,
    mock: MockOption = False,
    port: PortOption = None,
) -> None:
    """Move one joint slowly while the others hold: gazerig jog my.yaml neck_yaw 20."""
    with clear_errors(rig, port, mock):
        loaded = load_rig(rig)
        refuse_angle(joint, deg, loaded.names, limits(loaded.joints))
    with _manual_control(loaded, rig, mock, port, yes, speed, hold, not no_park) as control:
        moved = control.jog(joint, deg)
        _report(moved, (joint,))
        _hold(control, seconds, hold)
    _exit_unless(moved.arrived)


@contextlib.contextmanager
def _manual_control(
    rig: Rig,
    name: str,
    mock: bool,
    port: str | None,
    yes: bool,
    speed: float,
    hold: bool,
    park: bool,
) -> Iterator[ManualControl]:
    """Return a rig that holds its pose; in all cases it ends with the torque off.

    name: name of the rig on the command line, for the commands that messages suggest
    """
    without_feedback = [
        name for name in rig.names if not rig.joints[name].model_facts.measures_position
    ]
    if without_feedback and not mock:
        with clear_errors(name, port):  # before Ctrl-C is only recorded
            confirm_safe(
                f"{', '.join(without_feedback)}: hobby servos without pulses go to their parking "
                "place at once, at their own full speed",
                "take your hands out of the mechanism",
                "Is no hand in the mechanism?",
                yes,
            )
    with (
        clear_errors(name, port, mock),
        record_signals() as stopped,
        rig_ports(rig, mock, port) as wire,
    ):
        gentle = rig.guard.soft_start_speed_deg_s
        if speed > gentle:
            say(f"--speed {speed:g}: no faster than the guard's gentle speed, {gentle:g} deg/s")
        params = JogParams(speed_deg_s=min(speed, gentle))
        watch = _StatusLine().show if sys.stderr.isatty() else None
        by_key = hold and sys.stdin.isatty()
        end = lambda: stopped() or (enter_pressed() if by_key else None)  # noqa: E731
        with holding_rig(rig, wire.paths, params, end, stopped, park, watch) as control:
            _print_events(control.body.bus.events())
            say(f"{holding_text(rig)}; Ctrl-C switches it off")
            yield control


class _StatusLine:
    """Shows the reasons that limit a motion; written only when they change."""

    def __init__(self) -> None:
        self._shown = ""

    def show(self, step: Step) -> None:
        reasons = [r for r in step.guard_result.reasons if r.partition(": ")[2] not in PASSING]
        line = ", ".join(reasons) or "on the way"
        if line != self._shown:
            self._shown = line
            status(line)


def enter_pressed() -> str | None:
    """Return whether Enter was pressed, without waiting."""
    if not select.select([sys.stdin], [], [], 0.0)[0]:
        return None
    try:
        return "Enter" if sys.stdin.readline() else "the end of standard input"
    except OSError:
        return "a terminal that is gone"


def _hold(control: ManualControl, seconds: float, hold: bool) -> None:
    if hold:
        say("holding: Enter or Ctrl-C ends it")
    if hold or seconds > 0.0:
        _print_events(control.hold(inf if hold else seconds).events)


def _report(moved: MoveResult, asked: tuple[str, ...]) -> None:
    """Print the result for the commanded joints and those that were limited or failed."""
    _print_events(moved.events)
    for applied in moved.joints:
        if applied.joint in asked or applied.reasons:
            say(str(applied))
    say(f"{moved} after {moved.seconds:.1f} s")


def _print_events(events: Iterable[str]) -> None:
    """Print the events by servo."""
    for line in group_events(events):
        say(line)


def _exit_unless(good: bool) -> None:
    if not good:
        raise typer.Exit(FAULT)
