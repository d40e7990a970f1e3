"""Network files of a package, verified by their hash."""

import hashlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.errors import ModelFileError


def read_known(file: Path, sha256: str, package: str, cure: str) -> NDArray[np.uint8]:
    """Return the content of a file whose hash is known, as OpenCV reads it.

    Args:
        file: Path of the file.
        sha256: Its hash, in hexadecimal digits.
        package: Name and version of its package.
        cure: Command that installs it.

    Raises:
        ModelFileError: the file is missing or altered.
    """
    try:
        content = file.read_bytes()
    except OSError as error:
        raise ModelFileError(f"cannot read {file} ({error.strerror}): {cure}") from error
    if hashlib.sha256(content).hexdigest() != sha256:
        raise ModelFileError(f"{file} is not the file of {package}: {cure}")
    return np.frombuffer(content, dtype=np.uint8)
