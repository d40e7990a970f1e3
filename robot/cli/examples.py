"""Examples for every command's help, and shell completion of names."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import msgspec
import typer

from gazerig.config.shipped_files import shipped_names
from gazerig.drivers.errors import PluginError
from gazerig.robot.cli.command_list import Examples


def core_examples() -> dict[str, Examples]:
    """Return the examples of the core's commands, each with its purpose, from examples.json."""
    text = Path(__file__).with_suffix(".json").read_bytes()
    read = msgspec.json.decode(text, type=dict[str, dict[str, str]])
    return {command: tuple(examples.items()) for command, examples in read.items()}


def add_examples(app: typer.Typer, given: Mapping[str, Examples], within: str = "") -> None:
    """Add examples to the help of every command of an app.

    Args:
        app: The app.
        given: Examples by command; for a feature's group of commands with the group's name.
        within: Group that contains the app, "" for none.
    """
    for command in app.registered_commands:
        name = command.name or str(getattr(command.callback, "__name__", "")).replace("_", "-")
        examples = given.get(f"{within} {name}") or given.get(name)
        if examples:
            command.epilog = epilog(examples)
    for group in app.registered_groups:
        part = group.typer_instance
        if part is None:
            continue
        title = part.info.name
        if not isinstance(title, str):  # commands of a module
            add_examples(part, given, within)
            continue
        if title in given:
            part.info.epilog = epilog(given[title])
        add_examples(part, given, title)


def epilog(examples: Iterable[tuple[str, str]]) -> str:
    """Format examples as separate lines of the help."""
    return "\n\n".join(f"gazerig {text}   ({what})" for text, what in examples)


def complete_shipped(kind: str, home: Path | None = None) -> Callable[[str], list[str]]:
    """Return the completion function for names of a kind of shipped file, e.g. "characters"."""
    return lambda incomplete: [
        name for name in shipped_names(kind, home) if name.startswith(incomplete)
    ]


def complete_world(incomplete: str) -> list[str]:
    """Complete a world with physics; without that feature there is none."""
    from gazerig.robot.run.surroundings import world

    try:
        return [name for name in world().names() if name.startswith(incomplete)]
    except PluginError:
        return []
