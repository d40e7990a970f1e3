"""Player of sounds in a process of its own; one sound at a time.

A sound is started with the time at which its beginning is heard, so it coincides with motion from
its first sample. The process reports the position that is really heard after each buffer.
"""

import contextlib
import signal
import subprocess
from math import inf

import msgspec

from gazerig.drivers.errors import SetupError, require_package
from gazerig.drivers.process import child_process
from gazerig.drivers.process.message_link import DONT_WAIT, MessageLink, create_links
from gazerig.drivers.sound.playback import WIDTH_BYTES, PlayedSound, SoundEvent

MAX_AHEAD_S = 2.0
"""Longest part of a stream that is stored before it is heard."""

_MODULE = "gazerig.drivers.sound.process"
_PIECE_BYTES = 60_000
_RATES_HZ = 8000, 192_000


class SoundError(SetupError):
    """A sound, a loudspeaker or a speech program is missing or not usable."""


class SoundPlayer:
    """Sounds on one loudspeaker. The methods are for one thread, except ``position_s``.

    Args:
        device: Name of the loudspeaker, a part of it, "" for the default, or "silent".

    Attributes:
        is_open: Whether the loudspeaker is open, so that a sound begins without delay; ``events``
            updates it.
    """

    def __init__(self, device: str) -> None:
        self._device = device
        self.is_open = False
        self._played = PlayedSound()
        self._process: subprocess.Popen[bytes] | None = None
        self._link: MessageLink | None = None
        self._number = 0
        self._heard: tuple[int, float] = (0, -inf)
        self._rate_hz, self._frame_bytes = _RATES_HZ[0], WIDTH_BYTES
        self._fed_s = 0.0

    @property
    def pid(self) -> int | None:
        """Return the id of the sound's process, None if it does not run."""
        return None if self._process is None else self._process.pid

    def prepare(self) -> None:
        """Start the process and open the loudspeaker; ``is_open`` reports when it is.

        Raises:
            SetupError: miniaudio is missing, or the process cannot be started.
        """
        self._send("prepare")

    def play(self, path: str, from_s: float, heard_s: float, volume: float = 1.0) -> int:
        """Play a file instead of the present sound; return its number.

        Args:
            path: A file that ``sound_file.check_sound`` has accepted.
            from_s: Position of the first sample, s.
            heard_s: Time at which the position 0 is heard, monotonic s; a part that should have
                been heard already is skipped.
            volume: Factor 0..1.

        Raises:
            SetupError: miniaudio is missing, or the process cannot be started.
        """
        self._number += 1
        self._send("play", self._number, path, from_s, heard_s, volume)
        return self._number

    def open_stream(self, rate_hz: int, channels: int, heard_s: float, volume: float = 1.0) -> int:
        """Play samples that ``feed`` adds, instead of the present sound; return the number.

        Args:
            rate_hz: Rate of the samples.
            channels: 1 or 2.
            heard_s: Time at which the first sample is heard, monotonic s.
            volume: Factor 0..1.

        Raises:
            SoundError: the format is not possible.
            SetupError: miniaudio is missing, or the process cannot be started.
        """
        check_format(rate_hz, channels)
        self._number += 1
        self._rate_hz, self._frame_bytes, self._fed_s = rate_hz, WIDTH_BYTES * channels, 0.0
        self._send("stream", self._number, rate_hz, channels, heard_s, volume)
        return self._number

    def ahead_s(self, now_s: float) -> float:
        """Return the length of the part of the stream that has not been heard, s."""
        return self._fed_s - max(0.0, self.position_s(now_s) or 0.0)

    def feed(self, pcm: bytes, now_s: float) -> None:
        """Add samples to the stream: signed, 16 bits, little-endian, channels interleaved.

        Args:
            pcm: Samples.
            now_s: Present time, monotonic s.

        Raises:
            SoundError: it is not whole frames, or more than ``MAX_AHEAD_S`` would wait; nothing of
                the piece is played.
        """
        if len(pcm) % self._frame_bytes:
            raise SoundError(
                f"a piece of {len(pcm)} bytes: give whole frames of {self._frame_bytes} bytes"
            )
        length_s = len(pcm) / self._frame_bytes / self._rate_hz
        if self.ahead_s(now_s) + length_s > MAX_AHEAD_S:
            raise SoundError(
                f"more than {MAX_AHEAD_S:g} s of sound are waiting: this piece is not played; "
                "send pieces as fast as they are heard"
            )
        self._fed_s += length_s
        for i in range(0, len(pcm), _PIECE_BYTES):
            self._send("feed", pcm[i : i + _PIECE_BYTES])

    def finish_stream(self) -> None:
        """Mark the end of the stream."""
        self._send("finish")

    def stop(self) -> None:
        """Stop the present sound immediately; never wait."""
        if self._link is not None:
            with contextlib.suppress(OSError):
                self._link.send(msgspec.msgpack.encode(["stop"]), DONT_WAIT)

    def position_s(self, now_s: float) -> float | None:
        """Return the position of the present sound that is heard, None before its start.

        Args:
            now_s: Present time, monotonic s.

        Returns:
            Seconds since the sound's start; it never decreases.
        """
        played = self._played
        if played.number != self._number or not played.number:
            return None
        number, before_s = self._heard
        position_s = played.position_s(now_s)
        if number == played.number:
            position_s = max(position_s, before_s)
        self._heard = played.number, position_s
        return position_s

    def events(self) -> tuple[SoundEvent, ...]:
        """Return the events of the present sound since the last call, and update its position."""
        found: list[SoundEvent] = []
        while self._link is not None:
            try:
                message = self._link.recv(1 << 16, DONT_WAIT)
            except BlockingIOError:
                break
            except OSError:
                message = b""
            if not message:
                found.append(SoundEvent("failed", self._number, self._end_text()))
                self.close()
                break
            event = msgspec.msgpack.decode(message, type=SoundEvent | PlayedSound)
            if isinstance(event, PlayedSound):
                self._played = event
            elif event.kind in ("opened", "closed"):
                self.is_open = event.kind == "opened"
            else:
                found.append(event)
        return tuple(one for one in found if one.number == self._number)

    def close(self) -> None:
        """End the process, and with it the sound; safe to call twice."""
        if self._link is not None:
            self._link.close()
        if self._process is not None:
            try:
                self._process.wait(0.5)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        self._link = self._process = None
        self.is_open = False

    def _send(self, *message: object) -> None:
        """Send a message; start the process if it does not run.

        Raises:
            SoundError: it cannot be started, or does not respond.
        """
        if self._link is None:
            self._start()
        assert self._link is not None
        try:
            self._link.send(msgspec.msgpack.encode(message), DONT_WAIT)
        except BlockingIOError:
            raise SoundError("the sound's process does not respond") from None
        except OSError:
            raise SoundError(self._end_text()) from None

    def _start(self) -> None:
        require_package("miniaudio", "sound")
        try:
            offer = create_links(1)
            (self._link,) = offer.parent_ends
            self._process = child_process.start(
                _MODULE, *offer.arguments, self._device, stderr=subprocess.DEVNULL,
                pass_fds=offer.fds,
            )  # fmt: skip
        except OSError as error:
            self._link = None
            raise SoundError(f"the sound's process cannot be started: {error.strerror}") from error
        for end in offer.child_sockets:
            end.close()

    def _end_text(self) -> str:
        code = None if self._process is None else self._process.poll()
        ended = "" if code is None else f" ({signal.Signals(-code).name if code < 0 else code})"
        return f"the sound's process has ended{ended}: the next sound starts it again"


def check_format(rate_hz: int, channels: int) -> None:
    """Check the format of a stream.

    Raises:
        SoundError: the rate or the number of channels is not possible.
    """
    low, high = _RATES_HZ
    if not (low <= rate_hz <= high and channels in (1, 2)):
        raise SoundError(
            f"a stream of {channels} channels at {rate_hz} Hz: give 1 or 2 channels at {low}..{high} Hz"
        )
