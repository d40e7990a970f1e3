"""Move a control from the page's side."""

from typing import TypeVar

import viser

T = TypeVar("T")


def put(handle: "viser.GuiInputHandle[T]", value: T) -> None:
    """Show a value in a control, in all its browsers; its callbacks see no client then."""
    if handle.value != value:
        handle.value = value  # type: ignore[misc]  # viser's setter stands apart from its getter
