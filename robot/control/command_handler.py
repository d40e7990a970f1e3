"""What can be asked of a running rig, by whomever: one vocabulary, carried out in one place.

The live page, other programs, the command line and Python all send a request {"do": verb, ...}.
A verb is a command to the robot (``gazerig.robot.model.commands``: look_at, jog, ask, stop, resume,
renew), a change of parameters (set, save, revert, character) or a question (``QUESTIONS``). Who
answers the asker makes JSON or a line of text of what comes back.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, Protocol

from gazerig.drivers.errors import DriverError
from gazerig.robot.control.gesture_choices import GestureInfo
from gazerig.robot.model.command_json import from_json
from gazerig.robot.model.commands import COMMANDS, Command, Tune, Value
from gazerig.robot.model.parameter import ParamChange, Parameter, SavedFile
from gazerig.robot.model.reply import Ticket

QUESTIONS = (
    "status",
    'state, "after": number of the last event that is known',
    "menus",
    "gestures",
    'parameters, "prefix"',
    'get, "prefix"',
    "unsaved",
    "differs",
    "characters",
)
CHANGES = (
    'set, "changes": {key: value}', 'save, "path": absolute path or null', "revert",
    'character, "name"', 'fault, "text": as of gazerig emulate',
)  # fmt: skip
REQUESTS = (*QUESTIONS, *CHANGES, *(name for name in COMMANDS if name != "tune"))
"""All that can be asked for, in words."""

REAL = "these servos are real: only emulated ones have faults to order (gazerig run --mock)"

FIXED = "these parameters cannot be changed while the rig runs"


class ParamAccess(Protocol):
    """The parameters of a running rig, as ``gazerig.robot.app.param_store.ParamStore`` has them."""

    @property
    def version(self) -> int:
        """Count the changes."""
        ...

    @property
    def path(self) -> Path:
        """Return the rig's file."""
        ...

    @property
    def character_name(self) -> str:
        """Return the character in force."""
        ...

    def parameters(self) -> tuple[Parameter, ...]:
        """Return all parameters."""
        ...

    def values(self) -> Mapping[str, Value]:
        """Return all values in force."""
        ...

    def get(self, prefix: str) -> Mapping[str, Value]:
        """Return the values in force whose keys begin so."""
        ...

    def set(self, changes: Mapping[str, Value]) -> Iterable[str]:
        """Apply values from the next tick on; return what the user should know."""
        ...

    def unsaved(self) -> Sequence[ParamChange]:
        """Return what is in force and not in the file."""
        ...

    def differs(self) -> Sequence[ParamChange]:
        """Return what differs from the defaults."""
        ...

    def save(self, path: Path | None = None) -> SavedFile:
        """Write what is in force."""
        ...

    def revert(self) -> object:
        """Apply the values of the file again."""
        ...

    def characters(self) -> Sequence[str]:
        """Return the characters there are."""
        ...

    def character(self, name: str) -> object:
        """Lay another character over the rig."""
        ...


class PathGuard(Protocol):
    """Which files an asker may name (``gazerig.config.allowed_folder.AllowedFolder``)."""

    def file(self, given: str, kind: str = "") -> str:
        """Return a shipped name or a whole path; raise where it may not be named."""
        ...

    def changes(self, changes: Mapping[str, object]) -> None:
        """Raise where a value names a file that may not be named."""
        ...


class Commandable(Protocol):
    """A robot that takes commands, as ``gazerig.robot.control.loop.Robot`` does."""

    def command(self, command: Command) -> Ticket | None:
        """Queue a command for the next tick; raise ValueError with the rule that it breaks."""
        ...

    def menus(self) -> dict[str, tuple[str, ...]]:
        """Return what there is to ask for."""
        ...

    def gestures(self) -> Sequence[GestureInfo]:
        """Return the gestures there are."""
        ...


class Answered(NamedTuple):
    """The answer to a question, as plain JSON values."""

    value: object


class ParamsChanged(NamedTuple):
    """Values are in force from the next tick on; notes: what a person should know of it."""

    notes: tuple[str, ...]


class ParamsSaved(NamedTuple):
    """The values in force were written."""

    saved: SavedFile


class CommandGiven(NamedTuple):
    """A command waits for the next tick; ticket: where its reply comes, None: nowhere."""

    command: Command
    ticket: Ticket | None


RequestResult = Answered | ParamsChanged | ParamsSaved | CommandGiven


class CommandHandler:
    """Carries out requests; everything may be called from any thread.

    Args:
        robot: executes commands.
        params: the parameters; None if they cannot be seen or changed.
        status: returns the state of the rig, as plain values.
        refusals: what ``params`` raises if a value breaks a rule, besides ValueError; the
            attribute holds all that ``do`` raises then.
        saved: called with each file that was written.
        paths: which files may be named; None: any.
        fixed: why parameters cannot be changed, if they cannot.
        state: returns the newest tick and the events above a number, as plain values.
        fault: carries out a fault command of the emulated servos and returns what was done; None:
            the servos are real.
    """

    def __init__(
        self,
        robot: Commandable,
        params: ParamAccess | None,
        status: Callable[[], object] = dict,
        refusals: tuple[type[Exception], ...] = (),
        saved: Callable[[Path], None] | None = None,
        paths: PathGuard | None = None,
        fixed: str = FIXED,
        state: Callable[[int], object] = lambda after: {},
        fault: Callable[[str], str] | None = None,
    ) -> None:
        self._fault = fault
        self._state = state
        self._robot, self._params, self._status = robot, params, status
        self._saved, self._paths, self._fixed = saved, paths, fixed
        self._described: tuple[Iterable[Parameter], list[tuple[str, object]]] = (), []
        self.refusals: tuple[type[Exception], ...] = (
            ValueError, DriverError, OSError, *refusals,
        )  # fmt: skip

    def do(
        self, request: object, sign: Callable[[Command], Command] = lambda command: command
    ) -> RequestResult:
        """Carry out one request; the patterns are the vocabulary.

        Args:
            request: {"do": verb, ...}.
            sign: writes into a command who asks.

        Raises:
            Exception: one of ``refusals``, with every rule broken.
        """
        match request:
            case {"do": "status", **rest} if not rest:
                return Answered(self._status())
            case {"do": "state", "after": int(after), **rest} if not rest:
                return Answered(self._state(after))
            case {"do": "menus", **rest} if not rest:
                return Answered({menu: list(them) for menu, them in self._robot.menus().items()})
            case {"do": "gestures", **rest} if not rest:
                return Answered([plain(one._asdict()) for one in self._robot.gestures()])
            case {"do": "fault", "text": str(text), **rest} if not rest:
                if self._fault is None:
                    raise ValueError(REAL)
                return Answered(self._fault(text))
            case {"do": str(name)} if name in COMMANDS:
                return self.give(sign(from_json(request)))
        return self._of_params(request)

    def give(self, command: Command) -> CommandGiven:
        """Hand on a command; parameters go through ``set``, which knows their rules.

        Raises:
            ValueError: it cannot be done; the message says which, and what there is.
        """
        if isinstance(command, Tune):
            raise ValueError("parameters are changed by the request set, which checks them")
        return CommandGiven(command, self._robot.command(command))

    def _of_params(self, request: object) -> RequestResult:
        match request:
            case {"do": "parameters", "prefix": str(prefix), **rest} if not rest:
                found = [text for key, text in self._all_described() if key.startswith(prefix)]
                return Answered(found)
            case {"do": "get", "prefix": str(prefix), **rest} if not rest:
                return Answered(plain(self._params.get(prefix)) if self._params else {})
            case {"do": "unsaved", **rest} if not rest:
                return Answered(as_changes(self._params.unsaved()) if self._params else [])
            case {"do": "characters", **rest} if not rest:
                return Answered(list(self._params.characters()) if self._params else [])
            case {"do": "differs", **rest} if not rest:
                return Answered(as_changes(self._changeable().differs()))
            case {"do": "set", "changes": dict(changes), **rest} if not rest:
                return self._set(changes)
            case {"do": "save", "path": str() | None as path, **rest} if not rest:
                return self._save(path)
            case {"do": "revert", **rest} if not rest:
                return ParamsChanged(_notes(self._changeable().revert()))
            case {"do": "character", "name": str(name), **rest} if not rest:
                return self._character(name)
        raise ValueError(f"not understood; there is {'; '.join(REQUESTS)}")

    def _changeable(self) -> ParamAccess:
        if self._params is None:
            raise ValueError(self._fixed)
        return self._params

    def _all_described(self) -> list[tuple[str, object]]:
        """Return key and plain values of every parameter; writing them all takes 4 ms."""
        if self._params is None:
            return []
        found = self._params.parameters()
        if found is not self._described[0]:
            self._described = found, [(one.key, plain(one._asdict())) for one in found]
        return self._described[1]

    def _set(self, changes: Mapping[str, object]) -> RequestResult:
        params = self._changeable()
        if self._paths is not None:
            self._paths.changes(changes)
        notes = params.set({key: as_value(value) for key, value in changes.items()})
        return ParamsChanged(_notes(notes))

    def _save(self, path: str | None) -> RequestResult:
        params = self._changeable()
        if path and self._paths is not None:
            path = self._paths.file(path)
        file = Path(path).expanduser() if path else None
        if file is not None and not file.is_absolute():
            raise ValueError(f"{path}: give the whole path; the rig has a folder of its own")
        saved = params.save(file)
        if self._saved is not None:
            self._saved(saved.path)
        return ParamsSaved(saved)

    def _character(self, name: str) -> RequestResult:
        params = self._changeable()
        if self._paths is not None and name not in params.characters():
            name = self._paths.file(name, "characters")
        return ParamsChanged(_notes(params.character(name)))


def plain(value: object) -> object:
    """Return lists and dicts made of tuples and mappings, as in JSON."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [plain(item) for item in value]
    return value


def as_changes(changes: Sequence[ParamChange]) -> list[dict[str, object]]:
    """Return differing values as plain JSON."""
    return [{"key": c.key, "old": plain(c.old), "new": plain(c.new)} for c in changes]


def as_value(value: object) -> Value:
    """Return JSON's lists as tuples, as the reader of files does."""
    if isinstance(value, list):
        return tuple(as_value(item) for item in value)
    if isinstance(value, dict):
        return {key: as_value(item) for key, item in value.items()}
    assert value is None or isinstance(value, bool | int | float | str)
    return value


def _notes(notes: object) -> tuple[str, ...]:
    """Return what a person should know, of what a change gave back."""
    if isinstance(notes, str) or not isinstance(notes, Iterable):
        return ()
    return tuple(map(str, notes))
