"""The events of a conversation as orders to a head; pure, time is an argument."""

from collections.abc import Mapping
from math import inf
from typing import Any, Literal, NamedTuple

CHARACTERS_PER_S = 15.0
"""Rate of synthetic speech in English: about 150 words a minute."""
_REPLAN_S = 0.3
"""A change of the planned end by less than this gives no order."""
_MAX_CHARACTERS = 5000

OrderName = Literal["listening", "thinking", "speaking", "idle", "interrupt"]


class TurnOrder(NamedTuple):
    """An order to the head: the name of a method of ``gazerig.Head``, and its arguments.

    Attributes:
        state: Method.
        seconds: Time until the planned end of speaking, s; None if the sound's length is unknown.
        text: What is spoken from now on, from which the head estimates the end otherwise.
    """

    state: OrderName
    seconds: float | None = None
    text: str = ""


Orders = tuple[TurnOrder, ...]


class UnknownMessage(Exception):
    """A neighbour sent a message that the door does not know; the text has the remedy."""


class TurnTaking:
    """Who has the turn in a conversation. Each method returns the orders for a change.

    Events may come in any order and more than once: an event that changes nothing gives no order.

    Args:
        after_speech: State after the head's own speech: "listening" in a session that continues,
            "idle" if a wake word begins the next exchange.
    """

    def __init__(self, after_speech: Literal["listening", "idle"] = "idle") -> None:
        self._after_speech: OrderName = after_speech
        self.state: OrderName = "idle"
        self._text = ""
        self._begin_s = self._end_s = inf

    def partner_speaks(self) -> Orders:
        """Return the orders for a partner who begins to speak; this may be a barge-in."""
        interrupts = self.state in ("speaking", "thinking")
        orders = self._change("listening", "interrupt" if interrupts else "listening")
        if orders:
            self._text = ""
        return orders

    def partner_pauses(self) -> Orders:
        """Return the orders for a partner who has finished; an answer is being prepared."""
        return () if self.state == "speaking" else self._change("thinking")

    def add_text(self, text: str, now_s: float) -> Orders:
        """Add text that is or will be spoken; return the orders for a later planned end."""
        self._text = (self._text + text)[:_MAX_CHARACTERS]
        end_s = self._begin_s + len(self._text) / CHARACTERS_PER_S
        if self.state != "speaking" or abs(end_s - self._end_s) < _REPLAN_S:
            return ()
        self._end_s = end_s
        spoken = int((now_s - self._begin_s) * CHARACTERS_PER_S)
        return (TurnOrder("speaking", None, self._text[spoken:]),)

    def speak(self, now_s: float, seconds: float | None = None) -> Orders:
        """Return the orders for own speech that begins now, or whose duration is now known.

        Args:
            now_s: Present time, s.
            seconds: Duration of the whole speech; None: the head estimates it from the text.
        """
        begins = self.state != "speaking"
        if begins:
            self.state, self._begin_s = "speaking", now_s
            self._end_s = now_s + len(self._text) / CHARACTERS_PER_S if self._text else inf
        if seconds is None:
            return (TurnOrder("speaking", None, self._text),) if begins else ()
        end_s = self._begin_s + seconds
        if not begins and abs(end_s - self._end_s) < _REPLAN_S:
            return ()
        self._end_s = end_s
        return (TurnOrder("speaking", max(0.0, round(end_s - now_s, 3)), self._text),)

    def end_speech(self) -> Orders:
        """Return the orders for the end of own speech."""
        if self.state != "speaking":
            return ()
        self._text = ""
        return self._change(self._after_speech)

    def end(self) -> Orders:
        """Return the orders for the end of the conversation."""
        self._text = ""
        return self._change("idle")

    def is_over(self, now_s: float) -> bool:
        """Return whether the planned end of own speech has passed."""
        return self.state == "speaking" and now_s >= self._end_s

    def _change(self, state: OrderName, order: OrderName | None = None) -> Orders:
        if self.state == state:
            return ()
        self.state = state
        return (TurnOrder(order or state),)


def field(message: Mapping[str, Any], name: str, kind: type, fallback: Any) -> Any:
    """Return a field of a message, or the fallback if it is absent or of another type."""
    value = message.get(name)
    return value if isinstance(value, kind) else fallback
