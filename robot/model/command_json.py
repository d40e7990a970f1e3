"""Commands as plain JSON, between processes and in recordings."""

from gazerig.robot.model.command_checks import MAX_WORDS, check
from gazerig.robot.model.commands import COMMANDS, Command, Leading, Play, Renew, Resume, Stop

_NAMES = {kind: name for name, kind in COMMANDS.items()}


def as_json(command: Command) -> dict[str, object]:
    """Return a command as plain JSON: its name under "do", and its fields."""
    return {"do": _NAMES[type(command)], **command._asdict()}


def as_recorded(command: Command) -> dict[str, object]:
    """Return a command as JSON for recordings: its name under "order", and its fields."""
    return {"order": _NAMES[type(command)], **command._asdict()}


def from_json(data: object) -> Command:
    """Read the result of ``as_json`` or ``as_recorded``; fields with defaults may be left out.

    Raises:
        ValueError: It is not a command; the message lists the commands or fields.
    """
    key = "order" if isinstance(data, dict) and "order" in data else "do"
    name = data.get(key) if isinstance(data, dict) else None
    kind = COMMANDS.get(name) if isinstance(name, str) else None
    if kind is None or not isinstance(data, dict):
        raise ValueError(f"no command; there is {', '.join(COMMANDS)}")
    fields = {field: _to_tuples(value) for field, value in data.items() if field != key}
    needed = set(kind._fields).difference(kind._field_defaults)
    if not needed <= set(fields) <= set(kind._fields):
        raise ValueError(f"{name} takes {', '.join(kind._fields)}; given {', '.join(fields)}")
    command = kind(**fields)  # type: ignore[arg-type]
    check(command)
    return command


def from_recording(data: dict[str, object]) -> Command:
    """Read a command of a recorded run.

    Old recordings lack the fields ``stay`` and ``confirmed``: in their runs a control never
    timed out, and any client could resume.

    Raises:
        ValueError: As ``from_json``.
    """
    old = {"look_at": {"stay": True}, "jog": {"stay": True}, "resume": {"confirmed": True}}
    name = data.get("order")
    return from_json({**old.get(name if isinstance(name, str) else "", {}), **data})


def signed(command: Command, who: str) -> Command:
    """Return a command with its client's name; commands without that field stay unchanged."""
    if isinstance(command, Leading | Play | Renew | Stop | Resume):
        return command._replace(who=who[:MAX_WORDS])
    return command


def _to_tuples(value: object) -> object:
    """Convert lists to tuples, recursively."""
    if isinstance(value, list | tuple):
        return tuple(_to_tuples(item) for item in value)
    if isinstance(value, dict):
        return {key: _to_tuples(item) for key, item in value.items()}
    return value
