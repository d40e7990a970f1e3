"""The command ``gazerig``: what people type, and what they read on the terminal."""

import json
import logging
import sys
from pathlib import Path
from typing import Annotated

import typer

from config.load import load
from config.schema import Rig, load_rig
from drivers.dynamixel_ports import serial_ports
from drivers.errors import SetupError
from robot import cli_emulate, cli_motion, cli_record, cli_servos
from robot.cli_examples import add_examples, complete_scene, complete_shipped
from robot.cli_start import next_steps
from robot.cli_terminal import (
    DEBUG_LOGGER,
    FAULT,
    RigArgument,
    clear_errors,
    say,
    signals,
    status,
)

app = typer.Typer(
    invoke_without_command=True,
    pretty_exceptions_enable=False,
)
for part in (cli_servos, cli_motion, cli_record, cli_emulate):
    app.add_typer(part.app)


@app.callback()
def begin(
    context: typer.Context,
    debug: Annotated[
        bool, typer.Option("--debug", help="Show where an error comes from, with any command.")
    ] = False,
) -> None:
    """Makes an animatronic head look at people the way people look at each other."""
    if context.invoked_subcommand is None:
        print(next_steps(serial_ports(), rig_files(), False))


@app.command()
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
        Path | None, typer.Option(help="Look at a recording of record-camera, again and again.")
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
    page: Annotated[str, typer.Option(help="Where the live page is served.")] = "127.0.0.1:8080",
    no_page: Annotated[bool, typer.Option(help="Without the live page.")] = False,
    heatmap: Annotated[
        Path | None, typer.Option(help="Write a heat map of the gaze on the face as PNG.")
    ] = None,
    heatmap_face: Annotated[
        Path | None, typer.Option(help="Picture of a face to lay the heat map over.")
    ] = None,
    summary: Annotated[
        str | None, typer.Option(help="Write figures as JSON to this file; - prints them.")
    ] = None,
) -> None:
    """Run the head: gazerig run --mock, then open the page it names."""
    with clear_errors():
        # Vision and emulator are heavy; `check` and `--help` do without them.
        from robot import session
        from robot.assemble import assemble

        address = _host_port(page)
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
            page=None if no_page or fast else address,
            status_line=not fast and sys.stderr.isatty(),
        )
        made = assemble(load_rig(rig, character, profile), wanted.choice())
        with signals() as stopped:
            figures = session.run(made, wanted, stopped, say, status)
        _write_summary(figures, summary)
    if str(figures["stopped_by"]).startswith("fault"):
        raise typer.Exit(FAULT)


@app.command("fit-scanpath")
def fit_scanpath(
    recording: Annotated[Path, typer.Argument(help="CSV of gaze samples or labelled fixations.")],
    parts: Annotated[
        Path | None, typer.Option(help="YAML of part rectangles, needed for samples.")
    ] = None,
    out: Annotated[Path, typer.Option(help="YAML to write.")] = Path("walk.yaml"),
    smoothing: Annotated[str, typer.Option(help="laplace, bootstrap or none.")] = "laplace",
    seed: Annotated[int, typer.Option(min=0, help="Seed of the bootstrap.")] = 0,
) -> None:
    """Fit a walk over the face to an eye-tracker recording, as YAML that run takes."""
    with clear_errors():
        from robot import fit_scanpath as fitting
        from robot.fixations import PartBoxes

        boxes = load(parts, PartBoxes) if parts is not None else None
        say(fitting.fit(recording, boxes, out, smoothing, seed))


@app.command()
def check(rig: RigArgument = "desk") -> None:
    """Check a rig's YAML and nothing else: all faults at once, no servo is touched."""
    with clear_errors():
        found: Rig = load_rig(rig)
        say(f"{rig}: good: rig {found.name!r}, {len(found.joints)} joints, profile {found.profile}")


@app.command()
def schema(
    out: Annotated[Path | None, typer.Argument(help="File to write; default: print.")] = None,
) -> None:
    """Export the JSON Schema of rig files, for editors."""
    from config.export import json_schema

    text = json.dumps(json_schema(Rig), indent=2) + "\n"
    if out is None:
        print(text, end="")
    else:
        with clear_errors():
            out.write_text(text, encoding="utf-8")


add_examples(app)


def main() -> None:
    """Run the command line: an error is one line, and with --debug also where it comes from."""
    words = sys.argv[1:]
    if "--debug" in words:  # wherever people put it
        words = [word for word in words if word != "--debug"]
        logging.getLogger(DEBUG_LOGGER).setLevel(logging.DEBUG)
    try:
        app(words)
    except Exception as error:
        if logging.getLogger(DEBUG_LOGGER).isEnabledFor(logging.DEBUG):
            raise
        what = " ".join(str(error).split()) or "no words"
        print(
            f"unexpected: {type(error).__name__}: {what}; say it again with --debug and report "
            "what it shows",
            file=sys.stderr,
        )
        sys.exit(FAULT)


def rig_files() -> list[Path]:
    """Give the YAML files of this folder that look like rigs."""
    return [
        path
        for path in Path(".").glob("*.yaml")
        if path.is_file() and "joints:" in path.read_text(encoding="utf-8", errors="replace")
    ]


def _host_port(text: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":")
    if not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise SetupError(f"--page {text}: not HOST:PORT, for example 127.0.0.1:8080")
    return host, int(port)


def _write_summary(figures: dict[str, object], where: str | None) -> None:
    if where is None:
        return
    text = json.dumps(figures, indent=2) + "\n"
    if where == "-":
        print(text, end="")
    else:
        Path(where).write_text(text, encoding="utf-8")
