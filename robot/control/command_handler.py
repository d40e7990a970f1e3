"""Requests to a running rig: the same for all clients, handled in one place.

The live page, other programs, the command line and Python all send a request {"do": verb, ...}.
A verb is a command to the robot (``gazerig.robot.model.commands``: look_at, jog, ask, stop, resume,
renew), a change of parameters (set, save, revert, character) or a question (``QUESTIONS``). The
caller turns the result into JSON or a line of text.
"""

import binascii
import json
from base64 import b64decode
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from gazerig.drivers.errors import DriverError
from gazerig.robot.control.track_choices import TrackInfo
from gazerig.robot.model.command_json import from_json
from gazerig.robot.model.commands import COMMANDS, Command, Say, Speak, Tune, Value
from gazerig.robot.model.parameter import ParamChange, Parameter, SavedFile
from gazerig.robot.model.reply import Ticket

QUESTIONS: dict[str, tuple[str, dict[str, Any]]] = {
    "hello": ("Check the version of the messages; return the rig's identity", {"version": int}),
    "status": ("Name, target, reason, guard, joints and last messages of the rig", {}),
    "state": ("Newest tick, and the events numbered above after", {"after": int}),
    "menus": ("Behaviours, modes of conversation, lid movements; the present one first", {}),
    "tracks": ("Tracks, and why the rig refuses them", {}),
    "parameters": ("Rules and defaults of keys with a prefix", {"prefix": str}),
    "get": ("Present values of keys with a prefix", {"prefix": str}),
    "unsaved": ("Values that differ from the rig's file", {}),
    "differs": ("Values that differ from the defaults", {}),
    "characters": ("Names of characters", {}),
}
CHANGES: dict[str, tuple[str, dict[str, Any]]] = {
    "set": ("Apply values of keys, all of them or none", {"changes": dict[str, Value]}),
    "save": ("Write the values to the rig's file, or to an absolute path", {"path": str | None}),
    "revert": ("Apply the values of the rig's file again", {}),
    "character": ("Apply another character to the rig", {"name": str}),
    "say_piece": (
        "Say a piece of a stream, base64 of signed 16 bits; returns the unheard length in s",
        {"pcm": str, "rate_hz": int, "channels": int, "last": bool, "volume": float},
    ),
    "fault": ("Execute a fault command of emulated servos (gazerig emulate)", {"text": str}),
}
"""Requests besides commands: their descriptions, and the types of their fields."""
_PREPARED = {Tune: "set", Speak: "say"}
"""Commands that programs cannot send, and the requests that check and prepare them."""
ORDERS: dict[str, type[Command]] = {
    name: kind for name, kind in COMMANDS.items() if kind not in _PREPARED
}
"""Commands that programs may send."""
REQUESTS = (
    *(", ".join((name, *map(json.dumps, of))) for name, (_, of) in (QUESTIONS | CHANGES).items()),
    *ORDERS,
)
"""Names of all requests, with their fields."""
_KINDS = {str: "text", int: "a whole number", bool: "true or false", str | None: "text or null"}

REAL = "only servos emulated byte by byte accept fault commands: gazerig run --mock, without --bus ideal"

FIXED = "these parameters cannot be changed while the rig runs"


class ParamAccess(Protocol):
    """The parameters of a running rig, such as ``gazerig.robot.app.param_store.ParamStore``."""

    @property
    def version(self) -> int:
        """Return the number of changes."""
        ...

    @property
    def path(self) -> Path:
        """Return the rig's file."""
        ...

    @property
    def character_name(self) -> str:
        """Return the present character."""
        ...

    def parameters(self) -> tuple[Parameter, ...]:
        """Return all parameters."""
        ...

    def values(self) -> Mapping[str, Value]:
        """Return all present values."""
        ...

    def get(self, prefix: str) -> Mapping[str, Value]:
        """Return the present values whose keys start with ``prefix``."""
        ...

    def set(self, changes: Mapping[str, Value]) -> Iterable[str]:
        """Apply values from the next tick on; return notes for the user."""
        ...

    def unsaved(self) -> Sequence[ParamChange]:
        """Return the present values that are not in the file."""
        ...

    def changed_from_defaults(self) -> Sequence[ParamChange]:
        """Return the values that differ from the defaults."""
        ...

    def save(self, path: Path | None = None) -> SavedFile:
        """Write the present values to a file."""
        ...

    def revert(self) -> object:
        """Restore the values of the file."""
        ...

    def characters(self) -> Sequence[str]:
        """Return the available characters."""
        ...

    def apply_character(self, name: str) -> object:
        """Apply another character to the rig."""
        ...


class PathGuard(Protocol):
    """Rules for the files that a client may name (``config.allowed_folder.AllowedFolder``)."""

    def check_file(self, given: str, kind: str = "") -> str:
        """Return a shipped name or an absolute path; raise if it is not allowed."""
        ...

    def check_changes(self, changes: Mapping[str, object]) -> None:
        """Raise if a value names a file that is not allowed."""
        ...


class Speaker(Protocol):
    """The voice of a head (``gazerig.robot.app.voice.RunVoice``)."""

    def prepare(self, command: Say, confined: bool = False, /) -> Speak:
        """Return the command that says a file or a text; raise if it cannot be said.

        confined: only files in the folders of sounds
        """
        ...

    def feed(self, pcm: bytes, rate_hz: int, channels: int, volume: float, /) -> float:
        """Say a piece of a stream; return the length that has not been heard, s."""
        ...

    def finish(self) -> None:
        """Mark the end of the stream."""
        ...


class CommandTarget(Protocol):
    """A robot that takes commands, such as ``gazerig.robot.control.loop.Robot``."""

    def command(self, command: Command) -> Ticket | None:
        """Queue a command for the next tick; raise ValueError if it breaks a rule."""
        ...

    def menus(self) -> dict[str, tuple[str, ...]]:
        """Return the menus."""
        ...

    def tracks(self) -> Sequence[TrackInfo]:
        """Return the available tracks."""
        ...


class QuestionAnswer(NamedTuple):
    """The answer to a question, as plain JSON values."""

    value: object


class ParamsChanged(NamedTuple):
    """A change of values from the next tick on, with notes for the user."""

    notes: tuple[str, ...]


class ParamsSaved(NamedTuple):
    """A file with the present values."""

    saved: SavedFile


class PendingCommand(NamedTuple):
    """A command that waits for the next tick, and the ticket of its reply, None without one."""

    command: Command
    ticket: Ticket | None


RequestResult = QuestionAnswer | ParamsChanged | ParamsSaved | PendingCommand


class CommandHandler:
    """The handler of all requests. All methods are thread-safe.

    Args:
        robot: Executes commands.
        params: The parameters, None if they cannot be read or changed.
        status: Returns the state of the rig as plain values.
        refusals: Exceptions of ``params`` for a value that breaks a rule, besides ValueError;
            the attribute contains all exceptions of ``handle``.
        saved: Called with each written file.
        paths: Rules for file names, None if any file is allowed.
        fixed: Reason why parameters cannot be changed.
        state: Returns the newest tick and the events above a number as plain values.
        fault: Executes a fault command of the emulated servos and returns the result; None if
            the servos are real.
        voice: Says sounds and texts; None if the head has no voice.
    """

    def __init__(
        self,
        robot: CommandTarget,
        params: ParamAccess | None,
        status: Callable[[], object] = dict,
        refusals: tuple[type[Exception], ...] = (),
        saved: Callable[[Path], None] | None = None,
        paths: PathGuard | None = None,
        fixed: str = FIXED,
        state: Callable[[int], object] = lambda after: {},
        fault: Callable[[str], str] | None = None,
        voice: Speaker | None = None,
    ) -> None:
        self._fault, self._voice = fault, voice
        self._state = state
        self._robot, self._params, self._status = robot, params, status
        self._saved, self._paths, self._fixed = saved, paths, fixed
        self._described: tuple[Iterable[Parameter], list[tuple[str, object]]] = (), []
        self.refusals: tuple[type[Exception], ...] = (
            ValueError, DriverError, OSError, *refusals,
        )  # fmt: skip

    def handle(
        self, request: object, sign: Callable[[Command], Command] = lambda command: command
    ) -> RequestResult:
        """Handle a request; its patterns define the possible requests.

        Args:
            request: {"do": verb, ...}.
            sign: Writes the name of the client into a command.

        Raises:
            Exception: One of ``refusals``, with every broken rule.
        """
        match request:
            case {"do": "status", **rest} if not rest:
                return QuestionAnswer(self._status())
            case {"do": "state", "after": int(after), **rest} if not rest:
                return QuestionAnswer(self._state(after))
            case {"do": "menus", **rest} if not rest:
                return QuestionAnswer(
                    {menu: list(them) for menu, them in self._robot.menus().items()}
                )
            case {"do": "tracks", **rest} if not rest:
                return QuestionAnswer([to_plain(one._asdict()) for one in self._robot.tracks()])
            case {"do": "fault", "text": str(text), **rest} if not rest:
                if self._fault is None:
                    raise ValueError(REAL)
                return QuestionAnswer(self._fault(text))
            case {
                "do": "say_piece", "pcm": str(text), "rate_hz": int(rate_hz),
                "channels": int(channels), "last": bool(last), "volume": int() | float() as volume,
                **rest,
            } if not rest:  # fmt: skip
                return QuestionAnswer(self._say_piece(text, rate_hz, channels, last, volume))
            case {"do": str(name)} if name in COMMANDS:
                return self.queue_command(sign(from_json(request)))
        return self._handle_params(request)

    def queue_command(self, command: Command) -> PendingCommand:
        """Queue a command; parameters are changed by ``set``, which checks their rules.

        Raises:
            ValueError: The command is invalid; the message lists the available choices.
        """
        if (request := _PREPARED.get(type(command))) is not None:
            raise ValueError(f"this is done by the request {request}, which checks it")
        if isinstance(command, Say):
            command = self._require_voice().prepare(command, self._paths is not None)
        return PendingCommand(command, self._robot.command(command))

    def _say_piece(
        self, text: str, rate_hz: int, channels: int, last: bool, volume: float
    ) -> float:
        """Say a piece of a stream; return the length that has not been heard, s."""
        voice = self._require_voice()
        try:
            pcm = b64decode(text, validate=True)
        except binascii.Error:
            raise ValueError("pcm must be base64") from None
        ahead_s = voice.feed(pcm, rate_hz, channels, volume)
        if last:
            voice.finish()
        return ahead_s

    def _require_voice(self) -> Speaker:
        if self._voice is None:
            raise ValueError("this head has no voice")
        return self._voice

    def _handle_params(self, request: object) -> RequestResult:
        match request:
            case {"do": "parameters", "prefix": str(prefix), **rest} if not rest:
                found = [text for key, text in self._describe_params() if key.startswith(prefix)]
                return QuestionAnswer(found)
            case {"do": "get", "prefix": str(prefix), **rest} if not rest:
                return QuestionAnswer(to_plain(self._params.get(prefix)) if self._params else {})
            case {"do": "unsaved", **rest} if not rest:
                return QuestionAnswer(as_changes(self._params.unsaved()) if self._params else [])
            case {"do": "characters", **rest} if not rest:
                return QuestionAnswer(list(self._params.characters()) if self._params else [])
            case {"do": "differs", **rest} if not rest:
                return QuestionAnswer(as_changes(self._require_params().changed_from_defaults()))
            case {"do": "set", "changes": dict(changes), **rest} if not rest:
                params = self._require_params()
                if self._paths is not None:
                    self._paths.check_changes(changes)
                notes = params.set({key: as_value(value) for key, value in changes.items()})
                return ParamsChanged(_notes(notes))
            case {"do": "save", "path": str() | None as path, **rest} if not rest:
                return self._save(path)
            case {"do": "revert", **rest} if not rest:
                return ParamsChanged(_notes(self._require_params().revert()))
            case {"do": "character", "name": str(name), **rest} if not rest:
                params = self._require_params()
                if self._paths is not None and name not in params.characters():
                    name = self._paths.check_file(name, "characters")
                return ParamsChanged(_notes(params.apply_character(name)))
            case {"do": str(name)} if name in QUESTIONS | CHANGES:
                kinds = (QUESTIONS | CHANGES)[name][1].items()
                fields = [f"{field} ({_KINDS.get(kind, 'an object')})" for field, kind in kinds]
                raise ValueError(
                    f"{name} has {', '.join(fields) or 'no fields'}{', and no others' if fields else ''}"
                )
        raise ValueError(f"unknown request; available: {'; '.join(REQUESTS)}")

    def _require_params(self) -> ParamAccess:
        if self._params is None:
            raise ValueError(self._fixed)
        return self._params

    def _describe_params(self) -> list[tuple[str, object]]:
        """Return key and plain values of every parameter; building the list takes 4 ms."""
        if self._params is None:
            return []
        found = self._params.parameters()
        if found is not self._described[0]:
            self._described = found, [(one.key, to_plain(one._asdict())) for one in found]
        return self._described[1]

    def _save(self, path: str | None) -> RequestResult:
        params = self._require_params()
        if path and self._paths is not None:
            path = self._paths.check_file(path)
        file = Path(path).expanduser() if path else None
        if file is not None and not file.is_absolute():
            raise ValueError(f"{path}: give the absolute path; the rig has its own folder")
        saved = params.save(file)
        if self._saved is not None:
            self._saved(saved.path)
        return ParamsSaved(saved)


def to_plain(value: object) -> object:
    """Convert tuples and mappings to lists and dicts, as in JSON."""
    if isinstance(value, Mapping):
        return {str(key): to_plain(item) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [to_plain(item) for item in value]
    return value


def as_changes(changes: Sequence[ParamChange]) -> list[dict[str, object]]:
    """Return differing values as plain JSON."""
    return [change._asdict() for change in changes]


def as_value(value: object) -> Value:
    """Convert JSON's lists to tuples, as the reader of files does."""
    if isinstance(value, list):
        return tuple(as_value(item) for item in value)
    if isinstance(value, dict):
        return {key: as_value(item) for key, item in value.items()}
    assert value is None or isinstance(value, bool | int | float | str)
    return value


def _notes(notes: object) -> tuple[str, ...]:
    """Return the notes for the user in the result of a change."""
    if isinstance(notes, str) or not isinstance(notes, Iterable):
        return ()
    return tuple(map(str, notes))
