"""What became of something that a program asked of a head: its reply, and its outcome."""

import threading
from collections.abc import Callable
from types import TracebackType
from typing import Literal, Protocol, Self

from gazerig.robot.control.tick_feed import Progress
from gazerig.robot.model.lead import ARRIVED_RAD
from gazerig.robot.model.leader import GestureState
from gazerig.robot.model.reply import CommandReply

Outcome = Literal["arrived", "refused", "out of reach", "taken over", "timed out"]
"""How an order ended.

arrived: the gaze was measured within 1 degree of the point, the joint of its angle; a gesture has
    come to its end; of other orders, the head has taken them up
refused: nothing was done; ``Order.why`` says why
out of reach: the gaze will rest more than 1 degree beside the point, as far as the joints reach;
    known as soon as the reply is there. ``Order.why`` says how far beside, and which joints keep
    it from there. The lead stays: the head goes as far as it can
taken over: something else moves the head now, or the lead ended; ``Order.why`` says what
timed out: none of these within the time given
"""


class OrderHost(Protocol):
    """The head that an order was given to."""

    def _progress(self) -> Progress:
        """Return the newest lead and gesture."""
        ...

    def _pause(self, until: Callable[[], bool], seconds: float) -> None:
        """Let the head's time pass until something is true, for so long at most.

        Raises:
            HeadEnded: the head has ended meanwhile.
        """
        ...

    def _let_go(self) -> None:
        """Let the head choose its targets again."""
        ...


class Order:
    """One order to a head, as ``look_at`` and its like return it.

    In a ``with`` block the lead that it took ends with the block:

        with head.look_at(1.0, 0.2, 0.3) as order:
            order.wait()

    Args:
        host: the head.
        answered: returns the reply once the head has taken the order up, None before.
        within_s: the head must take it up in this time.
    """

    def __init__(
        self, host: OrderHost, answered: Callable[[], CommandReply | None], within_s: float = 1.0
    ) -> None:
        self._host, self._answered, self._within_s = host, answered, within_s
        self._reply: CommandReply | None = None
        self._outcome: Outcome | None = None
        self._why = ""

    def __repr__(self) -> str:
        reply = self._taken_up()
        said = "not taken up yet" if reply is None else reply.text()
        return f"<Order: {self._outcome or 'under way'}; {said}>"

    @property
    def reply(self) -> CommandReply:
        """Return what the head made of the order; waits until it has taken it up, a tick or two.

        Raises:
            HeadEnded: the head has ended, or hangs.
        """
        reply = self._taken_up()
        if reply is None:
            self._host._pause(lambda: self._taken_up() is not None, self._within_s)
            reply = self._taken_up()
        if reply is None:
            from gazerig.errors import HeadEnded

            raise HeadEnded(f"the head has not taken the order up within {self._within_s:g} s")
        return reply

    @property
    def refused(self) -> bool:
        """Return whether nothing was done; ``why`` says why."""
        return bool(self.reply.refused)

    @property
    def outcome(self) -> Outcome | None:
        """Return how the order ended, None while it is under way."""
        if self._outcome is None:
            self._see(self._host._progress())
        return self._outcome

    @property
    def active(self) -> bool:
        """Return whether the lead that the order took is still in force."""
        reply, lead = self._taken_up(), self._host._progress().lead
        return reply is not None and 0 < reply.lead == lead.number and lead.active

    @property
    def why(self) -> str:
        """Return why the order was refused, taken over or out of reach, "" if it was not."""
        return self._why

    def wait(self, timeout_s: float | None = 10.0) -> Outcome:
        """Wait until the order has ended; of a head in simulated time, step it until then.

        For a point that is out of reach this returns as soon as the reply says so; the head is
        then still moving.

        Args:
            timeout_s: seconds of the head's own clock; None: for ever.

        Raises:
            HeadEnded: the head has ended meanwhile.
        """
        longest_s = timeout_s if timeout_s is not None else threading.TIMEOUT_MAX
        self._host._pause(lambda: self.outcome is not None, longest_s)
        return self._outcome or "timed out"

    def end(self) -> None:
        """End the lead that the order took, if it is still in force."""
        if self.active:
            self._host._let_go()

    def __enter__(self) -> Self:
        """Return the order itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End the lead."""
        self.end()

    def _see(self, now: Progress) -> bool:
        """See the newest lead and gesture; return whether the order has ended."""
        reply = self._taken_up()
        if reply is None or self._outcome is not None:
            return self._outcome is not None
        played = reply.gesture.number if reply.gesture is not None else 0
        if reply.refused:
            self._end("refused", reply.refused)
        elif played:
            self._see_gesture(played, now.gesture)
        elif reply.lead == 0:  # it takes no lead: done as soon as taken up
            self._end("arrived", "")
        elif reply.error_rad > ARRIVED_RAD:
            self._end("out of reach", reply.text())
        elif now.lead.number == reply.lead:
            if now.lead.arrived:
                self._end("arrived", "")
            elif not now.lead.active:
                self._end("taken over", now.lead.ended)
        elif now.lead.number > reply.lead:
            self._end("taken over", now.led or now.lead.ended)
        return self._outcome is not None

    def _see_gesture(self, number: int, newest: GestureState) -> None:
        if newest.number > number:
            self._end("taken over", f"another gesture: {newest.name or newest.ended}")
        elif newest.number == number and newest.ended:
            self._end("taken over", newest.ended)
        elif newest.number == number and not newest.name:
            self._end("arrived", "")

    def _end(self, outcome: Outcome, why: str) -> None:
        self._why = why
        self._outcome = outcome

    def _taken_up(self) -> CommandReply | None:
        if self._reply is None:
            self._reply = self._answered()
        return self._reply
