"""A neighbour's sound, said by the head while it arrives."""

import queue
from collections.abc import Callable, Iterator
from typing import Any

import gazerig

WIDTH = 2
"""Bytes of a sample."""
_PIECE_S = 0.04
_LONGEST_END_S, _LOOK_S = 3.0, 0.05
"""Longest wait for the end of a sound after its last piece, and how often it is looked for."""


class SpokenSound:
    """A sound that the head says while it arrives; ``say`` is called in a thread.

    Args:
        rate_hz: Rate of the samples.
        channels: 1 or 2.
    """

    def __init__(self, rate_hz: int, channels: int) -> None:
        self._rate_hz, self._channels = rate_hz, channels
        self._pieces: queue.SimpleQueue[bytes] = queue.SimpleQueue()

    def split(self, pcm: bytes) -> Iterator[tuple[bytes, float]]:
        """Return the pieces of samples, and the duration of each, s."""
        frame = WIDTH * self._channels
        step = frame * round(_PIECE_S * self._rate_hz)
        for at in range(0, len(pcm), step):
            piece = pcm[at : at + step]
            yield piece, len(piece) / frame / self._rate_hz

    def feed(self, piece: bytes) -> None:
        """Add a piece of samples: signed, 16 bits, channels interleaved."""
        self._pieces.put(piece)

    def end(self) -> None:
        """End the sound."""
        self._pieces.put(b"")

    def say(self, connect: Callable[[], Any]) -> str:
        """Let the head say it until it is heard; return why that fails, "" if it does not.

        Args:
            connect: Returns a connection to the head, of which this has its own.
        """
        try:
            head = connect()
            try:
                order = head.say(self._read(), rate_hz=self._rate_hz, channels=self._channels)
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
