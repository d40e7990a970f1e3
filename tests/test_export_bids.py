"""A run exported as a BIDS data set, which the official validator reads."""

import gzip
import json
import shutil
import subprocess
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from exported_run import RATE_HZ, Run, seen

from gazerig.drivers.errors import SetupError
from gazerig.robot.recording.export_bids import DatasetDescription, bids_label, write_bids
from gazerig.robot.recording.gaze_angles import RecordedTurn, gaze_in_space

pytestmark = pytest.mark.usefixtures("ideal_servos")

ABOUT = DatasetDescription(
    "desk", "face-to-face", RATE_HZ, "2026-01-01T00:00:00+00:00", "gazerig 0"
)


@pytest.fixture(scope="module")
def face() -> Run:
    """Twelve seconds in front of a person."""
    return Run(seen("face-to-face", 12.0))


@pytest.fixture(scope="module")
def bids(face: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same run as a data set."""
    root = tmp_path_factory.mktemp("bids")
    write_bids(face.trace, face.labels, face.stretches, ABOUT, root)
    return root


def table(path: Path) -> list[list[str]]:
    """Lines of a compressed table."""
    with gzip.open(path, "rt", encoding="utf-8") as file:
        return [line.rstrip("\n").split("\t") for line in file]


def test_a_data_set_has_its_files(bids: Path) -> None:
    files = {str(path.relative_to(bids)) for path in bids.rglob("*") if path.is_file()}
    stem = "sub-desk/beh/sub-desk_task-facetoface_recording-eye"
    assert files == {
        "dataset_description.json", "README.md", "participants.tsv", "participants.json",
        *(f"{stem}{k}_{kind}" for k in (1, 2, 3) for kind in
          ("physio.tsv.gz", "physio.json", "physioevents.tsv.gz", "physioevents.json")),
    }  # fmt: skip
    assert json.loads((bids / "dataset_description.json").read_text())["BIDSVersion"] == "1.11.1"
    assert (bids / "participants.tsv").read_text() == "participant_id\tspecies\nsub-desk\trobot\n"


@pytest.mark.parametrize(("eye", "recorded"), [(1, "left"), (2, "right"), (3, "cyclopean")])
def test_a_recording_is_headerless_and_even(face: Run, bids: Path, eye: int, recorded: str) -> None:
    stem = bids / f"sub-desk/beh/sub-desk_task-facetoface_recording-eye{eye}_physio"
    sidecar = json.loads(stem.with_suffix(".json").read_text())
    assert sidecar["PhysioType"] == "eyetrack" and sidecar["RecordedEye"] == recorded
    assert sidecar["SamplingFrequency"] == RATE_HZ and sidecar["StartTime"] == 0.0
    assert sidecar["SampleCoordinateSystem"] == "gaze-in-world"
    assert sidecar["RecordingStartUTC"] == "2026-01-01T00:00:00+00:00"
    assert 0.005 <= sidecar["EventLag"] <= 0.03  # two to six ticks from a goal to its motion
    columns = sidecar["Columns"]
    assert columns[:3] == ["timestamp", "x_coordinate", "y_coordinate"]
    assert {sidecar[name]["Units"] for name in columns[1:3]} == {"deg"}
    lines = table(stem.with_suffix(".tsv.gz"))
    assert {len(line) for line in lines} == {len(columns)} and len(lines) == len(face.ticks)
    space = gaze_in_space(face.ticks[700].pose)
    assert float(lines[700][1]) == pytest.approx(space[eye - 1][0], abs=6e-5)


def test_events_are_indexed_by_the_timestamps(face: Run, bids: Path) -> None:
    stem = bids / "sub-desk/beh/sub-desk_task-facetoface_recording-eye3_physioevents"
    sidecar = json.loads(stem.with_suffix(".json").read_text())
    assert sidecar["OnsetSource"] == "timestamp" and sidecar["Columns"][0] == "onset"
    lines = table(stem.with_suffix(".tsv.gz"))
    assert {len(line) for line in lines} == {len(sidecar["Columns"])}
    kinds = Counter(line[2] for line in lines)
    assert kinds["saccade"] == len(face.onsets_s("saccade"))
    assert kinds["n/a"] == len(face.trace.messages) > 0
    onsets = [float(line[0]) for line in lines]
    assert onsets == sorted(onsets)
    assert {"LE", "RE"} <= {line[sidecar["Columns"].index("part")] for line in lines}


def test_a_message_of_any_text_is_one_cell(face: Run, tmp_path: Path) -> None:
    short = Run(face.ticks[:50])
    trace = short.trace._replace(messages=((0.1, "a servo\tsays\r\nthis \u2028 and that"),))
    write_bids(trace, short.labels, (), ABOUT, tmp_path)
    (path,) = tmp_path.rglob("*eye1_physioevents.tsv.gz")
    (line,) = gzip.decompress(path.read_bytes()).decode().splitlines()
    cells = line.split("\t")
    assert cells[0] == "0.100000" and cells[1:-1] == ["n/a"] * 6
    assert cells[-1] == "a servo says this and that"


def test_a_turn_is_an_event_with_its_partner_and_text(face: Run, tmp_path: Path) -> None:
    short = Run(face.ticks[:50])
    turn = RecordedTurn(0.1, 2.5, "speaking", 1, "Good\tmorning.")
    write_bids(short.trace._replace(turns=(turn,), messages=()), short.labels, (), ABOUT, tmp_path)
    (path,) = tmp_path.rglob("*eye1_physioevents.tsv.gz")
    cells = gzip.decompress(path.read_bytes()).decode().rstrip("\n").split("\t")
    assert cells[:3] == ["0.100000", "2.500000", "turn_speaking"]
    assert cells[5:] == ["face 1", "n/a", "Good morning."]
    levels = json.loads(path.with_name(path.name.replace("tsv.gz", "json")).read_text())
    assert cells[2] in levels["trial_type"]["Levels"]


@pytest.mark.parametrize(
    "there",
    [
        {"GeneratedBy": [{"Name": "another program"}]},
        {"Name": "mine"},
        {"GeneratedBy": "gazerig"},
        ["gazerig"],
        "no JSON",
    ],
)
def test_a_run_is_not_put_into_the_data_set_of_another_program(
    face: Run, tmp_path: Path, there: object
) -> None:
    short = Run(face.ticks[:50])
    about = tmp_path / "dataset_description.json"
    about.write_text(there if isinstance(there, str) else json.dumps(there))
    before = about.read_bytes()
    with pytest.raises(SetupError, match="is not a data set of gazerig: use another folder"):
        write_bids(short.trace, short.labels, short.stretches, ABOUT, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == [about.name]
    write_bids(short.trace, short.labels, short.stretches, ABOUT, tmp_path, force=True)
    assert about.read_bytes() == before and list(tmp_path.rglob("*_physio.tsv.gz"))


def test_a_missed_slot_is_a_row_without_values(face: Run, tmp_path: Path) -> None:
    ticks = [*face.ticks[1000:1010], *face.ticks[1013:1020]]
    gap = Run(ticks)
    write_bids(gap.trace, gap.labels, gap.stretches, ABOUT, tmp_path)
    (path,) = tmp_path.rglob("*eye1_physio.tsv.gz")
    lines = table(path)
    assert len(lines) == 20
    assert [line[1] == "n/a" for line in lines] == [10 <= k < 13 for k in range(20)]
    assert np.diff([float(line[0]) for line in lines]) == pytest.approx(0.005, abs=2e-6)


def test_a_second_run_joins_the_data_set_and_none_is_written_over(
    face: Run, tmp_path: Path
) -> None:
    short = Run(face.ticks[:50])
    write_bids(short.trace, short.labels, short.stretches, ABOUT, tmp_path)
    with pytest.raises(SetupError, match="another --subject or --task"):
        write_bids(short.trace, short.labels, short.stretches, ABOUT, tmp_path)
    other = ABOUT._replace(subject="stage rig")
    write_bids(short.trace, short.labels, short.stretches, other, tmp_path)
    participants = (tmp_path / "participants.tsv").read_text().splitlines()
    assert participants[1:] == ["sub-desk\trobot", "sub-stagerig\trobot"]


def test_the_same_run_gives_the_same_bytes(face: Run, tmp_path: Path) -> None:
    short = Run(face.ticks[:50])
    for name in "ab":
        write_bids(short.trace, short.labels, short.stretches, ABOUT, tmp_path / name)
    for path in (tmp_path / "a").rglob("*.gz"):
        twin = tmp_path / "b" / path.relative_to(tmp_path / "a")
        assert path.read_bytes() == twin.read_bytes()
        assert path.read_bytes()[4:8] == bytes(4)  # RFC 1952: no time, so also a second later


def test_labels_are_letters_and_digits() -> None:
    assert bids_label("face-to-face 2") == "facetoface2" and bids_label("--") == "unnamed"


def test_the_official_validator_has_nothing_to_say_against_it(bids: Path) -> None:
    program = shutil.which("bids-validator-deno")
    if program is None:
        pytest.skip("no bids-validator-deno in the path: pip install bids-validator-deno")
    done = subprocess.run(
        [program, "--format", "json", "--max-rows", "-1", str(bids)],
        capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    issues = json.loads(done.stdout)["issues"]["issues"]
    assert [issue for issue in issues if issue.get("severity") == "error"] == []
    assert any(issue["severity"] == "warning" for issue in issues)  # it did look


def test_numbers_that_are_none_are_not_written() -> None:
    from gazerig.robot.recording.export_csv import number

    assert number(None) == "" and number(float("nan")) == "" and number(1.25, 1) == "1.2"
