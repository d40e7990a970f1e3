"""The folder of an emulator's terminals, held by a lock that the kernel drops when its owner dies.

A process that is killed leaves its folder behind; the next one to start sweeps what nobody holds.
A process's number alone could mislead: it may be another's by now, or of another container.
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
    """A new folder of this user's own, removed by ``remove`` or by a later start.

    Args:
        parent: in which it is made; None: where temporary files are.
    """

    def __init__(self, parent: Path | None = None) -> None:
        parent = parent or Path(tempfile.gettempdir())
        sweep(parent)
        self.path = Path(tempfile.mkdtemp(prefix=PREFIX, dir=parent))
        # Not inherited: the server's process must not keep it held.
        self._held = os.open(self.path / _HELD, os.O_CREAT | os.O_RDWR | os.O_CLOEXEC, 0o600)
        fcntl.flock(self._held, fcntl.LOCK_EX | fcntl.LOCK_NB)

    def remove(self) -> None:
        """Remove it with all that is in it; safe to call twice."""
        if self._held >= 0:
            shutil.rmtree(self.path, ignore_errors=True)
            os.close(self._held)
            self._held = -1


def sweep(parent: Path) -> None:
    """Remove the folders of this user's that were left behind by processes which have ended.

    Args:
        parent: in which they are.
    """
    for path in parent.glob(f"{PREFIX}*"):
        with contextlib.suppress(OSError):  # somebody else may sweep it, too
            _sweep_one(path)


def _sweep_one(path: Path) -> None:
    """Remove a folder if nobody holds it.

    Raises:
        OSError: it is held, not a folder of ours, or gone.
    """
    if path.is_symlink() or path.stat().st_uid != os.getuid():
        return
    # Without the file somebody is just making the folder, or it is not one of ours.
    held = os.open(path / _HELD, os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW)
    try:
        fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        shutil.rmtree(path, ignore_errors=True)
    finally:
        os.close(held)
