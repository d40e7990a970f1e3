"""The folder of an emulator's terminals, with a lock that the kernel frees if its owner dies.

Its owner, the process of the loop, imports this module without the emulator.
"""

import contextlib
import fcntl
import os
import shutil
import tempfile
from pathlib import Path

PREFIX = "servo-bus-"
_HELD = "held"


class ServedFolder:
    """A new folder of this user, deleted by ``remove`` or by a later start.

    Its lock is freed by the kernel if its owner is killed; the next process removes folders without
    an owner. A process id alone could mislead: another process, or one in another container, may
    have it by now.
    """

    def __init__(self, parent: Path | None = None) -> None:
        parent = parent or Path(tempfile.gettempdir())
        sweep(parent)
        self.path = Path(tempfile.mkdtemp(prefix=PREFIX, dir=parent))
        # Not inherited: the server's process must not keep the lock.
        self._held = os.open(self.path / _HELD, os.O_CREAT | os.O_RDWR | os.O_CLOEXEC, 0o600)
        fcntl.flock(self._held, fcntl.LOCK_EX | fcntl.LOCK_NB)

    def remove(self) -> None:
        """Remove it and its content; safe to call twice."""
        if self._held >= 0:
            shutil.rmtree(self.path, ignore_errors=True)
            os.close(self._held)
            self._held = -1


def sweep(parent: Path) -> None:
    """Remove this user's folders of processes that have ended."""
    for path in parent.glob(f"{PREFIX}*"):
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
