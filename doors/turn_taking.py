"""The events of a conversation as orders to a head; pure, time is an argument."""

from collections.abc import Mapping
from math import inf
from typing import Any, Literal, NamedTuple

import gazerig

_REPLAN_S = 0.3
"""A change of the planned end by less than this gives no order."""
_AHEAD_S = 1.0
"""Text whose end is closer than this is being spoken."""
_PART_CHARACTERS = 30
"""A shorter text may be the first part of a longer one."""
_LEAST_S = 0.05
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
    """The turns of a conversation. Each method returns the orders for a change.

    Events may come in any order and more than once: an event that changes nothing gives no order.

    Args:
        after_speech: State after the head's own speech: "listening" in a session that continues,
            "idle" if a wake word begins the next exchange.
        reports_silence: Whether ``end_speech`` is called after an interruption, too; without that
            call, ``resume`` continues the speech.
        streams_text: Whether the text may arrive in parts, of which the first reveal no end.
    """

    def __init__(
        self, after_speech: Literal["listening", "idle"] = "idle", reports_silence: bool = False,
        streams_text: bool = False,
    ) -> None:  # fmt: skip
        self._after_speech: OrderName = after_speech
        self._reports_silence = reports_silence
        self._least_characters = _PART_CHARACTERS if streams_text else 1
        self.state: OrderName = "idle"
        self._text = ""
        self._seconds: float | None = None
        self._begin_s = self._end_s = inf
        self._sounds = False

    def partner_speaks(self) -> Orders:
        """Return the orders for a partner who begins to speak; this may be a barge-in."""
        interrupts = self.state in ("speaking", "thinking")
        if not self._sounds:
            self._text = ""
        return self._change("listening", "interrupt" if interrupts else "listening")

    def partner_pauses(self) -> Orders:
        """Return the orders for a partner who has finished; an answer is being prepared."""
        return () if self.state == "speaking" else self._change("thinking")

    def resume(self, now_s: float) -> Orders:
        """Return the orders for own speech that has continued behind a partner's short word."""
        if not self._sounds or self.state != "listening":
            return ()
        self.state = "speaking"
        return (self._plan(now_s),)

    def add_text(self, text: str, now_s: float) -> Orders:
        """Add text that is or will be spoken; return the orders for a later planned end.

        Text that arrives while it is spoken reveals no end and gives no order.
        """
        self._text = (self._text + text).lstrip()[:_MAX_CHARACTERS]  # spaces alone are no speech
        return self._correct(now_s) if self._planned_end_s() > now_s + _AHEAD_S else ()

    def speak(self, now_s: float, seconds: float | None = None) -> Orders:
        """Return the orders for own speech that begins now, or whose duration is now known.

        Args:
            now_s: Present time, s.
            seconds: Duration of the whole speech; None: the head estimates it from the text.
        """
        if self.state == "speaking":
            self._seconds = self._seconds if seconds is None else seconds
            return self._correct(now_s)
        self.state, self._begin_s, self._seconds = "speaking", now_s, seconds
        self._sounds = self._reports_silence
        return (self._plan(now_s),)

    def end_speech(self) -> Orders:
        """Return the orders for the end of own speech."""
        if self._sounds or self.state == "speaking":
            self._sounds, self._text = False, ""
        return self._change(self._after_speech) if self.state == "speaking" else ()

    def end(self) -> Orders:
        """Return the orders for the end of the conversation."""
        self._text, self._sounds = "", False
        return self._change("idle")

    def is_over(self, now_s: float) -> bool:
        """Return whether the planned end of own speech has passed."""
        return self.state == "speaking" and now_s >= self._end_s

    def _planned_end_s(self) -> float:
        """Return the end of own speech by its duration or its text, inf if both are unknown."""
        if self._seconds is not None:
            return self._begin_s + self._seconds
        known = len(self._text) >= self._least_characters
        return self._begin_s + len(self._text) / gazerig.CHARACTERS_PER_S if known else inf

    def _correct(self, now_s: float) -> Orders:
        """Return the orders for a planned end that has changed during own speech."""
        end_s = self._planned_end_s()
        if self.state != "speaking" or end_s == self._end_s or abs(end_s - self._end_s) < _REPLAN_S:
            return ()
        return (self._plan(now_s),)

    def _plan(self, now_s: float) -> TurnOrder:
        """Return the order for own speech with its planned end."""
        self._end_s = self._planned_end_s()
        if self._seconds is not None:
            return TurnOrder("speaking", max(_LEAST_S, round(self._end_s - now_s, 3)), self._text)
        spoken = int((now_s - self._begin_s) * gazerig.CHARACTERS_PER_S)
        rest = self._text[spoken:] if self._end_s < inf else ""
        return TurnOrder("speaking", None, rest if rest.strip() else "")

    def _change(self, state: OrderName, order: OrderName | None = None) -> Orders:
        if self.state == state:
            return ()
        self.state = state
        return (TurnOrder(order or state),)


def field(message: Mapping[str, Any], name: str, kind: type, fallback: Any) -> Any:
    """Return a field of a message, or the fallback if it is absent or of another type."""
    value = message.get(name)
    return value if isinstance(value, kind) else fallback
