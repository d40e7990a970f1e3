"""A door's connection to the head, and the program around it."""

import asyncio
import os
import signal
from collections.abc import Awaitable, Callable, Coroutine, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any, NamedTuple

import gazerig
from gazerig.doors.turn_taking import Orders, TurnOrder

FIRST_WAIT_S, LONGEST_WAIT_S = 0.5, 15.0
"""Wait before the first and before later attempts to connect; it doubles."""
_STEADY_S = 10.0
"""A connection that lasted this long makes the next wait the first again."""
_ORDER_EVERY_S = 0.02
"""Shortest time between two orders: of a flood, only the newest orders reach the head."""
_LOOK_S, _WATCH_S = 2.0, 0.1
"""Time without orders after which the door looks at the head: whether it still runs, and who
addresses it."""
_LOOPBACK = ("127.0.0.1", "::1", "localhost")
_MAX_LINES = 40
"""Different messages that are reported about one neighbour."""


class Address(NamedTuple):
    """A host and a port."""

    host: str
    port: int

    @classmethod
    def parse(cls, text: str) -> "Address":
        """Return the address of "HOST:PORT".

        Raises:
            gazerig.Error: it is not one.
        """
        host, _, port = text.rpartition(":")
        if not host or not port.isdecimal() or int(port) > 65535:
            raise gazerig.Error(f"{text!r} is not HOST:PORT, e.g. 127.0.0.1:10601")
        return cls(host.strip("[]"), int(port))


Listener = Callable[[int | None], Awaitable[object]]
"""Tells a neighbour which person addresses the head from now on, None if nobody does."""


class DoorLink:
    """Passes a neighbour's orders on to a running head, without ever waiting for it.

    Only the newest order that the head has not received yet is kept. ``run`` connects, and connects
    again when the head has ended. If this process dies, the head's state of conversation ends
    within a second.

    Args:
        connect: Connects to the head, e.g. ``gazerig.connect``.
        say: Receives one line per message.
        address: Address of the neighbour.
        bind: Where to listen, HOST:PORT.
        watches: Whether to tell the neighbour who addresses the head.

    Attributes:
        addressed_by: The person who addresses the head and whom the agent may hear, None without.
        may_interrupt: Whether the agent may be interrupted: it hears while the head speaks, too.
    """

    def __init__(
        self, connect: Callable[[], Any], say: Callable[[str], None], address: str = "",
        bind: str = "", watches: bool = False,
    ) -> None:  # fmt: skip
        self.connect, self._say = connect, say
        self.address, self.bind, self.watches = address, bind, watches
        self.addressed_by: int | None = None
        self.may_interrupt = False
        self._listeners: set[Listener] = set()
        self._begun: set[asyncio.Task[None]] = set()
        self._pending: TurnOrder | None = None
        self._last: TurnOrder | None = None
        self._news = asyncio.Event()
        self._reported: set[str] = set()

    def now_s(self) -> float:
        """Return the present time, s."""
        return asyncio.get_running_loop().time()

    def send(self, orders: Orders) -> None:
        """Send orders; a newer one replaces one that is waiting."""
        if orders:
            self._pending = self._last = orders[-1]
            self._news.set()

    def begin(self, work: Coroutine[Any, Any, None]) -> None:
        """Begin work that nothing waits for."""
        task = asyncio.ensure_future(work)
        self._begun.add(task)
        task.add_done_callback(self._begun.discard)

    @contextmanager
    def on_addressed(self, listener: Listener) -> Iterator[None]:
        """Call a function in this block, at its begin and when ``addressed_by`` changes."""
        self._listeners.add(listener)
        self.begin(self._tell(listener))
        try:
            yield
        finally:
            self._listeners.discard(listener)

    def _watch(self, state: Any) -> None:
        """Tell the neighbour who addresses the head in a state."""
        if self.watches:
            speaks = state.conversation.state == "speaking" or any(
                track.name == "speech" and not track.end_reason for track in state.tracks
            )
            hears = self.may_interrupt or not speaks
            self._address(state.addressed_by if hears else None)

    def _address(self, person: int | None) -> None:
        if person != self.addressed_by:
            self.addressed_by = person
            for listener in self._listeners:
                self.begin(self._tell(listener))

    async def _tell(self, listener: Listener) -> None:
        try:
            if self.watches:
                await listener(self.addressed_by)
        except Exception as error:  # of the neighbour's own package
            self.report(f"the neighbour is not told who addresses the head: {error}")

    def report(self, line: str) -> None:
        """Report a line to the user, each different line once until ``report_again``."""
        if line not in self._reported and len(self._reported) < _MAX_LINES:
            self._reported.add(line)
            self._say(line)

    def report_again(self) -> None:
        """Forget what was reported, after a connection that worked."""
        self._reported.clear()

    async def run(self) -> None:
        """Pass orders on for ever."""
        await self.keep(self._follow_head, "a head", errors=(gazerig.Error,))

    async def _follow_head(self) -> None:
        """Connect to the head, and pass orders on until it ends."""
        head = await asyncio.to_thread(self.connect)
        if self._last is not None and self._last.state != "idle":
            self.send((self._last,))
        try:
            await self._pass_on(head)
        finally:
            self._address(None)
            await asyncio.to_thread(head.__exit__, None, None, None)

    async def _pass_on(self, head: Any) -> None:
        """Pass orders on until the head ends."""
        while True:
            with suppress(TimeoutError):
                await asyncio.wait_for(self._news.wait(), _WATCH_S if self.watches else _LOOK_S)
            self._news.clear()
            order, self._pending = self._pending, None
            if order is not None:
                if refused := await asyncio.to_thread(_perform, head, order):
                    self.report(f"the head refuses {order.state}: {refused}")
                await asyncio.sleep(_ORDER_EVERY_S)
            self._watch(await asyncio.to_thread(lambda: head.state))

    async def keep(
        self, attempt: Callable[[], Awaitable[object]], neighbour: str, remedy: str = "",
        errors: tuple[type[Exception], ...] = (OSError, TimeoutError),
    ) -> None:  # fmt: skip
        """Connect to a neighbour, and again whenever the connection is lost, for ever.

        Args:
            attempt: Connects, follows the neighbour, and returns when it disconnects.
            neighbour: Name and address of the awaited program, for reports.
            remedy: What to do if it does not come.
            errors: Errors of a lost connection.
        """
        wait_s = FIRST_WAIT_S
        while True:
            begin_s = self.now_s()
            reason = "it has closed the connection"
            try:
                await attempt()
            except errors as error:
                text = getattr(error, "strerror", None) or str(error)
                reason = " ".join(text.split()) or type(error).__name__
            if self.now_s() - begin_s > _STEADY_S:
                wait_s = FIRST_WAIT_S
                self.report_again()
            hint = f"; {remedy}" if remedy else ""
            self.report(f"waiting for {neighbour}: {reason}{hint}")
            await asyncio.sleep(wait_s)
            wait_s = min(2.0 * wait_s, LONGEST_WAIT_S)


def _perform(head: Any, order: TurnOrder) -> str:
    """Send an order to the head; return why the head refuses it, "" if it does not."""
    given = {name: value for name, value in order._asdict().items() if value not in (None, "")}
    try:
        refused = str(getattr(head, given.pop("state"))(**given).reply.refused or "")
    except gazerig.Refused as error:
        refused = str(error)
    if refused and order.state == "interrupt":  # it has not received what is interrupted
        return _perform(head, TurnOrder("listening"))
    return refused


@dataclass(frozen=True)
class Door:
    """A door: the object of an entry point of the group ``gazerig.door``.

    Attributes:
        name: Name of the entry point.
        serve: Follows the neighbour for ever, and sends orders to the link.
        summary: The neighbour, for lists.
        address: Address of the neighbour if the user gives none, "" if it connects to the door.
        bind: HOST:PORT where the door listens if the user gives none, "" if it does not listen.
    """

    name: str
    serve: Callable[[DoorLink], Awaitable[object]]
    summary: str
    address: str = ""
    bind: str = ""

    def run(
        self, head: int | str | None = None, address: str = "", bind: str = "",
        say: Callable[[str], None] = print, ends_with_input: bool = False, addressed: bool = False,
    ) -> None:  # fmt: skip
        """Run the door until Ctrl-C or SIGTERM.

        Args:
            head: Process id or name of the head; None if only one runs.
            address: Address of the neighbour, "" for the usual one.
            bind: HOST:PORT to listen on, "" for the usual one on this computer only.
            say: Receives one line per message.
            ends_with_input: End when standard input is closed, i.e. with the parent process.
            addressed: Let the neighbour listen, without a wake word, when a person addresses the
                head.

        Raises:
            gazerig.Error: the door cannot open; the message has the remedy.
        """
        bind = bind or self.bind
        if bind and Address.parse(bind).host not in _LOOPBACK:
            say(f"listening on {bind}: every program on this network can steer the conversation")

        link = DoorLink(
            lambda: gazerig.connect(
                name=None if head is None else str(head), who=f"door {self.name}"
            ),
            say,
            address or self.address,
            bind,
            addressed,
        )
        try:
            asyncio.run(self._serve(link, ends_with_input))
        except (KeyboardInterrupt, asyncio.CancelledError):
            return
        except OSError as error:
            reason = error.strerror or str(error)
            raise gazerig.Error(f"the door cannot listen on {bind}: {reason}") from None

    async def _serve(self, link: DoorLink, ends_with_input: bool) -> None:
        loop, task = asyncio.get_running_loop(), asyncio.current_task()
        assert task is not None
        loop.add_signal_handler(signal.SIGTERM, task.cancel)
        if ends_with_input:
            loop.add_reader(0, lambda: os.read(0, 64) or task.cancel())
        tasks = [asyncio.ensure_future(one) for one in (link.run(), self.serve(link))]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            done.pop().result()
        finally:
            for one in tasks:
                one.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
