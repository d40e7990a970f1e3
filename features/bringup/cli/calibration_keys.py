"""Keys of a terminal or words of a script that control a calibration."""

from typing import cast

from gazerig.drivers.errors import SetupError
from gazerig.features.bringup.calibration.face_steering import Key
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
_WORDS: dict[str, Key] = {"": "enter", **_PLAIN} | {
    word: word for word in ("enter", "left", "right", "up", "down", "skip", "back", "end")
}


def split_words(text: str) -> tuple[list[Key], str]:
    """Return the keys in a terminal's input, and an incomplete sequence at its end."""
    typed, rest = split_keys(text)
    named = ((one if len(one) > 1 else _PLAIN.get(one.lower())) for one in typed)
    return [cast(Key, key) for key in named if key is not None], rest


def parse_keys(line: str) -> list[Key]:
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
    return [_WORDS[word]] * int(number)


class TerminalKeys(TerminalInput):
    """Keys of standard input one by one, within the block."""

    def __init__(self) -> None:
        self._ready: list[Key] = []
        self._rest = ""

    def next(self) -> Key | None:
        """Return the next key, None if none has been pressed."""
        if not self._ready:
            text = self.text()
            if text is None:
                return "end"
            self._ready, self._rest = split_words(self._rest + text)
        return self._ready.pop(0) if self._ready else None
