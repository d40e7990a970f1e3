"""Saccades as the eyes make them: duration, peak speed and skew of people's.

On the rig ``desk``: single ones of 1 to 30 deg on the true shaft of an eye, and those of the
shipped scenes as the report finds them.
"""

import numpy as np
import pytest
from human.eye_steps import steps
from human.measured_run import Figures, Runs

pytest.importorskip("gazerig.features.lab")  # its measures
from gazerig.features.lab.analysis import human_norms as people  # noqa: E402
from gazerig.features.lab.report.saccades import saccade_table  # noqa: E402

SCENES = ("visitor", "face-to-face")
SIZES_DEG = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 15.0, 18.0, 22.0, 26.0, 30.0)

WANTED = {
    "1-30 deg, inside both bands, share": (0.75, 1.0),
    "scenes, peak inside its band, share": (0.75, 1.0),
    "time of the peak less people's, up to 10 deg, median": (-0.08, 0.08),
    "time of the peak, 18-30 deg": (0.25, 0.47),
    "time of the peak, 10 deg": (0.42, 0.48),
    "time of the peak, 20 deg": (0.36, 0.42),
}


def inside(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return for (n, 3) amplitudes, durations, peaks whether peak and duration are people's."""
    size, ms, peak = rows.T[:3]
    fast = (people.lowest_peak_deg_s(size) <= peak) & (peak <= people.highest_peak_deg_s(size))
    long = (people.shortest_duration_ms(size) <= ms) & (ms <= people.longest_duration_ms(size))
    return fast, long


def peak_time(size_deg: float) -> float:
    """Return the time of the peak on the true shaft, a mean over sizes within a degree."""
    near = [size_deg + off for off in (-1.0, -0.5, 0.0, 0.5, 1.0)]
    return float(np.mean([one.timing()[2] for one in steps("desk", near)]))


def measure(runs: Runs) -> Figures:
    """Return the figures; those of single saccades are not random."""
    single = np.array([(one.done_deg[-1], *one.timing()) for one in steps("desk", SIZES_DEG)])
    scenes = np.vstack([saccade_table(one.trace) for scene in SCENES for one in runs(scene)])
    fast, long = inside(single)
    scene_fast, _ = inside(scenes)
    small, large = single[single[:, 0] <= 10.5], single[single[:, 0] >= 17.5]
    return {
        "1-30 deg, inside both bands, share": np.mean(fast & long),
        "scenes, peak inside its band, share": np.mean(scene_fast),
        "time of the peak less people's, up to 10 deg, median": np.median(
            small[:, 3] - people.acceleration_share(small[:, 0])
        ),
        "time of the peak, 18-30 deg": np.median(large[:, 3]),
        **{f"time of the peak, {size:g} deg": peak_time(size) for size in (10.0, 20.0)},
    }
