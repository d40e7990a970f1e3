"""Sound files: their check, and their samples for the mouth."""

import wave
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.errors import require_package
from gazerig.drivers.sound.params import KINDS
from gazerig.drivers.sound.player import SoundError

MOUTH_RATE_HZ = 16000
"""Rate at which the mouth reads a sound."""
_MISSING_S = 0.1


class SoundInfo(NamedTuple):
    """A sound file that can be played.

    Attributes:
        path: The file.
        duration_s: Its duration, s.
    """

    path: str
    duration_s: float


def check_sound(path: Path, longest_s: float) -> SoundInfo:
    """Check that a file can be played.

    Args:
        path: The file.
        longest_s: Longest duration.

    Raises:
        SetupError: miniaudio is missing.
        SoundError: the file cannot be played; the message names it and the remedy.
    """
    require_package("miniaudio", "sound")
    import miniaudio

    if not path.is_file():
        raise SoundError(f"{path}: there is no such file")
    if path.suffix.lower() not in KINDS:
        raise SoundError(f"{path}: a sound is a file {', '.join(KINDS)}; convert it")
    try:
        info = miniaudio.get_file_info(str(path))
    except (miniaudio.MiniaudioError, OSError) as error:
        raise SoundError(
            f"{path}: is damaged or not a {path.suffix[1:]} file ({error}); write it again"
        ) from None
    if path.suffix.lower() == ".wav" and _is_cut(path):
        raise SoundError(
            f"{path}: is cut off: it is shorter than its header states; write it again"
        )
    if info.nchannels > 2:
        raise SoundError(f"{path}: has {info.nchannels} channels; write it with 1 or 2")
    if info.duration <= 0.0:
        raise SoundError(f"{path}: contains no sound")
    if info.duration > longest_s:
        raise SoundError(
            f"{path}: lasts {info.duration:.0f} s, more than {longest_s:.0f} s; divide it"
        )
    return SoundInfo(str(path), info.duration)


def _is_cut(path: Path) -> bool:
    """Return whether a WAV file ends before its header states; 0 and -1 are unknown sizes."""
    with path.open("rb") as file:
        size = int.from_bytes(file.read(8)[4:], "little")
    return 0 < size < 0xFFFFFFFF and size + 8 > path.stat().st_size + 1


def read_samples(sound: SoundInfo) -> NDArray[np.float32]:
    """Return the samples of a file: one channel, -1..1, at ``MOUTH_RATE_HZ``.

    Raises:
        SoundError: the file ends before its header states.
    """
    import miniaudio

    try:
        decoded = miniaudio.decode_file(
            sound.path, miniaudio.SampleFormat.FLOAT32, 1, MOUTH_RATE_HZ
        )
    except miniaudio.MiniaudioError as error:
        raise SoundError(f"{sound.path}: is damaged ({error}); write it again") from None
    samples = np.frombuffer(decoded.samples, np.float32)
    found_s = len(samples) / MOUTH_RATE_HZ
    if found_s < sound.duration_s - _MISSING_S:
        raise SoundError(
            f"{sound.path}: is cut off: {found_s:.1f} s of {sound.duration_s:.1f} s; write it again"
        )
    return samples


def write_wav(path: Path, pcm: bytes, rate_hz: int, channels: int = 1) -> None:
    """Write samples, signed, 16 bits, as a WAV file.

    Raises:
        OSError: it cannot be written.
    """
    with wave.open(str(path), "wb") as file:
        file.setnchannels(channels)
        file.setsampwidth(2)
        file.setframerate(rate_hz)
        file.writeframes(pcm)
