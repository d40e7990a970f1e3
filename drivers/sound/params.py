"""Parameters of the sound."""

from dataclasses import dataclass
from typing import Annotated

from gazerig.params import Bounds

SILENT_DEVICE = "silent"
"""Name of the device that plays nothing but keeps time."""

KINDS = (".wav", ".flac", ".mp3", ".ogg")
"""Endings of sound files."""


@dataclass(frozen=True)
class SoundParams:
    """Loudspeaker and voice of the head."""

    # fmt: off
    device: Annotated[str, "name of the loudspeaker or a part of it; empty: the system's default; silent: plays nothing, keeps time"] = ""
    volume: Annotated[float, Bounds(0, 1), "factor on all sounds"] = 1.0
    latency_ms: Annotated[float, Bounds(0, 1000),
        "delay of the loudspeaker itself, e.g. by Bluetooth; motion waits for it"] = 0.0
    folders: Annotated[tuple[str, ...],
        "folders whose sounds may be played, relative to this file; empty: this file's folder"] = ()
    voice: Annotated[str, "voice of espeak-ng, such as en-us or de; espeak-ng --voices lists them"] = "en-us"
    # fmt: on
