"""The command run before a photo and a film: faces in them are found and looked at."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from command_line import figures


def photo(path: Path) -> Path:
    data = pytest.importorskip("skimage.data", reason="scikit-image ships the photo")
    cv2.imwrite(str(path), np.ascontiguousarray(data.astronaut()[:, :, ::-1]))
    return path


def test_a_photo_is_looked_at_and_gives_the_same_bytes_twice(tmp_path: Path) -> None:
    picture = photo(tmp_path / "photo.png")
    runs = [figures("--video", str(picture), "--seconds", "2") for _ in range(2)]
    assert runs[0]["faces_seen"] == runs[0]["pictures"] >= 17
    assert runs[0]["target_share"]["face"] > 0.8  # after a reaction time
    assert runs[0]["bus"] == runs[1]["bus"]
