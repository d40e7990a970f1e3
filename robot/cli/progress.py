"""Tables, styled lines and progress bars, in which names of files cannot control the terminal."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from rich import console
from rich.progress import (
    BarColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from gazerig.drivers.process.visible_text import visible


class Console(console.Console):
    """Rich's console; control characters of its texts are shown."""

    def render_str(self, text: str, **options: Any) -> Text:
        """Convert a text of a line or of a table's cell."""
        return super().render_str(visible(text), **options)


Steps = Callable[[str, float], None]
"""Receives the name of the current step and the finished share, 0..1."""


@contextmanager
def progress_bar() -> Iterator[Steps]:
    """Draw a bar for each step on a terminal; elsewhere nothing."""
    columns = TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()
    left = TextColumn("left"), TimeRemainingColumn()
    out = Console(stderr=True)
    with Progress(*columns, *left, console=out, disable=not sys.stderr.isatty()) as bar:
        steps: dict[str, TaskID] = {}

        def tell(text: str, share: float) -> None:
            if text not in steps:
                steps[text] = bar.add_task(text, total=1.0)
            bar.update(steps[text], completed=share)

        yield tell
