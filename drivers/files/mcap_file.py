"""Opening of MCAP recordings, of a camera or of a run."""

from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

MAGIC = b"\x89MCAP0\r\n"
"""First and last bytes of every MCAP file."""


def open_mcap(path: Path, failed: Callable[[str], Exception], cure: str) -> BinaryIO:
    """Open an MCAP file, at the first byte after its magic bytes.

    Args:
        path: Path of the file.
        failed: Creates the error from its message.
        cure: Remedy if the file is no recording.

    Raises:
        Exception: created by ``failed``: the file is absent, no regular file, not readable or no
            recording.
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
