"""A camera's frames are the same after recording, whatever happens to the writer."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from present import present
from stand_in import StandIn

from gazerig.drivers.camera import recorder as recording_write
from gazerig.drivers.camera import recording_format as fmt
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.camera.playback import CameraReplay, Recording
from gazerig.drivers.camera.recorder import CameraRecorder, RecordingWriter
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.errors import CameraError, SetupError
from gazerig.drivers.types import CameraTurn, DetectedFace

GO_ON = threading.Event()
LENS = Intrinsics(310.5, 311.25, 31.5, 23.5)
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
    landmarks = rng.uniform(0.0, 48.0, (5, 2))
    faces = (DetectedFace((1.25, 2.5, 30.0, 40.0), landmarks, 0.875),) if k % 2 else ()
    turn = CameraTurn(1 + k // 2, ((0.8, -0.6, 0.0), (0.6, 0.8, 0.0), (0.0, 0.0, 1.0)))
    return Shot(TIMES_S[k], k + 1, picture, depth, LENS, faces, turn)


def write(path: Path, shots, **how) -> Path:
    writer = RecordingWriter(path, {"source": "test"}, **how)
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
    assert found.turn == wanted.turn
    assert len(present(found.faces)) == len(present(wanted.faces))
    for face, other in zip(present(found.faces), present(wanted.faces), strict=True):
        assert (face.box_px, face.confidence) == (other.box_px, other.confidence)
        assert np.array_equal(face.landmarks_px, other.landmarks_px)


def test_pictures_depth_lens_faces_and_times_come_out_exactly(file):
    recording = Recording(file)
    assert recording.note == ""
    assert recording.times_s == pytest.approx([t - TIMES_S[0] for t in TIMES_S], abs=1e-9)
    for k in range(len(TIMES_S)):
        assert_same(recording.shot(k), shot(k))
        assert not recording.shot(k).image.flags.writeable
    recording.close()


def test_standard_tools_read_the_file(file):
    with file.open("rb") as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        assert present(present(summary).statistics).message_count == 5 * len(TIMES_S)
        names = {schema.name for schema in present(summary).schemas.values()}
        assert {"foxglove.CompressedImage", "foxglove.CameraCalibration"} <= names
        assert [m.metadata["source"] for m in reader.iter_metadata()] == ["test"]
        _, _, message = next(iter(reader.iter_messages(topics=[fmt.PICTURE])))
        assert message.log_time == round(TIMES_S[0] * 1e9)
        _, _, message = next(iter(reader.iter_messages(topics=[fmt.LENS])))
        lens = json.loads(message.data)
        assert (lens["width"], lens["height"]) == (64, 48)
        assert lens["K"] == [310.5, 0.0, 31.5, 0.0, 311.25, 23.5, 0.0, 0.0, 1.0]


def test_what_the_camera_does_not_give_is_not_there(tmp_path):
    recording = Recording(write(tmp_path / "plain.mcap", [shot(0, whole=False)]))
    found = recording.shot(0)
    assert (found.depth_m, found.lens, found.faces, found.turn) == (None, None, None, None)


def test_jpeg_is_smaller_and_nearly_the_same(tmp_path):
    smooth = np.tile(np.linspace(0, 255, 640).astype(np.uint8)[None, :, None], (400, 1, 3))
    smooth = smooth + np.random.default_rng(0).integers(0, 3, smooth.shape).astype(np.uint8)
    shots = [Shot(1.0, 1, smooth)]
    exact = write(tmp_path / "a.mcap", shots)
    small = write(tmp_path / "b.mcap", shots, jpeg_quality=90)
    assert small.stat().st_size < 0.3 * exact.stat().st_size
    difference = Recording(small).shot(0).image.astype(int) - smooth
    assert np.abs(difference).mean() < 2.0
    smallest = write(tmp_path / "c.mcap", shots, jpeg_quality=20)
    assert smallest.stat().st_size < 0.5 * small.stat().st_size


def test_existing_file_is_kept_unless_told_otherwise(file):
    before = file.read_bytes()
    with pytest.raises(SetupError, match="already exists"):
        RecordingWriter(file, {})
    assert file.read_bytes() == before
    write(file, [shot(0)], over=True)
    assert len(Recording(file).times_s) == 1


def test_file_that_cannot_be_made_is_named(tmp_path):
    with pytest.raises(CameraError, match=r"cannot write .*nowhere.*No such file"):
        RecordingWriter(tmp_path / "nowhere" / "x.mcap", {})


def test_depth_whose_picture_is_missing_belongs_to_no_other(tmp_path):
    path = tmp_path / "r.mcap"
    writer = RecordingWriter(path, {})
    parts = [fmt.encode_shot(shot(k), None) for k in range(3)]
    writer.add(TIMES_S[0], 1, parts[0][:-1])  # all but the picture
    writer.add(TIMES_S[1], 2, parts[1][-1:])  # the picture alone
    writer.add(TIMES_S[2], 3, parts[2])
    writer.close()
    recording = Recording(path)
    assert len(recording.times_s) == 2
    found = recording.shot(0)
    assert np.array_equal(found.image, shot(1).image)
    assert (found.depth_m, found.lens, found.faces, found.turn) == (None, None, None, None)
    assert_same(recording.shot(1), shot(2))


def test_a_frame_that_is_no_later_than_the_one_before_is_left_out(tmp_path):
    """A clock that was set back: frames are played by their times, which rise."""
    shots = [
        shot(k)._replace(captured_s=5000.0 + t) for k, t in enumerate((0.0, 0.2, 0.1, 0.2, 0.3))
    ]
    recording = Recording(write(tmp_path / "back.mcap", shots))
    assert recording.times_s == pytest.approx([0.0, 0.2, 0.3])
    for index, k in enumerate((0, 1, 4)):
        assert np.array_equal(recording.shot(index).image, shots[k].image)


def test_frames_are_put_on_the_disk_every_second(tmp_path, monkeypatch):
    written, synced = [0], list[int]()
    monkeypatch.setattr(os, "fsync", lambda fd: synced.append(written[0]))
    writer = RecordingWriter(tmp_path / "r.mcap", {})
    for k in range(95):
        written[0] = k + 1
        writer.write(Shot(5000.0 + k / 30.0, k + 1, np.zeros((4, 4, 3), np.uint8)))
    writer.close()
    assert np.diff([0, *synced, 95]).max() <= 31


@pytest.mark.parametrize("share", [0.999, 0.9, 0.5, 0.3])
def test_cut_file_gives_its_whole_pictures(file, share):
    data = file.read_bytes()
    file.write_bytes(data[: int(len(data) * share)])
    recording = Recording(file)
    count = len(recording.times_s)
    assert count >= int(len(TIMES_S) * share) - 1
    if share < 0.95:
        assert f"was not closed: its {count} complete frames" in recording.note
    for k in range(count):
        assert_same(recording.shot(k), shot(k))


def test_file_cut_anywhere_never_fails_but_with_a_clear_error(tmp_path):
    data = write(tmp_path / "a.mcap", [shot(0, whole=False), shot(1, whole=False)]).read_bytes()
    cut = tmp_path / "cut.mcap"
    counts = set()
    for end in range(0, len(data), 97):
        cut.write_bytes(data[:end])
        try:
            recording = Recording(cut)
        except CameraError:
            counts.add(0)
            continue
        counts.add(len(recording.times_s))
        recording.close()
    assert counts == {0, 1, 2}


def test_damage_inside_a_picture_is_named(file):
    data = bytearray(file.read_bytes())
    where = data.rindex(b'"data":"') + 40
    data[where : where + 400] = b"!" * 400
    file.write_bytes(bytes(data))
    recording = Recording(file)
    with pytest.raises(CameraError, match=r"frame 6 of .* is damaged .*copy the file again"):
        recording.shot(5)
    assert_same(recording.shot(4), shot(4))


def test_damaged_lengths_are_named(file):
    data = bytearray(file.read_bytes())
    data[9:17] = b"\xff" * 8
    file.write_bytes(bytes(data))
    with pytest.raises(CameraError, match="damaged after byte 8"):
        Recording(file)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda p: None, "no recording at"),
        (lambda p: p.mkdir(), "is not a file"),
        (lambda p: p.touch(), "is not a recording"),
        (lambda p: p.write_text("short"), "is not a recording"),
        (lambda p: p.write_text("hello world, this is text"), "is not a recording"),
        (lambda p: write(p, []), "contains no frame"),
    ],
)
def test_what_is_no_recording_is_named(tmp_path, make, words):
    path = tmp_path / "x.mcap"
    make(path)
    with pytest.raises(CameraError, match=words) as caught:
        CameraReplay(path).open()
    assert "\n" not in str(caught.value)


def test_recordings_of_other_programs_are_named(tmp_path):
    for chunks in (True, False):
        path = tmp_path / f"other{chunks}.mcap"
        with path.open("wb") as stream:
            writer = recording_write.Writer(stream, use_chunking=chunks)
            writer.start(profile="ros2" if not chunks else fmt.PROFILE)
            channel = writer.register_channel("/x", "json", writer.register_schema("x", "y", b""))
            writer.add_message(channel, 1, b"{}", 1)
            writer.finish()
        with pytest.raises(CameraError, match="chunks" if chunks else "profile is 'ros2'"):
            Recording(path)


def test_replay_counts_on_and_repeats(file):
    replay = CameraReplay(file)
    replay.open()
    n = len(TIMES_S)
    step = replay.length_s - (TIMES_S[-1] - TIMES_S[0])
    assert step == pytest.approx(0.0334, abs=0.001)
    for number in (1, 4, n, n + 1, 2 * n + 3):
        found = replay.shot(number)
        assert found.number == number
        assert_same(found, shot((number - 1) % n))
        showing, index = divmod(number - 1, n)
        due_s = showing * replay.length_s + TIMES_S[index] - TIMES_S[0]
        assert found.captured_s == pytest.approx(due_s, abs=1e-6)
    assert replay.events() == ()
    replay.close()
    with pytest.raises(CameraError, match="not open"):
        replay.shot(1)


class Clock(StandIn):
    """A clock that advances with each wait; ``late_s`` is added to every wait."""

    def __init__(self) -> None:
        self.now_s = 70.0
        self.late_s = 0.0
        self.stopped = False

    def __call__(self) -> float:
        return self.now_s

    def wait(self, seconds: float) -> bool:
        self.now_s += seconds + self.late_s
        return self.stopped


def test_replay_in_real_time_has_the_times_of_the_recording(file):
    replay, clock = CameraReplay(file), Clock()
    replay.open()
    found = [replay.take(clock, clock) for _ in TIMES_S]
    assert [present(f).number for f in found] == list(range(1, len(TIMES_S) + 1))
    assert [present(f).captured_s - 70.0 for f in found] == pytest.approx(
        [t - TIMES_S[0] for t in TIMES_S], abs=1e-6
    )
    clock.late_s = 0.07
    assert (
        present(replay.take(clock, clock)).number > len(TIMES_S) + 1
    )  # late: pictures are skipped
    clock.stopped = True
    assert replay.take(clock, clock) is None


def test_a_picture_taken_late_does_not_delay_those_that_follow(file):
    replay, clock = CameraReplay(file), Clock()
    replay.open()
    due_s = [70.0 + t - TIMES_S[0] for t in TIMES_S]
    present(replay.take(clock, clock))
    clock.now_s = due_s[2] + 0.01  # no one has looked meanwhile
    late = present(replay.take(clock, clock))
    assert late.number == 3 and late.captured_s == pytest.approx(due_s[2], abs=1e-6)
    for number in (4, 5, 6):
        following = present(replay.take(clock, clock))
        assert following.number == number
        assert following.captured_s == pytest.approx(due_s[number - 1], abs=1e-6)
        assert clock.now_s == pytest.approx(due_s[number - 1], abs=1e-6)


def test_recording_of_one_picture_can_be_played(tmp_path):
    replay = CameraReplay(write(tmp_path / "one.mcap", [shot(0)]))
    replay.open()
    assert replay.shot(3).captured_s == pytest.approx(2 * replay.length_s)


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


def test_recorder_hands_pictures_through_and_into_the_file(tmp_path):
    source = Source()
    recorder = CameraRecorder(source, tmp_path / "r.mcap", {"source": "test"})
    recorder.open()
    seen = [recorder.take(time.monotonic, GO_ON) for _ in range(4)]
    # The camera is lost and comes back; the file goes on.
    recorder.close()
    assert not source.is_open
    recorder.open()
    seen += [recorder.take(time.monotonic, GO_ON) for _ in range(2)]
    with pytest.raises(CameraError, match="unplugged"):
        recorder.take(time.monotonic, GO_ON)
    recorder.close()
    recorder.finish()
    recorder.finish()
    recording = Recording(tmp_path / "r.mcap")
    assert recording.note == "" and len(recording.times_s) == recorder.written_frames == 6
    for k, one in enumerate(seen):
        assert_same(present(one), shot(k))
        assert_same(recording.shot(k), present(one))
    assert recorder.events() == ("something of the source",)
    assert (recorder.failure, recorder.dropped_frames) == ("", 0)


def test_recorder_that_cannot_write_its_file_frees_the_source(tmp_path):
    source = Source()
    with pytest.raises(CameraError, match="cannot write"):
        CameraRecorder(source, tmp_path / "no" / "r.mcap").open()
    assert not source.is_open


def test_full_disk_ends_the_recording_and_not_the_camera(tmp_path, monkeypatch):
    def full(self, captured_s, number, messages) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(RecordingWriter, "add", full)
    recorder = CameraRecorder(Source(), tmp_path / "r.mcap")
    recorder.open()
    seen = [recorder.take(time.monotonic, GO_ON) for _ in range(6)]
    recorder.finish()
    assert all(one is not None for one in seen)
    assert "No space left on device" in recorder.failure
    assert recorder.failure in recorder.events()


def test_slow_disk_leaves_pictures_out_and_says_so(tmp_path, monkeypatch):
    go = threading.Event()
    monkeypatch.setattr(RecordingWriter, "add", lambda *given: go.wait(20.0))
    source = Source()
    source.left = [0] * 60
    recorder = CameraRecorder(source, tmp_path / "r.mcap")
    recorder.open()
    for _ in range(60):
        assert recorder.take(time.monotonic, GO_ON) is not None
    go.set()
    recorder.finish()
    assert 25 <= recorder.dropped_frames <= 30
    (reported,) = [line for line in recorder.events() if "is slower than the camera" in line]
    assert "--jpeg" in reported


def test_killed_program_leaves_what_it_wrote(tmp_path):
    path = tmp_path / "killed.mcap"
    code = (
        "import sys, threading, time, numpy as np\n"
        "from pathlib import Path\n"
        "from gazerig.drivers.camera.source import Shot\n"
        "from gazerig.drivers.camera.recorder import RecordingWriter\n"
        "writer = RecordingWriter(Path(sys.argv[1]), {})\n"
        "for k in range(1000):\n"
        "    writer.write(Shot(1.0 + k / 30, k + 1, np.full((48, 64, 3), k % 256, np.uint8)))\n"
        "    print(k, flush=True)\n"
        "    time.sleep(0.005)\n"
    )
    child = subprocess.Popen(
        [sys.executable, "-c", code, str(path)], stdout=subprocess.PIPE, text=True
    )
    assert child.stdout is not None
    while (line := child.stdout.readline()) and int(line) < 10:
        pass
    os.kill(child.pid, signal.SIGKILL)
    last = [int(line), *map(int, child.stdout.read().split())][-1]
    child.wait()
    recording = Recording(path)
    assert len(recording.times_s) >= last + 1  # every picture that was written is there
    assert int(recording.shot(last).image[0, 0, 0]) == last
    assert "was not closed" in recording.note


def test_flipped_bits_in_what_the_file_says_of_itself_are_one_clear_line(file):
    data = file.read_bytes()
    for bit in range(8 * 8, 8 * 300, 5):
        hurt = bytearray(data)
        hurt[bit // 8] ^= 1 << bit % 8
        file.write_bytes(hurt)
        with contextlib.suppress(CameraError):
            Recording(file).close()
