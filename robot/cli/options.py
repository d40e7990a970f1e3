"""Options and arguments that several commands have."""

from collections.abc import Callable
from dataclasses import fields
from inspect import Parameter, Signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar, get_type_hints

import typer

from gazerig.robot.cli.terminal import RigArgument, say
from gazerig.robot.run.options import Option, RunOptions

if TYPE_CHECKING:
    from gazerig.robot.model.reply import TrackState

F = TypeVar("F", bound=Callable[..., Any])
DEFAULT_RIG = "desk"

PidOption = Annotated[
    str | None,
    typer.Option(
        "--rig",
        "--pid",
        metavar="NAME|N",
        help="Name or process id of the rig, if several run.",
    ),
]


_HINTS = get_type_hints(RunOptions, include_extras=True)


def run_option(name: str, is_shown: bool = True) -> Any:
    """Return the declaration of a field of ``RunOptions`` for typer.

    Args:
        name: Name of the field.
        is_shown: Whether the help of the command lists it.
    """
    about: Option = _HINTS[name].__metadata__[0]
    return typer.Option(
        f"--{(about.name or name).replace('_', '-')}",
        help=about.help,
        metavar=about.value or None,
        min=about.low,
        max=about.high,
        hidden=not is_shown,
    )


MockOption = Annotated[bool, run_option("mock")]
PortOption = Annotated[str | None, run_option("port")]
CameraOption = Annotated[str | None, run_option("camera")]
OakOption = Annotated[bool, run_option("oak")]
FolderOption = Annotated[Path, typer.Option("--folder", help="Folder for the track's file.")]
NoBrowserOption = Annotated[bool, run_option("no_browser")]


def add_run_options(command: F) -> F:
    """Declare the rig and the fields of ``RunOptions`` as arguments of a command."""
    kind = Parameter.KEYWORD_ONLY
    rig = Parameter("rig", kind, default=DEFAULT_RIG, annotation=RigArgument)
    declared = [rig]
    for field in fields(RunOptions):
        about = getattr(_HINTS[field.name], "__metadata__", None)
        if about is not None:
            hint = str | None if field.name == "camera" else _HINTS[field.name].__origin__
            option = run_option(field.name, about[0].is_shown)
            declared.append(
                Parameter(
                    field.name, kind, default=field.default, annotation=Annotated[hint, option]
                )
            )
    command.__signature__ = Signature(declared)  # type: ignore[attr-defined]
    return command


def print_track_fit(rig_name: str, path: Path, track: "TrackState") -> None:
    """Print how a rig plays a track, and how to use it."""
    say(f"{path}: on {rig_name} {track.text()}")
    say(f"use it: in a folder tracks/ beside the rig's file, gazerig ctl play {path.stem} finds it")
