"""Optional first argument RIG of commands with several arguments."""

from pathlib import Path
from typing import Any

from typer.core import TyperCommand, TyperOption

from gazerig.config.shipped_files import shipped_names

DEFAULT_RIG = "desk"


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
        missing = positional[1 + len(given) - named :]
        if missing and given and missing[0].required and not ctx.resilient_parsing:
            needed = [f"{one.metavar} ({(one.help or '').rstrip('.')})" for one in positional[1:]]
            ctx.fail(f"needs {', '.join(needed)}: {missing[0].metavar} is missing")
        return named or len(given) >= len(positional)
