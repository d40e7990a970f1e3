"""Process that plays sounds: ``python -m gazerig.drivers.sound.process LINK DEVICE``.

It receives messages (MessagePack) on a link, and sends its position and events back. The device is
open while a sound is played and for a moment after. The process ends with its program.
"""

import os
import select
import sys
import time
from collections.abc import Generator
from contextlib import suppress
from typing import Any

import miniaudio
import msgspec

from gazerig.drivers.process.message_link import DONT_WAIT, MessageLink, open_link
from gazerig.drivers.sound.params import SILENT_DEVICE
from gazerig.drivers.sound.playback import (
    WIDTH_BYTES,
    PcmQueue,
    Playback,
    PlayedSound,
    SoundEvent,
)

LONGEST_MESSAGE = 1 << 17
FILE_FORMAT = 48000, 2
"""Rate in Hz and channels to which files are converted."""

_PERIOD_MS, _PERIODS = 10, 3
_LATENCY_S = _PERIOD_MS / 1e3 * (_PERIODS - 1)
"""A requested buffer follows those that the device has already."""
_REFILL_S = 0.12
_IDLE_S = 10.0
_LOST_S = 1.0
_POLL_S = 0.1


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


class _Player:
    """The player of the process, and its open loudspeaker."""

    def __init__(self, link: MessageLink, device: str) -> None:
        self._link, self._name = link, device
        self._device: miniaudio.PlaybackDevice | None = None
        self._playback = Playback(*FILE_FORMAT, _LATENCY_S, self._report)
        self._queue = PcmQueue(1)
        self._number = 0
        self._used_s = self._filled_s = time.monotonic()

    def handle(self, message: bytes) -> None:
        """Execute a message; errors become events."""
        self._used_s = time.monotonic()
        try:
            self._execute(msgspec.msgpack.decode(message))
        except (miniaudio.MiniaudioError, OSError, ValueError) as error:
            self._fail(_error_text(error, self._name))

    def _execute(self, message: list[Any]) -> None:
        match message:
            case ["play", number, path, from_s, heard_s, volume]:
                self._number = number
                source = _FileSource(path, from_s)
                self._open(*FILE_FORMAT).play(number, source, from_s, heard_s, volume)
            case ["stream", number, rate_hz, channels, heard_s, volume]:
                self._number = number
                self._queue = PcmQueue(WIDTH_BYTES * channels, round(_REFILL_S * rate_hz))
                playback = self._open(rate_hz, channels)
                playback.play(number, self._queue, 0.0, heard_s, volume, skips=False)
            case ["feed", pcm]:
                self._queue.add(pcm)
            case ["finish"]:
                self._queue.finish()
            case ["prepare"]:
                self._open(*FILE_FORMAT)
            case ["stop"]:
                self._playback.stop()

    def _open(self, rate_hz: int, channels: int) -> Playback:
        """Return the playback of a loudspeaker with this format, which is open."""
        playback = self._playback
        if self._device is None or (playback.rate_hz, playback.channels) != (rate_hz, channels):
            self._close()
            self._playback = Playback(rate_hz, channels, _LATENCY_S, self._report)
            null = self._name == SILENT_DEVICE
            self._device = miniaudio.PlaybackDevice(
                nchannels=channels,
                sample_rate=rate_hz,
                buffersize_msec=_PERIOD_MS,
                callback_periods=_PERIODS,
                device_id=None if null else _find_device(self._name),
                backends=[miniaudio.Backend.NULL] if null else _real_backends(),
                app_name="gazerig",
            )
            self._filled_s = time.monotonic()
            buffers = self._fill(self._playback)
            next(buffers)
            self._device.start(buffers)
        self._report(SoundEvent("opened", self._number))
        return self._playback

    def _fill(self, playback: Playback) -> Generator[bytes, int, None]:
        frames = yield b""
        while True:
            self._filled_s = time.monotonic()
            frames = yield playback.fill(frames, self._filled_s)

    def check(self) -> None:
        """Close an idle device, and report one that requests no more buffers."""
        now_s = time.monotonic()
        if self._device is None:
            return
        if self._playback.is_playing:
            self._used_s = now_s
        if now_s - self._filled_s > _LOST_S:
            self._close()
            self._fail(
                f"the loudspeaker {self._name or 'of the system'} has disappeared: connect it"
            )
        elif now_s - self._used_s > _IDLE_S:
            self._close()

    def _close(self) -> None:
        if self._device is not None:
            self._device.close()
            self._device = None
            self._report(SoundEvent("closed", self._number))

    def _fail(self, reason: str) -> None:
        self._report(SoundEvent("failed", self._number, reason))

    def _report(self, event: SoundEvent | PlayedSound) -> None:
        # A suspended program reads nothing: positions are dropped then, and events wait.
        flags = DONT_WAIT if isinstance(event, PlayedSound) else 0
        with suppress(OSError):  # the program is gone, and this process ends
            self._link.send(msgspec.msgpack.encode(event), flags)


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


def main(word: str, device: str) -> None:
    """Play until the program is gone."""
    parent = os.getppid()
    link = open_link(word)
    player = _Player(link, device)
    while os.getppid() == parent:
        if select.select([link], [], [], _POLL_S)[0]:
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
    main(*sys.argv[1:])
