"""A camera's frames are the same after recording, whatever happens to the writer."""

import threading
import time
from pathlib import Path

import numpy as np
import pytest
from present import present

from gazerig.drivers.camera import recording_format as fmt
from gazerig.drivers.camera.capture_loop import CameraParts, CaptureLoop
from gazerig.drivers.camera.params import CameraRecovery
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.camera.playback import CameraReplay
from gazerig.drivers.camera.recorder import RecordingWriter
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.errors import CameraError, SetupError
from gazerig.robot.run.options import RunOptions

GO_ON = threading.Event()
LENS = Intrinsics(310.5, 311.25, 31.5, 23.5, (0.1, -0.2, 0.001, -0.002, 0.3))
# Uneven, as real pictures are; far from 0, as a monotonic clock is.
TIMES_S = tuple(5000.0 + t for t in (0.0, 0.0333, 0.0671, 0.1, 0.2004, 0.2335))


def shot(k: int, whole: bool = True) -> Shot:
    """Return picture k (from 0) of noise, with all that can belong to it."""
    rng = np.random.default_rng(k)
    picture = rng.integers(0, 256, (48, 64, 3), np.uint8)
    if not whole:
        return Shot(TIMES_S[k], k + 1, picture)
    mm = rng.integers(0, 65536, (48, 64)).astype(np.float32)
    depth = np.where(mm == 0, np.float32(np.nan), mm / np.float32(1000.0)).astype(np.float32)
    depth[:5] = np.nan
    return Shot(TIMES_S[k], k + 1, picture, depth, LENS)


def write(path: Path, shots) -> Path:
    writer = RecordingWriter(path)
    for each in shots:
        writer.write(each)
    writer.close()
    return path


@pytest.fixture
def file(tmp_path):
    return write(tmp_path / "seen.mcap", map(shot, range(len(TIMES_S))))


def assert_same(found: Shot, wanted: Shot) -> None:
    assert np.array_equal(found.image, wanted.image)
    assert np.array_equal(present(found.depth_m), present(wanted.depth_m), equal_nan=True)
    assert present(found.depth_m).dtype == np.float32
    assert found.lens == wanted.lens


def frames_of(path: Path) -> list[Shot]:
    """Return the frames of a recording with their times since the first."""
    return [
        frame.read()._replace(captured_s=frame.start_s) for frame in CameraReplay(path).play_once()
    ]


def test_pictures_depth_lens_and_times_come_out_exactly(file):
    found = frames_of(file)
    assert [one.captured_s for one in found] == pytest.approx(
        [t - TIMES_S[0] for t in TIMES_S], abs=1e-9
    )
    for k, one in enumerate(found):
        assert_same(one, shot(k))
        assert not one.image.flags.writeable


@pytest.mark.parametrize("share", [0.999, 0.9, 0.5, 0.3])
def test_cut_file_gives_its_whole_pictures(file, share):
    data = file.read_bytes()
    file.write_bytes(data[: int(len(data) * share)])
    replay = CameraReplay(file)
    count = len(list(replay.play_once()))
    assert count >= int(len(TIMES_S) * share) - 1
    if share < 0.95:
        assert replay.events() == ("seen.mcap was not closed: its complete frames are played",)
    for k, one in enumerate(frames_of(file)):
        assert_same(one, shot(k))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda p: None, "no recording at"),
        (lambda p: p.write_text("hello world, this is text"), "is not a recording"),
        (lambda p: write(p, []), "contains no readable frame"),
    ],
)
def test_what_is_no_recording_is_named(tmp_path, make, words):
    path = tmp_path / "x.mcap"
    make(path)
    with pytest.raises(CameraError, match=words):
        CameraReplay(path).open()


def test_a_frame_needs_a_picture_and_nothing_else():
    messages = dict(fmt.encode_shot(shot(0)._replace(depth_m=None, lens=None)))
    found = fmt.decode_shot(messages)
    assert (found.depth_m, found.lens, [*messages]) == (None, None, [fmt.PICTURE])
    with pytest.raises(ValueError, match="no 16-bit depth image"):
        fmt.decode_shot({fmt.DEPTH: messages[fmt.PICTURE], **messages})


def test_replay_counts_on_and_repeats(file):
    replay = CameraReplay(file)
    replay.open()
    n = len(TIMES_S)
    for number in range(1, 2 * n + 3):
        found = replay.next_shot()
        assert found.number == number
        assert_same(found, shot((number - 1) % n))
        showing, index = divmod(number - 1, n)
        due_s = showing * (TIMES_S[-1] - TIMES_S[0] + 0.0331) + TIMES_S[index] - TIMES_S[0]
        assert found.captured_s == pytest.approx(due_s, abs=1e-6)
    assert replay.events() == ()


class Source:
    """A source that delivers the test frames one after another and is then lost."""

    def __init__(self, count: int = len(TIMES_S)) -> None:
        self.left = list(range(count))
        self.is_open = False

    def open(self) -> None:
        self.is_open = True

    def take(self, now_s, stop) -> Shot | None:
        if not self.left:
            raise CameraError("unplugged")
        return shot(self.left.pop(0))

    def events(self) -> tuple[str, ...]:
        return ("something of the source",)

    def close(self) -> None:
        self.is_open = False


class _Nobody:
    def find(self, image):
        return ()


def looked(source: Source, path: Path, events: list[str] | None = None) -> CaptureLoop:
    """Return an open loop that records the frames of a source."""
    parts = CameraParts(lambda: source, _Nobody, record=path)
    report = (events if events is not None else []).append
    loop = CaptureLoop(parts, time.monotonic, CameraRecovery(give_up_s=0.0), report)
    loop.open()
    return loop


def test_a_run_records_the_frames_of_its_camera_and_never_over_a_file(tmp_path):
    events: list[str] = []
    for path in (tmp_path / "r.mcap", tmp_path / "r-2.mcap"):
        loop = looked(Source(), tmp_path / "r.mcap", events)
        for _ in TIMES_S:
            loop.next_detections(GO_ON)
        with pytest.raises(CameraError, match="unplugged"):
            loop.next_detections(GO_ON)
        loop.close()
        for k, found in enumerate(frames_of(path)):
            assert_same(found, shot(k))
        replay = CameraReplay(path)
        assert len([*replay.play_once()]) == len(TIMES_S)
        assert replay.events() == ()  # it was closed
    assert set(events) == {"something of the source"}
    with pytest.raises(SetupError, match="--oak or --camera"):
        RunOptions(mock=True, record_camera=tmp_path / "x.mcap").check_and_complete()
