"""Token of a page that survives restarts, in a file that only its owner can read."""

import os
import re
import secrets
import stat
from pathlib import Path

from gazerig.drivers.errors import SetupError

_TOKEN = re.compile(r"[A-Za-z0-9_-]{22,200}")
_IN_ADDRESS = re.compile(r"/\?token=[\w-]+")
_KINDS = 8
"""Fewest different characters; 22 random hexadecimal digits have fewer in one of 10,000 files."""
_CURE = "remove it, and the next start writes a new one"


def read_token(path: Path) -> str:
    """Return the token in a file; if the file does not exist, write a new token.

    Raises:
        SetupError: other users can read or own the file, or its token is too weak.
    """
    try:
        file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        file = -1
    except OSError as error:
        raise _unusable(path, error) from None
    if file >= 0:
        token = secrets.token_urlsafe(16)
        with open(file, "w", encoding="ascii") as new:
            new.write(f"{token}\n")
        return token
    try:
        # Opening a pipe without a writer would block.
        file = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        with open(file, encoding="ascii", errors="replace") as there:
            about, text = os.fstat(file), there.read(300)
    except OSError as error:
        raise _unusable(path, error) from None
    if not stat.S_ISREG(about.st_mode):
        raise SetupError(f"--token-file {path}: not a file")
    if about.st_mode & 0o077 or about.st_uid not in (0, os.getuid()):
        raise SetupError(
            f"--token-file {path}: other users may read it, or own it: chown $USER, chmod 600"
        )
    token = text.strip()
    if not _TOKEN.fullmatch(token) or len(set(token)) < _KINDS:
        raise SetupError(
            f"--token-file {path}: a token is 22 to 200 random letters, digits, - and _: {_CURE}"
        )
    return token


def hide_token(line: str) -> str:
    """Return a message without the token of an address in it, and where the token is shown."""
    return _IN_ADDRESS.sub("/; gazerig ctl rigs shows it with its token", line)


def _unusable(path: Path, error: OSError) -> SetupError:
    return SetupError(f"--token-file {path}: {error.strerror}")
