"""A page process to look at, and a face for it to show."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

import numpy as np
from fakes.waiting import free_port
from page_visitor import PATIENCE_S

from gazerig.gaze.types import Face
from gazerig.robot.dashboard.feed.page_process import PageProcess, Serve

T = TypeVar("T")

# A person's face in its own frame (x out of the face, y to the owner's left, z up), in the
# order chin, left side, left eye, mouth, nose, right side, right eye, forehead.
PARTS_M = (
    (-0.015, 0.0, -0.085), (-0.045, 0.062, -0.020), (-0.022, 0.031, 0.035), (-0.010, 0.0, -0.045),
    (0.0, 0.0, 0.0), (-0.045, -0.062, -0.020), (-0.022, -0.031, 0.035), (-0.020, 0.0, 0.080),
)  # fmt: skip
BACK = ((-0.98, 0.199, 0.0), (-0.199, -0.98, 0.0), (0.0, 0.0, 1.0))
FACE = Face(
    3,
    (0.9, 0.1, 0.25),
    (0.0, 0.0, 0.0),
    BACK,
    tuple(
        (x, y, z) for x, y, z in np.array((0.9, 0.1, 0.25)) + np.array(PARTS_M) @ np.array(BACK).T
    ),
    1.0,
)
"""A face that looks back along the x axis, a little aside."""


def wait_for(ready: Callable[[], T | None], what: str) -> T:
    """Ask again and again until there is something that is neither None nor False."""
    last_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < last_s:
        found = ready()
        if found is not None and found is not False:
            return found
        time.sleep(0.02)
    raise AssertionError(f"{what} did not come within {PATIENCE_S:.0f} s")


@contextmanager
def running_page(
    port: int | None = None, serve: Serve | None = None
) -> Iterator[tuple[PageProcess, str]]:
    page = PageProcess("127.0.0.1", free_port() if port is None else port, serve)
    page.open()
    try:
        yield page, wait_for(page.url, "the page's address")
    finally:
        page.close()
