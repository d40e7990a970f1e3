"""The command run."""

import json
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from gazerig.drivers.file_output import refuse_existing, write_file
from gazerig.robot.app.options import RunOptions
from gazerig.robot.cli.examples import complete_scene, complete_shipped
from gazerig.robot.cli.rig_command import RigCommand
from gazerig.robot.cli.terminal import FAULT, RigArgument, clear_errors, say, signals, status
from gazerig.robot.control.joint_faults import JointFault

app = typer.Typer()


@app.command(cls=RigCommand)
def run(
    rig: RigArgument = "desk",
    mock: Annotated[bool, typer.Option(help="Emulated servo bus instead of the rig's.")] = False,
    port: Annotated[str | None, typer.Option(help="Serial port instead of the rig's.")] = None,
    scene: Annotated[
        str | None,
        typer.Option(
            help="Look at a simulated scene (default with --mock: visitor).",
            autocompletion=complete_scene,
        ),
    ] = None,
    video: Annotated[Path | None, typer.Option(help="Look at a film or picture, looped.")] = None,
    camera: Annotated[int | None, typer.Option(help="Look through webcam N.")] = None,
    oak: Annotated[bool, typer.Option(help="Look through an OAK-D camera.")] = False,
    replay: Annotated[
        Path | None,
        typer.Option(
            "--camera-recording", help="Look at a recording of record-camera, again and again."
        ),
    ] = None,
    pixels: Annotated[
        bool, typer.Option(help="Draw the scene and find faces and motion in the pictures.")
    ] = False,
    seconds: Annotated[float | None, typer.Option(min=0.0, help="Stop after S seconds.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of all dice.")] = 0,
    fast: Annotated[
        bool, typer.Option(help="Simulated clock: as fast as it goes (needs --mock).")
    ] = False,
    profile: Annotated[
        str | None,
        typer.Option(
            help="Style of gaze: robot, or literal mitake, nakamoto.",
            autocompletion=complete_shipped("profiles"),
        ),
    ] = None,
    character: Annotated[
        str | None,
        typer.Option(
            help="A character laid over the rig: shy, bold, sleepy, strong_boxer ...",
            autocompletion=complete_shipped("characters"),
        ),
    ] = None,
    rules: Annotated[
        str | None,
        typer.Option(
            help="Rule set instead of the rig's: boxing, conversation.",
            autocompletion=complete_shipped("rules"),
        ),
    ] = None,
    behaviour: Annotated[
        str | None, typer.Option(help="Behaviour in force at the start, one of the rig's rules.")
    ] = None,
    conversation: Annotated[
        str | None, typer.Option(help="Looking away as in: talk, listen, think; none (default).")
    ] = None,
    scanpath: Annotated[
        str | None, typer.Option(help="Face scanpath: markov, simple, face_tracking, random.")
    ] = None,
    saccade: Annotated[
        str | None, typer.Option(help="Saccades: min_jerk, main_sequence, literal_frame.")
    ] = None,
    page: Annotated[
        str,
        typer.Option(
            metavar="HOST:PORT",
            help="Where the live page is served. Other machines reach it at 0.0.0.0:8080. It "
            "opens with the token in the address that is printed at start.",
        ),
    ] = "127.0.0.1:8080",
    no_page: Annotated[bool, typer.Option(help="Without the live page.")] = False,
    heatmap: Annotated[
        Path | None, typer.Option(help="Write a heat map of the gaze on the face as PNG.")
    ] = None,
    heatmap_face: Annotated[
        Path | None, typer.Option(help="Picture of a face to lay the heat map over.")
    ] = None,
    record: Annotated[
        Path | None, typer.Option(help="Record every tick, to replay and judge: FILE.mcap.")
    ] = None,
    record_pictures: Annotated[
        float, typer.Option(min=0.0, max=60.0, help="Camera pictures a second in the recording.")
    ] = 2.0,
    force: Annotated[
        bool,
        typer.Option("--force", help="Write over an older recording, heat map or summary."),
    ] = False,
    summary: Annotated[
        str | None, typer.Option(help="Write figures as JSON to this file; - prints them.")
    ] = None,
) -> None:
    """Run the head: gazerig run --mock, then open the page it names."""
    options = RunOptions(**locals())  # what a person can ask for is a field of the same name
    with clear_errors(rig, port, mock):
        options = options.checked()
        refuse_existing(*options.written_at_the_end, force=force)
        # Vision and emulator are heavy; `check` and `--help` do without them.
        from gazerig.robot.app import session

        composed = session.compose(options)
        shows = status if not fast and sys.stderr.isatty() else None
        with signals() as stopped:
            figures = session.run(composed, stopped, say, shows)
        _write_summary(figures, summary, force)
    if had_faults(figures, say) or "not_written" in figures:
        raise typer.Exit(FAULT)


def had_faults(figures: Mapping[str, Any], say: Callable[[str], None]) -> bool:
    """Return whether a run had faults, and say which joints they held."""
    held = [
        str(JointFault(joint, reason, count["times"], count["seconds"]))
        for joint, reasons in figures["joint_faults"].items()
        for reason, count in reasons.items()
    ]
    if held:
        say(f"the run had faults: {'; '.join(held)}")
    return bool(held) or str(figures["stopped_by"]).startswith("fault")


def _write_summary(figures: dict[str, object], where: str | None, force: bool) -> None:
    if where is None:
        return
    text = json.dumps(figures, indent=2) + "\n"
    if where == "-":
        print(text, end="")
    else:
        write_file(Path(where), text, force)
