"""How every command names its rig: RIG is a word, and the first one wherever there are others."""

from collections.abc import Mapping
from typing import Any

from typer.core import TyperCommand, TyperOption

from gazerig.config.shipped import shipped_names
from gazerig.robot.cli.terminal import say

DEFAULT_RIG = "desk"

RENAMED: Mapping[str, Mapping[str, str]] = {"run": {"--replay": "--camera-recording"}}
"""Options of earlier versions and what they are called now, by command."""


class RigCommand(TyperCommand):
    """A command in which RIG may be left out although other words follow.

    ``gazerig jog my.yaml neck_yaw 10`` and, for the shipped rig, ``gazerig jog neck_yaw 10``.
    Options of earlier versions (``--rig``, those of ``RENAMED``) are still taken, each with one
    line that says what to type now.
    """

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Insert the default rig if the arguments name none."""
        args = self._renamed(args)
        args, rig = self._without_rig_option(args)
        positional = [one for one in self.params if not isinstance(one, TyperOption)]
        if positional and positional[0].name == "rig" and len(positional) > 1:
            if rig is None and not self._names_rig(ctx, args, positional):
                rig = DEFAULT_RIG
            args = args if rig is None else [rig, *args]
        elif rig is not None:
            args = [*args, rig]
        return list(super().parse_args(ctx, args))

    def _renamed(self, args: list[str]) -> list[str]:
        now = RENAMED.get(str(self.name), {})
        for old in dict.fromkeys(word.partition("=")[0] for word in args):
            if old in now:
                say(f"{old} is called {now[old]} now; {old} goes with the next version")
        pairs = (word.partition("=") for word in args)
        return [f"{now.get(word, word)}{equals}{value}" for word, equals, value in pairs]

    def _without_rig_option(self, args: list[str]) -> tuple[list[str], str | None]:
        """Return the words without ``--rig RIG``, and the rig, None where it is not there."""
        for i, word in enumerate(args):
            option, equals, value = word.partition("=")
            if option == "--rig" and (equals or i + 1 < len(args)):
                say(f"the rig is a word now: {self.name} RIG; --rig goes with the next version")
                rest = args[i + 1 :] if equals else args[i + 2 :]
                return [*args[:i], *rest], value if equals else args[i + 1]
        return args, None

    def _names_rig(self, ctx: Any, args: list[str], positional: list[Any]) -> bool:
        """Return whether the first word is a rig: there is one more than needed, or it looks so."""
        options = [one for one in self.params if isinstance(one, TyperOption)]
        parser = TyperCommand(self.name, params=list(options)).make_parser(ctx)
        _, given, _ = parser.parse_args(list(args))
        if all(one.nargs == 1 for one in positional):
            return len(given) >= len(positional)
        first = given[0] if given else ""
        return first in shipped_names("rigs") or "/" in first or first.endswith((".yaml", ".yml"))
