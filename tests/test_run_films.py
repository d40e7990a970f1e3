"""The command run before a photo and a film: faces in them are found and looked at."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from command_line import figures

MEDIA = Path(__file__).parents[2] / "shared" / "media"
MODELS = Path(__file__).parents[2] / "shared" / "models"
DESK = Path(__file__).parents[1] / "config" / "rigs" / "desk.yaml"


def photo(path: Path) -> Path:
    data = pytest.importorskip("skimage.data", reason="scikit-image ships the photo")
    cv2.imwrite(str(path), np.ascontiguousarray(data.astronaut()[:, :, ::-1]))
    return path


def faces_alone(file: Path, network: str = "mtcnn") -> str:
    """Write a rig at half the rate without motion detection: the tests concern faces."""
    text = DESK.read_text(encoding="utf-8")
    text = text.replace("  enabled: true  # look", "  enabled: false  # look")
    text = text.replace("rate_hz: 200.0  # Hz, 20", "rate_hz: 100.0  # Hz, 20")
    if network == "yunet":
        (model,) = MODELS.glob("*.onnx")
        text = re.sub(r"kind: mtcnn", "kind: yunet", text)
        text = re.sub(r'model_file: ""', f"model_file: {model}", text)
    file.write_text(text, encoding="utf-8")
    return str(file)


def test_a_photo_is_looked_at_and_gives_the_same_bytes_twice(tmp_path: Path) -> None:
    picture = photo(tmp_path / "photo.png")
    runs = [figures("--video", str(picture), "--seconds", "2") for _ in range(2)]
    assert runs[0]["faces_seen"] == runs[0]["pictures"] >= 17
    assert runs[0]["target_share"]["face"] > 0.8  # after a reaction time
    assert runs[0]["bus"] == runs[1]["bus"]


@pytest.mark.skipif(not MEDIA.is_dir(), reason=f"films are not at {MEDIA}")
@pytest.mark.parametrize("network", ["mtcnn", "yunet"])
def test_a_film_of_two_talking_people(network: str, tmp_path: Path) -> None:
    # The detector's own test looks all through the film; a quarter of it suffices here.
    rig = faces_alone(tmp_path / "rig.yaml", network)
    run = figures(rig, "--video", str(MEDIA / "Megamind.avi"), "--seconds", "2")
    assert run["pictures"] >= 45
    assert run["faces_seen"] >= 0.95 * run["pictures"]
    assert run["target_share"]["face"] > 0.75


def write_stills(path: Path, sizes: list[tuple[int, int]]) -> Path:
    """Write a stream of JPEG pictures of these widths and heights."""
    pictures = [np.full((height, width, 3), 90, np.uint8) for width, height in sizes]
    path.write_bytes(b"".join(cv2.imencode(".jpg", p)[1].tobytes() for p in pictures))
    return path


@pytest.mark.parametrize(
    "sizes",
    [[(1, 1)], [(640, 1)], [(1, 480)], [(64, 48)], [(64, 48)] * 5 + [(128, 96)] * 5],
    ids=["one pixel", "a row", "a column", "one picture", "another size"],
)
def test_odd_films_are_looked_at(tmp_path: Path, sizes: list[tuple[int, int]]) -> None:
    film = write_stills(tmp_path / "odd.mjpeg", sizes)
    seen = figures("--video", str(film), "--seconds", "0.5")
    assert seen["stopped_by"] == "seconds" and seen["pictures"] >= 2


def test_a_film_of_one_picture_is_not_cut_short(tmp_path: Path) -> None:
    path = tmp_path / "one.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 25.0, (64, 48))
    writer.write(np.full((48, 64, 3), 90, np.uint8))
    writer.release()
    assert figures("--video", str(path), "--seconds", "0.5")["pictures"] >= 2
