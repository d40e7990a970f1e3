"""Texts spoken by espeak-ng."""

import subprocess

import msgspec

from gazerig.drivers.process import child_process
from gazerig.drivers.sound.espeak import SpokenText
from gazerig.drivers.sound.player import SoundError

MAX_CHARACTERS = 5000
"""Longest text."""
_TIMEOUT_S = 60.0
_MODULE = "gazerig.drivers.sound.espeak"


def speak(text: str, voice: str) -> SpokenText:
    """Return a text as speech.

    Args:
        text: The text.
        voice: Name of a voice of espeak-ng.

    Raises:
        SoundError: the text is too long, or espeak-ng is missing or fails.
    """
    if len(text) > MAX_CHARACTERS:
        raise SoundError(f"a spoken text has at most {MAX_CHARACTERS} characters, not {len(text)}")
    try:
        done = child_process.run(_MODULE, msgspec.msgpack.encode((text, voice)), _TIMEOUT_S)
        answer = msgspec.msgpack.decode(done.stdout, type=SpokenText | str)
    except (OSError, subprocess.TimeoutExpired, msgspec.DecodeError) as error:
        raise SoundError(f"espeak-ng cannot speak: {error}") from None
    if isinstance(answer, str):
        raise SoundError(answer)
    return answer
