"""State of a conversation, as a voice agent reports it, and its end."""

from msgspec import Struct

from gazerig.gaze.types import TurnState
from gazerig.robot.model.commands import Talk
from gazerig.robot.model.lease import Lease

CHARACTERS_PER_S = 15.0
"""Rate of speech, for the end of a text without times: about 150 English words a minute."""
LAST_WORD_S = 0.4
"""Assumed duration of the last word."""
GIVEN, TIMED, ESTIMATED = 0.9, 0.8, 0.3
"""Confidence of a planned end: given in seconds, from word times, from the length of a text."""
OVERRUN_S, OVERRUN_SHARE = 5.0, 0.5
"""Speech that is not ended ends this time after its planned end, plus this share of its length."""
LONGEST_S = {"thinking": 60.0, "speaking": 600.0}
"""Longest time in a state without a planned end and without a new report."""
SHOWN_CHARACTERS = 80
"""Length of the text that each tick contains; the command contains the whole."""


class ConversationState(Struct, frozen=True):
    """State of the conversation after a tick.

    Attributes:
        number: Number of the state since the start, 0 before the first; a plan that changes during
            speech keeps it.
        state: What the voice agent does; interrupted: it listens, after an interruption.
        partner: Perception's number of the person, None if unknown.
        since_s: Start of the state.
        ends_s: Planned end of speech, None if unknown.
        confidence: Confidence of the planned end, 0..1.
        text: Beginning of the spoken text.
        who: Name of the client, "" without one.
        end_reason: Reason for an end that no client has requested, "" otherwise.
    """

    number: int = 0
    state: TurnState = "idle"
    partner: int | None = None
    since_s: float = 0.0
    ends_s: float | None = None
    confidence: float = 0.0
    text: str = ""
    who: str = ""
    end_reason: str = ""


NO_CONVERSATION = ConversationState()


class Conversation:
    """The present state of conversation, its client, and the end if reports are missing.

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
        other = self._lease.who if active and not self._comes_from_owner(command) else ""
        person = command.person if command.person is not None or not active else now.partner
        self._lease.start(command.who, command.stay, t_s)
        self._reported_s = t_s
        if state == "idle":
            self.state = ConversationState(now.number + active, since_s=t_s)
        else:
            repeated = not other and (state, person) == (now.state, now.partner)
            ends_s, confidence = _planned_end(command, t_s)
            self.state = ConversationState(
                now.number if repeated else now.number + 1,
                state,
                person,
                now.since_s if repeated else t_s,
                ends_s,
                confidence,
                command.text[:SHOWN_CHARACTERS],
                command.who,
            )
        if not other:
            return ""
        return f"conversation: {command.who or 'a client'} takes over from {other}"

    def _comes_from_owner(self, command: Talk) -> bool:
        """Return whether a report is of the same client; one that stays may be of a new process."""
        before, now = self._lease.who, command.who
        if self._lease.stay and command.stay:
            before, now = (who.partition(" (process ")[0] for who in (before, now))
        return before == now

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
        if now.ends_s is not None:
            planned_s = now.ends_s - self._reported_s
            late_s = OVERRUN_S + OVERRUN_SHARE * planned_s
            if t_s - now.ends_s > late_s:
                return f"{late_s:.0f} s after its planned end; report idle when the speech ends"
        elif (longest_s := LONGEST_S.get(now.state)) and t_s - self._reported_s > longest_s:
            return f"no report for {longest_s:g} s; report the next state, or the same again"
        return ""

    def end(self, why: str, t_s: float) -> None:
        """End the conversation without a request."""
        self.state = ConversationState(self.state.number + 1, since_s=t_s, end_reason=why)


def _planned_end(command: Talk, t_s: float) -> tuple[float | None, float]:
    """Return the planned end of speech and its confidence; None and 0 if unknown."""
    if command.seconds is not None:
        return t_s + command.seconds, GIVEN
    if command.words:
        return t_s + max([start_s for _, start_s in command.words]) + LAST_WORD_S, TIMED
    if command.text.strip():
        return t_s + len(command.text.strip()) / CHARACTERS_PER_S, ESTIMATED
    return None, 0.0
