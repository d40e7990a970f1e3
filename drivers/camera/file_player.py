"""Files of frames as endless sources: a film, a still image or a recording of a camera.

Film time starts at 0 with frame 1 and continues through every repeat, as do the numbers of frames.
"""

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from gazerig.drivers.camera.source import Shot
from gazerig.drivers.errors import CameraError

_MOST_LATE_S = 1.0
"""Delay after which a film pauses instead of skipping frames: a computer that decodes it too
slowly, or was suspended, would skip forever."""
_ALONE_S = 0.1
"""Time for which the frame of a file with one frame is shown."""


class StoredFrame(NamedTuple):
    """A frame of a file, before its pixels are read.

    start_s: time at which it is due; read: returns it
    """

    start_s: float
    read: Callable[[], Shot]


class FilePlayer(ABC):
    """A source that repeats the frames of a file forever.

    Args:
        path: Path of the file; nothing is opened yet.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path).expanduser()
        self._frames: Iterator[StoredFrame] | None = None
        self._next: StoredFrame | None = None
        self._zero_s: float | None = None
        self._events: list[str] = []
        self.number = 0

    @abstractmethod
    def play_once(self) -> Iterator[StoredFrame]:
        """Open the file and return its frames, the first at 0, in ascending order of time.

        Raises:
            CameraError: it is absent, of another kind or damaged.
        """

    def open(self) -> None:
        """Open the file, or open it again at film time 0.

        Raises:
            CameraError: it is absent, of another kind, damaged, or contains no frame.
        """
        self.close()
        self.number, self._zero_s = 0, None
        self._frames = self._repeat()
        self._next = next(self._frames)

    @property
    def due_s(self) -> float:
        """Return the film time at which the next frame is due."""
        return self._upcoming().start_s

    def next_shot(self) -> Shot:
        """Return the next frame with the film time at which it is due.

        Raises:
            CameraError: the file is damaged there.
        """
        return self._read(self._pop(), 0.0)

    def take(self, now_s: Callable[[], float], stop: threading.Event) -> Shot | None:
        """Wait until the next frame is due and return the newest; film time starts here.

        Raises:
            CameraError: the file is damaged there.
        """
        due_s = self.due_s
        if self._zero_s is None:
            self._zero_s = now_s() - due_s
        if stop.wait(max(0.0, self._zero_s + due_s - now_s())):
            return None
        late_s = now_s() - self._zero_s - due_s
        if late_s > _MOST_LATE_S:
            self._zero_s += late_s
        film_s = now_s() - self._zero_s
        frame = self._pop()
        while self.due_s <= film_s:
            frame = self._pop()
        return self._read(frame, self._zero_s)

    def events(self) -> tuple[str, ...]:
        """Return problems of the file since the last call, one line each."""
        events, self._events = tuple(self._events), []
        return events

    def close(self) -> None:
        """Free the file; safe to call twice."""
        self._frames = self._next = None

    def _repeat(self) -> Iterator[StoredFrame]:
        begin_s = 0.0
        while True:
            last_s, step_s = -1.0, _ALONE_S
            for frame in self.play_once():
                if last_s >= 0.0:
                    step_s = frame.start_s - last_s
                last_s = frame.start_s
                yield frame._replace(start_s=begin_s + last_s)
            if last_s < 0.0:
                raise CameraError(f"{self.path} contains no readable frame: use another file")
            begin_s += last_s + step_s

    def _upcoming(self) -> StoredFrame:
        if self._frames is None:
            raise CameraError(f"{self.path} is not open: call open() before reading")
        if self._next is None:
            self._next = next(self._frames)
        return self._next

    def _pop(self) -> StoredFrame:
        frame, self._next = self._upcoming(), None
        self.number += 1
        return frame

    def _read(self, frame: StoredFrame, zero_s: float) -> Shot:
        return frame.read()._replace(captured_s=zero_s + frame.start_s, number=self.number)
