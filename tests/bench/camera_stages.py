"""Processor time of a frame in the camera's process by stage: python tests/bench/camera_stages.py

Frames of photographed people who walk about in a photographed room (one, or three) go through
``FrameAnalyzer`` as in the camera's process, on one thread; each call of a stage counts with the
least of the rounds. The rate that a share of a core gives is that share over the sum; the camera
delivers 30 frames a second, with the profile small 15. bench_small_machine.py measures it under a
spinner. YuNet only where its file is at hand.
"""

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from math import radians
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

TESTS = Path(__file__).parents[1]
sys.path.insert(0, str(TESTS))

from seeing.material import MODELS, at_hand, background, eyes_at, noisy, paste, portrait  # noqa: E402
from seeing.row_05_finding_and_placing import YUNET  # noqa: E402

from gazerig.config.schema import load_rig  # noqa: E402
from gazerig.drivers.camera.capture_loop import FrameAnalyzer  # noqa: E402
from gazerig.drivers.camera.source import Shot  # noqa: E402
from gazerig.drivers.types import ImageArray  # noqa: E402
from gazerig.drivers.vision.face.detector import face_detector  # noqa: E402
from gazerig.robot.perception.frame_locator import FrameLocator  # noqa: E402
from gazerig.robot.perception.motion_source import MotionSource  # noqa: E402

FIELD_DEG = 69.0
STAGES = ("faces", "mesh", "motion", "rest")
SHARES = (1.0, 0.5, 0.25)


class Case(NamedTuple):
    """What the camera's process is asked to do.

    profile: "" or "small"; people: in the frames; yunet: with its file; mesh: of how many faces
    """

    profile: str = ""
    people: int = 1
    yunet: bool = False
    mesh: int = 0
    motion: bool = True

    @property
    def text(self) -> str:
        """Return it as the first cell of a row."""
        finder = "auto with YuNet" if self.yunet else "auto"
        mesh = f", mesh of {self.mesh}" if self.mesh else ""
        size = "320x240, small" if self.profile else "640x400"
        who = "one person" if self.people == 1 else f"{self.people} people"
        return f"{size}, {who}: {finder}{mesh}{'' if self.motion else ', no motion'}"


CASES = tuple(
    Case(profile, people, yunet, mesh)
    for profile in ("", "small")
    for people in (1, 3)
    for yunet in (False, True)
    for mesh in ((0, 1) if people == 1 else (0,))
)


def camera_hz(case: Case) -> float:
    """Return how many frames a second the camera delivers."""
    return 15.0 if case.profile else 30.0


def frames(case: Case, count: int = 48) -> list[ImageArray]:
    """Return frames of people who walk about."""
    width, height = (320, 240) if case.profile else (640, 400)
    rng, out = np.random.default_rng(0), []
    for k in range(count):
        frame = background(width, height).copy()
        for i in range(case.people):
            eyes = eyes_at(1.2 + 0.4 * i, width, FIELD_DEG)
            at = (i + 0.5) / case.people + 0.06 * np.sin(0.15 * k + i)
            shown = portrait(("astronaut", "hopper")[i % 2])
            paste(frame, shown, (at * width, (0.5 + 0.02 * np.sin(0.2 * k)) * height), eyes)
        out.append(noisy(frame, 2.0, rng))
    return out


def analyzer(case: Case) -> FrameAnalyzer:
    """Return what looks at the frames, as the rig desk has it."""
    rig = load_rig("desk", profile=case.profile or None)
    file = at_hand(YUNET, MODELS) if case.yunet else None
    params = replace(rig.detector, mesh_faces=case.mesh, model_file=str(file or ""))
    motion = replace(rig.motion, enabled=case.motion)
    field = radians(FIELD_DEG)
    return FrameAnalyzer(
        face_detector(params), MotionSource(motion, None, field, None), FrameLocator(None, field)
    )


def shots(images: list[ImageArray], rate_hz: float) -> list[Shot]:
    """Return frames with their times, to and fro so that nothing jumps."""
    order = [*range(len(images)), *range(len(images) - 2, 0, -1)]
    return [Shot(k / rate_hz, k + 1, images[i]) for k, i in enumerate(order)]


def stages_ms(case: Case, rounds: int) -> dict[str, float]:
    """Return the mean processor time of a frame by stage, the first frames left out."""
    cv2.setNumThreads(1)
    taken = shots(frames(case), camera_hz(case))
    least: np.ndarray | None = None
    for _ in range(rounds):
        spent = one_round(case, taken)
        least = spent if least is None else np.minimum(least, spent)
    assert least is not None
    faces, mesh, motion, whole = least[8:].mean(axis=0)
    values = (faces - mesh, mesh, motion, whole - faces - motion)
    return dict(zip(STAGES, values, strict=True))


def one_round(case: Case, taken: list[Shot]) -> np.ndarray:
    """Return (frames, 4) ms: finding faces with their meshes, meshes, motion, and the whole."""
    looks = analyzer(case)
    columns = {name: 0.0 for name in ("faces", "mesh", "motion")}

    def timed(name: str, call: Callable[..., Any]) -> Callable[..., Any]:
        def measured(*given: Any) -> Any:
            began = time.thread_time_ns()
            found = call(*given)
            columns[name] += (time.thread_time_ns() - began) / 1e6
            return found

        return measured

    detector: Any = looks._detector
    if case.mesh:
        detector.add_meshes = timed("mesh", detector.add_meshes)
    detector.find = timed("faces", detector.find)
    looks._motion = timed("motion", looks._motion)  # type: ignore[arg-type]
    rows = []
    for shot in taken:
        columns.update(dict.fromkeys(columns, 0.0))
        began = time.thread_time_ns()
        looks.analyze(shot)
        rows.append([*columns.values(), (time.thread_time_ns() - began) / 1e6])
    return np.array(rows)


def rate_hz(case: Case, seconds: float) -> float:
    """Return how many frames a second are looked at, one after the other, on the wall clock."""
    cv2.setNumThreads(1)
    most_hz = camera_hz(case)
    looks, taken = analyzer(case), shots(frames(case), most_hz)
    for shot in taken[:8]:
        looks.analyze(shot)
    count, began = 0, time.monotonic()
    while time.monotonic() - began < seconds:
        # Forward and backward without a gap: the order of the shots ends at its start.
        shot = taken[(8 + count) % len(taken)]
        looks.analyze(shot._replace(captured_s=(8 + count) / most_hz, number=9 + count))
        count += 1
    return count / (time.monotonic() - began)


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=3)
    args = parser.parse_args()
    print(
        "| ms a frame | " + " | ".join((*STAGES, "all")) + " | frames/s of a core, half, quarter |"
    )
    for case in CASES:
        if case.yunet and at_hand(YUNET, MODELS) is None:
            continue
        spent = stages_ms(case, args.rounds)
        whole = sum(spent.values())
        rates = ", ".join(f"{min(camera_hz(case), 1e3 * share / whole):.0f}" for share in SHARES)
        cells = " | ".join(f"{value:.1f}" for value in (*spent.values(), whole))
        print(f"| {case.text} | {cells} | {rates} |", flush=True)


if __name__ == "__main__":
    main()
