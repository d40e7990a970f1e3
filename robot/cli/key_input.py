"""Keys of a terminal as they are pressed."""

import contextlib
import os
import re
import select
import sys
import termios
import tty
from typing import Self

_ARROWS = {"A": "up", "B": "down", "C": "right", "D": "left"}
# Sequences of arrow keys in both modes of a terminal (ECMA-48 CSI, or SS3), and of other keys,
# which are ignored.
_SEQUENCE = re.compile(r"\x1b(?:\[[0-9;?]*([A-Za-z~])|O([A-Za-z]))")
_BEGUN = re.compile(r"\x1b(?:\[[0-9;?]*|O)?$")


def split_keys(text: str) -> tuple[list[str], str]:
    """Return what was typed key by key, and the rest that a sequence begins with.

    A letter is itself, an arrow key "up", "down", "left" or "right"; other keys that send
    sequences are left out.
    """
    begun = _BEGUN.search(text)
    rest = begun[0] if begun is not None else ""
    text = text[: len(text) - len(rest)]
    keys: list[str] = []
    while text:
        sequence = _SEQUENCE.match(text)
        key = text[0] if sequence is None else _ARROWS.get(sequence[1] or sequence[2])
        keys += [key] if key is not None else []
        text = text[sequence.end() if sequence is not None else 1 :]
    return keys, rest


class TerminalInput:
    """Standard input without lines and echo; Ctrl-C stays a signal, the terminal is restored."""

    def __enter__(self) -> Self:
        """Switch off lines and echo."""
        self._before = termios.tcgetattr(sys.stdin)
        tty.setcbreak(sys.stdin, termios.TCSANOW)
        return self

    def __exit__(self, *raised: object) -> None:
        """Switch them on again; keys that were not read are forgotten."""
        # Not TCSAFLUSH: a terminal that was stopped with Ctrl-S would be waited for.
        with contextlib.suppress(termios.error, OSError):  # it may be gone
            termios.tcflush(sys.stdin, termios.TCIFLUSH)
            termios.tcsetattr(sys.stdin, termios.TCSANOW, self._before)

    def text(self) -> str | None:
        """Return the typed text, "" for nothing, None if the terminal is gone."""
        if not select.select([sys.stdin.fileno()], [], [], 0.0)[0]:
            return ""
        try:
            data = os.read(sys.stdin.fileno(), 256)
        except OSError:
            data = b""
        return data.decode(errors="replace") if data else None
