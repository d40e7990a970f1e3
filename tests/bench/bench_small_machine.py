"""Limits of a small computer: python tests/bench/bench_small_machine.py [--seconds 20]

One core is slowed to three quarters, a half and a quarter, and runs are pinned to it. How:

    --by spinner   a process of real-time priority takes the rest of every millisecond of that core;
                   all else there, the kernel too, advances as on a slower core, but timers
                   ring up to one pause late, which they would not there (default)
    --by quota     a control group may use a share of every 10 ms at full speed
                   and then pauses, with the kernel's accuracy of some milliseconds

The loop runs as ``gazerig run --mock`` does, real time, scene visitor, profile small at several
rates; the process that emulates the servos, which are real ones on a robot, stays on the other
core, and so do browsers. With a page the page's process shares the slow core, as on a computer
that has only one. Detectors look at drawn people, the camera's whole process at photographed ones
(camera_stages.py has its stages by processor time, which needs no idle computer). Needs root, and
two cores without other work.

    fits   less than 1 % of the slots skipped and half a slot late at most in 99 of 100
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

SHARES = (1.0, 0.75, 0.5, 0.25)
GROUP = Path("/sys/fs/cgroup/cpu/gazerig-bench")
PERIOD_S, QUOTA_PERIOD_US = 0.001, 10_000
SPIN = """
import os, sys, time
core, share, period = int(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3])
os.sched_setaffinity(0, {core})
os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(50))
now, slot = time.monotonic, time.monotonic()
while os.getppid() == int(sys.argv[4]):
    end = slot + (1.0 - share) * period
    while now() < end:
        pass
    slot = max(slot + period, now())
    time.sleep(max(0.0, slot - now()))
"""
LOOPS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("200 Hz", {"rate": 200.0}),
    ("100 Hz", {"rate": 100.0}),
    ("50 Hz", {"rate": 50.0}),
    ("200 Hz, recording", {"rate": 200.0, "record": True}),
    ("100 Hz, recording", {"rate": 100.0, "record": True}),
    ("200 Hz, page, one client", {"rate": 200.0, "page": True}),
    ("100 Hz, page, one client", {"rate": 100.0, "page": True}),
)
DETECTORS = (
    ("faces, 320 px", {"faces": 320}),
    ("faces, 240 px", {"faces": 240}),
    ("motion, 320 px", {"motion": 320}),
    ("motion, 160 px", {"motion": 160}),
)
CAMERAS = (
    ("camera, 640x400", {"camera": ("", 1, False, 0)}),
    ("camera, 640x400, YuNet", {"camera": ("", 1, True, 0)}),
    ("camera, 640x400, mesh", {"camera": ("", 1, False, 1)}),
    ("camera, 640x400, no motion", {"camera": ("", 1, False, 0, False)}),
    ("camera, 320x240, small", {"camera": ("small", 1, False, 0)}),
)


@contextmanager
def slowed(core: int, share: float, by: str) -> Iterator[None]:
    """Leave this share of a core to those who are pinned to it."""
    if share == 1.0:
        yield
        return
    if by == "quota":
        GROUP.mkdir(exist_ok=True)
        (GROUP / "cpu.cfs_period_us").write_text(str(QUOTA_PERIOD_US))
        (GROUP / "cpu.cfs_quota_us").write_text(str(round(share * QUOTA_PERIOD_US)))
        try:
            yield
        finally:
            GROUP.rmdir()
        return
    words = [str(core), str(share), str(PERIOD_S), str(os.getpid())]
    spinner = subprocess.Popen([sys.executable, "-c", SPIN, *words])
    time.sleep(0.3)
    if spinner.poll() is not None:
        raise SystemExit("--by spinner needs the right to real-time priority: run it as root")
    try:
        yield
    finally:
        spinner.kill()
        spinner.wait()


def main() -> None:
    """Measure, and print tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--by", choices=("spinner", "quota"), default="spinner")
    parser.add_argument("--core", type=int, default=0)
    parser.add_argument("--shares", type=float, nargs="*", default=SHARES)
    parser.add_argument("--rig", default="desk")
    parser.add_argument("--only", nargs="*", default=(), help="lines with one of these words")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.one:
        asked = json.loads(args.one)
        measure = looping if "rate" in asked else looking if "camera" in asked else detecting
        print(json.dumps(measure(asked)))
        return
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.2f} at the start, by {args.by}")
    full = apart(args, 1.0, {"rate": 0.0})["loops"]
    for share in args.shares:
        with slowed(args.core, share, args.by):
            left = apart(args, share, {"rate": 0.0})["loops"] / full
            print(f"\n{share:.0%} of a core ({left:.0%} of its speed, measured)\n", flush=True)
            for name, asked in (*LOOPS, *DETECTORS, *CAMERAS):
                if not args.only or any(word in name for word in args.only):
                    said = apart(args, share, asked | {"rig": args.rig})
                    print(f"| {name} | {said['cell']} |", flush=True)


def apart(args: argparse.Namespace, share: float, asked: dict[str, Any]) -> dict[str, Any]:
    """Measure one thing in a process of its own, pinned to the slow core."""
    grouped = args.by == "quota" and share < 1.0
    asked = asked | {"core": args.core, "seconds": args.seconds, "group": grouped}
    words = [sys.executable, __file__, "--one", json.dumps(asked)]
    done = subprocess.run(words, stdout=subprocess.PIPE, text=True, check=True)
    said: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return said


def pin(asked: dict[str, Any]) -> None:
    """Go to the slow core, with all threads and processes that are started later."""
    os.sched_setaffinity(0, {asked["core"]})
    os.setpriority(os.PRIO_PROCESS, 0, -19)  # before whatever else runs on that core
    if asked["group"]:
        (GROUP / "cgroup.procs").write_text(str(os.getpid()))


def looping(asked: dict[str, Any]) -> dict[str, Any]:
    """Run the head at a rate and return how late ticks began; at rate 0, how fast the core is."""
    pin(asked)
    if asked["rate"] == 0.0:
        count, end = 0, time.monotonic() + 2.0
        while time.monotonic() < end:
            count += 1
            sum(range(200))
        return {"loops": count}
    from bench_page import watched

    from gazerig.robot.app import session
    from gazerig.robot.app.options import RunOptions

    with tempfile.TemporaryDirectory() as folder:
        profile = Path(folder) / "measured.yaml"
        shipped = Path(session.__file__).parents[2] / "config" / "profiles" / "small.yaml"
        text = shipped.read_text(encoding="utf-8")
        profile.write_text(text.replace("rate_hz: 100.0", f"rate_hz: {asked['rate']}"))
        more: dict[str, Any] = {"profile": str(profile), "rig": asked["rig"]}
        if asked.get("page"):
            more["page"] = "127.0.0.1:8797"
        if asked.get("record"):
            more["record"] = Path(folder) / "run.mcap"
        composed = session.compose(RunOptions(mock=True, scene="visitor", **more))
        elsewhere(os.getpid(), "gazerig.sim_mock.pty.server")
        run = session.Session(composed, lambda: None, lambda line: None, summarised=False)
        begun_s: list[float] = []
        with run.power_on() as loop:
            page: Any = run._run_observers._page
            client = None
            start_s, warm = time.monotonic(), True
            while time.monotonic() - start_s < asked["seconds"] + 5.0:
                if page is not None and client is None and (url := page.url()) is not None:
                    client = watched(url, 1)
                    os.sched_setaffinity(client.pid, others(asked["core"]))
                if (reason := loop.step()) is not None:
                    raise SystemExit(f"the run ended: {reason}")
                begun_s.append(loop._last_s)
                if warm and time.monotonic() - start_s > 5.0:
                    warm = False
                    begun_s.clear()
                    overruns, cpu_s, wall_s = loop._overruns, time.process_time(), time.monotonic()
            used = (time.process_time() - cpu_s) / (time.monotonic() - wall_s)
            skipped = (loop._overruns - overruns) / (len(begun_s) + loop._overruns - overruns)
            run.stopped_by = "seconds"
        composed.assembly.close()
        if client is not None:
            client.kill()
            client.wait()
    late_ms = lateness(np.array(begun_s), asked["rate"])
    half_slot = 0.5e3 / asked["rate"]
    verdict = "fits" if skipped < 0.01 and late_ms <= half_slot else "too much"
    return {"cell": f"{verdict}: {skipped:.1%} skipped, p99 {late_ms:.1f} ms, {used:.0%}"}


def lateness(begun_s: np.ndarray, rate_hz: float) -> float:
    """Return how late ticks began in their slots, ms, 99th percentile."""
    phase = (begun_s - begun_s[0]) * rate_hz
    off = phase - np.round(phase)
    return float(1e3 / rate_hz * np.percentile(off - np.percentile(off, 1), 99))


def elsewhere(pid: int, module: str) -> None:
    """Move child processes that run a module to the other cores, where real servos would be."""
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = file.read_text().rpartition(")")[2].split()
            words = (file.parent / "cmdline").read_bytes()
        except OSError:
            continue
        if int(fields[1]) == pid and module.encode() in words:
            os.sched_setaffinity(int(file.parent.name), others(0))
            if GROUP.exists():
                (GROUP.parent / "cgroup.procs").write_text(file.parent.name)


def others(core: int) -> set[int]:
    """Return all cores but one."""
    return set(range(os.cpu_count() or 1)) - {core} or {core}


def detecting(asked: dict[str, Any]) -> dict[str, Any]:
    """Look at drawn people and return milliseconds a picture."""
    pin(asked)
    import cv2

    cv2.setNumThreads(1)
    from gazerig.drivers.camera.pinhole import Intrinsics
    from gazerig.drivers.vision.face.detector import face_detector
    from gazerig.drivers.vision.face.params import FaceDetectorParams
    from gazerig.drivers.vision.motion.detector import MotionDetector
    from gazerig.drivers.vision.motion.params import MotionParams

    pictures = drawn(40)
    height, width = pictures[0].shape[:2]
    lens = Intrinsics(0.73 * width, 0.73 * width, (width - 1) / 2, (height - 1) / 2)
    faces = face_detector(FaceDetectorParams(work_width_px=asked.get("faces", 320)))
    motion = MotionDetector(MotionParams(work_px=asked.get("motion", 320)))
    spent = []
    for k, picture in enumerate(pictures):
        began = time.monotonic()
        if "faces" in asked:
            faces.find(picture)
        else:
            motion.find(picture, k / 15, lens, None)
        spent.append(1e3 * (time.monotonic() - began))
    p50, p95 = np.percentile(spent[5:], (50, 95))
    return {"cell": f"{p50:.0f} / {p95:.0f} ms"}


def looking(asked: dict[str, Any]) -> dict[str, Any]:
    """Look at photographed people as the camera's process does, as fast as it goes."""
    pin(asked)
    from camera_stages import Case, camera_hz, rate_hz

    case = Case(*asked["camera"])
    found = rate_hz(case, asked["seconds"])
    return {"cell": f"{found:.0f} frames/s, of {camera_hz(case):.0f} that come"}


def drawn(count: int) -> list[Any]:
    """Return pictures of a visitor, 640 by 480."""
    from gazerig.config.schema import load_rig
    from gazerig.robot.app import assemble as assembling
    from gazerig.robot.app.options import RunOptions
    from gazerig.robot.control.loop import run

    made = assembling.assemble(
        load_rig("desk"), RunOptions(mock=True, fast=True, scene="visitor", pixels=True)
    )
    found: list[Any] = []

    def note(tick: Any) -> None:
        image = getattr(tick.detections, "image", None)
        if image is not None and tick.t_s > 4.0 and (not found or image is not found[-1]):
            found.append(image)

    made.robot.start(made.clock)
    run(made.robot, made.clock, made.loop, lambda s: "x" if len(found) >= count else None, note)
    made.robot.stop()
    made.close()
    return found


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    main()
