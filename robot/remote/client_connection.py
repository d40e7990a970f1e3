"""Connection of a client to a running rig: requests, answers and their errors."""

import threading
from collections.abc import Callable

from gazerig.drivers.errors import DriverError, SetupError
from gazerig.errors import HeadEnded, NotFound, Refused
from gazerig.robot.model.reply import CommandReply
from gazerig.robot.remote.socket_io import MalformedMessage, Wire

CONNECT_S = 1.0
_ANSWER_S = 10.0
_FILES_S = 40.0
"""Timeout of requests that read or write files, which another process of the rig does, s."""
_WITH_FILES = {"save", "character"}


class NoRobotError(SetupError, NotFound):
    """No rig runs, or not the requested one; the message lists those that run."""


class RequestRejected(SetupError, Refused):
    """The rig refused a request and is unchanged; the message lists every broken rule.

    Attributes:
        reply: Reply of the head to a command; None if the request was no command.
    """

    def __init__(self, message: str, reply: CommandReply | None = None) -> None:
        super().__init__(message)
        self.reply = reply


class ConnectionLost(DriverError, HeadEnded):
    """The rig ended or does not answer; the message names the reason."""


class ClientConnection:
    """Client end of a connection to one rig; may be used from several threads.

    Args:
        wire: Connection.
        pid: Process id of the rig.
        ending: Called before the connection is closed.
    """

    def __init__(self, wire: Wire, pid: int, ending: Callable[[], None]) -> None:
        self._wire, self.pid, self._ending = wire, pid, ending
        self._lock = threading.Lock()

    def close(self) -> None:
        """Close the connection."""
        self._ending()
        self._wire.close()

    def ask(self, do: str, **fields: object) -> object:
        """Send a request and return its result.

        Raises:
            RequestRejected: a rule forbids it.
            ConnectionLost: the rig has ended, does not answer, or failed with an internal error.
        """
        with self._lock:
            answer = self._answer(
                {"do": do, **fields}, _FILES_S if do in _WITH_FILES else _ANSWER_S
            )
        match answer:
            case {"ok": said}:
                return said
            case {"refused": str(rules), "reply": dict(reply)}:
                raise RequestRejected(rules, CommandReply.from_json(reply))
            case {"refused": str(rules)}:
                raise RequestRejected(rules)
            case {"failed": str(what)}:
                raise ConnectionLost(
                    f"the rig (process {self.pid}) met an error of its own: {what}"
                )
        raise ConnectionLost(f"process {self.pid} gave no answer of a rig: {answer!r:.80}")

    def _answer(self, request: dict[str, object], within_s: float) -> object:
        try:
            self._wire.write(request, CONNECT_S)
        except (TypeError, ValueError) as error:
            raise RequestRejected(
                f"only finite numbers, text, lists and mappings go: {error}"
            ) from None
        except OSError:
            raise ConnectionLost(f"the rig (process {self.pid}) has ended or hung up") from None
        try:
            return self._wire.read(within_s, within_s)
        except TimeoutError:
            self.close()  # a late answer would be taken for that of the next request
            raise ConnectionLost(f"the rig (process {self.pid}) does not answer") from None
        except (EOFError, OSError):
            raise ConnectionLost(f"the rig (process {self.pid}) has ended or hung up") from None
        except MalformedMessage as error:
            self.close()
            raise ConnectionLost(f"process {self.pid} gave no answer of a rig: {error}") from None
