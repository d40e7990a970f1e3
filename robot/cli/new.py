"""Command new: a new rig from a few answers."""

import sys
from collections.abc import Iterable, Mapping
from importlib.util import find_spec
from pathlib import Path
from shlex import quote
from typing import Annotated

import typer

from gazerig.config.faults import ConfigError
from gazerig.drivers.errors import SetupError, install_command
from gazerig.drivers.files.file_output import refuse_existing, write_file
from gazerig.robot.cli.new_rig import (
    BOARDS,
    CAMERAS,
    MECHANISMS,
    NewRig,
    joints_of,
    rig_text,
    usual_port,
)
from gazerig.robot.cli.terminal import ForceOption, clear_errors, finish_lines, say

app = typer.Typer()

_EYES_MM = 62.0
_BOARD, _JOINTS, _CAMERA = "none", "eyes-lids", "webcam"
"""Defaults if there is no option and nobody can be asked."""


@app.command()
def new(
    file: Annotated[Path, typer.Argument(help="The YAML file to write.")] = Path("myrig.yaml"),
    board: Annotated[
        str | None,
        typer.Option(help=f"{', '.join(BOARDS)}.", autocompletion=lambda: list(BOARDS)),
    ] = None,
    joints: Annotated[
        str | None,
        typer.Option(
            help=f"{', '.join(MECHANISMS)}; or names of joints: eyes_pan,eyes_tilt,jaw.",
            autocompletion=lambda: list(MECHANISMS),
        ),
    ] = None,
    camera: Annotated[
        str | None,
        typer.Option(help=f"{', '.join(CAMERAS)}.", autocompletion=lambda: list(CAMERAS)),
    ] = None,
    eyes_mm: Annotated[
        float | None,
        typer.Option(min=10, max=500, help=f"Distance between the eye centres: {_EYES_MM:g}."),
    ] = None,
    port: Annotated[
        str | None, typer.Option(help="Port of the board; default: the adaptor plugged in.")
    ] = None,
    force: ForceOption = False,
) -> None:
    """Write a new rig's YAML from a few answers, check it, and print the next command."""
    with clear_errors():
        if file.suffix not in (".yaml", ".yml"):
            raise SetupError(f"{file}: a rig's file ends in .yaml: gazerig new {file.stem}.yaml")
        refuse_existing(file, force=force)
        asked = Questions(sys.stdin.isatty())
        chosen = asked.ask_choice("Which board drives the servos?", "board", board, BOARDS, _BOARD)
        mechanisms = {name: one.summary for name, one in MECHANISMS.items()}
        wanted = asked.ask_choice(
            "Which joints do the servos move? (a mechanism, or names of joints: eyes_pan,eyes_tilt,jaw)",
            "joints", joints, mechanisms, _JOINTS, others=True,
        )  # fmt: skip
        seen = asked.ask_choice(
            "Which camera does the head use?", "camera", camera, CAMERAS, _CAMERA
        )
        distance = asked.ask_number(
            "What is the distance between the eyes, in mm?", "eyes-mm", eyes_mm, _EYES_MM
        )
        rig = NewRig(
            file.stem, chosen, joints_of(wanted), seen, distance, port or _plugged_in(chosen)
        )
        from gazerig.robot.cli.check import check_line

        write_file(file, rig_text(rig), force)
        try:
            say(check_line(str(file)))
        except ConfigError:  # an invalid file is deleted
            file.unlink()
            raise
        for line in next_steps(rig, str(file)):
            print(line)


class Questions:
    """Questions on the terminal for missing options; without a terminal, defaults are used.

    terminal: whether a person can answer
    """

    def __init__(self, terminal: bool) -> None:
        self._terminal = terminal

    def ask_choice(
        self, question: str, option: str, given: str | None, choices: Mapping[str, str],
        usual: str, others: bool = False,
    ) -> str:  # fmt: skip
        """Return a choice, given by its name or its number.

        Args:
            question: Its text.
            option: The option that answers it.
            given: The value of that option.
            choices: Choices with their descriptions.
            usual: Default, chosen with Enter.
            others: Whether other answers are valid too.

        Raises:
            SetupError: the option's value is invalid, or there is no answer.
        """
        names = list(choices)
        if given is not None:
            if given in choices or (others and given):
                return given
            raise SetupError(f"--{option} {given}: expected {', '.join(names)}")
        if not self._terminal:
            say(f"{option}: {usual} ({choices[usual]}); choices for --{option}: {', '.join(names)}")
            return usual
        say(question)
        for number, (name, what) in enumerate(choices.items(), 1):
            say(f"  {number}  {name:10} {what}")
        while True:
            answer = _missing_answer(f"1 to {len(names)}", str(names.index(usual) + 1), option)
            if answer.isdecimal() and 0 < int(answer) <= len(names):
                return names[int(answer) - 1]
            if answer in choices or (others and "_" in answer):
                return answer
            say(f"{answer!r} is not a choice: give a number from 1 to {len(names)}, or a name")

    def ask_number(self, question: str, option: str, given: float | None, usual: float) -> float:
        """Return a length in mm.

        Raises:
            SetupError: there is no answer.
        """
        if given is not None:
            return given
        if not self._terminal:
            return usual
        say(question)
        while True:
            answer = _missing_answer("10 to 500", f"{usual:g}", option)
            try:
                if 10.0 <= (value := float(answer)) <= 500.0:
                    return value
            except ValueError:
                pass
            say(f"{answer!r} is not a length from 10 to 500 mm")


def next_steps(rig: NewRig, file: str) -> Iterable[str]:
    """Return the next commands for a new rig file, as lines."""
    named = quote(file)
    sees = {"webcam": "--camera 0", "oak": "--oak", "none": "--scene visitor"}[rig.camera]
    steps = [(f"gazerig run {named} --mock", "the head in your browser, without any hardware")]
    if rig.board != "none":
        if rig.board not in ("maestro", "pca9685"):  # whose channels have no ids
            steps.append((f"gazerig setup {named}", "with the adaptor plugged in: gives ids"))
        steps += [
            (f"gazerig doctor {named} --fix", "check port, servos and settings against the file"),
            (f"gazerig calibrate {named}", "measure zero, sign and range of each joint"),
            (f"gazerig run {named} {sees}", "the real head"),
        ]
    wide = max(len(command) for command, _ in steps)
    yield "next:"
    yield from (f"  {command:{wide}}  {what}" for command, what in steps)
    if rig.camera == "oak" and find_spec("depthai") is None:
        yield f"an OAK-D needs one more package: {install_command('oak')}"


def _plugged_in(board: str) -> str:
    """Return the port of the only USB serial adaptor if the board uses one, otherwise ""."""
    if not usual_port(board).startswith("/dev/tty") or board == "none":
        return ""
    from gazerig.drivers.serial.list_ports import serial_ports

    usb = [port for port in serial_ports() if port.usb]
    return (usb[0].by_id or usb[0].device) if len(usb) == 1 else ""


def _missing_answer(what: str, usual: str, option: str) -> str:
    finish_lines()
    try:
        return input(f"{what} [{usual}]: ").strip() or usual
    except EOFError:
        raise SetupError(f"no answer: use the option --{option}") from None
