"""Options and arguments that several commands have."""

from collections.abc import Callable
from dataclasses import fields
from inspect import Parameter, Signature
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_type_hints

import typer
from typer.core import TyperCommand, TyperOption

from gazerig.config.shipped_files import shipped_names
from gazerig.robot.cli.terminal import RigArgument
from gazerig.robot.run.options import Option, RunOptions

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


class RigCommand(TyperCommand):
    """A command whose first argument RIG may be omitted although others follow.

    ``gazerig jog my.yaml neck_yaw 10`` and, for the shipped rig, ``gazerig jog neck_yaw 10``.
    """

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Insert the default rig if the arguments name none."""
        positional = [one for one in self.params if not isinstance(one, TyperOption)]
        if positional and positional[0].name == "rig" and len(positional) > 1:
            args = args if self._names_rig(ctx, args, positional) else [DEFAULT_RIG, *args]
        return list(super().parse_args(ctx, args))

    def _names_rig(self, ctx: Any, args: list[str], positional: list[Any]) -> bool:
        """Return whether the first argument is a rig: it looks like one, or is one too many."""
        options = [one for one in self.params if isinstance(one, TyperOption)]
        parser = TyperCommand(self.name, params=list(options)).make_parser(ctx)
        _, given, _ = parser.parse_args(list(args))
        first = given[0] if given else ""
        folder = "/" in first and not Path(first).suffix
        named = first in shipped_names("rigs") or folder or first.endswith((".yaml", ".yml"))
        if not all(one.nargs == 1 for one in positional):
            return named
        return named or len(given) >= len(positional)
