"""Client of a rig that runs in another program of the same user.

from gazerig.robot.model.commands import LookAt
from gazerig.robot.net.client import RobotClient

with RobotClient.connect() as rig:
    rig.set_many({"gaze.lids.blinks_per_min": 12.0})
    print(rig.send(LookAt((1.0, 0.3, 0.0))).text())
    print(rig.status()["headline"])
    rig.ask(Save("/home/me/my.yaml"), SavedFile)
"""

import contextlib
import json
import os
import threading
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import msgspec

from gazerig.drivers.errors import DriverError, SetupError
from gazerig.errors import HeadEnded, NotFound, Refused
from gazerig.robot.model.commands import (
    HEARTBEAT_S,
    SLOW,
    Change,
    Command,
    ControlCommand,
    Get,
    Hello,
    LookAt,
    ReadStatus,
    Renew,
    Request,
    Set,
    State,
    Stop,
    Talk,
    Value,
    set_client,
    verb,
)
from gazerig.robot.model.reply import CommandReply
from gazerig.robot.net.socket_io import (
    ANSWER_BYTES,
    VERSION,
    MalformedMessage,
    Wire,
    connect_to_socket,
    find_sockets,
    is_private,
    socket_folder,
)

if TYPE_CHECKING:
    from gazerig.robot.loop.head_state import HeadEvent, HeadState

_T = TypeVar("_T")
CONNECT_S = 1.0
_ANSWER_S = 10.0
_FILES_S = 40.0
"""Timeout of requests that read or write files, which another process of the rig does, s."""


class NoRobotError(SetupError, NotFound):
    """No rig runs, or not the requested one; the message lists those that run."""


class RequestRejected(SetupError, Refused):
    """The rig refused a request and is unchanged; the message lists every broken rule.

    Attributes:
        reply: Reply of the head to a command; None if the request was not a command.
    """

    def __init__(self, message: str, reply: CommandReply | None = None) -> None:
        super().__init__(message)
        self.reply = reply


class ConnectionLost(DriverError, HeadEnded):
    """The rig ended or does not answer; the message names the reason."""


_EVERY_S = 0.25 * HEARTBEAT_S


class ControlHeartbeat:
    """Renews manual control until another client takes it or it ends.

    Args:
        dial: Returns a new connection to the rig.
        who: Name of the client, as in the command that started the control.

    Raises:
        OSError: the connection failed.
    """

    def __init__(self, dial: Callable[[], Wire], who: str) -> None:
        self._wire = dial()
        self._request = Renew(who=who)
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._beat, name="heartbeat", daemon=True)
        self._thread.start()

    @property
    def in_control(self) -> bool:
        """Return whether the rig confirmed the last heartbeat."""
        return self._thread.is_alive() and not self._over.is_set()

    def end(self) -> None:
        """Stop the heartbeat."""
        self._over.set()
        self._wire.close()
        self._thread.join(timeout=2.0)

    def _beat(self) -> None:
        with contextlib.suppress(OSError, EOFError, MalformedMessage):  # closed by either side
            while not self._over.is_set():
                self._wire.write(self._request, HEARTBEAT_S)
                match self._wire.read(10.0, 10.0):
                    case {"ok": _}:
                        self._over.wait(_EVERY_S)
                    case _:  # another client is in control, or none
                        return


class RobotClient:
    """Connection to one running rig; a call returns when the rig has executed it.

    Use ``connect`` to create one. It may be used from several threads.

    Args:
        wire: Connection.
        pid: Process id of the rig.
        who: Name of this client in messages.
        dial: Opens another connection to the same rig.
    """

    def __init__(
        self, wire: Wire, pid: int, who: str = "", dial: Callable[[], Wire] | None = None
    ) -> None:
        self._wire, self.pid, self.who, self._dial = wire, pid, who, dial
        self._lock = threading.Lock()
        self._greeted = False
        self._heartbeat: ControlHeartbeat | None = None
        self._talks = False

    @classmethod
    def connect(cls, which: int | str | None = None, who: str = "") -> "RobotClient":
        """Connect to the only rig that runs, or to that of a process or name.

        Args:
            which: Process id or name of the rig; None if only one runs.
            who: Name of this client in messages, e.g. "my show"; the process is added.

        Raises:
            NoRobotError: no rig runs, or not exactly one fits; the message lists those that run.
        """
        found = connect_to_all(which, who)
        if len(found) == 1:
            return found[0]
        for other in found:
            other.close()
        kind = "of process" if str(which).isdecimal() else "named"
        asked = "" if which is None else f" {kind} {which}"
        running = _names_of_all()
        if not found:
            raise NoRobotError(
                f"no rig{asked} is running: {running or 'start one with gazerig run ...'}"
            )
        raise NoRobotError(
            f"{len(found)} rigs{asked} are running: {running}; choose one with --rig NAME or --pid N"
        )

    def __enter__(self) -> "RobotClient":
        """Return the connection itself."""
        return self

    def __exit__(self, *raised: object) -> None:
        """Disconnect."""
        self.close()

    def close(self) -> None:
        """Close the connection; the rig continues, and manual control without ``stay`` ends."""
        self._end_heartbeat()
        self._wire.close()

    def ask(self, request: Request, kind: type[_T]) -> _T:
        """Send a request and return its result, which has the given type.

        Raises:
            RequestRejected: a rule forbids it; the message lists every broken rule.
            ConnectionLost: the rig has ended, does not answer, or failed with an internal error.
        """
        with self._lock:
            # Nothing may delay or refuse a stop.
            if not self._greeted and not isinstance(request, Stop):
                self._result(self._answer(Hello(VERSION)))
                self._greeted = True
            answer = self._answer(request)
        return msgspec.convert(self._result(answer), kind, dec_hook=_to_path)

    def _result(self, answer: object) -> object:
        """Return the result in an answer, or raise the error in it."""
        match answer:
            case {"ok": result}:
                return result
            case {"refused": str(rules), "reply": reply}:
                raise RequestRejected(rules, msgspec.convert(reply, CommandReply))
            case {"refused": str(rules)}:
                raise RequestRejected(rules)
            case {"failed": str(what)}:
                raise ConnectionLost(f"the rig (process {self.pid}) had an internal error: {what}")
        raise ConnectionLost(f"process {self.pid} did not answer like a rig: {answer!r:.80}")

    def _answer(self, request: Request) -> object:
        within_s = _FILES_S if verb(type(request)) in SLOW else _ANSWER_S
        try:
            self._wire.write(request, CONNECT_S)
        except (TypeError, ValueError) as error:
            raise RequestRejected(
                f"only finite numbers, text, lists and mappings can be sent: {error}"
            ) from None
        except OSError:
            raise self._lost() from None
        try:
            return self._wire.read(within_s, within_s)
        except TimeoutError:
            self.close()  # a late answer would be mistaken for that of the next request
            raise ConnectionLost(f"the rig (process {self.pid}) does not answer") from None
        except (EOFError, OSError):
            raise self._lost() from None
        except MalformedMessage as error:
            self.close()
            raise ConnectionLost(f"process {self.pid} did not answer like a rig: {error}") from None

    def _lost(self) -> ConnectionLost:
        return ConnectionLost(f"the rig (process {self.pid}) has ended or disconnected")

    def state(self, after: int = 0) -> "tuple[HeadState | None, tuple[HeadEvent, ...]]":
        """Return the newest tick, None before the first, and events numbered above ``after``."""
        # Imported here, because ``gazerig stop`` must not wait for NumPy.
        from gazerig.robot.loop.head_state import HeadReport

        news = self.ask(State(after), HeadReport)
        return news.state, news.events

    def status(self) -> dict[str, Any]:
        """Return the rig's name and process, the fields of ``HeadState``, and the last messages."""
        return self.ask(ReadStatus(), dict[str, Any])

    @property
    def name(self) -> str:
        """Return the name of the rig (``gazerig run --name``)."""
        now = self.status()
        return str(now.get("name") or rig_name(now["rig"]))

    def get(self, prefix: str = "") -> dict[str, Any]:
        """Return the present values of all keys that start with ``prefix``."""
        return self.ask(Get(prefix), dict[str, Any])

    def set_many(self, changes: Mapping[str, Value]) -> tuple[str, ...]:
        """Apply several values in the same tick, or none; return notes for the user."""
        try:
            json.dumps(changes, allow_nan=False)
        except (TypeError, ValueError) as error:
            raise RequestRejected(f"only finite numbers, text and lists: {error}") from None
        return self.change(Set(dict(changes)))

    @property
    def in_control(self) -> bool:
        """Return whether this connection renews a manual control that the rig still follows."""
        return self._heartbeat is not None and self._heartbeat.in_control

    def send(self, command: Command) -> CommandReply:
        """Send any command; control and conversation without ``stay`` are renewed from now on.

        Raises:
            RequestRejected: the command is not valid, or the head refuses it.
        """
        command = set_client(command, self.who)
        if isinstance(command, LookAt) and command.p_world_m is None and not self._talks:
            self._end_heartbeat()
        reply, renews = self._command(command), False
        if isinstance(command, Talk):
            # After idle the heartbeat ends by itself, unless the client controls the gaze too.
            renews = self._talks = command.state != "idle" and not command.stay
        elif isinstance(command, ControlCommand) and reply.control_number:
            renews = self._talks or not command.stay
            if not renews:
                self._end_heartbeat()
        if renews and self._dial is not None and not self.in_control:
            self._end_heartbeat()
            try:
                self._heartbeat = ControlHeartbeat(self._dial, self.who)
            except OSError:
                raise self._lost() from None
        return reply

    def _end_heartbeat(self) -> None:
        heartbeat, self._heartbeat = self._heartbeat, None
        if heartbeat is not None:
            heartbeat.end()

    def _command(self, command: Command) -> CommandReply:
        if isinstance(command, Stop) and self._lock.locked() and self._dial is not None:
            # A thread waits on this connection, e.g. until a text is spoken.
            try:
                wire = self._dial()
            except OSError:
                raise self._lost() from None
            with RobotClient(wire, self.pid, self.who) as other:
                return other.send(command)
        return self.ask(command, _Done).reply or CommandReply()

    def change(self, request: Change) -> tuple[str, ...]:
        """Send a request that changes values; return notes for the user."""
        return self.ask(request, _Done).notes


class _Done(msgspec.Struct):
    """The result of a change or a command."""

    notes: tuple[str, ...] = ()
    reply: CommandReply | None = None


def _to_path(kind: type, value: Any) -> Any:
    return kind(value)


def connect_to_all(which: int | str | None = None, who: str = "") -> list[RobotClient]:
    """Connect to every rig of this user that runs, or to those of one process or name.

    Args:
        which: Process id or name of the rig; None: all.
        who: As in ``RobotClient.connect``.
    """
    uid = os.getuid()
    place = socket_folder(os.environ, uid)
    if not is_private(place, uid):  # any user may have put a socket there
        return []
    found: list[RobotClient] = []
    for path, pid in find_sockets(place).items():
        dial = partial(_connect_wire, path)
        with contextlib.suppress(OSError):  # killed: the next rig that starts removes it
            rig = RobotClient(dial(), pid, who, dial)
            if which is None or is_chosen(rig, str(which)):
                found.append(rig)
            else:
                rig.close()
    return found


def _connect_wire(path: Path) -> Wire:
    """Connect to a rig's socket."""
    return Wire(connect_to_socket(path, CONNECT_S), ANSWER_BYTES)


def is_chosen(rig: RobotClient, which: str) -> bool:
    """Return whether a rig has this process id or name."""
    if which.isdecimal():
        return rig.pid == int(which)
    try:
        return rig.name == which
    except DriverError:  # it is ending or hangs
        return False


def rig_name(rig: str) -> str:
    """Return the name of an unnamed rig: that of its file."""
    return Path(rig).stem


def _names_of_all() -> str:
    """Return the names and processes of all rigs that run as text."""
    names = []
    for rig in connect_to_all():
        with rig:
            try:
                names.append(f"{rig.name} (process {rig.pid})")
            except DriverError as error:
                names.append(f"process {rig.pid} ({error})")
    return ", ".join(sorted(names))
