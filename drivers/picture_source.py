"""What gives pictures in real time: a camera, or a film paced by the clock."""

import threading
from collections.abc import Callable
from typing import NamedTuple, Protocol

from drivers.types import Picture


class Shot(NamedTuple):
    """One picture and when it was taken.

    captured_s: host time of the exposure (of a film: when the picture was due)
    number: counts the source's pictures from 1; skipped ones are counted too
    """

    captured_s: float
    number: int
    picture: Picture


class PictureSource(Protocol):
    """Gives pictures one after another, always the newest."""

    def open(self) -> None:
        """Open the device or file.

        Raises:
            drivers.errors.CameraError: it cannot; the message names the thing and the cure.
        """
        ...

    def take(self, now_s: Callable[[], float], stop: threading.Event) -> Shot | None:
        """Wait for a picture newer than the last one; None where ``stop`` was set meanwhile.

        Raises:
            drivers.errors.CameraError: there will be no more pictures.
        """
        ...

    def close(self) -> None:
        """Free the device or file; safe to call twice."""
        ...
