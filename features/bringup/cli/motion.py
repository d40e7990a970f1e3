"""The command jog: one joint moved slowly, without a camera."""

import contextlib
import select
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from math import inf
from typing import Annotated

import typer

from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.features.bringup.cli.ports import (
    MockOption,
    PortOption,
    YesOption,
    confirm_safe,
    rig_ports,
)
from gazerig.features.bringup.manual_control import (
    RATE_HZ,
    SPEED_DEG_S,
    ManualControl,
    park_slowly,
    refuse_angle,
)
from gazerig.robot.cli.terminal import FAULT, RigArgument, clear_errors, record_signals, say
from gazerig.robot.loop.body import Body
from gazerig.robot.loop.events import group_events
from gazerig.robot.loop.power_down import Interrupts, PowerDown
from gazerig.robot.model.clock import RealClock
from gazerig.robot.run.buses import guarded_rig_bus
from gazerig.robot.run.rig_limits import limits
from gazerig.robot.safety.guard import Guard

app = typer.Typer()

# A number below zero is an argument, not an option.
_NEGATIVE = {"ignore_unknown_options": True}


@app.command(context_settings=_NEGATIVE)
def jog(
    rig: RigArgument,
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
    yes: YesOption = False,
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
        by_key = hold and sys.stdin.isatty()
        end = lambda: stopped() or (enter_pressed() if by_key else None)  # noqa: E731
        top = min(speed, gentle)
        with holding_rig(loaded, wire.paths, top, end, stopped, not no_park) as control:
            _print_events(control.body.bus.events())
            say(f"{holding_text(loaded)}; Ctrl-C switches it off")
            moved = control.jog(joint, deg)
            _print_events(moved.events)
            for part in moved.joints.values():
                if part.joint == joint or part.reasons:
                    say(str(part))
            say(f"{moved} after {moved.seconds:.1f} s")
            if hold:
                say("holding: Enter or Ctrl-C ends it")
            if hold or seconds > 0.0:
                _print_events(control.hold(inf if hold else seconds).events)
    if not moved.arrived:
        raise typer.Exit(FAULT)


def enter_pressed() -> str | None:
    """Return whether Enter was pressed, without waiting."""
    if not select.select([sys.stdin], [], [], 0.0)[0]:
        return None
    try:
        return "Enter" if sys.stdin.readline() else "the end of standard input"
    except OSError:
        return "a terminal that is gone"


def _print_events(events: Iterable[str]) -> None:
    for line in group_events(events):
        say(line)


_UNRELEASED = (
    ": servos hold their last goal or pulse until their own watchdog stops them, the servo power is "
    "cut, or the guardian, which tries for 10 s, reaches the port"
)


@contextlib.contextmanager
def holding_rig(
    rig: Rig,
    paths: Mapping[str, str],
    speed_deg_s: float,
    stopped: Callable[[], str | None],
    interrupts: Interrupts,
    park: bool = True,
) -> Iterator[ManualControl]:
    """Switch torque on at the present pose; at the end of the block park, torque off, close.

    Args:
        rig: the rig to move.
        paths: paths of the serial ports, by the name of the bus.
        speed_deg_s: top speed of the motion.
        stopped: returns why to end a motion, None without a reason.
        interrupts: requests to end this program.
        park: whether to park the joints at the end.

    Raises:
        SetupError: port or servos do not match the configuration.
        typer.Exit: not all servos confirmed the torque-off after a successful block.
    """
    body = Body(guarded_rig_bus(rig, paths), rig.joints, pairs=rig.couplings.values())
    guard = Guard(rig.guard, limits(rig.joints), rig.names, period_s=1.0 / RATE_HZ)
    control = ManualControl(body, guard, RealClock(), speed_deg_s, stopped)
    with PowerDown(
        (lambda again: park_slowly(control, rig.park_deg, again)) if park else None,
        control.stop,
        say,
        interrupts,
        "torque off on all servos",
        _UNRELEASED,
    ) as way_out:
        way_out.switch_on(control.start)
        yield control
    if way_out.unreleased:
        raise typer.Exit(FAULT)


def holding_text(rig: Rig) -> str:
    """Return the behaviour of the servos once the torque is on."""
    hobby = [name for name in rig.names if not rig.joints[name].model_facts.measures_position]
    texts = []
    if measured := len(rig.names) - len(hobby):
        texts.append(f"torque on: {measured} servos hold where they are")
    if hobby:
        where = "hobby servos hold where their pulses are (estimated: they report nothing)"
        texts.append(f"{len(hobby)} {where}")
    return ", ".join(texts)
