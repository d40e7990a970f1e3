"""A head that records the orders of a conversation, and is awaited instead of a clock."""

import asyncio
import threading
from collections.abc import Callable, Iterable
from types import SimpleNamespace
from typing import Any

from fakes.waiting import PATIENCE_S


class TalkingHead:
    """Has the methods that a door uses."""

    def __init__(self) -> None:
        self.orders: list[tuple[Any, ...]] = []
        self.sounds: list[tuple[int, int, bytes]] = []
        self.mouths: list[tuple[int, int, bytes]] = []
        self.ended_tracks: list[str] = []
        self.said: list[str] = []
        self.addressed_by: int | None = None
        self.looks = 0

    def connect(self) -> "TalkingHead":
        return self

    def __enter__(self) -> "TalkingHead":
        return self

    def __exit__(self, *raised: object) -> None:
        pass

    @property
    def state(self) -> object:
        self.looks += 1
        conversation = SimpleNamespace(state=self.last or "idle")
        return SimpleNamespace(tracks=(), conversation=conversation, addressed_by=self.addressed_by)

    def _order(self, *order: Any) -> Any:
        if order:
            self.orders.append(order)
        return SimpleNamespace(reply=SimpleNamespace(refused=""))

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

    def say(
        self, pieces: Iterable[bytes], *, rate_hz: int, channels: int, volume: float = 1.0
    ) -> Any:
        said = b""
        for piece in pieces:
            said += piece
            threading.Event().wait(len(piece) / (2 * channels * rate_hz))
        (self.sounds if volume else self.mouths).append((rate_hz, channels, said))
        return self._order()

    def end_track(self, track: str = "") -> Any:
        self.ended_tracks.append(track)
        return self._order()

    @property
    def states(self) -> list[str]:
        return [order[0] for order in self.orders]

    @property
    def last(self) -> str:
        return self.states[-1] if self.orders else ""

    async def is_looked_at(self) -> None:
        """Wait until a door has looked at it as it is now, and has done what follows."""
        seen = self.looks
        await until(lambda: self.looks >= seen + 3)

    async def reaches(self, state: str) -> None:
        """Wait until a state is the last that was ordered."""
        await until(lambda: self.last == state)


async def until(condition: Callable[[], object]) -> None:
    """Wait for a condition, however busy the machine is."""
    async with asyncio.timeout(PATIENCE_S):
        while not condition():
            await asyncio.sleep(0.005)
