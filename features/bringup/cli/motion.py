"""The command jog: one joint moved slowly, without a camera."""

import select
import sys
from collections.abc import Iterable
from math import inf
from typing import Annotated

import typer

from gazerig.config.schema import load_rig
from gazerig.features.bringup.cli.manual_session import holding_rig, holding_text
from gazerig.features.bringup.cli.ports import MockOption, PortOption, confirm_safe, rig_ports
from gazerig.features.bringup.manual_control import PASSING, SPEED_DEG_S, Step, refuse_angle
from gazerig.robot.app.rig_limits import limits
from gazerig.robot.cli.rig_command import RigCommand
from gazerig.robot.cli.terminal import FAULT, RigArgument, clear_errors, record_signals, say, status
from gazerig.robot.control.event_text import group_events

app = typer.Typer()

# A number below zero is an argument, not an option.
_NEGATIVE = {"ignore_unknown_options": True}


@app.command(cls=RigCommand, context_settings=_NEGATIVE)
def jog(
    rig: RigArgument = "desk",
    *,
    joint: Annotated[str, typer.Argument(metavar="JOINT", help="A joint, e.g. neck_yaw.")],
    deg: Annotated[float, typer.Argument(metavar="DEG", help="Joint angle in degrees.")],
    speed: Annotated[
        float, typer.Option(metavar="DEG_S", min=0.5, max=200.0, help="Top speed on the way.")
    ] = SPEED_DEG_S,
    seconds: Annotated[float, typer.Option(min=0.0, help="Stay there for S seconds.")] = 1.0,
    hold: Annotated[
        bool, typer.Option("--hold", help="Stay there with torque on until Enter or Ctrl-C.")
    ] = False,
    no_park: Annotated[
        bool,
        typer.Option(
            "--no-park", help="Switch the torque off at the present pose, without parking first."
        ),
    ] = False,
    yes: Annotated[
        bool, typer.Option("--yes", help="Hobby servos: do not ask; no hand is in the mechanism.")
    ] = False,
    mock: MockOption = False,
    port: PortOption = None,
) -> None:
    """Move one joint slowly while the others hold: gazerig jog my.yaml neck_yaw 20."""
    with clear_errors(rig, port, mock):  # before Ctrl-C is only recorded
        loaded = load_rig(rig)
        refuse_angle(joint, deg, loaded.names, limits(loaded.joints))
        facts = {name: loaded.joints[name].model_facts for name in loaded.names}
        limp = [name for name, servo in facts.items() if not servo.measures_position]
        if limp and not mock:
            confirm_safe(
                f"{', '.join(limp)}: hobby servos without pulses go to their parking "
                "place at once, at their own full speed",
                "take your hands out of the mechanism",
                "Is no hand in the mechanism?",
                yes,
            )
    with (
        clear_errors(rig, port, mock),
        record_signals() as stopped,
        rig_ports(loaded, mock, port) as wire,
    ):
        gentle = loaded.guard.soft_start_speed_deg_s
        if speed > gentle:
            say(f"--speed {speed:g}: no faster than the guard's gentle speed, {gentle:g} deg/s")
        watch = _StatusLine().show if sys.stderr.isatty() else None
        by_key = hold and sys.stdin.isatty()
        end = lambda: stopped() or (enter_pressed() if by_key else None)  # noqa: E731
        top = min(speed, gentle)
        with holding_rig(loaded, wire.paths, top, end, stopped, not no_park, watch) as control:
            _print_events(control.body.bus.events())
            say(f"{holding_text(loaded)}; Ctrl-C switches it off")
            moved = control.jog(joint, deg)
            _print_events(moved.events)
            for part in moved.joints:
                if part.joint == joint or part.reasons:
                    say(str(part))
            say(f"{moved} after {moved.seconds:.1f} s")
            if hold:
                say("holding: Enter or Ctrl-C ends it")
            if hold or seconds > 0.0:
                _print_events(control.hold(inf if hold else seconds).events)
    if not moved.arrived:
        raise typer.Exit(FAULT)


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


def _print_events(events: Iterable[str]) -> None:
    """Print the events by servo."""
    for line in group_events(events):
        say(line)
