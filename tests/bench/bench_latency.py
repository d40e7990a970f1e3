"""From picture to servo bytes: python tests/bench/bench_latency.py [FILM ...]

The whole rig in real time, its servos on a pseudo-terminal, before a film that is paced by the
clock. For each picture: from its capture to the first goals that were sent with it known, and
what of that passed before the control loop had it. Beside it stands what nobody can avoid: the
same pictures through the bare face detector and OpenCV's optical flow, in a loop of their own.
Nothing here passes or fails.
"""

import argparse
import os
import time
from dataclasses import dataclass, field, replace
from pathlib import Path

import cv2
import numpy as np

from gazerig.config.schema import load_rig
from gazerig.drivers.types import Detections
from gazerig.drivers.vision.face.detector import face_detector
from gazerig.robot.app.assemble import Assembly, assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import Tick, run

MEDIA = Path(__file__).resolve().parents[3] / "shared" / "media"
SECONDS, SKIP_S, BARE = 20.0, 2.0, 60


@dataclass
class Stamps:
    """When things happened, by the host's clock.

    arrived_s, sent_s: of each picture's capture time: when the loop took it, and when the
        goals of that tick had been handed to the port
    """

    arrived_s: dict[float, float] = field(default_factory=dict)
    sent_s: dict[float, float] = field(default_factory=dict)
    last_write_s: float = 0.0

    def update(self, tick: Tick) -> None:
        """Note a tick; its goals have just been sent."""
        if tick.percept is not None:
            self.sent_s.setdefault(tick.percept.captured_s, self.last_write_s)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    usual = [MEDIA / "Megamind.avi", MEDIA / "vtest.avi"]
    parser.add_argument("films", nargs="*", type=Path, default=usual)
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.2f} at the start")
    for film in parser.parse_args().films:
        capture = cv2.VideoCapture(str(film))
        size = f"{capture.get(3):.0f}x{capture.get(4):.0f}, {capture.get(5):.0f} a second"
        print(f"\n{film.name} ({size}), ms{'p50':>37}{'p95':>8}{'p99':>8}{'n':>6}")
        for motion in (True, False):
            stamps = measured(film, motion)
            show("faces and motion" if motion else "faces only", stamps)
        show_bare(film)


def measured(film: Path, motion: bool) -> Stamps:
    """Run the rig before a film."""
    rig = load_rig("desk")
    rig = replace(rig, motion=replace(rig.motion, enabled=motion))
    made = assemble(rig, RunOptions(mock=True, fast=False, seed=0, video=film))
    stamps = stamped(made)
    made.robot.start(made.clock)
    try:
        run(made.robot, made.clock, made.loop, ended, stamps.update)
    finally:
        made.robot.stop()
        made.close()
    return stamps


def ended(seconds: float) -> str | None:
    """Return whether the run is over."""
    return "seconds" if seconds >= SECONDS else None


def stamped(made: Assembly) -> Stamps:
    """Put stamps on the robot's pictures and goals."""
    stamps, robot = Stamps(), made.robot
    latest, write = robot.camera.latest, robot.body.write

    def look(now_s: float) -> Detections | None:
        found = latest(now_s)
        if found is not None:
            stamps.arrived_s.setdefault(found.captured_s, time.monotonic())
        return found

    def send(command_rad: tuple[float, ...]) -> None:
        write(command_rad)
        stamps.last_write_s = time.monotonic()

    robot.camera.latest = look  # type: ignore[method-assign]
    robot.body.write = send  # type: ignore[method-assign]
    return stamps


def show(name: str, stamps: Stamps) -> None:
    """Print the latencies of a run."""
    first_s = min(stamps.sent_s) + SKIP_S
    known = [c for c in stamps.sent_s if c >= first_s and c in stamps.arrived_s]
    row(f"{name}: capture to servo bytes", [1e3 * (stamps.sent_s[c] - c) for c in known])
    row("  until the loop has it", [1e3 * (stamps.arrived_s[c] - c) for c in known])
    row(
        "  from there to the bytes", [1e3 * (stamps.sent_s[c] - stamps.arrived_s[c]) for c in known]
    )


def show_bare(film: Path) -> None:
    """Print what the bare calls take for the same pictures."""
    detector = face_detector(load_rig("desk").detector)
    flow = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_FAST)
    capture = cv2.VideoCapture(str(film))
    before, faces, flows = None, [], []
    for _ in range(BARE):
        good, picture = capture.read()
        if not good or picture is None:
            break
        began = time.perf_counter()
        detector.find(picture.astype(np.uint8, copy=False))
        faces.append(1e3 * (time.perf_counter() - began))
        grey = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
        if before is not None:
            began = time.perf_counter()
            flow.calc(before, grey, np.zeros((*grey.shape, 2), np.float32))
            flows.append(1e3 * (time.perf_counter() - began))
        before = grey
    row("face detector alone", faces)
    row("cv2 DIS alone, whole picture", flows)


def row(name: str, values_ms: list[float]) -> None:
    """Print one line."""
    p50, p95, p99 = np.percentile(values_ms, (50, 95, 99))
    print(f"  {name:44} {p50:8.1f}{p95:8.1f}{p99:8.1f}{len(values_ms):6d}")


if __name__ == "__main__":
    main()
