"""Reports of a rig of six hobby servos without a neck mark estimated results."""

import json
from html import unescape
from pathlib import Path

import numpy as np
import pytest
from desk import GAZE_JOINTS
from mixed_rig import mixed_text
from recorded_rigs import Run, recorded
from six_joints import SIX

from gazerig.config.schema import load_rig
from gazerig.features.lab.report import report as build
from gazerig.features.lab.report.compare import compare
from gazerig.features.lab.report.gaze_trace import GazeTrace, GazeTraceBuilder
from gazerig.features.lab.report.joint_basis import JointBasis
from gazerig.features.lab.report.page import RunHeader
from gazerig.robot.app.resimulate import rerun
from gazerig.robot.control.loop import Tick
from gazerig.robot.recording.export_csv import columns
from gazerig.robot.recording.gaze_angles import collect_gaze_angles

pytestmark = pytest.mark.usefixtures("ideal_servos")


@pytest.fixture(scope="module")
def maker(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return recorded(tmp_path_factory.mktemp("six") / "maker.mcap", load_rig("maker"), 4.2)


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return recorded(tmp_path_factory.mktemp("nine") / "desk.mcap", load_rig("desk"), 2.0)


def gathered(ticks: list[Tick]) -> GazeTrace:
    gathering = GazeTraceBuilder()
    for tick in ticks:
        gathering.update(tick)
    return gathering.trace()


def quiet(words: str, share: float) -> None:
    """Ignore progress."""


@pytest.mark.slow
@pytest.mark.usefixtures("unlaid_figures")
def test_a_report_of_estimated_joints_says_so_everywhere(maker: Run, tmp_path: Path) -> None:
    out = tmp_path / "six.html"
    about = RunHeader("six")
    made = build.make_report(build.read_run(maker.ticks, about, quiet), about, out, quiet)
    rows = {row["key"]: row for row in json.loads(made.data.read_text())}
    assert {row["basis"] for row in rows.values()} == {"estimated"}
    page = unescape(out.read_text(encoding="utf-8"))
    assert "Nothing here is measured: the servos of this rig have no feedback" in page
    assert "not measured" in page.partition("Saccades <span")[2][:120]
    assert "measured from the servos" not in page
    assert "{measured}" not in page and "line of sight of each eye, estimated" in page
    for key in ("head_slope", "head_share", "head_after", "head_peak", "vor", "vergence",
                "vergence_ok", "unasked"):  # fmt: skip
        assert key not in rows, key
    for key in ("head_part", "vor", "vergence"):
        assert not (tmp_path / "six_figures" / f"{key}.png").exists(), key
    assert (tmp_path / "six_figures" / "blink_shape.png").exists()
    assert "This rig has no neck" in page and "they stay parallel" in page


def test_a_report_of_measured_joints_claims_it(desk: Run) -> None:
    run = gathered(desk.ticks)
    assert run.joints == JointBasis(GAZE_JOINTS, ())
    assert run.joints.whole_basis == "measured"
    assert not any(run.joints.left_out(drawing.key) for drawing in build.DRAWINGS)
    assert np.isnan(run.column("lower_lid")).all() and np.isfinite(run.column("lid")).all()


@pytest.mark.usefixtures("unlaid_figures")
def test_a_measured_run_beside_a_estimated_one_is_warned_of(
    maker: Run, desk: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawings = [d for d in build.DRAWINGS if d.key in ("overview", "vor", "blink_shape")]
    monkeypatch.setattr(build, "DRAWINGS", tuple(drawings))
    abouts = RunHeader("desk"), RunHeader("maker")
    made = compare((desk.ticks, maker.ticks), abouts, tmp_path / "both.html", quiet)
    assert made.warning.startswith("desk is measured and maker is estimated")
    page = unescape(made.page.read_text(encoding="utf-8"))
    assert made.warning in page and "maker: Nothing here is measured" in page
    assert "maker: This rig has no neck" in page
    assert len(made.figures) == 3  # the desk rig has a neck to draw
    rows = json.loads(made.data.read_text())
    assert {tuple(row["basis"]) for row in rows} == {("measured", "estimated")}
    assert not {"vor", "vergence"} & {row["key"] for row in rows}
    alike = compare((desk.ticks, desk.ticks), abouts, tmp_path / "same.html", quiet)
    assert alike.warning == "" and "not measured" not in alike.page.read_text("utf-8")


@pytest.mark.parametrize(
    ("names", "key", "words"),
    [
        (SIX, "vor", "no neck"),
        (SIX, "vergence", "stay parallel"),
        (("left_eye_pan", "neck_yaw"), "vor", ""),
        (("left_eye_pan", "neck_yaw"), "head_slope", ""),
        (("left_eye_pan", "neck_pitch"), "vor", ""),
        (("left_eye_pan", "neck_pitch"), "head_part", "turns the head sideways"),
        (("left_eye_pan", "neck_roll"), "vor", "sideways or up"),
        (("left_eye_pan", "left_lower_lid"), "blink_rate", "no upper lids"),
        (("left_eye_pan", "left_upper_lid"), "blink_rate", ""),
        ((), "vor", ""),
    ],
)
def test_what_cannot_be_told_says_why(names: tuple[str, ...], key: str, words: str) -> None:
    why = JointBasis(names).left_out(key)
    assert (words in why) if words else why == ""


def test_a_rig_of_both_kinds_of_servos_is_measured_in_parts() -> None:
    eyes = JointBasis(GAZE_JOINTS, tuple(name for name in GAZE_JOINTS if "eye" in name))
    assert eyes.basis("Saccades") == "partly estimated" and eyes.basis("Lids") == "measured"
    assert eyes.whole_basis == "partly estimated" and eyes.left_out("unasked")
    lids = JointBasis(GAZE_JOINTS, ("left_upper_lid", "right_upper_lid"))
    assert lids.basis("Lids") == "estimated" and lids.basis("On the face") == "measured"
    assert not lids.left_out("unasked")


def test_hobby_eyes_on_a_neck_that_tells_its_place(tmp_path: Path) -> None:
    file = tmp_path / "mixed.yaml"
    file.write_text(mixed_text(), encoding="utf-8")
    mixed = recorded(tmp_path / "mixed.mcap", load_rig(str(file)), 1.0)
    seen = gathered(list(mixed.recording.ticks())).joints
    assert seen == JointBasis((*SIX, "neck_yaw", "neck_pitch"), SIX)
    assert seen.basis("Eyes and head") == "partly estimated" and seen.basis("Lids") == "estimated"
    trace = collect_gaze_angles(mixed.ticks)
    assert trace.basis("head") == "measured" and trace.basis("left") == "partly estimated"
    assert {"head_yaw_deg", "head_pitch_deg"} < set(columns(trace.joints))
    assert "head_roll_deg" not in columns(trace.joints)
    assert rerun(mixed.recording).is_same


def test_a_run_without_lids_has_no_blinks(maker: Run) -> None:
    bare = [
        tick._replace(
            guard_result=tick.guard_result._replace(joints=("eyes_pan", "eyes_tilt")),
            joints=tick.joints._replace(measured=(True, True)),
        )
        for tick in maker.ticks[:60]
    ]
    run = gathered(bare)
    assert np.isnan(run.column("lid")).all() and run.asked_blinks == ()
    assert not {"blink_rate", "evoked"} & {measure.key for measure in build.measure_run(run)}
