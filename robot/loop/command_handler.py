"""Requests to a running rig: the same for all clients, handled in one place.

The live page, other programs, the command line and Python all send the classes of
``gazerig.robot.model.commands`` and ``gazerig.robot.model.commands``.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Protocol

from gazerig.errors import Error
from gazerig.robot.loop.track_choices import TrackInfo
from gazerig.robot.model.commands import (
    Character,
    Characters,
    Command,
    Get,
    Parameters,
    ReadMenus,
    Request,
    Resume,
    Revert,
    Save,
    Say,
    SayPiece,
    Set,
    Speak,
    Stop,
    Tracks,
    Unsaved,
    Value,
    as_value,
)
from gazerig.robot.model.parameter import ParamChange, Parameter, SavedFile
from gazerig.robot.model.reply import CommandTaker, Ticket

REFUSALS = (ValueError, OSError, Error)
"""Exceptions that refuse a request; the message is for the user."""
FIXED = "these parameters cannot be changed while the rig runs"


class ParamAccess(Protocol):
    """The parameters of a running rig, such as ``gazerig.robot.run.live.ParamStore``."""

    @property
    def version(self) -> int:
        """Return the number of changes."""

    def parameters(self) -> tuple[Parameter, ...]:
        """Return all parameters."""

    def get(self, prefix: str) -> Mapping[str, Value]:
        """Return the present values whose keys start with ``prefix``."""

    def set(self, changes: Mapping[str, Value]) -> tuple[str, ...]:
        """Apply values from the next tick on; return notes for the user."""

    def unsaved(self) -> Sequence[ParamChange]:
        """Return the present values that are not in the file."""

    def save(self, path: Path | None = None) -> SavedFile:
        """Write the present values to a file."""

    def revert(self) -> tuple[str, ...]:
        """Restore the values of the file; return notes for the user."""

    def characters(self) -> Sequence[str]:
        """Return the available characters."""

    def apply_character(self, name: str) -> tuple[str, ...]:
        """Apply another character to the rig; return notes for the user."""

    def files(self) -> tuple[Path, ...]:
        """Return the files in use: the rig's file and its overlays."""

    def reload(self, path: Path) -> tuple[str, ...]:
        """Apply the contents of a file; on errors change nothing and raise with all of them."""


class PathGuard(Protocol):
    """Rules for the files that a client may name (``config.rig_files.AllowedFolder``)."""

    def check_file(self, given: str, kind: str = "") -> str:
        """Return a shipped name or an absolute path; raise if it is not allowed."""

    def check_changes(self, changes: Mapping[str, object]) -> None:
        """Raise if a value names a file that is not allowed."""


class Speaker(Protocol):
    """The voice of a head (``gazerig.robot.run.voice.RunVoice``)."""

    def prepare(self, command: Say, confined: bool = False, /) -> Speak:
        """Return the command that says a file or a text; raise if it cannot be said.

        confined: only files in the folders of sounds
        """

    def feed(self, pcm: bytes, rate_hz: int, channels: int, volume: float, /) -> float:
        """Say a piece of a stream; return the length that has not been heard, s."""

    def finish(self) -> None:
        """Mark the end of the stream."""


def accept_only_stops(command: CommandTaker, reason: str) -> CommandTaker:
    """Return a taker of stop and resume; it refuses other commands with the reason."""

    def take(asked: Command) -> Ticket | None:
        if not isinstance(asked, Stop | Resume):
            raise ValueError(f"{reason}: only stop and resume are accepted")
        return command(asked)

    return take


class CommandHandler:
    """The handler of all requests. All methods are thread-safe.

    Args:
        command: Queues a command for the next tick.
        params: The parameters, None if they cannot be read or changed.
        saved: Called with each written file.
        fixed: Reason why parameters cannot be changed.
        voice: Says sounds and texts; None if the head has no voice.
        menus: Returns the menus.
        tracks: Returns the available tracks.
    """

    def __init__(
        self,
        command: CommandTaker,
        params: ParamAccess | None,
        saved: Callable[[Path], None] | None = None,
        fixed: str = FIXED,
        voice: Speaker | None = None,
        menus: Callable[[], Mapping[str, tuple[str, ...]]] = dict,
        tracks: Callable[[], Sequence[TrackInfo]] = tuple,
    ) -> None:
        self._command, self.params, self._voice = command, params, voice
        self._menus, self._tracks = menus, tracks
        self._saved, self._fixed = saved, fixed

    def handle(self, request: Request, paths: PathGuard | None = None) -> object:
        """Handle a request.

        Args:
            request: A question, a change of parameters or a command.
            paths: Rules for file names, None if any file is allowed.

        Returns:
            The answer to a question; the notes for the user of a change, from the next tick on; the
            saved file; or the ticket for the reply to a command, None without one.

        Raises:
            Exception: One of ``REFUSALS``, with every broken rule.
        """
        match request:
            case ReadMenus():
                return self._menus()
            case Tracks():
                return self._tracks()
            case SayPiece() | Say():
                return self._say(request, paths is not None)
            case Command():
                return self._command(request)
            case Get() | Parameters() | Unsaved() | Characters() if self.params is None:
                return {} if isinstance(request, Get) else ()
        if self.params is None:
            raise ValueError(self._fixed)
        return self._handle_params(request, self.params, paths)

    def _handle_params(
        self, request: Request, params: ParamAccess, paths: PathGuard | None
    ) -> object:
        match request:
            case Parameters(prefix):
                return [one for one in params.parameters() if one.key.startswith(prefix)]
            case Get(prefix):
                return params.get(prefix)
            case Unsaved():
                return params.unsaved()
            case Characters():
                return params.characters()
            case Set(changes):
                if paths is not None:
                    paths.check_changes(changes)
                return params.set({key: as_value(one) for key, one in changes.items()})
            case Save(path):
                if path and paths is not None:
                    path = paths.check_file(path)
                file = Path(path).expanduser() if path else None
                if file is not None and not file.is_absolute():
                    raise ValueError(f"{path}: give the absolute path; the rig has its own folder")
                saved = params.save(file)
                if self._saved is not None:
                    self._saved(saved.path)
                return saved
            case Revert():
                return params.revert()
            case Character(name):
                if paths is not None and name not in params.characters():
                    name = paths.check_file(name, "characters")
                return params.apply_character(name)
        raise ValueError(f"{type(request).__name__} is not available here")

    def _say(self, request: Say | SayPiece, confined: bool) -> object:
        """Say a file or a text; of a stream, return the length that has not been heard, s."""
        voice = self._voice
        if voice is None:
            raise ValueError("this head has no voice")
        if isinstance(request, Say):
            return self._command(voice.prepare(request, confined))
        ahead_s = voice.feed(request.pcm, request.rate_hz, request.channels, request.volume)
        if request.last:
            voice.finish()
        return ahead_s
