"""Mutual gaze without a conversation: bouts of some 3.3 s, entries where the gaze comes from."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from human.measured_run import Figures, MeasuredRun, Runs

from gazerig.gaze.scanpath.scanpath import ENTRY_PARTS
from gazerig.robot.model.face_geometry import PARTS_FACE_M

SCENE = "face-to-face"

WANTED = {
    "median bout, s": (2.6, 4.0),
    "spread of bouts, SD of the logarithm": (0.3, 0.75),
    "longest bout, s": (4.0, 15.0),
    "median look away, s": (0.3, 1.2),
    "time on the face, %": (75.0, 92.0),
    "entries at the nearest of eyes and nose, %": (85.0, 100.0),
    "entries at the paper's first part, %": (0.0, 40.0),
}


def stays(run: MeasuredRun) -> Iterator[tuple[bool, float, int]]:
    """Yield whether a complete stay is on the face, its length, and the tick of its beginning."""
    on = run.part != ""
    edges = np.flatnonzero(np.diff(on)) + 1
    for begin, end in pairwise(edges.tolist()):
        yield bool(on[begin]), float(run.t_s[end] - run.t_s[begin]), begin


def nearest(run: MeasuredRun, begin: int) -> set[str]:
    """Return the eyes or the nose nearest to the gaze of a tick, within the camera's error."""
    face = run.target_deg[begin] - _part_deg(run, begin, str(run.part[begin]))
    gaze = run.plan_deg[begin - 1]
    away = {
        part: float(np.hypot(*(face + _part_deg(run, begin, part) - gaze))) for part in ENTRY_PARTS
    }
    return {part for part, angle in away.items() if angle < min(away.values()) + 0.7}


def _part_deg(run: MeasuredRun, at: int, part: str) -> np.ndarray:
    """Return the place of a part on a face that is turned to the head, from the face's centre."""
    _, left, up = PARTS_FACE_M[part]
    distance_m = np.linalg.norm(run.target_m[at] - run.head_m[at])
    # The owner's left is on the right of who looks.
    return np.degrees(np.array([-left, up]) / distance_m)


def measure(runs: Runs) -> Figures:
    """Return the figures over all seeds."""
    all_runs = runs(SCENE)
    every = [(one, *stay) for one in all_runs for stay in stays(one)]
    bouts = np.array([seconds for _, on, seconds, _ in every if on])
    away = np.array([seconds for _, on, seconds, _ in every if not on])
    entries = [(one, begin) for one, on, _, begin in every if on]
    return {
        "median bout, s": np.median(bouts),
        "spread of bouts, SD of the logarithm": np.log(bouts).std(),
        "longest bout, s": bouts.max(),
        "median look away, s": np.median(away),
        "time on the face, %": 100.0 * np.mean([(one.part != "").mean() for one in all_runs]),
        "entries at the nearest of eyes and nose, %": 100.0
        * np.mean([one.part[begin] in nearest(one, begin) for one, begin in entries]),
        "entries at the paper's first part, %": 100.0
        * np.mean([one.part[begin] == "FR" for one, begin in entries]),
    }
