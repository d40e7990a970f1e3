"""Watch of files that users edit: reports new content once it is complete.

Editors overwrite a file, write it in two steps, rename a new file over it, or delete it for a
moment. New content therefore counts when two checks in a row found the same, and a missing file
when it is missing for several checks.
"""

import hashlib
import threading
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import NamedTuple

from gazerig.drivers.files.file_input import read_limited

EVERY_S = 0.5
_LARGEST = 10_000_000  # bytes; no rig is as large, so more counts as missing
_SAME_LOOKS = 1
"""Checks that must find the same as the one before."""
_SAME_LOOKS_CUT = 5
"""The same for a text without a final line end: the rest is probably not written yet."""
_MISSING_LOOKS = 6
"""Checks in a row with a missing or empty file before it counts as missing."""


class FileState(NamedTuple):
    """State of a file at one check.

    Attributes:
        mtime_ns: Time of the last change, ns.
        size: Size, bytes.
        digest: SHA-256 of its bytes.
        whole: Whether its last line has an end.
    """

    mtime_ns: int
    size: int
    digest: bytes
    whole: bool


def look(path: Path) -> FileState | None:
    """Return the state of a file; None if it cannot be read: absent, empty or not permitted."""
    try:
        stat, data = path.stat(), read_limited(path, _LARGEST)
    except OSError:
        return None
    if not data:
        return None
    return FileState(
        stat.st_mtime_ns, len(data), hashlib.sha256(data).digest(), data.endswith(b"\n")
    )


class Debouncer:
    """Detects when a file has new content that no longer changes."""

    def __init__(self, first: FileState | None) -> None:
        self.known(first)

    def known(self, now: FileState | None) -> None:
        """Treat the present content of the file as read."""
        self._known = now.digest if now is not None else b""
        self._last = now
        self._same = 0
        self._missing = 0

    def update(self, now: FileState | None) -> bool:
        """Add a state of the file; return whether the file, new or missing, should be read."""
        self._same = self._same + 1 if now == self._last else 0
        self._last = now
        if now is None:
            self._missing += 1
            gone = self._missing == _MISSING_LOOKS
            # A file that appears again is read, whatever it contains.
            self._known = b"" if gone else self._known
            return gone
        self._missing = 0
        enough = _SAME_LOOKS if now.whole else _SAME_LOOKS_CUT
        if self._same < enough or now.digest == self._known:
            return False
        self._known = now.digest
        return True


class FileWatch:
    """Thread that checks some files periodically.

    Args:
        files: Returns the files in use.
        changed: Called in this thread with a path of ``files`` that should be read again, also if
            the file is missing.
        every_s: Period of the checks, s.
    """

    def __init__(
        self,
        files: Callable[[], Iterable[Path]],
        changed: Callable[[Path], None],
        every_s: float = EVERY_S,
    ) -> None:
        self._files = files
        self._changed = changed
        self._every_s = every_s
        self._lock = threading.Lock()
        self._watched: dict[Path, Debouncer] = {}
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="file watch", daemon=True)

    def start(self) -> None:
        """Start watching; the present content of the files counts as read."""
        self.look()
        self._thread.start()

    def stop(self) -> None:
        """Stop watching."""
        self._over.set()
        if self._thread.is_alive():
            self._thread.join(timeout=2.0)

    def saved(self, path: Path) -> None:
        """Treat a file as known: it was written by this program; for any thread.

        A file that is not watched yet is watched from now on, so that an edit before the next check
        is noticed.
        """
        same = path.resolve()
        with self._lock:
            known = [one for one in self._watched if one.resolve() == same]
            for watched in known:
                self._watched[watched].known(look(watched))
            if not known:
                self._watched[path] = Debouncer(look(path))

    def look(self) -> None:
        """Check all files once and report those that are new or stay missing."""
        with self._lock:
            files = dict.fromkeys(self._files())
            self._watched = {
                path: self._watched.get(path) or Debouncer(look(path)) for path in files
            }
            new = [path for path, settling in self._watched.items() if settling.update(look(path))]
        # Not under the lock: the receiver may wait for a thread that saves.
        for path in new:
            self._changed(path)

    def _watch(self) -> None:
        while not self._over.wait(self._every_s):
            self.look()
