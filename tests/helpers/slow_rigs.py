"""Shipped rigs at another rate of their control loop, for tests that do not judge the rate."""

import re
from dataclasses import replace
from pathlib import Path

from gazerig.config.load import shipped_path
from gazerig.config.schema import Rig

_RATE = re.compile(r"^loop:.*\n  rate_hz: [\d.]+", re.MULTILINE)


def at_rate(folder: Path, rig: str, rate_hz: float) -> str:
    """Write a shipped rig, or one of a file, with another loop rate; return the file's path."""
    source = Path(rig) if rig.endswith(".yaml") else shipped_path("rigs", rig)
    text = source.read_text(encoding="utf-8")
    loop = f"loop:\n  rate_hz: {rate_hz}"
    text, count = _RATE.subn(loop, text)
    if count == 0:  # it has the rate of the schema
        assert not re.search("^loop:", text, re.MULTILINE)
        text += f"\n{loop}\n"
    file = folder / f"{source.stem}.yaml"
    file.write_text(text, encoding="utf-8")
    return str(file)


def slowed(rig: Rig, rate_hz: float) -> Rig:
    return replace(rig, loop=replace(rig.loop, rate_hz=rate_hz))
