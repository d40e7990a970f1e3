"""Progress bars of long tasks, on a terminal only."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.progress import (
    BarColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from gazerig.robot.cli.console import Console

Steps = Callable[[str, float], None]
"""Receives the name of the current step and the finished share, 0..1."""


@contextmanager
def progress_bar(remaining: bool = False) -> Iterator[Steps]:
    """Draw a bar for each step on a terminal; elsewhere nothing.

    Args:
        remaining: Also show the remaining time.
    """
    columns = [TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()]
    if remaining:
        columns += [TextColumn("left"), TimeRemainingColumn()]
    console = Console(stderr=True)
    with Progress(*columns, console=console, disable=not sys.stderr.isatty()) as bar:
        steps: dict[str, TaskID] = {}

        def tell(text: str, share: float) -> None:
            if text not in steps:
                steps[text] = bar.add_task(text, total=1.0)
            bar.update(steps[text], completed=share)

        yield tell
