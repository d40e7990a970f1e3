"""Outbox of the page: sends the requests of browsers to the rig."""

import contextlib
import json
import threading
from collections.abc import Callable, Mapping

from gazerig.drivers.process.message_link import DONT_WAIT, MessageLink
from gazerig.robot.dashboard.requests.inbox import BEAT, MESSAGE_BYTES, PICTURE, request_message
from gazerig.robot.dashboard.requests.token_bucket import TokenBucket
from gazerig.robot.model.clock import Clock, RealClock
from gazerig.robot.model.command_json import as_json
from gazerig.robot.model.commands import Command, Leading

DOOR = "door"
"""Name of the sender for the stop button and clicks in the image."""


_PER_S, _BURST = 100.0, 200.0
"""Rate limit of all browsers together; dragging sends some 20 changes a second."""


def _unnamed(client: str) -> str:
    """Return "": the browser of a client is unknown."""
    return ""


class Outbox:
    """Sends requests over the page's socket; from any thread.

    Args:
        feed: to the rig.
        clock: of the page.
        name: returns the name of the browser of a client of the page.
        leads: Receives the name of the browser in control of the head.
    """

    def __init__(
        self,
        feed: MessageLink,
        clock: Clock | None = None,
        name: Callable[[str], str] = _unnamed,
        leads: Callable[[str], object] = _unnamed,
    ) -> None:
        self._feed = feed
        self._clock = clock if clock is not None else RealClock()
        self._rate = TokenBucket(_PER_S, _BURST)
        self._lock = threading.Lock()
        self.name, self._leads = name, leads

    def command(self, command: Command, who: str) -> bool:
        """Send a command; return False if the rig does not accept it now."""
        if isinstance(command, Leading):
            self._leads(self.name(who))
            command = command._replace(who=self.name(who))
        return self.ask(as_json(command), who)

    def ask(self, data: Mapping[str, object], who: str) -> bool:
        """Send a request; ``who`` is returned with the reply."""
        return self.hand_on(json.dumps(data, separators=(",", ":")).encode(), who)

    def picture(self, jpeg: bytes) -> bool:
        """Send an image of a browser's webcam; return False if the rig does not accept it."""
        try:
            self._feed.send(PICTURE + jpeg, DONT_WAIT)
        except OSError:  # full, gone, or too long
            return False
        return True

    def beat(self) -> None:
        """Tell the rig that this page is alive."""
        with contextlib.suppress(OSError):  # full, or gone
            self._feed.send(BEAT, DONT_WAIT)

    def hand_on(self, data: bytes, who: str = DOOR) -> bool:
        """Send a compact JSON object."""
        message = request_message(who, data)
        with self._lock:
            if len(message) > MESSAGE_BYTES or not self._rate.take(self._clock.now_s()):
                return False
        try:
            # A rig that accepts nothing must not delay other requests.
            self._feed.send(message, DONT_WAIT)
        except OSError:  # full, or closed: then the page ends
            return False
        return True
