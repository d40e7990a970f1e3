"""Requests of browsers to the rig: checked, limited in rate, and sent."""

import contextlib
import json
import threading
from collections.abc import Callable, Mapping

import msgspec

from gazerig.drivers.process.message_link import DONT_WAIT, MessageLink
from gazerig.robot.dashboard.requests.inbox import BEAT, MESSAGE_BYTES, PICTURE, request_message
from gazerig.robot.model.clock import Clock, RealClock
from gazerig.robot.model.commands import (
    COMMANDS,
    ClientCommand,
    Command,
    ControlCommand,
    set_client,
)
from gazerig.robot.remote.excess import TokenBucket

DOOR = "door"
"""Name of the sender for the stop button and clicks in the image."""
ASKED_BYTES = 2048
"""Longest request, bytes; a stop with a reason has about a hundred."""
UNCONFIRMED = (
    'resume needs "confirmed": true, after a person has made sure that no hand is in the mechanism; '
    "only the websocket of a program that stopped the head needs none"
)
_LEADING = frozenset(name for name, kind in COMMANDS.items() if issubclass(kind, ControlCommand))
_SAY_WHO = tuple(name for name, kind in COMMANDS.items() if issubclass(kind, ClientCommand))
"""Commands with the name of the client."""
_PER_S, _BURST = 100.0, 200.0
"""Rate limit of all browsers together; dragging sends about 20 changes a second."""


class Outbox:
    """Sends requests over the page's socket; safe to call from any thread."""

    def __init__(
        self,
        feed: MessageLink,
        clock: Clock | None = None,
        name: Callable[[str], str] = lambda client: "",
        leads: Callable[[str], object] = lambda name: None,
    ) -> None:
        self._feed = feed
        self._clock = clock if clock is not None else RealClock()
        self._rate = TokenBucket(_PER_S, _BURST)
        self._lock = threading.Lock()
        self.name, self._leads = name, leads

    def command(self, command: Command, who: str) -> bool:
        """Send a command; return False if the rig does not accept it now."""
        if isinstance(command, ControlCommand):
            self._leads(self.name(who))
            command = set_client(command, self.name(who))
        return self.forward(msgspec.json.encode(command), who)

    def ask(self, data: Mapping[str, object], who: str) -> bool:
        """Send a request; ``who`` is returned with the reply."""
        return self.forward(json.dumps(data, separators=(",", ":")).encode(), who)

    def send_picture(self, jpeg: bytes) -> bool:
        """Send an image of a browser's webcam; return False if the rig does not accept it."""
        try:
            self._feed.send(PICTURE + jpeg, DONT_WAIT)
        except OSError:  # the buffer is full, the rig has ended, or the message is too long
            return False
        return True

    def send_heartbeat(self) -> None:
        """Report to the rig that this page is alive."""
        with contextlib.suppress(OSError):  # the buffer is full, or the rig has ended
            self._feed.send(BEAT, DONT_WAIT)

    def forward(self, data: bytes, who: str = DOOR) -> bool:
        """Send a compact JSON object."""
        message = request_message(who, data)
        with self._lock:
            if len(message) > MESSAGE_BYTES or not self._rate.take(self._clock.now_s()):
                return False
        try:
            # A rig that accepts nothing must not delay other requests.
            self._feed.send(message, DONT_WAIT)
        except OSError:  # the buffer is full, or the socket has closed; then the page ends
            return False
        return True


def add_client(body: bytes | str, who: str) -> dict[str, object] | None:
    """Return a request with the browser's name added, None if it is not valid.

    Args:
        body: the request as received
        who: name of the browser; it replaces a name in the request
    """
    try:
        asked = msgspec.json.decode(body)
    except (ValueError, RecursionError):
        return None
    if not isinstance(asked, dict):
        return None
    if (name := asked.get("do")) in _SAY_WHO:
        asked = {"do": name, **asked, "who": who}
    if isinstance(pick := asked.get("pick"), dict):
        asked["pick"] = {**pick, "who": who}
    return asked


def takes_control(asked: Mapping[str, object]) -> bool:
    """Return whether a request gives its browser control of the head."""
    return "pick" in asked or asked.get("do") in _LEADING


def encode_request(asked: Mapping[str, object]) -> bytes:
    """Return a request as JSON without blanks, its "do" first."""
    return json.dumps(asked, separators=(",", ":")).encode()
