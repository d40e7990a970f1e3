"""Three people: most of the time on the speaker, stays of every length, no one left out.

The person looked at is the one listened to in 88 % of the time (Vertegaal et al. 2001). Listeners
turn to the next speaker about when the turn begins (Holler & Kendrick 2015). A head without ears
can only know of speech that its camera sees.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from human.measured_run import MeasuredRun, Runner

from gazerig.robot.app.scene_files import load_scene

SCENE = "three-people"
_HALF_FIELD_DEG = 31.0


WANTED = {
    "on a speaker in view, % of the time on faces": (80.0, 95.0),
    "from the beginning of a turn to its speaker, median s": (0.0, 1.5),
    "stays, SD over mean": (0.7, 2.0),
    "stays above 4 s, %": (5.0, 35.0),
    "longest stay, s": (5.0, 20.0),
    "least looked at, % of the time on faces": (5.0, 34.0),
}
_SEEN_S = 1.0
"""Speech is seen within this time of its beginning."""


def measure(run: Runner, seconds: float, seeds: Sequence[int]) -> dict[str, float]:
    """Return the figures over all seeds."""
    runs = [run(SCENE, seed=seed, seconds=seconds) for seed in seeds]
    seen, delays, lengths, counts = [], list[float](), list[float](), np.zeros(3)
    for one in runs:
        who, speaker = _columns(one)
        in_view = _in_view(one, speaker)
        here = (who >= 0) & _lasts(one, speaker) & in_view & _lasts(one, in_view)
        seen.append((who == speaker)[here])
        counts += np.bincount(who[who >= 0], minlength=3)
        delays += _delays(one, who, speaker)
        lengths += _stays(one, who)
    stays = np.array(lengths)
    return {
        "on a speaker in view, % of the time on faces": 100.0 * float(np.concatenate(seen).mean()),
        "from the beginning of a turn to its speaker, median s": float(np.median(delays)),
        "stays, SD over mean": float(stays.std() / stays.mean()),
        "stays above 4 s, %": 100.0 * float((stays > 4.0).mean()),
        "longest stay, s": float(stays.max()),
        "least looked at, % of the time on faces": 100.0 * float(counts.min() / counts.sum()),
    }


def _columns(one: MeasuredRun) -> tuple[np.ndarray, np.ndarray]:
    """Return (n,) who is looked at and who speaks, -1 for none."""
    scene = load_scene(SCENE)
    faces = np.stack([one.truth[f"face {number}"] for number in range(3)])
    off = np.linalg.norm(faces - one.target_m, axis=2)
    on = (one.part != "") & (off.min(axis=0) < 0.2)
    who = np.where(on, off.argmin(axis=0), -1)
    speaker = np.full(len(who), -1)
    for tick in range(0, len(who), 10):
        for number, person in enumerate(scene.people(float(one.t_s[tick]))):
            if person.speaks:
                speaker[tick : tick + 10] = number
    return who, speaker


def _in_view(one: MeasuredRun, number: np.ndarray) -> np.ndarray:
    """Return (n,) whether the camera can see a person of this number; -1: none."""
    yaw = np.stack([one.truth_deg(f"face {each}")[:, 0] for each in range(3)])
    off = np.abs(yaw[number, np.arange(len(number))] - one.head_deg[:, 0])
    seen: np.ndarray = (number >= 0) & (off < _HALF_FIELD_DEG)
    return seen


def _lasts(one: MeasuredRun, state: np.ndarray) -> np.ndarray:
    """Return (n,) whether a state has lasted for long enough to be seen."""
    begins = np.flatnonzero(np.diff(state.astype(int), prepend=-2))
    last = begins[np.searchsorted(begins, np.arange(len(state)), side="right") - 1]
    lasts: np.ndarray = one.t_s - one.t_s[last] > _SEEN_S
    return lasts


def _delays(one: MeasuredRun, who: np.ndarray, speaker: np.ndarray) -> list[float]:
    """Return the times from the beginning of each turn to the first look at its speaker."""
    found = []
    edges = [*(np.flatnonzero(np.diff(speaker)) + 1).tolist(), len(speaker)]
    for begin, end in pairwise(edges):
        if speaker[begin] >= 0:
            there = np.flatnonzero(who[begin:end] == speaker[begin])
            found.append(float(one.t_s[begin + there[0]] - one.t_s[begin]) if len(there) else 9.9)
    return found


def _stays(one: MeasuredRun, who: np.ndarray) -> list[float]:
    """Return the lengths of complete stays with one person; looks away do not end them."""
    kept = np.flatnonzero(who >= 0)
    edges = np.flatnonzero(np.diff(who[kept])) + 1
    return [float(one.t_s[kept[b]] - one.t_s[kept[a]]) for a, b in pairwise(edges.tolist())]
