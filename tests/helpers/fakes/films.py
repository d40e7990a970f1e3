"""Films of plain pictures whose grey is the number of the picture."""

from pathlib import Path

import cv2
import numpy as np


def write_film(
    path: Path,
    length: int = 10,
    rate_hz: float = 60.0,
    size: tuple[int, int] = (64, 48),
    grey: int = 20,
    fourcc: str = "MJPG",
) -> Path:
    """Write a film whose picture k (from 0) is grey of ``grey`` times k, modulo 256."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*fourcc), rate_hz, size)
    for k in range(length):
        writer.write(np.full((size[1], size[0], 3), grey * k % 256, np.uint8))
    writer.release()
    return path
