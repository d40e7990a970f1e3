"""The command record-track: a track is recorded by hand, torque off, or of a running head."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.config.tracks import check_name
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import refuse_existing
from gazerig.features.bringup.cli.monitor import open_readers
from gazerig.features.bringup.cli.motion import enter_pressed
from gazerig.features.bringup.cli.ports import (
    MockOption,
    PortOption,
    YesOption,
    confirm_safe,
    open_port,
    rig_ports,
)
from gazerig.features.bringup.hand_recording import (
    LONGEST_S,
    HandRecording,
    record_hand_motion,
    record_live,
    switch_off,
)
from gazerig.features.bringup.telemetry import Monitor
from gazerig.gaze.track.track import MAX_DURATION_S
from gazerig.robot.cli.options import FolderOption, PidOption, print_track_fit
from gazerig.robot.cli.terminal import (
    INTERRUPTED,
    ForceOption,
    RigArgument,
    clear_errors,
    record_signals,
    say,
)
from gazerig.robot.loop.head_state import HeadState
from gazerig.robot.model.clock import RealClock
from gazerig.robot.net.client import RobotClient

app = typer.Typer()


@app.command("record-track")
def record_track(
    rig: RigArgument,
    *,
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the track.")],
    live: Annotated[
        bool,
        typer.Option("--live", help="Record what moves a running head: page, keys or program."),
    ] = False,
    joint: Annotated[
        list[str] | None,
        typer.Option(help="With --live: this joint only; repeatable; default: those of no track."),
    ] = None,
    which: PidOption = None,
    seconds: Annotated[
        float | None,
        typer.Option(min=0.5, max=MAX_DURATION_S, help="Longest time, s; Enter ends it earlier."),
    ] = None,
    folder: FolderOption = Path("."),
    force: ForceOption = False,
    yes: YesOption = False,
    mock: MockOption = False,
    port: PortOption = None,
) -> None:
    """Record a track in YAML: by hand with torque off, or with --live of a running head."""
    with clear_errors(rig, port, mock):
        from gazerig.robot.run.track_file import write_track

        loaded = load_rig(rig)
        path = folder / f"{name}.yaml"
        check_name(path)
        refuse_existing(path, force=force)
        with record_signals() as stopped:
            end = lambda: stopped() or (enter_pressed() if sys.stdin.isatty() else None)  # noqa: E731
            if live:
                recorded = _record_live(which, joint or [], end, seconds or MAX_DURATION_S)
            else:
                recorded = _record_hand(loaded, mock, port, yes, end, seconds or LONGEST_S)
            ended = stopped()
        if ended:
            say("ended by Ctrl-C: nothing is written" + ("" if live else "; the torque is off"))
            raise typer.Exit(INTERRUPTED)
        say(f"recorded {len(recorded.series)} joints; ended: {recorded.ended_by}")
        for one in recorded.left_out:
            say(f"{one}: answered too seldom and is left out")
        description = "recorded from a running head" if live else "recorded by hand"
        reply = write_track(loaded, path, recorded.series, description, force=force, owned=live)
        print_track_fit(loaded.name, path, reply)


def _record_hand(
    rig: Rig,
    mock: bool,
    port: str | None,
    yes: bool,
    end: Callable[[], str | None],
    seconds: float,
) -> HandRecording:
    """Switch the torque off, and record a head that is moved by hand."""
    measured = [one for one in rig.names if rig.joints[one].model_facts.measures_position]
    if not measured:
        raise SetupError(
            f"{rig.name}: hobby servos do not report their position: none can be recorded"
        )
    confirm_safe(
        "the torque of all servos goes off and stays off: a heavy head drops",
        "hold it",
        "Is the head held, and no finger between its parts?",
        yes,
    )
    clock, there = RealClock(), {one: rig.joints[one] for one in measured}
    with rig_ports(rig, mock, port) as wire:
        for bus in dict.fromkeys(joint.bus for joint in there.values()):
            with open_port(rig, wire, bus) as line:
                switch_off({one: joint for one, joint in there.items() if joint.bus == bus}, line)
        say(f"the torque is off and stays off; move the head, Enter ends it (within {seconds:g} s)")
        with open_readers(rig, wire, there) as readers:
            watch = Monitor(readers, there, clock.now_s)
            return record_hand_motion(watch.sample, clock, end, seconds)


def _record_live(
    which: str | None, joints: list[str], end: Callable[[], str | None], seconds: float
) -> HandRecording:
    """Record a running head, which others move."""
    with RobotClient.connect(which, "record-track") as head:

        def read() -> HeadState:
            state = head.state()[0]
            if state is None:
                raise SetupError("the head has just started: its loop is not running yet")
            return state

        say(f"recording what moves the head; Enter ends it (within {seconds:g} s)")
        return record_live(read, joints, RealClock(), end, seconds)
