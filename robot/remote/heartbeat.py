"""The heartbeat of a program that leads a running rig: on a connection of its own.

A program that dies, hangs as a whole or is stopped sends none, and the gaze leads again.
"""

import threading
from collections.abc import Callable

from gazerig.robot.model.command_json import as_json
from gazerig.robot.model.commands import HEARTBEAT_S, Renew
from gazerig.robot.remote.socket_io import MalformedMessage, Wire

_EVERY_S = 0.25 * HEARTBEAT_S


class LeadHeartbeat:
    """Renews a lead until it is taken by another client or ended.

    Args:
        dial: connects to the rig.
        who: as in the order that took the lead.

    Raises:
        OSError: the rig is gone.
    """

    def __init__(self, dial: Callable[[], Wire], who: str) -> None:
        self._wire = dial()
        self._request = as_json(Renew(who))
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._beat, name="heartbeat", daemon=True)
        self._thread.start()

    @property
    def leads(self) -> bool:
        """True while the rig has said that this program still leads."""
        return self._thread.is_alive() and not self._over.is_set()

    def end(self) -> None:
        """Send no more."""
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
                    case _:  # another client leads, or none
                        return
        except (OSError, EOFError, MalformedMessage):
            return  # hung up, by either side
