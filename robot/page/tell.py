"""The page's voice: what people do in their browsers goes to the rig from here."""

import json
import socket
from collections.abc import Mapping

from robot.orders import Order, as_json
from robot.page.ear import MESSAGE_BYTES, telling

DOOR = "door"
"""Who asks where it is the stop button or a click in the picture."""


class Teller:
    """Sends requests over the page's socket; from any thread."""

    def __init__(self, feed: socket.socket) -> None:
        """Take the socket to the rig."""
        self._feed = feed

    def order(self, order: Order, who: str) -> bool:
        """Give an order; False where the rig does not take it now."""
        return self.ask(as_json(order), who)

    def ask(self, data: Mapping[str, object], who: str) -> bool:
        """Ask for anything; ``who`` comes back with the answer."""
        return self.hand_on(json.dumps(data, separators=(",", ":")).encode(), who)

    def hand_on(self, data: bytes, who: str = DOOR) -> bool:
        """Hand on a compact JSON object."""
        message = telling(who, data)
        if len(message) > MESSAGE_BYTES:
            return False
        try:
            # A rig that takes nothing must not hold up the others who ask.
            self._feed.send(message, socket.MSG_DONTWAIT)
        except OSError:  # full, or gone: then the page ends by itself
            return False
        return True
