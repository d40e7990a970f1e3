"""Conversation that a voice agent reports, and its end if reports are missing."""

from gazerig.gaze.types import TurnState
from gazerig.robot.loop.client_control import Lease
from gazerig.robot.model.commands import Talk
from gazerig.robot.model.control_source import (
    CHARACTERS_PER_S,
    NO_CONVERSATION,
    ConversationState,
)

_GIVEN, _ESTIMATED = 0.9, 0.3
"""Confidence of a planned end: given in seconds, and from the length of a text."""
_LONGEST_S = 60.0
"""Thinking or speaking ends this time after its planned end, or after its last report."""
_SHOWN_CHARACTERS = 80
"""Length of the text that each tick contains; the command contains the whole."""


class Conversation:
    """The present state of conversation and its client.

    Attributes:
        state: State at the present tick.
    """

    def __init__(self) -> None:
        self.state = NO_CONVERSATION
        self._lease = Lease()
        self._reported_s = 0.0

    @property
    def active(self) -> bool:
        """Return whether there is a conversation."""
        return self.state.state != "idle"

    def report(self, command: Talk, t_s: float) -> str:
        """Enter the state that a client reports; return a message if it replaces another client.

        Raises:
            ValueError: There is no speech or thought to interrupt.
        """
        now, active = self.state, self.active
        state: TurnState = "interrupted" if command.state == "interrupt" else command.state
        if state == "interrupted" and now.state not in ("thinking", "speaking"):
            raise ValueError(
                f"there is nothing to interrupt: the state is {now.state}; report speaking or "
                "thinking first"
            )
        other = self._lease.who if active and self._lease.who != command.who else ""
        person = command.person if command.person is not None or not active else now.partner
        self._lease.start(command.who, command.stay, t_s)
        self._reported_s = t_s
        repeated = not other and (state, person) == (now.state, now.partner)
        number, since_s = (now.number, now.since_s) if repeated else (now.number + 1, t_s)
        if state == "idle":
            self.state = ConversationState(now.number + active, since_s=t_s)
        else:
            ends_s, confidence = _planned_end(command, t_s)
            text = command.text[:_SHOWN_CHARACTERS]
            self.state = ConversationState(
                number, state, person, since_s, ends_s, confidence, text, command.who
            )
        return f"conversation: {command.who or 'a client'} takes over from {other}" if other else ""

    def renew(self, who: str, t_s: float) -> bool:
        """Record a heartbeat; return whether it came from the client of the conversation."""
        return self.active and self._lease.renew(who, t_s)

    def expiry_reason(self, t_s: float) -> str:
        """Return the reason for an end now, "" if the state continues or is idle."""
        now = self.state
        if now.state == "idle":
            return ""
        if self._lease.has_lapsed(t_s):
            return "not renewed"
        late_s = t_s - max(now.ends_s or 0.0, self._reported_s)
        if now.state in ("thinking", "speaking") and late_s > _LONGEST_S:
            return f"no report for {_LONGEST_S:g} s; report the next state, or the same again"
        return ""

    def end(self, why: str, t_s: float) -> None:
        """End the conversation without a request."""
        self.state = ConversationState(self.state.number + 1, since_s=t_s, end_reason=why)


def _planned_end(command: Talk, t_s: float) -> tuple[float | None, float]:
    """Return the planned end of speech and its confidence; None and 0 if unknown."""
    if command.seconds is not None:
        return t_s + command.seconds, _GIVEN
    if text := command.text.strip():
        return t_s + len(text) / CHARACTERS_PER_S, _ESTIMATED
    return None, 0.0
