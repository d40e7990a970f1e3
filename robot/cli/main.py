"""The command ``gazerig``: what people type, and what they read on the terminal."""

import json
import logging
import sys
from pathlib import Path
from typing import Annotated

import typer

import gazerig
from gazerig.config.load import load
from gazerig.config.schema import Rig, load_rig
from gazerig.drivers.file_input import read_limited
from gazerig.drivers.file_output import write_file
from gazerig.drivers.serial.list_ports import serial_ports
from gazerig.robot.cli import doctor, gestures, kinds, monitor, reboot, scan, setup
from gazerig.robot.cli import emulate as cli_emulate
from gazerig.robot.cli import motion as cli_motion
from gazerig.robot.cli import record as cli_record
from gazerig.robot.cli import replay as cli_replay
from gazerig.robot.cli import report as cli_report
from gazerig.robot.cli import run as cli_run
from gazerig.robot.cli import tune as cli_tune
from gazerig.robot.cli.calibrate import group as cli_calibrate
from gazerig.robot.cli.entry_point import as_now
from gazerig.robot.cli.examples import PanelGroup, add_examples
from gazerig.robot.cli.terminal import (
    DEBUG_LOGGER,
    ForceOption,
    RigArgument,
    clear_errors,
    run_app,
    say,
)
from gazerig.robot.cli.welcome import next_steps
from gazerig.robot.remote.client import running

app = typer.Typer(
    cls=PanelGroup,
    invoke_without_command=True,
    pretty_exceptions_enable=False,
)
for part in (
    cli_run,
    *(kinds, scan, setup, doctor, cli_calibrate, cli_motion, gestures, monitor, reboot),
    cli_tune,
    cli_record,
    cli_replay,
    cli_report,
    cli_emulate,
):
    app.add_typer(part.app)


def _version(wanted: bool) -> None:
    if wanted:
        print(f"gazerig {gazerig.__version__}")
        raise typer.Exit


@app.callback()
def begin(
    context: typer.Context,
    debug: Annotated[
        bool, typer.Option("--debug", help="Show where an error comes from, with any command.")
    ] = False,
    version: Annotated[
        bool,
        typer.Option(
            "--version", help="Show the version and end.", callback=_version, is_eager=True
        ),
    ] = False,
) -> None:
    """Makes an animatronic head look at people the way people look at each other."""
    if context.invoked_subcommand is None:
        print(next_steps(serial_ports(), rig_files(), bool(running())))


@app.command("fit-scanpath")
def fit_scanpath(
    recording: Annotated[Path, typer.Argument(help="CSV of gaze samples or labelled fixations.")],
    parts: Annotated[
        Path | None, typer.Option(help="YAML of part rectangles, needed for samples.")
    ] = None,
    out: Annotated[Path, typer.Option(help="YAML to write.")] = Path("walk.yaml"),
    smoothing: Annotated[str, typer.Option(help="laplace, bootstrap or none.")] = "laplace",
    seed: Annotated[int, typer.Option(min=0, help="Seed of the bootstrap.")] = 0,
    force: ForceOption = False,
) -> None:
    """Fit a walk over the face to an eye-tracker recording, as YAML that run takes."""
    with clear_errors():
        from gazerig.robot.analysis import fit_scanpath as fitting
        from gazerig.robot.analysis.fixations import PartBoxes

        boxes = load(parts, PartBoxes) if parts is not None else None
        say(fitting.fit(recording, boxes, out, smoothing, seed, force))


@app.command()
def check(rig: RigArgument = "desk") -> None:
    """Check a rig's YAML and nothing else: all faults at once, no servo is touched."""
    with clear_errors(rig):
        found: Rig = load_rig(rig)
        say(f"{rig}: good: rig {found.name!r}, {len(found.joints)} joints, profile {found.profile}")


@app.command()
def schema(
    out: Annotated[Path | None, typer.Argument(help="File to write; default: print.")] = None,
    force: ForceOption = False,
) -> None:
    """Export the JSON Schema of rig files, for editors."""
    from gazerig.config.export import json_schema

    text = json.dumps(json_schema(Rig), indent=2) + "\n"
    if out is None:
        print(text, end="")
    else:
        with clear_errors():
            write_file(out, text, force)


add_examples(app)


def main() -> None:
    """Run the command line: an error is one line, and with --debug also where it comes from."""
    arguments = as_now(sys.argv[1:])
    if "--debug" in arguments:  # wherever people put it
        arguments = [word for word in arguments if word != "--debug"]
        logging.getLogger(DEBUG_LOGGER).setLevel(logging.DEBUG)
    run_app(app, arguments, "say it again with --debug and report what it shows")


def rig_files() -> list[Path]:
    """Return the YAML files of this folder that look like rigs."""
    return [path for path in Path(".").glob("*.yaml") if _looks_like_a_rig(path)]


def _looks_like_a_rig(path: Path) -> bool:
    try:
        return b"joints:" in read_limited(path, 1_000_000)
    except OSError:
        return False
