"""Mixing of one sound into the buffers of a device, with the time at which each part is heard.

A device requests buffers at its own rate; a request can be late but never early. The earliest
request of the last second defines the device's clock, so a busy computer does not move it. A part
is heard after the buffers that precede it, and after the loudspeaker's own latency.
"""

from collections import deque
from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from gazerig.drivers.sound.position import PlayedSound

WIDTH_BYTES = 2
"""Size of a sample: signed, 16 bits."""
STALL_S = 0.1
"""Time without samples after which a stream is reported."""
_REQUESTS = 100
_MOST_SKIPPED = 1 << 15


class SampleSource(Protocol):
    """Samples of a sound in the device's format."""

    def read(self, frames: int) -> bytes:
        """Return at most this number of frames, b"" if none has arrived."""

    @property
    def is_over(self) -> bool:
        """Return whether no more samples will follow."""


class SoundEvent(NamedTuple):
    """Event of a sound: "started", "ended", "stalled" or "failed", with a reason."""

    kind: str
    number: int
    reason: str = ""


class PcmQueue:
    """Source of a stream: samples in the order of their arrival.

    Args:
        frame_bytes: Size of a frame.
        refill_frames: After the queue was empty, it returns nothing until it has as many frames;
            otherwise a late stream would be interrupted at every piece.
    """

    def __init__(self, frame_bytes: int, refill_frames: int = 0) -> None:
        self._frame_bytes, self._refill_bytes = frame_bytes, refill_frames * frame_bytes
        self._pieces: deque[bytes] = deque()
        self._bytes = 0
        self._finished = self._dry = False

    def add(self, pcm: bytes) -> None:
        """Add samples."""
        self._pieces.append(pcm)
        self._bytes += len(pcm)

    def finish(self) -> None:
        """Mark the end of the stream."""
        self._finished = True

    @property
    def is_over(self) -> bool:
        """Return whether no more samples will follow."""
        return self._finished and not self._pieces

    def read(self, frames: int) -> bytes:
        """Return at most this number of frames, b"" if none has arrived."""
        if self._dry and not self._finished and self._bytes < self._refill_bytes:
            return b""
        wanted, parts = frames * self._frame_bytes, []
        self._dry = self._bytes < wanted
        self._bytes -= min(wanted, self._bytes)
        while wanted > 0 and self._pieces:
            piece = self._pieces.popleft()
            parts.append(piece[:wanted])
            if len(piece) > wanted:
                self._pieces.appendleft(piece[wanted:])
            wanted -= len(parts[-1])
        return b"".join(parts)


class Playback:
    """One sound at a time in the buffers of a device.

    Args:
        rate_hz: Rate of the device.
        channels: Its channels; samples are signed, 16 bits.
        latency_s: Time from a request until the requested part is heard.
        write: Receives the record of the position.
        report: Receives events.
    """

    def __init__(
        self,
        rate_hz: int,
        channels: int,
        latency_s: float,
        write: Callable[[PlayedSound], None],
        report: Callable[[SoundEvent], None],
    ) -> None:
        self.rate_hz, self.channels = rate_hz, channels
        self._latency_s, self._write, self._report = latency_s, write, report
        self._frame_bytes = WIDTH_BYTES * channels
        self._requested = 0
        self._zeros_s: deque[float] = deque(maxlen=_REQUESTS)
        self._source: SampleSource | None = None
        self._stop()

    def _stop(self) -> None:
        self._source, self._number, self._stopping = None, 0, False
        self._begun = self._over = False
        self._missing = 0

    def play(
        self,
        number: int,
        source: SampleSource,
        from_s: float,
        heard_s: float,
        volume: float,
        skips: bool = True,
    ) -> None:
        """Play a sound instead of the present one.

        Args:
            number: Number of the sound.
            source: Its samples, from the position ``from_s`` on.
            from_s: Position of the first sample, s.
            heard_s: Time at which the position 0 is heard, monotonic s; silence precedes it.
            volume: Factor.
            skips: Whether what should have been heard already is skipped; otherwise it is late.
        """
        self._stop()
        self._number, self._volume, self._skips = number, volume, skips
        self._from_s, self._heard_s = from_s, heard_s
        self._received = 0
        self._source = source

    @property
    def is_playing(self) -> bool:
        """Return whether a sound is played or waits for its time."""
        return self._source is not None

    def stop(self) -> None:
        """Stop the sound within one buffer, which fades out."""
        self._stopping = True

    def fill(self, frames: int, now_s: float) -> bytes:
        """Return the samples of one buffer.

        Args:
            frames: Size of the buffer.
            now_s: Time of the request, monotonic s.
        """
        self._zeros_s.append(now_s - self._requested / self.rate_hz)
        zero_s = min(self._zeros_s) + self._latency_s
        begin, self._requested = self._requested, self._requested + frames
        if self._source is None or (self._stopping and not self._begun):
            self._stop()
            return bytes(frames * self._frame_bytes)
        silence = 0
        if not self._begun:
            early_s = self._heard_s + self._from_s - (zero_s + begin / self.rate_hz)
            silence = min(frames, max(0, round(early_s * self.rate_hz)))
            if silence == frames:
                return bytes(frames * self._frame_bytes)
            if self._skips:
                self._skip(self._source, round(-early_s * self.rate_hz))
            self._first = begin + silence - self._received - round(self._from_s * self.rate_hz)
            self._begun = True
            self._report(SoundEvent("started", self._number))
        return self._mix(self._source, frames, silence, zero_s, now_s)

    def _skip(self, source: SampleSource, frames: int) -> None:
        """Skip frames that should have been heard already."""
        while frames > 0 and (part := source.read(min(frames, _MOST_SKIPPED))):
            self._received += len(part) // self._frame_bytes
            frames -= len(part) // self._frame_bytes

    def _mix(
        self, source: SampleSource, frames: int, silence: int, zero_s: float, now_s: float
    ) -> bytes:
        data = source.read(frames - silence)
        found = len(data) // self._frame_bytes
        if found:
            self._first += self._missing
            self._missing = 0
        self._received += found
        if found < frames - silence and source.is_over:
            self._over = True
        elif found < frames - silence:  # the position waits for the stream
            self._missing += frames - silence - found
            if self._missing >= STALL_S * self.rate_hz > self._missing - frames:
                self._report(SoundEvent("stalled", self._number))
        received_s = self._from_s + self._received / self.rate_hz
        played = PlayedSound(self._number, zero_s + self._first / self.rate_hz, received_s)
        self._write(played)
        if self._stopping:
            self._stop()
        elif self._over and played.position_s(now_s) >= received_s:
            self._report(SoundEvent("ended", self._number))
            self._stop()
        samples = np.frombuffer(data, np.int16).reshape(-1, self.channels).astype(np.float32)
        samples *= self._volume
        if self._source is None:
            samples *= np.linspace(1.0, 0.0, len(samples), dtype=np.float32)[:, None]
        rest = (frames - silence - found) * self._frame_bytes
        return bytes(silence * self._frame_bytes) + samples.astype(np.int16).tobytes() + bytes(rest)
