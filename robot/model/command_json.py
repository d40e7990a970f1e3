"""Commands as plain JSON: between processes, and in recordings."""

from gazerig.robot.model.command_checks import MAX_WORDS, check
from gazerig.robot.model.commands import COMMANDS, Command, Leading, Play, Renew, Resume, Stop

_NAMES = {kind: name for name, kind in COMMANDS.items()}


def as_json(command: Command) -> dict[str, object]:
    """Return a command as plain JSON: its name under "do", and its fields."""
    return {"do": _NAMES[type(command)], **command._asdict()}


def as_recorded(command: Command) -> dict[str, object]:
    """Return a command as recordings hold it: its name under "order", and its fields."""
    return {"order": _NAMES[type(command)], **command._asdict()}


def from_json(data: object) -> Command:
    """Read what ``as_json`` or ``as_recorded`` gave; fields with defaults may be left out.

    Raises:
        ValueError: it is no command; the message says what is wrong and what there is.
    """
    key = "order" if isinstance(data, dict) and "order" in data else "do"
    name = data.get(key) if isinstance(data, dict) else None
    kind = COMMANDS.get(name) if isinstance(name, str) else None
    if kind is None or not isinstance(data, dict):
        raise ValueError(f"no command; there is {', '.join(COMMANDS)}")
    fields = {field: _frozen(value) for field, value in data.items() if field != key}
    needed = set(kind._fields).difference(kind._field_defaults)
    if not needed <= set(fields) <= set(kind._fields):
        raise ValueError(f"{name} takes {', '.join(kind._fields)}; given {', '.join(fields)}")
    command = kind(**fields)  # type: ignore[arg-type]
    check(command)
    return command


def from_recording(data: dict[str, object]) -> Command:
    """Read a command of a recorded run.

    Those of runs made before leads could lapse and stops be guarded say nothing of it: they
    stayed, and any client could resume.

    Raises:
        ValueError: as ``from_json``.
    """
    old = {"look_at": {"stay": True}, "jog": {"stay": True}, "resume": {"confirmed": True}}
    name = data.get("order")
    return from_json({**old.get(name if isinstance(name, str) else "", {}), **data})


def signed(command: Command, who: str) -> Command:
    """Return a command with who asks for it; commands that do not tell stay as they are."""
    if isinstance(command, Leading | Play | Renew | Stop | Resume):
        return command._replace(who=who[:MAX_WORDS])
    return command


def _frozen(value: object) -> object:
    """Return JSON's lists as tuples."""
    if isinstance(value, list | tuple):
        return tuple(_frozen(item) for item in value)
    if isinstance(value, dict):
        return {key: _frozen(item) for key, item in value.items()}
    return value
