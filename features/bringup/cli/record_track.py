"""The command record-track: torque off, and a track is recorded by hand."""

import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from gazerig.config.schema import load_rig
from gazerig.config.tracks import track_name
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import refuse_existing
from gazerig.features.bringup.cli.motion import enter_pressed
from gazerig.features.bringup.cli.ports import (
    MockOption,
    PortOption,
    confirm_safe,
    open_port,
    rig_ports,
)
from gazerig.features.bringup.hand_recording import LONGEST_S, record_hand_motion, switch_off
from gazerig.features.bringup.servo_kinds import servo_kind
from gazerig.features.bringup.telemetry import Monitor, SmartServoTelemetry
from gazerig.robot.cli.rig_command import RigCommand
from gazerig.robot.cli.terminal import (
    INTERRUPTED,
    ForceOption,
    RigArgument,
    clear_errors,
    record_signals,
    say,
)
from gazerig.robot.cli.tracks import FolderOption, print_track_fit
from gazerig.robot.model.clock import RealClock

app = typer.Typer()


@app.command("record-track", cls=RigCommand)
def record_track(
    rig: RigArgument = "desk",
    *,
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the track.")],
    seconds: Annotated[
        float, typer.Option(min=0.5, max=LONGEST_S, help="Longest time, s; Enter ends it earlier.")
    ] = LONGEST_S,
    folder: FolderOption = Path("."),
    force: ForceOption = False,
    yes: Annotated[
        bool, typer.Option("--yes", help="Do not ask: the head is held, torque may go off.")
    ] = False,
    mock: MockOption = False,
    port: PortOption = None,
) -> None:
    """Record a track in YAML while you move the head by hand, torque off."""
    with clear_errors(rig, port, mock):
        from gazerig.robot.app.track_file import track_text, write_track

        loaded = load_rig(rig)
        measured = [one for one in loaded.names if loaded.joints[one].model_facts.measures_position]
        if not measured:
            raise SetupError(
                f"{rig}: hobby servos do not report their position: none can be recorded"
            )
        track_name(f"{name}.yaml")
        refuse_existing(folder / f"{name}.yaml", force=force)
        confirm_safe(
            "the torque of all servos goes off and stays off: a heavy head drops",
            "hold it",
            "Is the head held, and no finger between its parts?",
            yes,
        )
        clock, there = RealClock(), {one: loaded.joints[one] for one in measured}
        with (
            record_signals() as stopped,
            rig_ports(loaded, mock, port) as wire,
            ExitStack() as ports,
        ):
            readers = {}
            for bus in dict.fromkeys(joint.bus for joint in there.values()):
                line = ports.enter_context(open_port(loaded, wire, bus))
                own = {one: joint for one, joint in there.items() if joint.bus == bus}
                switch_off(own, line)
                readers[bus] = SmartServoTelemetry(line, servo_kind(next(iter(own.values())).model))
            say(f"the torque is off; move the head, Enter ends it (within {seconds:g} s)")
            watch = Monitor(readers, there, clock.now_s)
            end = lambda: stopped() or (enter_pressed() if sys.stdin.isatty() else None)  # noqa: E731
            recorded = record_hand_motion(watch.sample, clock, end, seconds)
            say(f"recorded {len(recorded.series)} joints; the torque stays off")
            ended = stopped()
        if ended:
            say("ended by Ctrl-C: the torque is off, nothing is written")
            raise typer.Exit(INTERRUPTED)
        for one in recorded.left_out:
            say(f"{one}: answered too seldom and is left out")
        made = track_text(loaded, recorded.series, "recorded by hand")
        print_track_fit(loaded.name, *write_track(loaded, name, made.text, folder, force))
