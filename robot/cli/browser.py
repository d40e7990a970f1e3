"""Opening the live page in a browser on the user's desktop."""

import contextlib
import os
import sys
import threading
import webbrowser
from collections.abc import Mapping


def has_desktop(environ: Mapping[str, str], terminal: bool) -> bool:
    """Return whether a browser can be opened on the user's desktop.

    Args:
        environ: Environment variables.
        terminal: Whether standard output is a terminal; otherwise a program has started this one.
    """
    if not terminal or environ.get("CI"):
        return False
    if environ.get("SSH_CONNECTION") or environ.get("SSH_TTY"):
        return False  # it would open on the remote computer, which has no user
    return bool(environ.get("DISPLAY") or environ.get("WAYLAND_DISPLAY"))


def is_desktop_here() -> bool:
    """Return ``has_desktop`` for this process."""
    return has_desktop(os.environ, sys.stdout is not None and sys.stdout.isatty())


def open_page(url: str) -> None:
    """Open an address in the user's browser, without waiting; a failure has no effect."""
    threading.Thread(target=_open, args=(url,), name="browser", daemon=True).start()


def _open(url: str) -> None:
    with contextlib.suppress(webbrowser.Error, OSError):
        webbrowser.open(url)
