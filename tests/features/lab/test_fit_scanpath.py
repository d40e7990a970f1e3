"""The fit-scanpath command: recordings on disk -> a YAML that run takes, or one line why not."""

import numpy as np
import pytest
from command_line import invoked

from gazerig.config.load import load
from gazerig.drivers.errors import SetupError
from gazerig.features.lab.analysis.eye_tracker_csv import Samples, read_recording
from gazerig.features.lab.analysis.fit_scanpath import PartBoxes, fit_to_recording
from gazerig.gaze.scanpath.scanpath import (
    Scanpath,
    ScanpathParams,
    Walk,
    normalise,
    row_sums_note,
)

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
def boxes(tmp_path) -> PartBoxes:
    path = tmp_path / "parts.yaml"
    path.write_text(BOXES_YAML)
    return PartBoxes.read(path)


def test_samples_become_fixations_of_parts(tmp_path, boxes):
    """That a known walk comes back is tested where it is fitted: test_scanpath."""
    # 250 Hz, looks of a fifth of a second at two parts in turn, noise of 1.5 px, some lost.
    places = np.repeat([(300.0, 290.0), (400.0, 390.0)] * 50, 50, axis=0)
    places += np.random.default_rng(3).normal(0.0, 1.5, places.shape)
    rows = [f"{0.004 * k:.3f},{x:.2f},{y:.2f}" for k, (x, y) in enumerate(places)]
    rows[::100] = [f"{row.split(',')[0]},," for row in rows[::100]]
    (tmp_path / "gaze.csv").write_text("\n".join(["time,x,y", *rows]))
    out = tmp_path / "mine.yaml"
    report = fit_to_recording(tmp_path / "gaze.csv", boxes, out)
    walk = load(out, Walk)
    nose, eye = walk.order.index("N"), walk.order.index("RE")
    assert normalise(walk.matrix)[nose, eye] > 0.9 and walk.start == "RE"
    assert walk.dwell_mean_s[nose] == pytest.approx(0.2, abs=0.015)
    assert "at 250 Hz" in report and "% lost; column time is in s" in report
    assert "#   gaze.csv" in out.read_text()


def test_labelled_fixations_are_taken_as_they_are(tmp_path):
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


TOBII = """\
Recording timestamp [\u03bcs]\tSensor\tEvent\tGaze point X [DACS px]\tGaze point Y [DACS px]
0\t\tRecordingStart\t\t
0\tEye Tracker\t\t400,5\t300
1000\tMouse\tMouseEvent\t\t
4000\tEye Tracker\t\t\t
8000\tEye Tracker\t\t401\t300,25
"""
STUDIO = """\
RecordingTimestamp\tGazePointX (ADCSpx)\tGazePointY (ADCSpx)
0\t400.5\t300
4\t\t
8\t401\t300.25
"""
NEON = """\
section id,timestamp [ns],gaze x [px],gaze y [px],worn,gaze position in reference image x [px],\
gaze position in reference image y [px]
a,1700000000000000000,7.5,7.5,1,400.5,300
a,1700000000004000000,7.5,7.5,1,,
a,1700000000008000000,7.5,7.5,1,401,300.25
"""
OWN = """\
clock;horizontal;vertical
0;400,5;300
4000;NA;.
8000;401;300,25
"""
MAPPED = {"time": "Clock", "x": "horizontal", "y": "vertical"}


@pytest.mark.parametrize(
    ("text", "encoding", "mapping", "note"),
    [
        (TOBII, "utf-16", {}, "column Recording timestamp [\u03bcs] is in us (from its name)"),
        (STUDIO, "utf-8-sig", {}, "column RecordingTimestamp is in ms (from a median of 4)"),
        (NEON, "utf-8", {}, "column timestamp [ns] is in ns (from its name)"),
        (OWN, "utf-8", MAPPED, "column clock is in us (from a median of 4000)"),
        (OWN, "utf-8", {**MAPPED, "time": "clock [us]"}, "column clock is in us (from its name)"),
    ],
)
def test_exports_of_trackers_are_read_by_their_own_columns(tmp_path, text, encoding, mapping, note):
    (tmp_path / "export.tsv").write_text(text, encoding=encoding)
    read = read_recording(tmp_path / "export.tsv", mapping)
    assert isinstance(read, Samples) and read.note == note
    assert read.time_s - read.time_s[0] == pytest.approx([0.0, 0.004, 0.008], abs=1e-6)
    assert read.x == pytest.approx([400.5, NAN, 401.0], nan_ok=True)
    assert read.y == pytest.approx([300.0, NAN, 300.25], nan_ok=True)


def test_fixations_of_neon_have_places_and_columns_are_mapped(tmp_path):
    lines = ["start timestamp [ns],took_ms,fixation x [px],fixation y [px]"]
    for k in range(80):
        place = "400,390" if k % 2 else "300,290"
        lines.append(f"{1_700_000_000_000_000_000 + 300_000_000 * k},250,{place}")
    recording, parts, out = (tmp_path / name for name in ("looks.csv", "parts.yaml", "mine.yaml"))
    recording.write_text("\n".join(lines))
    parts.write_text(BOXES_YAML)
    words = "fit-scanpath", str(recording), "--out", str(out)
    for wrong, why in (
        (("--map=duration",), "not NAME=COLUMN"),
        (("--map=duration=there",), "no column there for duration"),
        (("--map=duration=took",), "fixations without parts need their rectangles"),
    ):
        done = invoked(*words, *wrong)
        assert done.code == 2 and why in done.err and done.err.count("\n") == 1
    assert invoked(*words, "--map=duration=took", "--parts", str(parts)).code == 0
    walk = load(out, Walk)
    assert normalise(walk.matrix)[walk.order.index("N"), walk.order.index("RE")] > 0.9
    assert walk.dwell_mean_s == pytest.approx([0.25] * 8)


SAMPLE_ROWS = [f"{0.004 * k:.3f},400,400" for k in range(200)]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", r"bad\.csv: is empty"),
        ("0.0,400,400\n0.004,400,400\n", r"bad\.csv:1: no column time; found: 0\.0, 400, 400"),
        ("time,x,y\n0,1,2\n0.1,1\n", r"bad\.csv:3: 2 cells under 3 column names"),
        ("time,x,y\n0,1,2\n0.1,inf,2\n", r"bad\.csv:3: column x: 'inf' is not a finite"),
        ("time,x,y\n0,1,2\n0.2,1,2\n0.1,1,2\n", r"bad\.csv:4: column time: 0\.1 does not come"),
        ("time [h],x,y\n0,1,2\n1,1,2\n", "h is no unit of time; known: s, ms, us, ns"),
        ("time,x,y\nnull,1,2\n1,1,2\n", r"bad\.csv:2: column time: the number is missing"),
        ("time,x,y\n0,na,2\n1,.,2\n", "the eye is lost in all 2 samples"),
        ("start,duration,part\n0,1,N\n1,0,N\n", r"bad\.csv:3: column duration: 0 is not above 0"),
        ("start,duration,part\n0,1,ear\n", r"bad\.csv:2: column part: no part 'ear'; known: DN"),
        ("\n".join(["time,x,y", *SAMPLE_ROWS]), "1 fixations on the face are too few"),
    ],
)  # fmt: skip
def test_files_that_cannot_be_trusted_are_refused(tmp_path, boxes, text, why):
    recording, out = tmp_path / "bad.csv", tmp_path / "mine.yaml"
    recording.write_text(text)
    with pytest.raises(SetupError, match=why) as caught:
        fit_to_recording(recording, boxes, out)
    assert "\n" not in str(caught.value) and "bad.csv" in str(caught.value)
    assert not out.exists()


def test_the_smaller_of_two_overlapping_parts_is_meant():
    boxes = PartBoxes({"FR": (0.0, 0.0, 100.0, 100.0), "RE": (20.0, 20.0, 60.0, 40.0)})
    assert boxes.part_at(30.0, 30.0) == "RE"
    assert boxes.part_at(30.0, 70.0) == "FR"
    assert boxes.part_at(130.0, 70.0) is None
