"""Cost of motion detection: python tests/bench/bench_motion.py

Prints milliseconds of processor time a picture (p50, p95) of each step at 320x240 and 640x400, and
next to them, in the same run, the plain OpenCV calls of a simpler program: the flow alone
(DIS at the picture's own size), and background subtraction (MOG2), which needs a camera that
stands. The picture: a head that turns at 20 deg/s before ground on which two people move; then one
that does not move before one, three and twenty. Nothing here passes or fails.
"""

import time
from collections.abc import Callable
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.vision.motion.clustering import cluster_motion
from gazerig.drivers.vision.motion.detector import MotionDetector, scale_to_level
from gazerig.drivers.vision.motion.ego_motion import estimate_ego_motion, predicted_ego_motion
from gazerig.drivers.vision.motion.image import scale_down
from gazerig.drivers.vision.motion.optical_flow import (
    FlowSearch,
    align_images,
    changed_windows,
    turn_homography,
)
from gazerig.drivers.vision.motion.params import MotionParams
from gazerig.drivers.vision.motion.segmentation import image_difference, segment_motion

PICTURES, DT_S, TURN_RAD = 150, 1 / 30, np.radians(20.0) / 30
Picture = NDArray[np.uint8]
Result = TypeVar("Result")


def main() -> None:
    """Measure and print."""
    for width, height in ((320, 240), (640, 400)):
        for turn_rad, people in ((TURN_RAD, 2), (0.0, 1), (0.0, 3), (0.0, 20)):
            title = f"{width}x{height}, {'turning' if turn_rad else 'standing'}, people: {people}"
            print(f"\n{title:36}{'p50':>9}{'p95':>9}{'of DIS':>9}{'of MOG2':>9}")
            times = measured(width, height, turn_rad, people)
            dis, mog = (np.median(times[name]) for name in ("cv2 DIS, plain", "cv2 MOG2, plain"))
            for name, spent in times.items():
                p50, p95 = np.percentile(spent, (50, 95))
                print(f"  {name:34}{p50:9.2f}{p95:9.2f}{p50 / dis:9.2f}{p50 / mog:9.2f}")


def measured(width: int, height: int, turn_rad: float, people: int) -> dict[str, list[float]]:
    """Return milliseconds of each step, picture by picture."""
    params = MotionParams()
    focal = 0.73 * width
    lens = Intrinsics(focal, focal, (width - 1) / 2, (height - 1) / 2)
    c, s = np.cos(turn_rad), np.sin(turn_rad)
    R = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
    search, whole = FlowSearch(params.preset), MotionDetector(params)
    dis = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_FAST)
    mog = cv2.createBackgroundSubtractorMOG2()
    times: dict[str, list[float]] = {}

    before, grey_before = None, None
    for k, picture in enumerate(pictures(width, height, focal * turn_rad, people)):
        t_s = k * DT_S
        given = picture, params.work_px, lens, t_s, params.finest_level
        now = timed(times, "small and grey", scale_down, *given)
        if before is not None:
            H = turn_homography(R, now, before)
            pair, still = align_images(now, before, H), None
            ego = None
            if not turn_rad:
                still = timed(times, "unlike", image_difference, pair)
                ego = timed(times, "stands", predicted_ego_motion, pair, still.changed_mask)
            if ego is not None and still is not None:
                pair = timed(
                    times, "flow", search.search, pair, changed_windows(still.changed_mask)
                )
            else:
                still, pair = None, timed(times, "flow", search.search, pair)
                ego = timed(times, "own motion", estimate_ego_motion, pair, now.K, True)
            given_level = scale_to_level(params, now)
            things = timed(
                times, "what moves", segment_motion, pair, ego, given_level, False, still
            )
            timed(times, "grouping", cluster_motion, things, params)
        before = now
        timed(times, "all, with slide, loom, spin, place", whole.find, picture, t_s, lens, R)
        grey = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
        if grey_before is not None:
            flow = np.zeros((*grey.shape, 2), np.float32)
            timed(times, "cv2 DIS, plain", dis.calc, grey_before, grey, flow)
        timed(times, "cv2 MOG2, plain", mog.apply, picture)
        grey_before = grey
    return times


def timed(
    times: dict[str, list[float]], name: str, work: Callable[..., Result], *given: object
) -> Result:
    """Do some work and note how long it took."""
    began = time.process_time()
    result = work(*given)
    times.setdefault(name, []).append(1e3 * (time.process_time() - began))
    return result


def pictures(width: int, height: int, slide_px: float, people: int) -> list[Picture]:
    """Draw ground that slides by as the head turns, and people who move on it."""
    rng = np.random.default_rng(0)
    ground = texture(rng, height, width + 600)
    side = min(width // 6, int(1.2 * width / people))
    person = texture(rng, 2 * side, side)
    at = rng.uniform((0.0, 0.0), (width - 1.3 * side, height - 2 * side), (people, 2))
    phase = rng.uniform(0.0, 2.0 * np.pi, people)
    out = []
    for k in range(PICTURES):
        left = 300 + 200 * np.sin(k * slide_px / 200)
        A = np.array([[1.0, 0.0, -left], [0.0, 1.0, 0.0]])
        picture = cv2.warpAffine(ground, A, (width, height))
        for (x, y), begun in zip(at, phase, strict=True):
            column, row = int(x + 0.3 * side * (1.0 + np.sin(0.1 * k + begun)) / 2.0), int(y)
            picture[row : row + 2 * side, column : column + side] = person
        noisy = picture[..., None] + rng.normal(0.0, 2.0, (height, width, 3))
        out.append(np.clip(noisy, 0, 255).astype(np.uint8))
    return out


def texture(rng: np.random.Generator, height: int, width: int) -> NDArray[np.float64]:
    """Make something to see."""
    grain = cv2.GaussianBlur(rng.standard_normal((height, width)), (0, 0), 2.5)
    return np.asarray(np.clip(128 + 300 * grain, 0, 255))


if __name__ == "__main__":
    main()
