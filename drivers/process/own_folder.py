"""Temporary folders with a lock that the kernel frees if their owner dies.

What a killed process has left, such as the sound of what was said, goes with the next start. A
process id alone could mislead: another process, or one in another container, may have it by now.
"""

import contextlib
import fcntl
import os
import shutil
import tempfile
from pathlib import Path

PREFIX = "gazerig-"
_HELD = "held"


class OwnFolder:
    """A new folder of this user, deleted by ``remove``, after its block, or by a later start.

    Args:
        kind: word in its name.
        parent: folder that contains it; None: that of temporary files.
    """

    def __init__(self, kind: str, parent: Path | None = None) -> None:
        parent = parent or Path(tempfile.gettempdir())
        sweep(parent)
        held = None
        while held is None:
            self.path = Path(tempfile.mkdtemp(prefix=f"{PREFIX}{kind}-", dir=parent))
            held = _hold(self.path)
        self._held = held

    def __enter__(self) -> Path:
        """Return its path."""
        return self.path

    def __exit__(self, *raised: object) -> None:
        """Remove it."""
        self.remove()

    def remove(self) -> None:
        """Remove it and its content; safe to call twice."""
        if self._held >= 0:
            held, self._held = self._held, -1
            shutil.rmtree(self.path, ignore_errors=True)
            os.close(held)


def _hold(path: Path) -> int | None:
    """Return the locked file of a new folder; None if a sweep has removed it first."""
    # Not inherited: a server's process must not keep the lock.
    held = os.open(path / _HELD, os.O_CREAT | os.O_RDWR | os.O_CLOEXEC, 0o600)
    try:
        fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if os.path.samestat(os.fstat(held), os.stat(path / _HELD)):
            return held
    except (BlockingIOError, FileNotFoundError):
        pass
    os.close(held)
    return None


def sweep(parent: Path | None = None) -> None:
    """Remove this user's folders of processes that have ended."""
    for path in (parent or Path(tempfile.gettempdir())).glob(f"{PREFIX}*"):
        with contextlib.suppress(OSError):  # another process may remove it, too
            _sweep_one(path)


def _sweep_one(path: Path) -> None:
    """Remove a folder without an owner."""
    if path.is_symlink() or path.stat().st_uid != os.getuid():
        return
    # Without the file, its owner has just created the folder, or it belongs to another program.
    held = os.open(path / _HELD, os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW)
    try:
        fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        shutil.rmtree(path, ignore_errors=True)
    finally:
        os.close(held)
