"""Texts spoken by an installed program: espeak-ng or piper."""

import shutil
import subprocess
import tempfile
import wave
from pathlib import Path
from typing import NamedTuple

import msgspec

from gazerig.drivers.process import child_process
from gazerig.drivers.sound.params import SoundParams
from gazerig.drivers.sound.player import SoundError

MAX_CHARACTERS = 5000
"""Longest text."""
_TIMEOUT_S = 60.0
_MODULE = "gazerig.drivers.sound.espeak"
_INSTALL = {"espeak-ng": "apt install espeak-ng", "piper": "pip install piper-tts"}
_MODEL = ".onnx"


class SpokenText(NamedTuple):
    """A spoken text.

    Attributes:
        pcm: Samples of one channel, signed, 16 bits.
        rate_hz: Their rate.
        phonemes: (name, begin in s); None if the program does not report them.
    """

    pcm: bytes
    rate_hz: int
    phonemes: tuple[tuple[str, float], ...] | None


def speak(text: str, params: SoundParams) -> SpokenText:
    """Return a text as speech.

    Raises:
        SoundError: the text is too long, or the program is missing or fails.
    """
    if len(text) > MAX_CHARACTERS:
        raise SoundError(f"a spoken text has at most {MAX_CHARACTERS} characters, not {len(text)}")
    program = params.speech
    if program == "auto":
        program = "piper" if params.voice.endswith(_MODEL) else "espeak-ng"
    found = shutil.which(program)
    if found is None:
        raise SoundError(
            f"{program} is not installed, so texts are not spoken: {_INSTALL[program]}"
        )
    try:
        return _espeak(text, params) if program == "espeak-ng" else _piper(found, text, params)
    except subprocess.TimeoutExpired:
        raise SoundError(f"{program} has not finished within {_TIMEOUT_S:g} s") from None
    except (OSError, wave.Error, EOFError) as error:
        raise SoundError(f"{program} cannot speak: {error}") from None


def _espeak(text: str, params: SoundParams) -> SpokenText:
    """Speak with the program's library, which reports phonemes."""
    request = msgspec.msgpack.encode((text, params.voice))
    done = child_process.run(_MODULE, request, _TIMEOUT_S)
    answer = msgspec.msgpack.decode(done.stdout) if done.stdout else "its process has ended"
    if not isinstance(answer, list):
        raise SoundError(f"espeak-ng cannot speak: {answer}")
    rate_hz, pcm, phonemes = answer
    return SpokenText(pcm, rate_hz, tuple((name, begin_s) for name, begin_s in phonemes))


def _piper(program: str, text: str, params: SoundParams) -> SpokenText:
    """Run piper, which reads a text and writes a WAV file.

    Raises:
        SoundError: it fails.
        OSError, wave.Error, EOFError: it cannot be started, or its file cannot be read.
        subprocess.TimeoutExpired: it takes too long.
    """
    if not params.voice.endswith(_MODEL):
        raise SoundError("piper needs a voice: set sound.voice to the path of its .onnx file")
    with tempfile.TemporaryDirectory(prefix="gazerig-speech-") as folder:
        file = Path(folder, "speech.wav")
        done = subprocess.run(
            [program, "--model", params.voice, "--output_file", str(file)],
            input=text.replace("\n", " ").encode(), capture_output=True, timeout=_TIMEOUT_S,
            check=False, start_new_session=True,
        )  # fmt: skip
        if done.returncode != 0 or not file.is_file():
            lines = done.stderr.decode("utf-8", "replace").strip().splitlines()
            raise SoundError(f"piper cannot speak: {lines[-1] if lines else 'no sound'}")
        with wave.open(str(file)) as spoken:
            if (spoken.getsampwidth(), spoken.getnchannels()) != (2, 1):
                raise SoundError("piper wrote another format than 16 bits, 1 channel")
            return SpokenText(spoken.readframes(spoken.getnframes()), spoken.getframerate(), None)
