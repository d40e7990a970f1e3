"""Heartbeat of a program that controls a running rig, on its own connection.

A program that dies, hangs or is suspended sends none, and the gaze models take over again.
"""

import threading
from collections.abc import Callable

from gazerig.robot.model.command_json import as_json
from gazerig.robot.model.commands import HEARTBEAT_S, Renew
from gazerig.robot.remote.socket_io import MalformedMessage, Wire

_EVERY_S = 0.25 * HEARTBEAT_S


class LeadHeartbeat:
    """Renews manual control until another client takes it or it ends.

    Args:
        dial: Returns a new connection to the rig.
        who: Name of the client, as in the command that started the control.

    Raises:
        OSError: the connection failed.
    """

    def __init__(self, dial: Callable[[], Wire], who: str) -> None:
        self._wire = dial()
        self._request = as_json(Renew(who))
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._beat, name="heartbeat", daemon=True)
        self._thread.start()

    @property
    def leads(self) -> bool:
        """Return whether the rig confirmed the last heartbeat."""
        return self._thread.is_alive() and not self._over.is_set()

    def end(self) -> None:
        """Stop the heartbeat."""
        self._over.set()
        self._wire.close()
        self._thread.join(timeout=2.0)

    def _beat(self) -> None:
        try:
            while not self._over.is_set():
                self._wire.write(self._request, HEARTBEAT_S)
                match self._wire.read(10.0, 10.0):
                    case {"ok": _}:
                        self._over.wait(_EVERY_S)
                    case _:  # another client is in control, or none
                        return
        except (OSError, EOFError, MalformedMessage):
            return  # closed by either side
