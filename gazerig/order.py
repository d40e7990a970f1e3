"""Orders to a head: their replies and outcomes."""

import threading
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, Self

from gazerig.robot.model.outcome import Outcome, Progress, command_outcome
from gazerig.robot.model.reply import CommandReply

if TYPE_CHECKING:
    from gazerig.head import Head


class Order:
    """An order to a head, as returned by ``look_at`` and similar methods.

    In a ``with`` block, control ends with the block:

        with head.look_at(1.0, 0.2, 0.3) as order:
            order.wait()

    Args:
        host: the head.
        read_reply: returns the reply once the head has accepted the order, None before.
        within_s: time in which the head must accept it, seconds.
    """

    def __init__(
        self, host: "Head", read_reply: Callable[[], CommandReply | None], within_s: float = 1.0
    ) -> None:
        self._host, self._read_reply, self._within_s = host, read_reply, within_s
        self._reply: CommandReply | None = None
        self._outcome: Outcome | None = None
        self._why = ""

    def __repr__(self) -> str:
        reply = self._accepted_reply()
        said = "not accepted yet" if reply is None else reply.text()
        return f"<Order: {self._outcome or 'in progress'}; {said}>"

    @property
    def reply(self) -> CommandReply:
        """Return the head's reply; wait until it has accepted the order, a tick or two.

        Raises:
            HeadEnded: the head has ended, or does not respond.
        """
        reply = self._accepted_reply()
        if reply is None:
            self._host._pause(lambda: self._accepted_reply() is not None, self._within_s)
            reply = self._accepted_reply()
        if reply is None:
            from gazerig.errors import HeadEnded

            raise HeadEnded(f"the head has not accepted the order within {self._within_s:g} s")
        return reply

    @property
    def refused(self) -> bool:
        """Return whether the head refused the order; ``why`` gives the reason."""
        return bool(self.reply.refused)

    @property
    def outcome(self) -> Outcome | None:
        """Return how the order ended, None while it is in progress."""
        if self._outcome is None:
            self._update_outcome(self._host._progress())
        return self._outcome

    @property
    def active(self) -> bool:
        """Return whether the order still controls gaze or joints."""
        reply, lead = self._accepted_reply(), self._host._progress().client_control
        return reply is not None and 0 < reply.control_number == lead.number and lead.active

    @property
    def why(self) -> str:
        """Return why the order was refused, taken over or out of reach, "" if it was not."""
        return self._why if self.outcome is not None else ""

    def wait(self, timeout_s: float | None = 10.0) -> Outcome:
        """Wait until the order has ended; step a head in simulated time until then.

        For a point that is out of reach this returns as soon as the reply arrives; the head is then
        still moving.

        Args:
            timeout_s: seconds by the head's own clock; None: without limit.

        Raises:
            HeadEnded: the head has ended in the meantime.
        """
        longest_s = timeout_s if timeout_s is not None else threading.TIMEOUT_MAX
        self._host._pause(lambda: self.outcome is not None, longest_s)
        return self._outcome or "timed out"

    def end(self) -> None:
        """Give up control, if the order still has it."""
        if self.active:
            self._host.look_freely()

    def __enter__(self) -> Self:
        """Return the order itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Give up control."""
        self.end()

    def _update_outcome(self, now: Progress) -> bool:
        """Update from the newest owner and tracks; return whether the order has ended."""
        reply = self._accepted_reply()
        if reply is not None and self._outcome is None and (end := command_outcome(reply, now)):
            outcome, self._why = end
            self._outcome = outcome
        return self._outcome is not None

    def _accepted_reply(self) -> CommandReply | None:
        if self._reply is None:
            self._reply = self._read_reply()
        return self._reply
