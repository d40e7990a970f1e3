"""Each paper's profile is its paper and nothing else: what runs, walks, blinks and looks away.

Nakamoto & Tsuruno's loop holds a part for its dwell *after* the eyes have arrived (3.2.1): what
follows from table 1 are rests of .271 s, and a shift and its landing come on top of each. The eyes'
limit of 20 deg is that of what they rest on: where they are to jump by 0.8 of the way in a frame
(3.3), the guard's braking takes them some tenths of a degree too far for a tick or two.
"""

from collections.abc import Sequence

import numpy as np
from human.measured_run import MeasuredRun, Runner
from human.profile_trace import as_told, claims
from human.row_03_rests import visits

WANTED = {
    "rows of docs/profiles.md that are not true": (0.0, 0.0),
    "nakamoto: mean rest on a part, s": (0.253, 0.294),
    "nakamoto: largest eye angle at rest, deg": (10.0, 20.1),
    "nakamoto: largest measured eye angle, deg": (10.0, 20.0),
    "mitake: a person before it, share of time on the face": (0.75, 1.0),
    "nakamoto: targets other than faces, %": (0.0, 0.0),
    "nakamoto: blinks a minute": (12.0, 24.0),
    "mitake: blinks a minute": (0.0, 0.0),
    "mitake: looks away and around, %": (0.0, 0.0),
}
NO_FACE = ("away", "glance", "search", "hand", "thing")


def measure(run: Runner, seconds: float, seeds: Sequence[int]) -> dict[str, float]:
    """Return the figures over all seeds, and the rows of the page that a run contradicts."""
    nakamoto, mitake = (
        [run("face-to-face", profile, seed=seed, seconds=seconds) for seed in seeds]
        for profile in ("nakamoto", "mitake")
    )
    found = [visit for one in nakamoto for visit in visits(one)]
    return {
        "rows of docs/profiles.md that are not true": float(
            sum(bool(as_told(claim)) for claim in claims())
        ),
        "nakamoto: mean rest on a part, s": float(np.mean([visit.rest_s for visit in found])),
        "nakamoto: largest eye angle at rest, deg": max(
            float(np.abs(one.eyes_goal_deg[_rests(one)]).max()) for one in nakamoto
        ),
        "nakamoto: largest measured eye angle, deg": float(
            max(
                np.abs(one.eyes_deg).max()
                for one in (*nakamoto, *_visits(run, "nakamoto", seconds, seeds))
            )
        ),
        "mitake: a person before it, share of time on the face": float(
            np.mean([_on_face(one) for one in mitake])
        ),
        "nakamoto: targets other than faces, %": _elsewhere(nakamoto),
        "nakamoto: blinks a minute": _blinks(nakamoto),
        "mitake: blinks a minute": _blinks(mitake),
        "mitake: looks away and around, %": _elsewhere(mitake),
    }


def _visits(run: Runner, profile: str, seconds: float, seeds: Sequence[int]) -> list[MeasuredRun]:
    return [run("visitor", profile, seed=seed, seconds=seconds) for seed in seeds]


def _on_face(one: MeasuredRun) -> float:
    """Return the share of time in which the measured gaze is on the face."""
    off = np.linalg.norm(one.gaze_deg - one.truth_deg("face 0"), axis=1)
    return float((off < 6.0).mean())


def _rests(one: MeasuredRun) -> np.ndarray:
    """Return (n,) whether the last saccade was over for 20 ms."""
    flying = (one.phase == "saccade").astype(int)
    return np.convolve(flying, np.ones(5), "full")[: len(flying)] == 0


def _blinks(runs: Sequence[MeasuredRun]) -> float:
    minutes = [(one.t_s[-1] - one.t_s[0]) / 60.0 for one in runs]
    return float(sum(one.blinks[-1] - one.blinks[0] for one in runs) / sum(minutes))


def _elsewhere(runs: Sequence[MeasuredRun]) -> float:
    names = np.concatenate([one.target_name for one in runs])
    return 100.0 * float(np.mean([name.split()[0] in NO_FACE for name in names]))
