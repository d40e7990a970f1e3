"""Single key presses in a terminal."""

import contextlib
import os
import re
import select
import sys
import termios
import tty
from typing import Self

_ARROWS = {"A": "up", "B": "down", "C": "right", "D": "left"}
# Arrow keys in both modes of a terminal (ECMA-48 CSI, or SS3), other keys that send sequences, and
# single characters.
_KEY = re.compile(r"\x1b(?:\[[0-9;?]*|O)(?P<code>[A-Za-z~])|(?P<typed>.)", re.DOTALL)
_BEGUN = re.compile(r"\x1b(?:\[[0-9;?]*|O)?$")


def split_keys(text: str) -> tuple[list[str], str]:
    """Return the typed keys one by one, and the start of an incomplete sequence.

    A letter is returned unchanged, an arrow key as "up", "down", "left" or "right". Other keys that
    send sequences are omitted.
    """
    begun = _BEGUN.search(text)
    end = begun.start() if begun is not None else len(text)
    keys = (found["typed"] or _ARROWS.get(found["code"]) for found in _KEY.finditer(text[:end]))
    return [key for key in keys if key is not None], text[end:]


class TerminalInput:
    """Standard input without line buffering and echo; Ctrl-C remains a signal; restored on exit."""

    def __enter__(self) -> Self:
        """Switch line buffering and echo off."""
        self._before = termios.tcgetattr(sys.stdin)
        tty.setcbreak(sys.stdin, termios.TCSANOW)
        return self

    def __exit__(self, *raised: object) -> None:
        """Switch them on again; unread keys are discarded."""
        # Not TCSAFLUSH, which would wait for a terminal that was stopped with Ctrl-S.
        with contextlib.suppress(termios.error, OSError):  # it may not exist any more
            termios.tcflush(sys.stdin, termios.TCIFLUSH)
            termios.tcsetattr(sys.stdin, termios.TCSANOW, self._before)

    def text(self) -> str | None:
        """Return the typed text, "" for none, None if the terminal does not exist any more."""
        if not select.select([sys.stdin.fileno()], [], [], 0.0)[0]:
            return ""
        try:
            data = os.read(sys.stdin.fileno(), 256)
        except OSError:
            data = b""
        return data.decode(errors="replace") if data else None
