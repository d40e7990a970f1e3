"""Reports of a rig of six hobby servos without a neck mark estimated results."""

import json
from html import unescape
from pathlib import Path

import pytest
from desk import GAZE_JOINTS
from recorded_rigs import Run, recorded
from six_joints import SIX

from gazerig.config.schema import load_rig
from gazerig.features.lab.report.joint_basis import JointBasis
from gazerig.features.lab.report.page import RunHeader

pytestmark = pytest.mark.usefixtures("ideal_servos")


@pytest.fixture(scope="module")
def maker(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return recorded(tmp_path_factory.mktemp("six") / "maker.mcap", load_rig("maker"), 4.2)


def quiet(words: str, share: float) -> None:
    """Ignore progress."""


@pytest.mark.slow
@pytest.mark.usefixtures("unlaid_figures")
def test_a_report_of_estimated_joints_says_so_everywhere(maker: Run, tmp_path: Path) -> None:
    from gazerig.features.lab.report.report import make_report, read_run

    out = tmp_path / "six.html"
    about = RunHeader("six")
    made = make_report(read_run(maker.ticks, about, quiet), about, out, quiet)
    rows = {row["key"]: row for row in json.loads(made.data.read_text())}
    assert {row["basis"] for row in rows.values()} == {"estimated"}
    page = unescape(out.read_text(encoding="utf-8"))
    assert "Nothing here is measured: the servos of this rig have no feedback" in page
    assert "not measured" in page.partition("Saccades <span")[2][:120]
    assert "measured from the servos" not in page
    for key in ("head_slope", "head_share", "head_after", "head_peak", "vor", "vergence",
                "vergence_ok", "unasked"):  # fmt: skip
        assert key not in rows, key
    drawn = {path.stem for path in (tmp_path / "six_figures").iterdir()}
    assert "blink_shape" in drawn and drawn.isdisjoint(("head_part", "vor", "vergence"))
    assert "This rig has no neck" in page and "they stay parallel" in page


@pytest.mark.parametrize(
    ("names", "key", "words"),
    [
        (SIX, "vor", "no neck"),
        (("left_eye_pan", "neck_yaw"), "vor", ""),
        (("left_eye_pan", "neck_pitch"), "head_part", "turns the head sideways"),
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
