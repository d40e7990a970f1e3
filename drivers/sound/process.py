"""Process that plays sounds: ``python -m gazerig.drivers.sound.process LINK MEMORY DEVICE``.

It receives messages (MessagePack) on a link, writes its position to shared memory and sends events
back. The device is open while a sound is played and for a moment after. The process ends with its
program.
"""

import os
import select
import sys
import time
from collections.abc import Generator
from typing import Any

import miniaudio
import msgspec

from gazerig.drivers.process.message_link import DONT_WAIT, MessageLink, open_link
from gazerig.drivers.sound.params import SILENT_DEVICE
from gazerig.drivers.sound.playback import PcmQueue, Playback, SampleSource, SoundEvent
from gazerig.drivers.sound.position import PositionMemory

PLAY, STREAM, FEED, FINISH, STOP, PREPARE = "play", "stream", "feed", "finish", "stop", "prepare"
"""Kinds of messages; see ``gazerig.drivers.sound.player``."""
LONGEST_MESSAGE = 1 << 17
FILE_FORMAT = 48000, 2
"""Rate in Hz and channels to which files are converted."""

_PERIOD_MS, _PERIODS = 10, 3
_LATENCY_S = _PERIOD_MS / 1e3 * (_PERIODS - 1)
"""A requested buffer follows those that the device has already."""
_REFILL_S = 0.12
_IDLE_S = 10.0
_LOST_S = 1.0
_POLL_MS = 100


class _FileSource:
    """Samples of a file, converted to the format of the device."""

    def __init__(self, path: str, from_s: float) -> None:
        rate_hz, channels = FILE_FORMAT
        first = round(from_s * rate_hz)
        self._stream = miniaudio.stream_file(
            path, nchannels=channels, sample_rate=rate_hz, seek_frame=first
        )
        self.is_over = False

    def read(self, frames: int) -> bytes:
        """Return at most this number of frames."""
        parts: list[bytes] = []
        while frames > 0 and not self.is_over:
            try:
                part = self._stream.send(min(frames, 16384)).tobytes()
            except (StopIteration, miniaudio.MiniaudioError):
                self.is_over = True
                break
            parts.append(part)
            frames -= len(part) // (2 * FILE_FORMAT[1])
        return b"".join(parts)


class _Device:
    """An open loudspeaker, and the playback that fills its buffers."""

    def __init__(self, name: str, rate_hz: int, channels: int, playback: Playback) -> None:
        self.format = rate_hz, channels
        self.playback = playback
        self.filled_s = time.monotonic()
        null = name == SILENT_DEVICE
        self._device = miniaudio.PlaybackDevice(
            nchannels=channels,
            sample_rate=rate_hz,
            buffersize_msec=_PERIOD_MS,
            callback_periods=_PERIODS,
            device_id=None if null else _find_device(name),
            backends=[miniaudio.Backend.NULL] if null else _real_backends(),
            app_name="gazerig",
        )
        buffers = self._fill()
        next(buffers)
        self._device.start(buffers)

    def _fill(self) -> Generator[bytes, int, None]:
        frames = yield b""
        while True:
            self.filled_s = time.monotonic()
            frames = yield self.playback.fill(frames, self.filled_s)

    def close(self) -> None:
        self._device.close()


class _Player:
    """The player of the process."""

    def __init__(self, link: MessageLink, memory: PositionMemory, device: str) -> None:
        self._link, self._memory, self._name = link, memory, device
        self._device: _Device | None = None
        self._queue = PcmQueue(1)
        self._number = 0
        self._used_s = time.monotonic()

    def handle(self, message: bytes) -> None:
        """Execute a message; errors become events."""
        kind, *values = msgspec.msgpack.decode(message)
        self._used_s = time.monotonic()
        try:
            self._execute(kind, values)
        except (miniaudio.MiniaudioError, OSError, ValueError) as error:
            self._report(SoundEvent("failed", self._number, _error_text(error, self._name)))

    def _execute(self, kind: str, values: list[Any]) -> None:
        if kind == PLAY:
            self._number, path, from_s, heard_s, volume = values
            self._play(_FileSource(path, from_s), *FILE_FORMAT, from_s, heard_s, volume)
        elif kind == STREAM:
            self._number, rate_hz, channels, heard_s, volume = values
            self._queue = PcmQueue(2 * channels, round(_REFILL_S * rate_hz))
            self._play(self._queue, rate_hz, channels, 0.0, heard_s, volume)
        elif kind == FEED:
            self._queue.add(values[0])
        elif kind == FINISH:
            self._queue.finish()
        elif kind == PREPARE:
            self._open(*FILE_FORMAT)
        elif self._device is not None:
            self._device.playback.stop()

    def _play(
        self, source: SampleSource, rate_hz: int, channels: int, from_s: float, heard_s: float,
        volume: float,
    ) -> None:  # fmt: skip
        device = self._open(rate_hz, channels)
        skips = isinstance(source, _FileSource)
        device.playback.play(self._number, source, from_s, heard_s, volume, skips)

    def _open(self, rate_hz: int, channels: int) -> _Device:
        """Return the open device with this format."""
        if self._device is None or self._device.format != (rate_hz, channels):
            self._close()
            playback = Playback(rate_hz, channels, _LATENCY_S, self._memory.write, self._report)
            self._device = _Device(self._name, rate_hz, channels, playback)
            self._memory.is_open = True
        return self._device

    def check(self) -> None:
        """Close an idle device, and report one that requests no more buffers."""
        device, now_s = self._device, time.monotonic()
        if device is None:
            return
        if device.playback.is_playing:
            self._used_s = now_s
        if now_s - device.filled_s > _LOST_S:
            self._close()
            text = f"the loudspeaker {self._name or 'of the system'} has disappeared: connect it"
            self._report(SoundEvent("failed", self._number, text))
        elif now_s - self._used_s > _IDLE_S:
            self._close()

    @property
    def is_open(self) -> bool:
        """Return whether a device is open."""
        return self._device is not None

    def _close(self) -> None:
        if self._device is not None:
            self._device.close()
        self._device = None
        self._memory.is_open = False

    def _report(self, event: SoundEvent) -> None:
        try:
            self._link.send(msgspec.msgpack.encode(event), DONT_WAIT)
        except OSError:  # the program is gone, and this process ends
            return


def _real_backends() -> list[miniaudio.Backend]:
    """Return all backends but the silent one, which must not replace a missing loudspeaker."""
    return [one for one in miniaudio.Backend if one != miniaudio.Backend.NULL]


def _find_device(name: str) -> Any:
    """Return the id of a loudspeaker, None for the system's default.

    Raises:
        ValueError: there is none of this name, or several.
    """
    if not name:
        return None
    try:
        found = miniaudio.Devices(_real_backends()).get_playbacks()
    except miniaudio.MiniaudioError:
        found = []
    fitting = [one for one in found if one["name"] == name] or [
        one for one in found if name.lower() in one["name"].lower()
    ]
    if len(fitting) != 1:
        there = ", ".join(one["name"] for one in found) or "none"
        raise ValueError(
            f"{len(fitting) or 'no'} loudspeakers are named {name!r}; available: {there}; "
            "set sound.device"
        )
    return fitting[0]["id"]


def _error_text(error: Exception, device: str) -> str:
    if isinstance(error, miniaudio.DecodeError):
        return f"the sound cannot be read: {error}"
    if isinstance(error, miniaudio.MiniaudioError):
        return (
            f"no sound: the loudspeaker {device or 'of the system'} cannot be opened ({error}); connect one "
            f"or set sound.device ({SILENT_DEVICE}: none)"
        )
    return str(error)


def main(word: str, memory_fd: int, device: str) -> None:
    """Play until the program is gone."""
    parent = os.getppid()
    link = open_link(word)
    player = _Player(link, PositionMemory(memory_fd), device)
    waiting = select.poll()
    waiting.register(link.fileno(), select.POLLIN)
    while os.getppid() == parent:
        if waiting.poll(_POLL_MS if player.is_open else 1000):
            try:
                message = link.recv(LONGEST_MESSAGE)
            except OSError:
                break
            if not message:
                break
            player.handle(message)
        player.check()
    # A device that hangs must not keep the process.
    os._exit(0)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), sys.argv[3])
