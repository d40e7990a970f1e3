"""Cost of a camera for the control loop: python tests/bench/bench_camera.py [FILM]

A 200 Hz loop with absolute deadlines runs during an uninterrupted search for faces and motion, in
turns: alone, with a camera thread, with a camera process (as shipped: one processor is left to
the loop), and with one whose OpenCV may use all; lateness of the loop, and what the search got
through. Then what a recording costs for each picture. Compare figures of one run with each other.
"""

import argparse
import gc
import os
import tempfile
import threading
import time
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
from all_processors import on_all_processors

from gazerig.drivers.camera.playback import Recording
from gazerig.drivers.camera.process import CameraProcess
from gazerig.drivers.camera.recorder import CameraRecorder
from gazerig.drivers.camera.recording_format import encode_shot
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.camera.thread import CameraThread
from gazerig.drivers.camera.video_file import VideoFile
from gazerig.drivers.camera.worker import CameraParts
from gazerig.drivers.vision.face.detector import face_detector
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.drivers.vision.motion.params import MotionParams
from gazerig.robot.perception.motion_source import motion_finder

RATE_HZ, ROUNDS, SECONDS = 200.0, 12, 1.0
STOP = threading.Event()
WORK = 6000  # turns of a Python loop, about what a tick costs


def main() -> None:
    """Run all parts and print their figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    shared = Path(__file__).resolve().parents[3] / "shared" / "media" / "Megamind.avi"
    parser.add_argument("film", nargs="?", type=Path, default=shared)
    film = parser.parse_args().film
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.2f} at the start\n")
    pictures = first_pictures(film, 60)
    with tempfile.TemporaryDirectory() as folder:
        jitter(flat_out(pictures, Path(folder) / "fast.avi"))
        recording(pictures, Path(folder))


def first_pictures(film: Path, count: int) -> list[np.ndarray]:
    """Read pictures of a film."""
    capture = cv2.VideoCapture(str(film))
    return [capture.read()[1] for _ in range(count)]


def flat_out(pictures: list[np.ndarray], path: Path) -> Path:
    """Write them as a film so fast that the detector never waits."""
    height, width = pictures[0].shape[:2]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 100.0, (width, height))
    for picture in pictures:
        writer.write(picture)
    writer.release()
    return path


def lateness_ms(seconds: float) -> np.ndarray:
    """Run the loop, and give how late each tick began."""
    late, start, tick = [], time.monotonic(), 0
    while tick < seconds * RATE_HZ:
        tick += 1
        due = start + tick / RATE_HZ
        time.sleep(max(0.0, due - time.monotonic()))
        late.append(time.monotonic() - due)
        total = 0
        for i in range(WORK):
            total += i
    return np.array(late) * 1e3


def jitter(film: Path) -> None:
    """Measure the loop's lateness in turns."""
    params = FaceDetectorParams()
    source = partial(VideoFile, film)
    motion = partial(motion_finder, MotionParams(), None, 1.2, None)
    kinds = {
        "alone": lambda: None,
        "thread": lambda: CameraThread(
            source(), face_detector(params), time.monotonic, motion=motion()
        ),
        "process": lambda: CameraProcess(
            CameraParts(source, partial(face_detector, params), motion), time.monotonic
        ),
        "process, OpenCV on all": lambda: CameraProcess(
            CameraParts(source, partial(on_all_processors, params), motion), time.monotonic
        ),
    }
    late: dict[str, list[np.ndarray]] = {name: [] for name in kinds}
    seen = dict.fromkeys(kinds, 0)
    gc.collect()
    gc.freeze()
    for _ in range(ROUNDS):
        for name, make in kinds.items():
            camera = make()
            if camera is None:
                late[name].append(lateness_ms(SECONDS))
                continue
            camera.open()
            while camera.latest(0.0) is None:
                time.sleep(0.01)
            before = camera.frames
            late[name].append(lateness_ms(SECONDS))
            seen[name] += camera.frames - before
            camera.close()
    print(f"lateness of a {RATE_HZ:g} Hz loop, ms; {ROUNDS} turns of {SECONDS:g} s each")
    alone = float(np.percentile(np.concatenate(late["alone"]), 99))
    for name, rounds in late.items():
        p50, p95, p99 = np.percentile(np.concatenate(rounds), (50, 95, 99))
        each = [float(np.percentile(r, 99)) for r in rounds]
        rate = seen[name] / (ROUNDS * SECONDS)
        print(
            f"  {name:22} p50 {p50:6.2f}  p95 {p95:6.2f}  p99 {p99:6.2f} ({p99 - alone:+6.2f})   "
            f"p99 of the turns: best {min(each):5.2f} median {np.median(each):5.2f}   "
            f"{rate:5.1f} pictures/s"
        )


def recording(pictures: list[np.ndarray], folder: Path) -> None:
    """Measure what a recording costs for each picture at 640x400 with depth."""
    shots = []
    rng = np.random.default_rng(0)
    for k, picture in enumerate(pictures):
        colour = cv2.resize(picture, (640, 400))
        smooth = cv2.resize(rng.uniform(0.5, 4.0, (10, 16)).astype(np.float32), (640, 400))
        depth = (np.round(smooth * 1e3) / 1e3).astype(np.float32)
        shots.append(Shot(k / 30.0, k + 1, colour.astype(np.uint8), depth))
    print("\nrecording 640x400 with depth, per picture")
    for name, quality in (("png", None), ("jpeg 90", 90)):
        path = folder / f"{name}.mcap"
        feed = iter(shots)
        source = SimpleNamespace(
            open=lambda: None, close=lambda: None, take=lambda now_s, stop, feed=feed: next(feed)
        )
        recorder = CameraRecorder(source, path, {}, quality)
        recorder.open()
        began = time.process_time()
        for k in range(len(shots)):
            recorder.take(time.monotonic, STOP)
            while recorder.written_frames < k - 20:
                time.sleep(0.001)
        recorder.finish()
        write_ms = (time.process_time() - began) / len(shots) * 1e3
        began = time.perf_counter()
        read = Recording(path)
        open_ms = (time.perf_counter() - began) * 1e3
        began = time.perf_counter()
        for k in range(len(shots)):
            read.shot(k)
        read_ms = (time.perf_counter() - began) / len(shots) * 1e3
        bare = time.perf_counter()
        for shot in shots:
            cv2.imencode(".png" if quality is None else ".jpg", shot.image)
        bare_ms = (time.perf_counter() - bare) / len(shots) * 1e3
        size = sum(len(data) for _, data in encode_shot(shots[-1], quality)) / 1e3
        print(
            f"  {name:8} write {write_ms:5.1f} ms of processor  read {read_ms:5.1f} ms  "
            f"open {open_ms:4.1f} ms for {len(shots)}  {size:6.0f} kB   "
            f"(plain cv2.imencode of the colour: {bare_ms:.1f} ms)"
        )


if __name__ == "__main__":
    main()
