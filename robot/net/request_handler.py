"""Requests of another program to a running rig, and the answers, as plain JSON values.

{"do": "set", "changes": {"loop.rate_hz": 100.0}}  ->  {"ok": {"notes": []}}
{"do": "set", "changes": {"loop.rate_hz": 1e9}}    ->  {"refused": "... wanted 20 to 1000 ..."}
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Protocol

from msgspec import structs

from gazerig.errors import Error
from gazerig.robot.loop.events import TickFeed
from gazerig.robot.loop.head_state import head_state
from gazerig.robot.loop.track_choices import TrackInfo
from gazerig.robot.model.commands import (
    Character,
    Characters,
    ClientCommand,
    Command,
    Fault,
    Get,
    Hello,
    Parameters,
    ReadMenus,
    ReadStatus,
    Request,
    Resume,
    Revert,
    Save,
    Say,
    SayPiece,
    Set,
    Speak,
    State,
    Stop,
    Tracks,
    Unsaved,
    Value,
    as_value,
    read_request,
    set_client,
)
from gazerig.robot.model.parameter import ParamChange, Parameter, SavedFile
from gazerig.robot.model.reply import CommandTaker, Ticket
from gazerig.robot.net.socket_io import VERSION

_TAKEN_UP_S = 1.0
"""Timeout of the loop's execution, s; a servo that answers late delays it by some 50 ms."""
_READ_BY_TICKS = 2
"""Ticks after which commands are read: the present one may have read them already."""
_WORDS = 20
"""Number of recent messages in the status."""

REAL = "only servos emulated byte by byte accept fault commands: gazerig run --mock, without --bus ideal"
_HANGS = (
    f"the control loop has not executed it within {_TAKEN_UP_S:g} s: it hangs, "
    "starts or ends; use the emergency stop if anything moves"
)

REFUSALS = (ValueError, OSError, Error)
"""Exceptions that refuse a request; the message is for the user."""
FIXED = "these parameters cannot be changed while the rig runs"


class ParamAccess(Protocol):
    """The parameters of a running rig, such as ``gazerig.robot.run.live.ParamStore``."""

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


class RequestHandler:
    """Executes requests of other programs; answers {"ok": ...} or {"refused": ...}.

    The live page, other programs and the command line all send the classes of
    ``gazerig.robot.model.commands``. All methods are thread-safe.

    Args:
        command: Queues a command for the next tick.
        feed: Newest tick and events of the loop.
        about: Constant fields of the status, e.g. {"rig": name, "pid": process}.
        params: The parameters, None if they cannot be read or changed.
        voice: Says sounds and texts; None if the head has no voice.
        menus: Returns the menus.
        tracks: Returns the available tracks.
        fault: Executes a fault command of emulated servos; None if the servos are real.
        changing: Returns the other fields of the status, e.g. {"page": address}.
        paths: Rules for the files that a client may name; None if any.
    """

    def __init__(
        self,
        command: CommandTaker,
        feed: TickFeed,
        about: Mapping[str, object],
        params: ParamAccess | None = None,
        *,
        voice: Speaker | None = None,
        menus: Callable[[], Mapping[str, tuple[str, ...]]] = dict,
        tracks: Callable[[], Sequence[TrackInfo]] = tuple,
        fault: Callable[[str], str] | None = None,
        changing: Callable[[], Mapping[str, object]] = dict,
        paths: PathGuard | None = None,
    ) -> None:
        self._command, self._feed, self._about = command, feed, dict(about)
        self._params, self._paths = params, paths
        self._voice, self._menus, self._tracks = voice, menus, tracks
        self._fault, self._changing = fault, changing

    def answer(self, message: object, peer: str = "") -> dict[str, object]:
        """Execute one request; return {"ok": result} or {"refused": every broken rule}.

        Args:
            message: Request {"do": verb, ...}. Its "tag" is returned with the answer.
            peer: Client at the other end, e.g. "process 123"; "" for the page, which names its own.
        """
        tag: dict[str, object] = {}
        if isinstance(message, dict):
            message = dict(message)
            tag = {"tag": message.pop("tag")} if "tag" in message else {}
        try:
            request = read_request(message)
            if peer and isinstance(request, ClientCommand):
                # The process is added: a client cannot pose as another one or the page.
                who = f"{request.who} ({peer})" if request.who else peer
                request = set_client(request, who)
            return {**self._execute(request), **tag}
        except REFUSALS as error:
            return {"refused": str(error), **tag}

    def _execute(self, request: Request) -> dict[str, object]:
        """Execute a request, and wait until the loop has done it."""
        match request:
            case Hello(version):
                if version != VERSION:
                    raise ValueError(
                        f"version {version} of the messages: this rig has {VERSION}; "
                        "update gazerig or the program"
                    )
                return {"ok": {"version": VERSION, **self._about}}
            case ReadStatus():
                return {"ok": self._status()}
            case State(after):
                return {"ok": self._feed.report(after)}
            case Fault(text):
                if self._fault is None:
                    raise ValueError(REAL)
                return {"ok": self._fault(text)}
            case Tracks():
                return {"ok": self._tracks()}
            case Command():
                done: object = self._command(self._speech(request))
            case _:
                done = self.perform(request)
        if isinstance(done, Ticket):
            reply = done.wait(_TAKEN_UP_S)
            if reply is None:
                raise ValueError(_HANGS)
            if reply.refused:
                return {"refused": reply.refused, "reply": reply}
            return {"ok": {"notes": (), "reply": reply}}
        if isinstance(request, Command | Set | Revert | Character):
            if not self._feed.wait_for_ticks(_READ_BY_TICKS, _TAKEN_UP_S):
                raise ValueError(_HANGS)
            return {"ok": {"notes": done or ()}}
        return {"ok": done}

    def perform(self, request: Request) -> object:
        """Return the answer to a question, or the notes of a change that the loop has not read.

        Raises:
            one of REFUSALS: a rule forbids it.
        """
        if isinstance(request, ReadMenus):
            return self._menus()
        if isinstance(request, SayPiece):
            return self._say_piece(request)
        params, paths = self._params, self._paths
        if params is None:
            raise ValueError(FIXED)
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
                return params.save(file)
            case Revert():
                return params.revert()
            case Character(name):
                if paths is not None and name not in params.characters():
                    name = paths.check_file(name, "characters")
                return params.apply_character(name)
        raise ValueError(f"{type(request).__name__} is not available here")

    def _speech(self, command: Command) -> Command:
        """Return the command that says a file or a text; others stay unchanged."""
        if not isinstance(command, Say):
            return command
        return self._require_voice().prepare(command, self._paths is not None)

    def _say_piece(self, piece: SayPiece) -> float:
        """Say a piece of a stream; return the length that has not been heard, s."""
        voice = self._require_voice()
        ahead_s = voice.feed(piece.pcm, piece.rate_hz, piece.channels, piece.volume)
        if piece.last:
            voice.finish()
        return ahead_s

    def _require_voice(self) -> Speaker:
        if self._voice is None:
            raise ValueError("this head has no voice")
        return self._voice

    def _status(self) -> dict[str, object]:
        unsaved = len(self._params.unsaved()) if self._params is not None else 0
        about = {**self._about, **self._changing(), "unsaved": unsaved}
        if (tick := self._feed.newest) is None:
            return {**about, "ticks": 0, "stopped": "", "said": ()}
        return {
            **about,
            **structs.asdict(head_state(tick)),
            "ticks": self._feed.ticks,
            "camera": tick.camera_conditions,
            "said": [event.text for event in self._feed.messages()[-_WORDS:]],
        }


def is_stop(message: object) -> bool:
    """Return whether a message is a stop, which nothing may delay."""
    return isinstance(message, dict) and message.get("do") == "stop"
