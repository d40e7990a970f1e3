"""Process that synthesises a text with espeak-ng's library, which reports the time of each phoneme.

``python -m gazerig.drivers.sound.espeak`` reads (text, voice) and writes a ``SpokenText`` or an
error text as MessagePack. The library keeps global state, so each text has a process. The calls are
those of espeak-ng's ``speak_lib.h``.
"""

import ctypes
import sys
from typing import Any

import msgspec

_LIBRARY = "libespeak-ng.so.1"
_RETRIEVAL = 1
_PHONEME_EVENTS, _DONT_EXIT = 0x0001, 0x8000
_UTF8 = 1
_END_OF_LIST, _PHONEME = 0, 7
_BUFFER_MS = 100


class _Event(ctypes.Structure):
    """The structure ``espeak_EVENT``."""

    _fields_ = [
        ("type", ctypes.c_int),
        ("identifier", ctypes.c_uint),
        ("text_position", ctypes.c_int),
        ("length", ctypes.c_int),
        ("audio_ms", ctypes.c_int),
        ("sample", ctypes.c_int),
        ("user_data", ctypes.c_void_p),
        ("name", ctypes.c_char * 8),
    ]


_CALLBACK = ctypes.CFUNCTYPE(
    ctypes.c_int, ctypes.POINTER(ctypes.c_short), ctypes.c_int, ctypes.POINTER(_Event)
)


class SpokenText(msgspec.Struct):
    """A spoken text.

    Attributes:
        pcm: Samples of one channel, signed, 16 bits.
        rate_hz: Their rate.
        phonemes: (name, begin in s).
    """

    pcm: bytes
    rate_hz: int
    phonemes: list[tuple[str, float]]


def synthesise(text: str, voice: str) -> SpokenText | str:
    """Return a text as speech, or an error text."""
    try:
        library = ctypes.CDLL(_LIBRARY)
    except OSError:
        return "espeak-ng is not installed, so texts are not spoken: apt install espeak-ng"
    rate_hz = library.espeak_Initialize(_RETRIEVAL, _BUFFER_MS, None, _PHONEME_EVENTS | _DONT_EXIT)
    if rate_hz <= 0:
        return "espeak-ng finds no voices"
    if library.espeak_SetVoiceByName(voice.encode()) != 0:
        return f"no voice {voice!r}; list them with: espeak-ng --voices"
    samples, phonemes = bytearray(), list[tuple[str, float]]()

    def collect(wave: Any, count: int, events: Any) -> int:
        if wave and count:
            samples.extend(ctypes.string_at(wave, 2 * count))
        i = 0
        while events[i].type != _END_OF_LIST:
            if events[i].type == _PHONEME:
                phonemes.append(
                    (events[i].name.decode("utf-8", "replace"), events[i].sample / rate_hz)
                )
            i += 1
        return 0

    callback = _CALLBACK(collect)
    library.espeak_SetSynthCallback(callback)
    data = text.encode()
    library.espeak_Synth(data, len(data) + 1, 0, 1, 0, _UTF8, None, None)
    library.espeak_Synchronize()
    return SpokenText(bytes(samples), rate_hz, phonemes)


def main() -> None:
    """Answer one request."""
    request = msgspec.msgpack.decode(sys.stdin.buffer.read(), type=tuple[str, str])
    sys.stdout.buffer.write(msgspec.msgpack.encode(synthesise(*request)))


if __name__ == "__main__":
    main()
