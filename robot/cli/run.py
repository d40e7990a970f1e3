"""The command run."""

import contextlib
import json
import os
import sys
import threading
import webbrowser
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import typer

from gazerig.drivers.files.file_output import refuse_existing, write_file
from gazerig.robot.cli.options import add_run_options
from gazerig.robot.cli.terminal import (
    FAULT,
    clear_errors,
    exit_on_signals,
    record_signals,
    say,
    status,
)
from gazerig.robot.dashboard.door.token_file import hide_token
from gazerig.robot.loop.joint_faults import joints_text
from gazerig.robot.run.options import RunOptions, level_text, parse_camera

app = typer.Typer()
DEFAULT_PAGE = "127.0.0.1:8080"


@app.command()
@add_run_options
def run(**given: Any) -> None:
    """Run the head: gazerig run --mock, then open the page at the printed address."""
    given["page"] = given["page"] or DEFAULT_PAGE
    asked = RunOptions(**{**given, "camera": parse_camera(given["camera"])})
    port, summary = asked.port, asked.summary
    with clear_errors(asked.rig, port, asked.mock):
        if port is not None and not asked.mock:
            from gazerig.drivers.serial.list_ports import check_exists

            for one in port.split(","):
                check_exists(one.rpartition("=")[2])
        asked = asked.check_and_complete()
        refuse_existing(*asked.output_files, force=asked.force)
        shows = status if not asked.fast and sys.stderr.isatty() else None
        if shows is not None:
            shows("loading: a few seconds ...")
        # Vision and emulator are large; `check` and `--help` do not import them.
        from gazerig.robot.run.run import Run
        from gazerig.robot.run.run_rig import run_rig
        from gazerig.robot.run.session import Session

        browse = open_page if not asked.no_browser and is_desktop_here() else None
        with exit_on_signals():
            made = Run(run_rig(asked), asked)
        if not asked.fast:
            made.notes = (start_text(asked), *made.notes)
        with record_signals() as stopped:
            figures = Session(made, stopped, say_publicly, shows, browse=browse).run()
        if summary is not None:
            text = json.dumps(figures, indent=2) + "\n"
            if summary == "-":
                print(text, end="")
            else:
                write_file(Path(summary), text, asked.force)
    if report_faults(figures, say) or "not_written" in figures:
        raise typer.Exit(FAULT)


def say_publicly(line: str) -> None:
    """Print a line; a log does not get the token of the page."""
    say(line if sys.stderr.isatty() else hide_token(line))


def start_text(asked: RunOptions) -> str:
    """Return one line that describes the run and how to end it."""
    servos = "emulated servos" if asked.mock else "its servos"
    sight = f"it looks at {asked.camera_source or f'a simulated scene, {asked.scene}'}"
    if asked.world is not None:
        sight = f"it is in a world, {asked.world}"
    text = f"{asked.rig}: {servos}; {sight}. Ctrl-C parks the head and ends the run."
    return text if asked.computer is None else f"{text}\n{level_text(asked.computer)}"


def report_faults(figures: Mapping[str, Any], say: Callable[[str], None]) -> bool:
    """Return whether a run had faults, and print the joints that were stopped by them."""
    alike: dict[str, list[str]] = {}
    for joint, reasons in figures["joint_faults"].items():
        for reason, times in reasons.items():
            text = reason if times == 1 else f"{reason} ({times} times)"
            alike.setdefault(text, []).append(joint)
    if alike:
        held = [f"{joints_text(joints)} {text}" for text, joints in alike.items()]
        say(f"the run had faults: {'; '.join(held)}")
    failed = str(figures["stopped_by"]).startswith("fault") or "torque_off_unconfirmed" in figures
    return bool(alike) or failed


def has_desktop(environ: Mapping[str, str], terminal: bool) -> bool:
    """Return whether a browser can be opened on the user's desktop.

    Args:
        environ: Environment variables.
        terminal: Whether standard output is a terminal; otherwise a program has started this one.
    """
    if not terminal or environ.get("CI"):
        return False
    if environ.get("SSH_CONNECTION") or environ.get("SSH_TTY"):
        return False  # it would open on the remote computer, which has no user
    return bool(environ.get("DISPLAY") or environ.get("WAYLAND_DISPLAY"))


def is_desktop_here() -> bool:
    """Return ``has_desktop`` for this process."""
    return has_desktop(os.environ, sys.stdout is not None and sys.stdout.isatty())


def open_page(url: str) -> None:
    """Open an address in the user's browser, without waiting; a failure has no effect."""
    threading.Thread(target=_open, args=(url,), name="browser", daemon=True).start()


def _open(url: str) -> None:
    with contextlib.suppress(webbrowser.Error, OSError):
        webbrowser.open(url)
