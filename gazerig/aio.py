"""Orders to a running head that are awaited; a thin layer over ``gazerig.connect``.

async with gazerig.aio.connect(who="my show") as head:
    print(await head.look_at(1.0, 0.2, 0.3))  # arrived
"""

import asyncio
from collections.abc import AsyncIterator, Callable, Container, Generator
from typing import Any, Concatenate, ParamSpec, Self, TypeVar

from gazerig.head import Head, Order
from gazerig.remote_head import RemoteHead
from gazerig.remote_head import connect as connect_now
from gazerig.robot.loop.head_state import EventKind, HeadEvent, HeadState
from gazerig.robot.model.reply import CommandReply, Outcome

_POLL_S = 0.02
_P = ParamSpec("_P")
_T = TypeVar("_T")


class AsyncOrder:
    """An order that was sent; ``await`` waits for its outcome, without limit.

    Args:
        sent: the order, once the head has replied.
    """

    def __init__(self, sent: "asyncio.Future[Order]") -> None:
        self._sent = sent

    def __await__(self) -> Generator[Any, None, Outcome]:
        return self._outcome().__await__()

    async def reply(self) -> CommandReply:
        """Return the head's reply, as soon as it has accepted or refused the order."""
        return (await self._sent).reply

    async def why(self) -> str:
        """Return why the order was refused, taken over or out of reach, "" if it was not."""
        return (await self._sent).why

    async def end(self) -> None:
        """Give up control, if the order still has it."""
        await asyncio.to_thread((await self._sent).end)

    async def _outcome(self) -> Outcome:
        order = await self._sent
        while (outcome := await asyncio.to_thread(lambda: order.outcome)) is None:
            await asyncio.sleep(_POLL_S)
        return outcome


def _call(
    method: Callable[Concatenate[Any, _P], _T],
) -> "Callable[Concatenate[AsyncHead, _P], asyncio.Task[_T]]":
    def call(head: "AsyncHead", /, *args: _P.args, **named: _P.kwargs) -> "asyncio.Task[_T]":
        work = asyncio.to_thread(method, head._connected, *args, **named)
        return asyncio.ensure_future(work)

    call.__doc__ = method.__doc__
    return call


def _order(
    method: Callable[Concatenate[Head, _P], Order],
) -> "Callable[Concatenate[AsyncHead, _P], AsyncOrder]":
    call = _call(method)

    def send(head: "AsyncHead", /, *args: _P.args, **named: _P.kwargs) -> AsyncOrder:
        return AsyncOrder(call(head, *args, **named))

    send.__doc__ = method.__doc__
    return send


class AsyncHead:
    """A head that runs in another program; ``connect`` creates it.

    The methods are those of ``gazerig.Head``, called in threads: orders return an ``AsyncOrder``,
    which is sent immediately, and the other methods a task. The event loop never waits.
    """

    def __init__(self, connect: Callable[[], RemoteHead]) -> None:
        self._connect = connect
        self._head: RemoteHead | None = None

    async def __aenter__(self) -> Self:
        """Connect."""
        self._head = await asyncio.to_thread(self._connect)
        return self

    async def __aexit__(self, *raised: object) -> None:
        """Give up control and disconnect; the head continues to run."""
        head = self._connected
        await asyncio.to_thread(lambda: head.__exit__(None, None, None))

    @property
    def _connected(self) -> RemoteHead:
        if self._head is None:
            raise RuntimeError("connect first: async with gazerig.aio.connect() as head: ...")
        return self._head

    look_at = _order(Head.look_at)
    look_towards = _order(Head.look_towards)
    look_at_person = _order(Head.look_at_person)
    find = _order(Head.find)
    look_at_pixel = _order(Head.look_at_pixel)
    look_freely = _order(Head.look_freely)
    jog = _order(Head.jog)
    release_joints = _order(Head.release_joints)
    play = _order(Head.play)
    end_track = _order(Head.end_track)
    say = _order(Head.say)
    express = _order(Head.express)
    level = _order(Head.level)
    listening = _order(Head.listening)
    thinking = _order(Head.thinking)
    speaking = _order(Head.speaking)
    interrupt = _order(Head.interrupt)
    idle = _order(Head.idle)
    behave = _order(Head.behave)
    wink = _order(Head.wink)
    stop = _order(Head.stop)
    resume = _order(Head.resume)
    get = _call(Head.get)
    set = _call(Head.set)
    save = _call(Head.save)
    revert = _call(Head.revert)
    menus = _call(Head.menus)
    picture = _call(Head.picture)

    async def state(self) -> HeadState:
        """Return the newest tick of the control loop."""
        head = self._connected
        return await asyncio.to_thread(lambda: head.state)

    async def states(self, rate_hz: float = 50.0) -> AsyncIterator[HeadState]:
        """Iterate over the newest states; those that are not read in time are dropped."""
        states = self._connected.states(rate_hz)
        while True:
            yield await asyncio.to_thread(next, states)

    async def events(
        self, *, kinds: Container[EventKind] = ("message",)
    ) -> AsyncIterator[HeadEvent]:
        """Iterate over all stored events of these kinds, then over new ones, without end."""
        number = 0
        while True:
            for event in await asyncio.to_thread(self._connected._events, number):
                number = event.number
                if event.kind in kinds:
                    yield event
            await asyncio.sleep(_POLL_S)


def connect(
    pid: int | None = None, *, name: str | None = None, who: str = "a program"
) -> AsyncHead:
    """Return a head to connect to in an ``async with`` block; the arguments of ``gazerig.connect``.

    The block raises ``NotFound`` if no head runs, or several fit; the message lists them.
    """
    return AsyncHead(lambda: connect_now(pid, name=name, who=who))
