"""Long track files, whose frames are read line by line: the YAML parser takes a minute for them."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import msgspec

from gazerig.config.entries import Entry, parse
from gazerig.config.faults import ConfigError, ConfigFault
from gazerig.drivers.files.file_input import FileTooLarge, read_limited
from gazerig.gaze.track.track import MAX_FRAMES

LONG_BYTES = 200_000
"""Larger files are long ones."""
_LARGEST = 20_000_000
_MOST_FAULTS = 10
_KEY = re.compile(r"([{,]\s*)([A-Za-z_]\w*)\s*:")
_WORD = re.compile(r"(:\s*)(?!(?:null|true|false)\b)([A-Za-z_]\w*)(?=\s*[,}])")
_FORM = "in a long file each frame is one line, such as - {time_s: 1.5, head_yaw_deg: 4.0}"


def read_long(path: Path) -> Entry | None:
    """Return the top entry of a long track file, None for a short or an unreadable one.

    Raises:
        ConfigError: the file is too large, or lines are not frames.
    """
    try:
        if path.stat().st_size <= LONG_BYTES:
            return None
        text = read_limited(path, _LARGEST).decode("utf-8-sig")
    except FileTooLarge:
        rule = f"is larger than {_LARGEST / 1e6:g} MB, or {MAX_FRAMES} frames; split the track"
        raise ConfigError([ConfigFault(str(path), None, "", "", rule)]) from None
    except (OSError, UnicodeDecodeError):
        return None
    lines = text.splitlines()
    begin = next((i for i, line in enumerate(lines) if line.rstrip() == "frames:"), None)
    if begin is None:
        return None
    end = begin + 1
    while end < len(lines) and lines[end][:1] in ("", " ", "-", "#"):
        end += 1
    faults: list[ConfigFault] = []
    frames = tuple(_frames(str(path), lines[begin + 1 : end], begin + 2, faults))
    if len(frames) > MAX_FRAMES:
        rule = f"{len(frames)} frames: a track has at most {MAX_FRAMES}; split it"
        faults.append(ConfigFault(str(path), begin + 1, "frames", "", rule))
    # The lines keep their numbers.
    rest = [*lines[:begin], "frames: []", *[""] * (end - begin - 1), *lines[end:]]
    root = parse(str(path), "\n".join(rest), faults)
    if faults or root is None or not isinstance(root.value, dict):
        raise ConfigError(faults[:_MOST_FAULTS])
    root.value["frames"] = Entry(frames, str(path), begin + 1)
    return root


def _frames(
    file: str, lines: Sequence[str], first: int, faults: list[ConfigFault]
) -> Iterator[Entry]:
    """Yield the frames; a line that is none adds a fault."""
    index = 0
    for number, line in enumerate(lines, start=first):
        text = line.partition("#")[0].strip()
        if not text:
            continue
        json = _WORD.sub(r'\1"\2"', _KEY.sub(r'\1"\2":', text.removeprefix("-")))
        try:
            value = msgspec.json.decode(json)
        except (msgspec.DecodeError, UnicodeEncodeError):
            value = None
        if not isinstance(value, dict) or not text.startswith("-"):
            faults.append(ConfigFault(file, number, f"frames.{index}", repr(text[:60]), _FORM))
        else:
            yield _entry(value, file, number)
        index += 1


def _entry(value: object, file: str, line: int) -> Entry:
    """Return plain values as an entry."""
    if isinstance(value, dict):
        return Entry({key: _entry(one, file, line) for key, one in value.items()}, file, line)
    if isinstance(value, list):
        return Entry(tuple([_entry(one, file, line) for one in value]), file, line)
    return Entry(value, file, line)  # type: ignore[arg-type]
