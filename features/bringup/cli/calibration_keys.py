"""Keys of a terminal or words of a script that control a calibration."""

from abc import ABC, abstractmethod
from contextlib import AbstractContextManager
from typing import cast

from gazerig.drivers.errors import SetupError
from gazerig.features.bringup.calibration.face_steering import Key
from gazerig.features.bringup.cli.prompts import Lines
from gazerig.robot.cli.key_input import TerminalInput, split_keys

HELP = (
    "arrow keys or w a s d move the gaze as you see it; + and - the step; Enter: it looks at it; "
    "n: next, leave this part; b: back; q: end"
)

_PLAIN: dict[str, Key] = {
    "w": "up", "a": "left", "s": "down", "d": "right",
    "+": "larger", "=": "larger", "-": "smaller", "_": "smaller",
    "\r": "enter", "\n": "enter", "n": "skip", "b": "back", "q": "end",
}  # fmt: skip
_WORDS: dict[str, Key] = {
    "": "enter", "enter": "enter", "left": "left", "right": "right", "up": "up", "down": "down",
    "+": "larger", "-": "smaller", "skip": "skip", "n": "skip", "back": "back", "b": "back",
    "end": "end", "q": "end",
}  # fmt: skip


def split_words(text: str) -> tuple[list[Key], str]:
    """Return the keys in a terminal's input, and an incomplete sequence at its end."""
    typed, rest = split_keys(text)
    named = ((one if len(one) > 1 else _PLAIN.get(one.lower())) for one in typed)
    return [cast(Key, key) for key in named if key is not None], rest


def key_and_count(line: str) -> tuple[Key, int]:
    """Parse "left 3", "enter" or an empty line, which is Enter.

    Raises:
        SetupError: it is not a key; the message lists the keys.
    """
    word, _, number = line.strip().lower().partition(" ")
    number = number.strip() or "1"
    if word not in _WORDS or not number.isdecimal() or not 0 < int(number) <= 1000:
        raise SetupError(
            f"{line!r} is no key: left, right, up, down, +, - with a number of times (left 3), "
            "enter or an empty line, skip, back, end"
        )
    return _WORDS[word], int(number)


class Keys(AbstractContextManager["Keys"], ABC):
    """Source of single keys within the block."""

    def __exit__(self, *raised: object) -> None:
        """End."""

    @abstractmethod
    def next(self, ready: bool) -> Key | None:
        """Return the next key, None without one; ``ready``: the last one has taken effect."""


class TerminalKeys(TerminalInput, Keys):
    """Keys of standard input one by one."""

    def __init__(self) -> None:
        self._ready: list[Key] = []
        self._rest = ""

    def next(self, ready: bool) -> Key | None:
        """Return the next key, None if none has been pressed; ``ready`` is ignored."""
        if not self._ready:
            text = self.text()
            if text is None:
                return "end"
            self._ready, self._rest = split_words(self._rest + text)
        return self._ready.pop(0) if self._ready else None


class LineKeys(Keys):
    """Keys from lines of a file or a pipe, each after the eyes have finished the previous one."""

    def __init__(self, lines: Lines) -> None:
        self._lines = lines
        self._ready: list[Key] = []

    def next(self, ready: bool) -> Key | None:
        """Return the next key if the eyes are ready for it.

        Raises:
            SetupError: a line is not a key, or no lines remain.
        """
        if self._ready:
            return self._ready.pop(0)
        if not ready:
            return None
        try:
            line = self._lines.next(0.0)
        except EOFError:
            raise SetupError(
                "no key left: after the last part comes its Enter (an empty line) or end"
            ) from None
        if line is None:
            return None
        key, times = key_and_count(line)
        self._ready = [key] * times
        return self._ready.pop(0)
