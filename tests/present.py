"""What may be nothing by its type, and by the test may not."""

from typing import TypeVar

T = TypeVar("T")


def present(thing: T | None) -> T:
    """Return the thing; fail where it is None."""
    assert thing is not None
    return thing
