"""A neighbour's sound, said by the head while it arrives."""

import asyncio
import contextlib
import queue
from collections.abc import Callable, Iterator
from typing import Any

import gazerig
from gazerig.doors.door import DoorLink

WIDTH = 2
"""Bytes of a sample."""
_PIECE_S = 0.04
_MOST_PIECES = 15_000
"""Pieces that wait: ten minutes."""
_RETRY_S = 10.0
"""Time without further attempts after a failure."""
_LONGEST_END_S, _LOOK_S = 3.0, 0.05
"""Longest wait for the end of a sound after its last piece, and how often it is looked for."""


class SpokenSound:
    """A sound that the head says while it arrives; ``say`` is called in a thread.

    Args:
        rate_hz: Rate of the samples.
        channels: 1 or 2.
        volume: Factor 0..1; 0: only the mouth moves.

    Attributes:
        is_cut: Whether it has ended at once.
    """

    def __init__(self, rate_hz: int, channels: int, volume: float = 1.0) -> None:
        self._rate_hz, self._channels, self._volume = rate_hz, channels, volume
        self.is_cut = False
        self._pieces: queue.SimpleQueue[bytes] = queue.SimpleQueue()

    def split(self, pcm: bytes) -> Iterator[tuple[bytes, float]]:
        """Return the pieces of samples, and the duration of each, s."""
        frame = WIDTH * self._channels
        step = frame * round(_PIECE_S * self._rate_hz)
        for at in range(0, len(pcm), step):
            piece = pcm[at : at + step]
            yield piece, len(piece) / frame / self._rate_hz

    def feed(self, piece: bytes) -> None:
        """Add a piece of samples: signed, 16 bits, channels interleaved; of a flood, none."""
        if self._pieces.qsize() < _MOST_PIECES:
            self._pieces.put(piece)

    def end(self) -> None:
        """End the sound."""
        self._pieces.put(b"")

    def cut(self) -> None:
        """End the sound at once, without the pieces that wait."""
        self.is_cut = True
        with contextlib.suppress(queue.Empty):
            while True:
                self._pieces.get_nowait()
        self.end()

    def say(self, connect: Callable[[], Any]) -> str:
        """Let the head say it until it is heard; return why that fails, "" if it does not.

        Args:
            connect: Returns a connection to the head, of which this has its own.
        """
        try:
            head = connect()
            try:
                order = head.say(
                    self._read(), rate_hz=self._rate_hz, channels=self._channels,
                    volume=self._volume,
                )  # fmt: skip
                if self.is_cut:
                    with contextlib.suppress(gazerig.Refused):  # it has ended
                        head.end_track("speech")
                for _ in range(round(_LONGEST_END_S / _LOOK_S)):
                    if not any(
                        track.name == "speech" and not track.end_reason
                        for track in head.state.tracks
                    ):
                        break
                    head.sleep(_LOOK_S)
                return str(order.reply.refused or "")
            finally:
                head.__exit__(None, None, None)
        except gazerig.Error as error:
            return str(error)

    def _read(self) -> Iterator[bytes]:
        while piece := self._pieces.get():
            yield piece


class MouthSound:
    """Moves the head's mouth by speech that the neighbour plays itself; nothing waits for it.

    Args:
        link: The head.
    """

    def __init__(self, link: DoorLink) -> None:
        self._link = link
        self._sound: SpokenSound | None = None
        self._rest = b""
        self._saying: asyncio.Task[None] | None = None
        self._next_s = 0.0

    def add(self, pcm: bytes, rate_hz: int, channels: int = 1) -> None:
        """Add speech that is heard from now on, after what was added before.

        Args:
            pcm: Samples, signed, 16 bits, channels interleaved.
            rate_hz: Rate of the samples.
            channels: 1 or 2.
        """
        if self._sound is None:
            if self._link.now_s() < self._next_s:
                return
            self._sound, self._rest = SpokenSound(rate_hz, channels, volume=0.0), b""
            self._saying = asyncio.ensure_future(self._say(self._sound, self._saying))
        pcm = self._rest + pcm
        whole = len(pcm) - len(pcm) % (WIDTH * channels)
        self._rest = pcm[whole:]
        for piece, _ in self._sound.split(pcm[:whole]):
            self._sound.feed(piece)

    def end(self) -> None:
        """End the speech after what was added."""
        if self._sound is not None:
            self._sound.end()
            self._sound = None

    def shut(self) -> None:
        """End the speech at once."""
        if self._sound is not None:
            self._sound.cut()
            self._sound = None

    async def _say(self, sound: SpokenSound, before: "asyncio.Task[None] | None") -> None:
        if before is not None:
            await before
        if failed := await asyncio.to_thread(sound.say, self._link.connect):
            self._next_s = self._link.now_s() + _RETRY_S
            if self._sound is sound:
                self._sound = None
            self._link.report(f"the mouth does not move: {failed}")
