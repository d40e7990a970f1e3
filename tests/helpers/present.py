"""Values that may be None by their type, but not in the test."""

from typing import TypeVar

T = TypeVar("T")


def present(thing: T | None) -> T:
    """Return the value; fail if it is None."""
    assert thing is not None
    return thing
