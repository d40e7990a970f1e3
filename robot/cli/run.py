"""The command run."""

import json
import os
import sys
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gazerig.config.load import ConfigError
from gazerig.config.schema import load_rig
from gazerig.config.text import rig_text, walk_text
from gazerig.drivers.errors import SetupError
from gazerig.drivers.file_output import refuse_existing, write_file
from gazerig.robot.cli.examples import complete_scene, complete_shipped
from gazerig.robot.cli.rig_command import RigCommand
from gazerig.robot.cli.terminal import FAULT, RigArgument, clear_errors, say, signals, status
from gazerig.robot.control.joint_faults import JointFault

if TYPE_CHECKING:
    from gazerig.robot.app.assemble import Assembly
    from gazerig.robot.app.options import Choice
    from gazerig.robot.app.run_observers import Told

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
    with clear_errors(rig, port, mock):
        # Vision and emulator are heavy; `check` and `--help` do without them.
        from gazerig.robot.app import session
        from gazerig.robot.app.assemble import assemble
        from gazerig.robot.app.run_observers import Wished

        address = host_port(page)
        refuse_existing(*_written_at_the_end(heatmap, summary), force=force)
        wanted = session.Wanted(
            mock=mock,
            fast=fast,
            seed=seed,
            seconds=seconds,
            scene=scene,
            video=video,
            camera=camera,
            oak=oak,
            replay=replay,
            pixels=pixels,
            scanpath=scanpath,
            saccade=saccade,
            rules=rules,
            port=port,
            asked=tuple(
                (menu, choice)
                for menu, choice in (("behaviour", behaviour), ("conversation", conversation))
                if choice is not None
            ),
            heatmap=heatmap,
            heatmap_face=heatmap_face,
            watched=Wished(
                page=None if no_page or fast else address,
                status_line=not fast and sys.stderr.isatty(),
                record=record,
                over=force,
            ),
        )
        choice = wanted.choice()
        made = assemble(load_rig(rig, character, profile), choice)
        told = _told(made, rig, character, profile, choice, record_pictures)
        with signals() as stopped:
            figures = session.run(made, wanted, stopped, say, status, told)
        _write_summary(figures, summary, force)
    if had_faults(figures, say) or "not_written" in figures:
        raise typer.Exit(FAULT)


def _told(
    made: "Assembly",
    rig: str,
    character: str | None,
    profile: str | None,
    choice: "Choice",
    pictures_hz: float,
) -> "Told":
    """Gather what tuning and recording must know of the command line."""
    from gazerig.robot.app.param_store import Tuning
    from gazerig.robot.app.run_observers import Told
    from gazerig.robot.recording.run_info import RunInfo, versions

    def info() -> RunInfo:
        whole = made.retuner.rig
        return RunInfo(
            rig=rig,
            profile=whole.profile,
            character=character,
            config_yaml=rig_text(whole),
            walk_yaml=walk_text(whole.gaze.scanpath.walk),
            seed=choice.seed,
            rate_hz=whole.loop.rate_hz,
            started_utc=datetime.now(UTC).isoformat(),
            scene=choice.scene,
            eyes=choice.eyes or f"scene {choice.scene}",
            mock=choice.mock,
            fast=choice.fast,
            pictures_hz=pictures_hz,
            versions=versions(),
        )

    tuning = Tuning(made.retuner, made.robot.order, rig, character, profile)
    return Told(tuning, (ConfigError,), {"rig": rig, "pid": os.getpid()}, info)


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


def host_port(text: str) -> tuple[str, int]:
    """Read what is given as --page.

    Raises:
        SetupError: it is no address.
    """
    host, _, port = text.rpartition(":")
    if not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise SetupError(f"--page {text}: not HOST:PORT, for example 127.0.0.1:8080")
    return host, int(port)


def _written_at_the_end(heatmap: Path | None, summary: str | None) -> tuple[Path, ...]:
    """Return the files whose names must be free now, as nobody wants to run again."""
    named = None if summary is None or summary == "-" else Path(summary)
    return tuple(path for path in (heatmap, named) if path is not None)


def _write_summary(figures: dict[str, object], where: str | None, force: bool) -> None:
    if where is None:
        return
    text = json.dumps(figures, indent=2) + "\n"
    if where == "-":
        print(text, end="")
    else:
        write_file(Path(where), text, force)
