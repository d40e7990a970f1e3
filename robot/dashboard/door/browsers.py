"""Browsers of the page: their names, and whether the one in control is still connected."""

import asyncio
import hashlib
import hmac
import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

_DIGITS = 4


class Browsers:
    """Names of browsers by their cookies; safe to call from any thread."""

    def __init__(self, token: str) -> None:
        self._key = token.encode()
        self._lock = threading.Lock()
        self._open: Counter[str] = Counter()
        self._leads = ""

    def name(self, cookie: str | None) -> str:
        """Return a browser's name; it is constant while the browser keeps its cookie."""
        if not cookie:
            return "the page"
        digest = hmac.new(self._key, cookie.encode(errors="replace"), hashlib.sha256)
        return f"browser {digest.hexdigest()[:_DIGITS]}"

    @contextmanager
    def connected(self, name: str) -> Iterator[None]:
        """Count a browser as connected within the block."""
        with self._lock:
            self._open[name] += 1
        try:
            yield
        finally:
            with self._lock:
                self._open[name] -= 1

    def led_by(self, name: str) -> None:
        """Record the browser that controlled the head last."""
        self._leads = name

    def leading(self) -> str:
        """Return the browser that controlled the head last, "" if it has disconnected."""
        with self._lock:
            return self._leads if self._leads and self._open[self._leads] > 0 else ""


class TabLimits:
    """Limited number of open tabs; for one more, the browser with most tabs loses its oldest.

    Belongs to one event loop.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._taken: dict[asyncio.Event, str] = {}  # oldest first

    @contextmanager
    def take(self, name: str) -> Iterator[asyncio.Event]:
        """Occupy a slot; the event is set when the slot must be freed."""
        leave = asyncio.Event()
        self._taken[leave] = name
        if len(self._taken) > self._most:
            greedy = Counter(self._taken.values()).most_common(1)[0][0]
            oldest = next(event for event, who in self._taken.items() if who == greedy)
            del self._taken[oldest]
            oldest.set()
        try:
            yield leave
        finally:
            self._taken.pop(leave, None)
