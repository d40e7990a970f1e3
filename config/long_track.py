"""Long track files, whose frames are read line by line: the YAML parser takes a minute for them."""

import re
from dataclasses import replace
from pathlib import Path

import msgspec

from gazerig.config.entries import Entry, parse
from gazerig.config.faults import ConfigError, ConfigFault
from gazerig.config.validation import abbreviate
from gazerig.drivers.files.file_input import FileTooLarge, read_limited
from gazerig.gaze.track.track import MAX_FRAMES

LONG_BYTES = 200_000
"""Larger files are long ones."""
_LARGEST = 20_000_000
_MOST_FAULTS = 10
_FRAMES = re.compile(r"^frames:[ ]*\n((?:[ \-#].*\n|\n)*)", re.MULTILINE)
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
        text = read_limited(path, _LARGEST).decode("utf-8-sig") + "\n"
    except FileTooLarge:
        rule = f"is larger than {_LARGEST / 1e6:g} MB, or {MAX_FRAMES} frames; split the track"
        raise ConfigError([ConfigFault(str(path), None, "", "", rule)]) from None
    except (OSError, UnicodeDecodeError):
        return None
    block = _FRAMES.search(text)
    if block is None:
        return None
    faults: list[ConfigFault] = []
    frames, first = list[Entry](), text.count("\n", 0, block.start(1)) + 1
    for number, line in enumerate(block[1].splitlines(), start=first):
        if frame := line.partition("#")[0].strip():
            frames.append(_frame(frame, str(path), number))
    faults += [
        ConfigFault(str(path), one.line, f"frames.{i}", abbreviate(one.value), _FORM)
        for i, one in enumerate(frames)
        if not isinstance(one.value, dict)
    ]
    # The lines keep their numbers.
    blank = "\n" * block[1].count("\n")
    rest = f"{text[: block.start()]}frames: []\n{blank}{text[block.end() :]}"
    root = parse(str(path), rest, faults)
    if faults or root is None or not isinstance(root.value, dict):
        raise ConfigError(faults[:_MOST_FAULTS])
    held = Entry(tuple(frames), str(path), first - 1)
    return replace(root, value={**root.value, "frames": held})


def _frame(text: str, file: str, line: int) -> Entry:
    """Return a frame's line as an entry; its text if it is none."""
    json = _WORD.sub(r'\1"\2"', _KEY.sub(r'\1"\2":', text.removeprefix("-")))
    try:
        value = msgspec.json.decode(json)
    except (msgspec.DecodeError, UnicodeEncodeError):
        value = text
    return _entry(value if text.startswith("-") else text, file, line)


def _entry(value: object, file: str, line: int) -> Entry:
    """Return plain values as an entry."""
    if isinstance(value, dict):
        return Entry({key: _entry(one, file, line) for key, one in value.items()}, file, line)
    if isinstance(value, list):
        return Entry(tuple([_entry(one, file, line) for one in value]), file, line)
    return Entry(value, file, line)  # type: ignore[arg-type]
