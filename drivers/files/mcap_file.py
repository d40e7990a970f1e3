"""Opening a file that should be an MCAP recording, of a camera or of a run."""

from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

MAGIC = b"\x89MCAP0\r\n"
"""First and last bytes of every MCAP file."""


def open_mcap(path: Path, failed: Callable[[str], Exception], cure: str) -> BinaryIO:
    """Open a file that begins as MCAP files do, at the first byte after that.

    Args:
        path: of the file.
        failed: makes the error from its line.
        cure: what to do where the file is no recording.

    Raises:
        Exception: what ``failed`` made: it is absent, no file, not readable or no recording.
    """
    if not path.exists():
        raise failed(f"no recording at {path}: check the path")
    if not path.is_file():
        raise failed(f"{path} is not a file: name a recording in it")
    try:
        file = path.open("rb")
    except OSError as error:
        raise failed(f"cannot read {path} ({error.strerror}): check its rights") from error
    if file.read(len(MAGIC)) != MAGIC:
        file.close()
        raise failed(f"{path} is no recording: {cure}")
    return file
