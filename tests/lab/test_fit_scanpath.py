"""The fit-scanpath command: recordings on disk -> a YAML that run takes, or one line why not."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from gazerig.config.load import load, shipped_path
from gazerig.drivers.errors import SetupError
from gazerig.features.lab.analysis.eye_tracker_csv import Samples
from gazerig.features.lab.analysis.fit_scanpath import fit_to_recording
from gazerig.features.lab.analysis.fixations import PartBoxes
from gazerig.gaze.scanpath.scanpath import (
    Scanpath,
    ScanpathParams,
    Walk,
    markov_walk,
    normalise,
    row_sums_note,
)
from gazerig.gaze.types import PARTS

WALK = load(shipped_path("scanpaths", "nakamoto_tsuruno"), Walk)

# A face of about 400 by 560 px in a picture of 800 by 800; y runs down.
BOXES_YAML = """\
UP: [300, 120, 500, 220]
RE: [240, 250, 370, 330]
LE: [430, 250, 560, 330]
N: [360, 335, 440, 450]
M: [320, 480, 480, 560]
DN: [330, 590, 470, 670]
FR: [190, 340, 300, 560]
FL: [500, 340, 610, 560]
"""
NAN = float("nan")


@pytest.fixture
def boxes(tmp_path: Path) -> PartBoxes:
    path = tmp_path / "parts.yaml"
    path.write_text(BOXES_YAML)
    return load(path, PartBoxes)


def walked(count: int, seed: int, dwell_s: float | None = None) -> Iterator[tuple[str, float]]:
    """Parts and dwell times of the known walk."""
    rng = np.random.default_rng(seed)
    walk = markov_walk(ScanpathParams(law="literal"), WALK, rng)
    part = 5
    for _ in range(count):
        mean_s, sd_s = WALK.dwell_mean_s[part], WALK.dwell_sd_s[part]
        drawn_s = float(rng.gamma((mean_s / sd_s) ** 2, sd_s**2 / mean_s)) + 1e-9
        yield PARTS[part], drawn_s if dwell_s is None else dwell_s
        part = walk.next_part(part)


def samples(boxes: PartBoxes, looks: Iterator[tuple[str, float]], seed: int) -> Samples:
    """An eye-tracker's view: 250 Hz, noise of 1.5 px, flights of 32 ms, some lost samples.

    Each look goes to another place of its part, so that a refixation can be seen.
    """
    rng, step_s = np.random.default_rng(seed), 0.004
    places: list[np.ndarray] = []
    at, before = np.array([0.0, 0.0]), ""
    left = True
    for part, dwell_s in looks:
        x0, y0, x1, y1 = boxes.boxes[part]
        left = not left if part == before else left
        share = np.array([0.2 if left else 0.8, rng.uniform(0.3, 0.7)])
        goal = np.array([x0, y0]) + share * np.array([x1 - x0, y1 - y0])
        flight = np.linspace(0.0, 1.0, 9)[1:-1, None]
        places += [at + flight * (goal - at), np.repeat(goal[None], round(dwell_s / step_s), 0)]
        at, before = goal, part
    p = np.concatenate(places).astype(np.float64)
    p += rng.normal(0.0, 1.5, p.shape)
    p[rng.random(len(p)) < 0.01] = NAN
    return Samples(np.arange(len(p)) * step_s, p[:, 0], p[:, 1], "")  # type: ignore[arg-type]


def as_csv(path: Path, s: Samples) -> Path:
    rows = [f"{t:.4f},{x:.2f},{y:.2f}\n" for t, x, y in zip(s.time_s, s.x, s.y, strict=True)]
    path.write_text("".join(["time,x,y\n", *rows]))
    return path


def test_labelled_fixations_are_taken_as_they_are(tmp_path: Path) -> None:
    """That a known walk comes back is tested where it is fitted: test_scanpath."""
    looks = "start,duration,part\n" + "".join(
        f"{300 * k},250,{'N' if k % 2 else 'RE'}\n" for k in range(80)
    )
    (tmp_path / "looks.csv").write_text(looks)
    report = fit_to_recording(tmp_path / "looks.csv", None, tmp_path / "mine.yaml")
    assert "80 fixations on the face, 0 elsewhere, 79 transitions" in report
    walk = load(tmp_path / "mine.yaml", Walk)
    nose, eye = walk.order.index("N"), walk.order.index("RE")
    assert normalise(walk.matrix)[nose, eye] > 0.9 and walk.start == "RE"
    assert walk.dwell_mean_s[nose] == pytest.approx(0.25)
    assert row_sums_note(walk) is None
    Scanpath(ScanpathParams(), walk, np.random.default_rng(1))


def test_samples_of_a_known_walk_give_it_back(tmp_path: Path, boxes: PartBoxes) -> None:
    # Looks of a fifth of a second: a detector needs at least 60 ms.
    recording = as_csv(tmp_path / "gaze.csv", samples(boxes, walked(1000, 2, 0.2), 3))
    out = tmp_path / "mine.yaml"
    report = fit_to_recording(recording, boxes, out, "none")
    walk = load(out, Walk)
    wanted, found = normalise(WALK.matrix), normalise(walk.matrix)
    for i, share in enumerate((0.0607, 0.0842, 0.0931, 0.0999, 0.2217, 0.0946, 0.2550, 0.0907)):
        n = 1000 * share * 0.85
        assert np.abs(found[i] - wanted[i]).max() < 4.0 * np.sqrt(0.25 / n), PARTS[i]
        assert walk.dwell_mean_s[i] == pytest.approx(0.2, abs=0.015), PARTS[i]
    assert "at 250 Hz" in report and "% lost; column time is in s" in report
    text = out.read_text()
    assert "#   gaze.csv" in text and "95 %" in text and "# from RE" in text


SAMPLE_ROWS = [f"{0.004 * k:.3f},400,400" for k in range(200)]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", r"bad\.csv: is empty"),
        ("0.0,400,400\n0.004,400,400\n", r"bad\.csv:1: no column time; found: 0\.0, 400, 400"),
        ("time,x,y\n0,1,2\n0.1,1\n", r"bad\.csv:3: 2 cells under 3 column names"),
        ("time,x,y\n0,1,2\n0.1,inf,2\n", r"bad\.csv:3: column x: 'inf' is not a finite"),
        ("time,x,y\n0,1,2\n0.2,1,2\n0.1,1,2\n", r"bad\.csv:4: column time: 0\.1 does not come"),
        ("time,x,y\n0,1,2\n4000,1,2\n8000,1,2\n", "steps of 4000 are neither seconds nor"),
        ("start,duration,part\n0,1,N\n1,0,N\n", r"bad\.csv:3: column duration: 0 is not above 0"),
        ("start,duration,part\n0,1,ear\n", r"bad\.csv:2: column part: no part 'ear'; known: DN"),
        ("\n".join(["time,x,y", *SAMPLE_ROWS]), "1 fixations on the face are too few"),
    ],
)  # fmt: skip
def test_files_that_cannot_be_trusted_are_refused(
    tmp_path: Path, boxes: PartBoxes, text: str, why: str
) -> None:
    recording, out = tmp_path / "bad.csv", tmp_path / "mine.yaml"
    recording.write_text(text)
    with pytest.raises(SetupError, match=why) as caught:
        fit_to_recording(recording, boxes, out)
    assert "\n" not in str(caught.value) and "bad.csv" in str(caught.value)
    assert not out.exists()


def test_the_smaller_of_two_overlapping_parts_is_meant() -> None:
    boxes = PartBoxes(FR=(0.0, 0.0, 100.0, 100.0), RE=(20.0, 20.0, 60.0, 40.0))
    assert boxes.part_at(30.0, 30.0) == "RE"
    assert boxes.part_at(30.0, 70.0) == "FR"
    assert boxes.part_at(130.0, 70.0) is None
