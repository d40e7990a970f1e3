"""A target that jumps early in a saccade bends it; nothing else comes sooner than 100 ms after one.

On the rig ``desk`` with byte-true servos: the planned saccades of the shipped scenes, and commanded
looks 32 to 40 deg away that are changed to another place in flight.
"""

from collections.abc import Sequence

import numpy as np
from human.commanded_looks import commanded, point
from human.measured_run import Runner

SCENES = ("visitor", "face-to-face")
EARLY_S, LATE_S = (0.005, 0.015, 0.025), (0.07, 0.075, 0.08)
"""When the look is changed after its command; such a saccade takes 105 to 130 ms, and is bent until
70 ms before its end."""

WANTED = {
    "shortest pause after a landing, ms": (95.0, 1e6),
    "early jumps that bend the saccade, share": (1.0, 1.0),
    "early, highest acceleration planned, deg/s2": (0.0, 42_000.0),
    "early, measured end off the new place, deg": (0.0, 1.0),
    "late jumps that wait 100 ms, share": (1.0, 1.0),
}


def pauses_ms(flight: np.ndarray, t_s: np.ndarray) -> np.ndarray:
    """Return the times from each landing to the next saccade."""
    begins = np.flatnonzero(flight[1:] & ~flight[:-1]) + 1
    ends = np.flatnonzero(~flight[1:] & flight[:-1]) + 1
    following = np.searchsorted(begins, ends, side="left")
    known = following < len(begins)
    return 1e3 * (t_s[begins[following[known]]] - t_s[ends[known]])


def changed(
    after_s: Sequence[float], seed: int
) -> tuple[list[int], list[float], list[float], list[float]]:
    """Return of looks changed in flight: saccades, accelerations, errors at the end, pauses."""
    rng = np.random.default_rng(seed)
    times, points = [], []
    for n, late in enumerate(after_s):
        side = 1.0 if n % 2 else -1.0
        times += [1.5 * n, 1.5 * n + late]
        aside = float(rng.uniform(-4.0, 4.0))
        points += [
            point(18.0 * side, 1.0),
            point(18.0 * side + aside, 1.0 + float(rng.uniform(-4.0, 4.0))),
        ]
    # From one side to the other: the first look only goes where they begin.
    times, points = [0.0, *(t + 1.5 for t in times)], [point(18.0, 1.0), *points]
    looks = commanded(times, points, seed)
    counts, hardest, errors, waits = [], [], [], []
    for n in range(len(after_s)):
        rows = np.flatnonzero((looks.look == 2 * n + 1) | (looks.look == 2 * n + 2))
        rows = rows[looks.t_s[rows] <= looks.t_s[rows[0]] + 0.45]
        if looks.flight[rows[0] - 1]:  # a re-fixation was in flight
            continue
        flight = looks.flight[rows]
        first = int(np.argmax(flight))
        if first:  # a blink came before the look: the jump was at another time of it
            continue
        landed = first + int(np.argmin(flight[first:]))
        counts.append(1 + int(np.any(flight[landed : landed + 21])))
        plan = looks.plan_deg[rows[: landed + 2]]
        velocity = np.diff(plan, axis=0) / 0.005
        hardest.append(float(np.linalg.norm(np.diff(velocity, axis=0), axis=1).max()) / 0.005)
        errors.append(float(np.linalg.norm(looks.gaze_deg[rows[-1]] - looks.target_deg[rows[-1]])))
        found = pauses_ms(flight, looks.t_s[rows])
        waits.append(float(found[0]) if len(found) else 1e6)
    return counts, hardest, errors, waits


def measure(run: Runner, seconds: float, seeds: Sequence[int]) -> dict[str, float]:
    """Return the figures over all seeds."""
    runs = [run(scene, seed=n, seconds=seconds) for scene in SCENES for n in seeds]
    pauses = np.concatenate([pauses_ms(one.phase == "saccade", one.t_s) for one in runs])
    early = [changed(EARLY_S * 2, n) for n in seeds]
    late = [changed(LATE_S * 2, n) for n in seeds]
    hardest, errors = (np.concatenate([one[k] for one in early]) for k in (1, 2))
    waits = np.concatenate([one[3] for one in late])
    return {
        "shortest pause after a landing, ms": float(pauses.min()),
        "early jumps that bend the saccade, share": float(
            np.mean(np.concatenate([one[0] for one in early]) == 1)
        ),
        "early, highest acceleration planned, deg/s2": float(hardest.max()),
        "early, measured end off the new place, deg": float(np.median(errors)),
        "late jumps that wait 100 ms, share": float(np.mean((waits >= 95.0) & (waits < 1e5))),
    }
