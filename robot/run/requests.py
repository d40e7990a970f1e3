"""Requests of another program to a running rig, and the answers, as plain JSON values.

{"do": "set", "changes": {"loop.rate_hz": 100.0}}  ->  {"ok": {"notes": []}}
{"do": "set", "changes": {"loop.rate_hz": 1e9}}    ->  {"refused": "... wanted 20 to 1000 ..."}
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec import structs

from gazerig.config.schema import NO_CHARACTER
from gazerig.errors import Error
from gazerig.robot.loop.events import TickFeed
from gazerig.robot.loop.head_state import head_state
from gazerig.robot.model.commands import (
    Ask,
    ClientCommand,
    Command,
    Fault,
    Get,
    Hello,
    Parameters,
    ReadMenus,
    ReadPicture,
    ReadStatus,
    Request,
    Resume,
    Revert,
    Save,
    Say,
    SayPiece,
    Set,
    State,
    Stop,
    Tracks,
    Unsaved,
    Value,
    as_value,
    read_request,
    set_client,
)
from gazerig.robot.model.reply import Ticket
from gazerig.robot.net.socket_io import VERSION

if TYPE_CHECKING:
    from gazerig.robot.run.run import Run

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
_CALIBRATED = "it is being calibrated: only stop and resume are accepted"
_WHILE_CALIBRATED = Stop | Resume | Hello | ReadStatus | State


class RequestHandler:
    """Executes requests of other programs; answers {"ok": ...} or {"refused": ...}.

    The live page, other programs and the command line all send the classes of
    ``gazerig.robot.model.commands``. All methods are thread-safe.

    Args:
        run: The running rig.
        feed: Newest tick and events of its loop.
        about: Constant fields of the status, e.g. {"rig": name, "pid": process}.
        changing: Returns the other fields of the status, e.g. {"page": address}.
        confined: Whether a client may name only files in the rig's folder and those of sounds.
        calibrated: Whether the rig is being calibrated, and accepts only stops and resumes.
    """

    def __init__(
        self,
        run: "Run",
        feed: TickFeed,
        about: Mapping[str, object],
        changing: Callable[[], Mapping[str, object]] = dict,
        *,
        confined: bool = False,
        calibrated: bool = False,
    ) -> None:
        self._run, self._feed, self._about = run, feed, dict(about)
        self._changing, self._confined, self._calibrated = changing, confined, calibrated

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
        if self._calibrated and not isinstance(request, _WHILE_CALIBRATED):
            raise ValueError(_CALIBRATED)
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
                if (inject := self._run.bus.inject_fault) is None:
                    raise ValueError(REAL)
                return {"ok": inject(text)}
            case Tracks():
                return {"ok": self._run.robot.tracks()}
            case Ask(menu="character", choice=name):
                done: object = self._set({"character": None if name == NO_CHARACTER else name})
            case Say():
                done = self._run.robot.command(self._run.voice.prepare(request, self._confined))
            case Command():
                done = self._run.robot.command(request)
            case _:
                done = self.perform(request)
        if isinstance(done, Ticket):
            reply = done.wait(_TAKEN_UP_S)
            if reply is None:
                raise ValueError(_HANGS)
            if reply.refused:
                return {"refused": reply.refused, "reply": reply}
            return {"ok": {"notes": (), "reply": reply}}
        if isinstance(request, Command | Set | Revert):
            if not self._feed.wait_for_ticks(_READ_BY_TICKS, _TAKEN_UP_S):
                raise ValueError(_HANGS)
            return {"ok": {"notes": done or ()}}
        return {"ok": done}

    def perform(self, request: Request) -> object:
        """Return the answer to a question, or the notes of a change that the loop has not read.

        Raises:
            one of REFUSALS: a rule forbids it.
        """
        params = self._run.params
        match request:
            case ReadMenus():
                return {**self._run.robot.menus(), "character": params.characters()}
            case ReadPicture():
                return self._picture()
            case SayPiece():
                return self._say_piece(request)
            case Parameters(prefix):
                return params.parameters(prefix)
            case Get(prefix):
                return params.get(prefix)
            case Unsaved():
                return params.unsaved()
            case Set(changes):
                return self._set({key: as_value(one) for key, one in changes.items()})
            case Save(path):
                if path and self._confined:
                    path = params.confined.check_file(path)
                file = Path(path).expanduser() if path else None
                if file is not None and not file.is_absolute():
                    raise ValueError(f"{path}: give the absolute path; the rig has its own folder")
                return params.save(file)
            case Revert():
                return params.revert()
        raise ValueError(f"{type(request).__name__} is not available here")

    def _set(self, changes: Mapping[str, Value]) -> tuple[str, ...]:
        """Apply values of keys, unless the client may not name their files."""
        if self._confined:
            self._run.params.confined.check_changes(changes)
        return self._run.params.set(changes)

    def _picture(self) -> bytes:
        tick = self._feed.newest
        seen = tick.detections if tick is not None else None
        if seen is None or seen.image is None:
            raise ValueError("there is no picture: no camera runs, or the scene is not drawn")
        import cv2  # a program that asks for no picture does not wait for it

        return bytes(cv2.imencode(".jpg", seen.image)[1])

    def _say_piece(self, piece: SayPiece) -> float:
        """Say a piece of a stream; return the length that has not been heard, s."""
        voice = self._run.voice
        ahead_s = voice.feed(piece.pcm, piece.rate_hz, piece.channels, piece.volume)
        if piece.last:
            voice.finish()
        return ahead_s

    def _status(self) -> dict[str, object]:
        unsaved = 0 if self._calibrated else len(self._run.params.unsaved())
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
