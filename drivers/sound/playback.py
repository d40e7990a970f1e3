"""Mixing of one sound into the buffers of a device, with the time at which each part is heard.

A device requests buffers at its own rate; a request can be late but never early. The earliest
request of the last second defines the device's clock, so a busy computer does not move it. A part
is heard after the buffers that precede it, and after the loudspeaker's own latency.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import msgspec
import numpy as np

WIDTH_BYTES = 2
"""Size of a sample: signed, 16 bits."""
STALL_S = 0.1
"""Time without samples after which a stream is reported."""
_REQUESTS = 100


class PlayedSound(msgspec.Struct, frozen=True, tag=True):
    """Position of the sound that is being played.

    It stops at the received end, so it stands still if the device or a stream stalls.

    Attributes:
        number: Number of the sound, 0 before the first.
        heard_s: Time at which its start is heard, monotonic s.
        received_s: End of the part that the device has received, s since its start.
    """

    number: int = 0
    heard_s: float = 0.0
    received_s: float = 0.0

    def position_s(self, now_s: float) -> float:
        """Return the position that is heard at a time, seconds since the sound's start."""
        return min(now_s - self.heard_s, self.received_s)


class SoundEvent(msgspec.Struct, frozen=True, tag=True):
    """Event of a sound: "started", "ended", "stalled" or "failed", with a reason.

    Of the loudspeaker: "opened" or "closed".
    """

    kind: str
    number: int
    reason: str = ""


class SampleSource(Protocol):
    """Samples of a sound in the device's format."""

    def read(self, frames: int) -> bytes:
        """Return at most this number of frames, b"" if none has arrived."""

    @property
    def is_over(self) -> bool:
        """Return whether no more samples will follow."""


class PcmQueue:
    """Source of a stream: samples in the order of their arrival.

    Args:
        frame_bytes: Size of a frame.
        refill_frames: After the queue was empty, it returns nothing until it has as many frames;
            otherwise a late stream would be interrupted at every piece.
    """

    def __init__(self, frame_bytes: int, refill_frames: int = 0) -> None:
        self._frame_bytes, self._refill_bytes = frame_bytes, refill_frames * frame_bytes
        self._waiting = bytearray()
        self._finished = self._dry = False

    def add(self, pcm: bytes) -> None:
        """Add samples."""
        self._waiting += pcm

    def finish(self) -> None:
        """Mark the end of the stream."""
        self._finished = True

    @property
    def is_over(self) -> bool:
        """Return whether no more samples will follow."""
        return self._finished and not self._waiting

    def read(self, frames: int) -> bytes:
        """Return at most this number of frames, b"" if none has arrived."""
        if self._dry and not self._finished and len(self._waiting) < self._refill_bytes:
            return b""
        size = frames * self._frame_bytes
        self._dry = len(self._waiting) < size
        part = bytes(self._waiting[:size])
        del self._waiting[:size]  # samples may have been added meanwhile
        return part


@dataclass
class _Sound:
    """A sound and its state.

    from_s: position of its first sample; heard_s: time at which the position 0 is heard
    skips: whether what should have been heard already is skipped; otherwise it is late
    first: frame of the device at which the position 0 is, None before the start
    received: frames that the device has received; missing: silent ones since the last of them
    """

    number: int
    source: SampleSource
    from_s: float
    heard_s: float
    volume: float
    skips: bool
    first: int | None = None
    received: int = 0
    missing: int = 0
    is_stopping: bool = False


class Playback:
    """One sound at a time in the buffers of a device.

    Args:
        rate_hz: Rate of the device.
        channels: Its channels; samples are signed, 16 bits.
        latency_s: Time from a request until the requested part is heard.
        report: Receives the position after each buffer, and events.
    """

    def __init__(
        self,
        rate_hz: int,
        channels: int,
        latency_s: float,
        report: Callable[[PlayedSound | SoundEvent], None],
    ) -> None:
        self.rate_hz, self.channels = rate_hz, channels
        self._latency_s, self._report = latency_s, report
        self._frame_bytes = WIDTH_BYTES * channels
        self._requested = 0
        self._zeros_s: deque[float] = deque(maxlen=_REQUESTS)
        self._sound: _Sound | None = None

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
        self._sound = _Sound(number, source, from_s, heard_s, volume, skips)

    @property
    def is_playing(self) -> bool:
        """Return whether a sound is played or waits for its time."""
        return self._sound is not None

    def stop(self) -> None:
        """Stop the sound within one buffer, which fades out."""
        sound = self._sound
        if sound is not None and sound.first is None:
            self._sound = None
        elif sound is not None:
            sound.is_stopping = True

    def fill(self, frames: int, now_s: float) -> bytes:
        """Return the samples of one buffer.

        Args:
            frames: Size of the buffer.
            now_s: Time of the request, monotonic s.
        """
        self._zeros_s.append(now_s - self._requested / self.rate_hz)
        zero_s = min(self._zeros_s) + self._latency_s
        begin, self._requested = self._requested, self._requested + frames
        sound, silence = self._sound, 0
        if sound is not None and sound.first is None:
            early = round((sound.heard_s + sound.from_s - zero_s) * self.rate_hz) - begin
            silence = min(frames, max(0, early))
            if silence < frames:
                if sound.skips and early < 0:
                    sound.received = len(sound.source.read(-early)) // self._frame_bytes
                sound.first = begin + silence - sound.received - round(sound.from_s * self.rate_hz)
                self._report(SoundEvent("started", sound.number))
        if sound is None or sound.first is None:
            return bytes(frames * self._frame_bytes)
        data = self._read(sound, frames - silence)
        received_s = sound.from_s + sound.received / self.rate_hz
        played = PlayedSound(sound.number, zero_s + sound.first / self.rate_hz, received_s)
        self._report(played)
        samples = np.frombuffer(data, np.int16).reshape(-1, self.channels) * sound.volume
        if sound.is_stopping:
            samples *= np.linspace(1.0, 0.0, len(samples))[:, None]
            self._sound = None
        elif sound.source.is_over and played.position_s(now_s) >= received_s:
            self._report(SoundEvent("ended", sound.number))
            self._sound = None
        sounding = bytes(silence * self._frame_bytes) + samples.astype(np.int16).tobytes()
        return sounding.ljust(frames * self._frame_bytes, b"\0")

    def _read(self, sound: _Sound, frames: int) -> bytes:
        """Return the next samples; the position waits for those of a stream that are missing."""
        assert sound.first is not None
        data = sound.source.read(frames)
        found = len(data) // self._frame_bytes
        if found:
            sound.first += sound.missing
            sound.missing = 0
        sound.received += found
        if found < frames and not sound.source.is_over:
            sound.missing += frames - found
            if sound.missing >= STALL_S * self.rate_hz > sound.missing - frames:
                self._report(SoundEvent("stalled", sound.number))
        return data
