"""Independent judges of an exported run: the saccades that pymovements and REMoDNaV find in it.

Both get what a laboratory gets: the file ``STEM_samples.csv`` of ``gazerig export --csv``, with the
noise that a good eye tracker adds. Encoders have none: at rest their speed is exactly 0, and both
algorithms, which set their thresholds by the noise, would have none either.
"""

import csv
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
from human.measured_run import MeasuredRun

NOISE_DEG = 0.02
"""Standard deviation of each sample, as of a tower-mounted tracker (0.01 to 0.05)."""

THRESHOLD_DEG_S = 30.0
"""Of Engbert & Kliegl's ellipse. They take six times the noise of a recording at rest, which here
would be less than a person's walk; this is the usual one of velocity-based detection (I-VT)."""

_SHORTEST_MS, _FACTOR = 15, 6.0
_SMOOTHED_S = 0.026
"""Five samples at 200 Hz. REMoDNaV's own 19 ms would be three, which smooth nothing."""


class Exported(NamedTuple):
    """The columns of an exported run, all of its time, that judges and their marks rest on.

    time_s: (n,); gaze_deg: (n, 2), yaw and pitch in space
    commanded: (m, 2) onset and end of each commanded saccade by the export's events
    """

    time_s: np.ndarray
    gaze_deg: np.ndarray
    commanded: np.ndarray


class Marks(NamedTuple):
    """What a judge found of our saccades.

    ours: (m,) whether each commanded one overlaps one of the judge's
    theirs: (k,) whether each of the judge's overlaps one of ours
    """

    ours: np.ndarray
    theirs: np.ndarray


def exported(run: MeasuredRun) -> Exported:
    """Write a run as the product's CSV files, and read them with a tracker's noise."""
    with TemporaryDirectory() as folder:
        stem = Path(folder) / "run"
        run.export.write(stem)
        samples = _read(stem.with_name("run_samples.csv"))
        events = _read(stem.with_name("run_events.csv"))
    time_s = _column(samples, "time_s")
    gaze = np.column_stack([_column(samples, "x_deg"), _column(samples, "y_deg")])
    gaze += np.random.default_rng(0).normal(0.0, NOISE_DEG, gaze.shape)
    saccades = [row for row in events if row["event"] == "saccade"]
    onset, length = _column(saccades, "onset_s"), _column(saccades, "duration_s")
    return Exported(time_s, gaze, np.column_stack([onset, onset + length]))


def pymovements_saccades(run: Exported) -> np.ndarray:
    """Return the saccades of Engbert & Kliegl's algorithm as pymovements has it."""
    import pymovements

    rate_hz = _rate_hz(run)
    recording = pymovements.gaze.from_numpy(
        time=np.round(1000.0 * run.time_s).astype(np.int64),
        position=run.gaze_deg.T,
        experiment=pymovements.Experiment(1920, 1080, 60, 34, 65, "center", rate_hz),
    )
    recording.pos2vel("smooth")
    each = (THRESHOLD_DEG_S / _FACTOR,) * 2
    recording.detect(
        "microsaccades", minimum_duration=_SHORTEST_MS, threshold=each, threshold_factor=_FACTOR
    )
    found = recording.events.frame.select("onset", "offset").to_numpy()
    return found.reshape(-1, 2) / 1000.0


def remodnav_saccades(run: Exported) -> np.ndarray:
    """Return the saccades of REMoDNaV (Dar, Wagner & Hanke 2021), those between fixations too."""
    import logging

    from remodnav import EyegazeClassifier

    logging.getLogger("remodnav").setLevel(logging.ERROR)
    judge = EyegazeClassifier(px2deg=1.0, sampling_rate=_rate_hz(run))
    data = np.rec.fromarrays(list(run.gaze_deg.T), names=["x", "y"])  # type: ignore[call-overload]
    events = judge(
        judge.preproc(data, savgol_length=_SMOOTHED_S), classify_isp=True, sort_events=True
    )
    spans = [(e["start_time"], e["end_time"]) for e in events if e["label"] in ("SACC", "ISAC")]
    return run.time_s[0] + np.array(spans).reshape(-1, 2)


def marks(run: Exported, seen: np.ndarray) -> Marks:
    """Compare a judge's saccades with ours.

    Args:
        run: what was judged.
        seen: (k, 2) onset and end of the judge's saccades.
    """
    begin, end = run.commanded.T[:, :, None]
    over = (seen[:, 0] <= end) & (seen[:, 1] >= begin)
    return Marks(np.asarray(over.any(axis=1)), np.asarray(over.any(axis=0)))


def _rate_hz(run: Exported) -> float:
    return float(round(1.0 / np.median(np.diff(run.time_s))))


def _read(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def _column(rows: list[dict[str, str]], name: str) -> np.ndarray:
    return np.array([float(row[name] or "nan") for row in rows])
