"""Where ``gazerig`` begins: the commands to a running rig do without the rest of the program.

Loading all commands takes more than a second; who types ``gazerig stop`` has none to lose.
"""

import os
import sys
from collections.abc import Mapping, Sequence

QUICK = frozenset(
    {
        *("get", "set", "save", "revert", "character"),
        *("ask", "look", "status", "stop", "resume"),
    }
)
"""The commands of robot.cli.tune."""
_ELSEWHERE = {"--help", "--debug"}
"""Options that the whole program knows more about."""


def main() -> None:
    """Run the command line."""
    if is_quick(sys.argv[1:], os.environ):
        _quick()
    else:
        from robot.cli.main import main as whole

        whole()


def is_quick(words: Sequence[str], environ: Mapping[str, str]) -> bool:
    """Tell whether robot.cli.tune alone can do what was typed, or complete it for a shell.

    words: what stands after ``gazerig``
    """
    if environ.get("_GAZERIG_COMPLETE", "").startswith("complete"):
        typed = environ.get("COMP_WORDS") or environ.get("_TYPER_COMPLETE_ARGS", "")
        begun = typed.split()[1:]
        # While the command's own name is typed, the names of all others belong to it.
        named = len(begun) > 1 or typed.endswith(" ")
        return named and begun[:1] != [] and begun[0] in QUICK
    return bool(words) and words[0] in QUICK and not _ELSEWHERE & set(words)


def _quick() -> None:
    from robot.cli.terminal import FAULT
    from robot.cli.tune import app

    try:
        app()
    except Exception as error:
        what = " ".join(str(error).split()) or "no words"
        print(f"unexpected: {type(error).__name__}: {what}; try with --debug", file=sys.stderr)
        sys.exit(FAULT)
