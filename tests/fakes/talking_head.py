"""A head that records the orders of a conversation, and is awaited instead of a clock."""

import asyncio
from collections.abc import Callable, Iterable
from types import SimpleNamespace
from typing import Any

import gazerig


class TalkingHead:
    """Has the methods that a door uses; ``refuses`` and ``ended`` make it refuse or end."""

    def __init__(self) -> None:
        self.orders: list[tuple[Any, ...]] = []
        self.pcm = b""
        self.connected = self.refuses = ""
        self.ended = False
        self.said: list[str] = []

    def connect(self) -> "TalkingHead":
        if self.ended:
            raise gazerig.NotFound("no rig is running")
        return self

    def __exit__(self, *raised: object) -> None:
        pass

    @property
    def state(self) -> object:
        return self._order()

    def _order(self, *order: Any) -> Any:
        if self.ended:
            raise gazerig.HeadEnded("the rig has ended")
        if order:
            self.orders.append(order)
        return SimpleNamespace(reply=SimpleNamespace(refused=self.refuses))

    def listening(self, person: int | None = None) -> Any:
        return self._order("listening")

    def thinking(self, person: int | None = None) -> Any:
        return self._order("thinking")

    def speaking(
        self, person: int | None = None, *, seconds: float | None = None, text: str = ""
    ) -> Any:
        return self._order("speaking", seconds, text)

    def idle(self) -> Any:
        return self._order("idle")

    def interrupt(self) -> Any:
        return self._order("interrupt")

    def say(self, pieces: Iterable[bytes], *, rate_hz: int, channels: int) -> Any:
        self.pcm += b"".join(pieces)
        return self._order("said", rate_hz, channels)

    @property
    def states(self) -> list[str]:
        return [order[0] for order in self.orders]

    @property
    def last(self) -> str:
        return self.states[-1] if self.orders else ""


async def until(condition: Callable[[], object]) -> None:
    """Wait for a condition; a test's own limit of time is the only one."""
    while not condition():
        await asyncio.sleep(0.005)
