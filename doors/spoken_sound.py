"""A neighbour's sound, said by the head while it arrives."""

import asyncio
import contextlib
import queue
import threading
from collections.abc import Iterator

import gazerig
from gazerig.doors.door import DoorLink

WIDTH = 2
"""Bytes of a sample."""
_PIECE_S = 0.04
_MOST_PIECES = 15_000
"""Pieces that wait: ten minutes."""
_LOOK_S, _MOST_LOOKS = 0.05, 60
"""How often the end of a sound is looked for after its last piece, 3 s at most."""


class SpokenSound:
    """Sounds of one source, which the head says one after the other; nothing waits for it.

    Args:
        link: The head.
        volume: Factor 0..1; 0: only the mouth moves, to a sound that the neighbour plays itself.

    Attributes:
        heard: Ends when the newest sound has been heard, None before the first.
    """

    def __init__(self, link: DoorLink, volume: float = 1.0) -> None:
        self._link, self._volume = link, volume
        self._pieces: queue.SimpleQueue[bytes] | None = None
        self._cut = threading.Event()
        self._rest = b""
        self.heard: asyncio.Task[None] | None = None

    def add(self, pcm: bytes, rate_hz: int, channels: int = 1) -> None:
        """Add samples, heard after what was added before; of a flood, none.

        Args:
            pcm: Samples, signed, 16 bits, channels interleaved.
            rate_hz: Rate of the samples.
            channels: 1 or 2.
        """
        if self._pieces is None:
            self._pieces, self._rest = queue.SimpleQueue(), b""
            sound = self._read(self._pieces, self._cut), self._cut, rate_hz, channels
            self.heard = asyncio.ensure_future(self._hear(self.heard, *sound))
        frame = WIDTH * channels
        pcm = self._rest + pcm
        whole = len(pcm) - len(pcm) % frame
        self._rest = pcm[whole:]
        step = frame * round(_PIECE_S * rate_hz)
        for at in range(0, whole, step):
            if self._pieces.qsize() < _MOST_PIECES:
                self._pieces.put(pcm[at : min(at + step, whole)])

    def end(self) -> "asyncio.Task[None] | None":
        """End the sound after what was added; return ``heard``, None if nothing was added."""
        if self._pieces is None:
            return None
        self._pieces.put(b"")
        self._pieces = None
        return self.heard

    def shut(self) -> None:
        """End all sounds at once."""
        self._cut.set()
        self._cut = threading.Event()
        self.end()

    async def _hear(
        self, before: "asyncio.Task[None] | None", pieces: Iterator[bytes], cut: threading.Event,
        rate_hz: int, channels: int,
    ) -> None:  # fmt: skip
        if before is not None:
            await before
        try:
            refused = await asyncio.to_thread(self._say, pieces, cut, rate_hz, channels)
        except gazerig.Error as error:
            refused = str(error)
        if refused:
            self._link.report(f"the sound is not said: {refused}")

    def _say(
        self, pieces: Iterator[bytes], cut: threading.Event, rate_hz: int, channels: int
    ) -> str:
        """Let the head say a sound until it is heard; return why it refuses, "" if it does not.

        Raises:
            gazerig.Error: the head has ended, or does not say it.
        """
        with self._link.connect() as head:  # its own, because it waits
            order = head.say(pieces, rate_hz=rate_hz, channels=channels, volume=self._volume)
            for _ in range(_MOST_LOOKS):
                if cut.is_set():
                    with contextlib.suppress(gazerig.Refused):  # it has ended
                        head.end_track("speech")
                if not any(t.name == "speech" and not t.end_reason for t in head.state.tracks):
                    break
                head.sleep(_LOOK_S)
            return str(order.reply.refused or "")

    @staticmethod
    def _read(pieces: queue.SimpleQueue[bytes], cut: threading.Event) -> Iterator[bytes]:
        while not cut.is_set() and (piece := pieces.get()):
            yield piece
