"""Tables of numbers and words as text, a row a line."""

from typing import Any


def rows(text: str) -> list[list[Any]]:
    """Return the rows; what follows # is a comment, a comma or a bar only separates."""
    table = [line.partition("#")[0].translate(_SPACES).split() for line in text.splitlines()]
    return [[_value(word) for word in row] for row in table if row]


_SPACES = str.maketrans(",|", "  ")


def _value(word: str) -> Any:
    try:
        return float(word)
    except ValueError:
        return word
