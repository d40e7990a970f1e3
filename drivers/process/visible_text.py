"""Text of files and names on a terminal: its control characters are shown, not executed.

A name of a file, a node of a glTF or a key of a YAML may contain the escape sequences with which a
terminal is controlled. ``VisibleStream`` is the one place through which text reaches it.
"""

import re
from typing import Any, TextIO

# C0 without tab, line feed and carriage return before a line feed; DEL and C1; marks that reverse
# the direction of writing; bytes of names that are not UTF-8.
_CONTROL = re.compile(
    "[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]|\r(?!\n)"
)
# Colours, cursor, erasing: what Rich itself sends.
_OF_RICH = re.compile("(\x1b\\[[?0-9;]*[A-KSThlm]|\r)")


def visible(text: str) -> str:
    r"""Return a text whose control characters are shown as escapes: ``\x1b``."""
    return text if text.isascii() and text.isprintable() else _CONTROL.sub(_escape, text)


def _escape(found: re.Match[str]) -> str:
    code = ord(found[0])
    # JSON escapes the first ones itself; it knows no \x.
    return f"\\x{code:02x}" if code < 0x7F else f"\\u{code:04x}"


class VisibleStream:
    """A text stream that shows control characters.

    Args:
        stream: Standard output or standard error.
        for_rich: Whether the control characters of Rich are executed.

    rich_proxied_file: stream for Rich, which looks for this name and colours its text itself
    """

    def __init__(self, stream: TextIO, for_rich: bool = False) -> None:
        self._stream, self._for_rich = stream, for_rich
        self.rich_proxied_file = self if for_rich else VisibleStream(stream, True)

    def write(self, text: str) -> int:
        """Write a text; return its length."""
        parts = _OF_RICH.split(text) if self._for_rich else [text]
        self._stream.write("".join([p if k % 2 else visible(p) for k, p in enumerate(parts)]))
        return len(text)

    def writelines(self, lines: Any) -> None:
        """Write texts."""
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:
        """Return everything else of the stream."""
        return getattr(self._stream, name)
