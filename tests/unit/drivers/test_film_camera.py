"""A film in simulated time shows each picture once, in order, after its delay."""

from collections.abc import Iterator
from functools import partial
from itertools import count

import numpy as np
import pytest
from present import present

from gazerig.drivers.camera.file_player import FilePlayer, StoredFrame
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.camera.playback import CameraReplay
from gazerig.drivers.camera.recorder import RecordingWriter
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import DetectedFace, MovingBlob
from gazerig.sim_mock.cameras.video import FilmCamera

RATE_HZ = 25.0


class Film(FilePlayer):
    """Pictures whose grey is their number, 25 a second."""

    def play_once(self) -> Iterator[StoredFrame]:
        for number in count(1):
            image = np.full((128, 128, 3), number % 256, np.uint8)
            yield StoredFrame((number - 1) / RATE_HZ, partial(Shot, 0.0, 0, image))


class EveryThird:
    """Finds a face in pictures whose grey is a multiple of three; counts its looks."""

    def __init__(self) -> None:
        self.looks = 0

    def find(self, picture):
        self.looks += 1
        grey = int(picture[0, 0, 0])
        face = DetectedFace((0.0, 0.0, 1.0, 1.0), np.full((5, 2), float(grey)), 1.0)
        return (face,) if grey % 3 == 0 else ()


@pytest.fixture
def film():
    return Film("film")


@pytest.fixture
def detector():
    return EveryThird()


@pytest.fixture
def camera(film, detector):
    made = FilmCamera(film, detector, delay_s=0.06)
    made.open()
    yield made
    made.close()


def test_picture_comes_through_after_the_delay(camera):
    assert camera.latest(0.0) is None
    assert camera.latest(0.0599) is None
    first = camera.latest(0.06)
    assert (first.number, first.captured_s) == (1, 0.0)
    assert camera.latest(0.0999) is first
    second = camera.latest(0.101)
    assert (second.number, second.captured_s) == (2, 0.04)
    assert (second.width_px, second.height_px) == (128, 128)
    assert int(second.image[0, 0, 0]) == 2


def test_jump_looks_at_every_picture_in_order(camera):
    assert camera.latest(1.07).number == 26
    assert camera.frames == 26


def test_recording_in_simulated_time_gives_depth_and_lens_and_what_moves(tmp_path):
    writer = RecordingWriter(tmp_path / "r.mcap")
    lens, blob = Intrinsics(20.0, 20.0, 8.0, 6.0), MovingBlob(1, "thing", (0.0, 0.0, 2.0), 0.1)
    for k in range(4):
        picture, depth = np.full((12, 16, 3), k, np.uint8), np.full((12, 16), 1.0 + k, np.float32)
        writer.write(Shot(500.0 + k / 10.0, k + 1, picture, depth, lens))
    writer.close()
    replay = CameraReplay(tmp_path / "r.mcap")
    camera = FilmCamera(replay, EveryThird(), 0.05, 100.0, lambda shot: (blob,))
    camera.open()
    assert camera.latest(100.04) is None
    for k in range(4):
        found = present(camera.latest(100.06 + k / 10.0))
        assert found.captured_s == pytest.approx(100.0 + k / 10.0)
        assert float(present(found.depth_m)[0, 0]) == 1.0 + k
        assert found.lens == lens and found.blobs == (blob,)
    camera.close()
