"""Keys with the names of the version before: read, reported once, rewritten on saving."""

import logging
import re
import shutil
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import pytest
from command_line import typed

from gazerig.config import renamed
from gazerig.config.allowed_folder import AllowedFolder
from gazerig.config.bounds import shapes_of
from gazerig.config.load import ConfigError
from gazerig.config.parameters import changed, value_of
from gazerig.config.rig import Rig
from gazerig.config.save import save_rig
from gazerig.config.schema import load_rig, load_rules
from gazerig.gaze.attention.action_planner import ActionPlannerParams
from gazerig.robot.app.resimulate import rerun
from gazerig.robot.recording.read import RunRecording

BEFORE = Path(__file__).parent / "before"
ROOT = Path(__file__).parents[1]
NOW = datetime(2026, 11, 22)


@pytest.fixture(autouse=True)
def nothing_reported(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    monkeypatch.setattr(renamed, "_reported", set())
    caplog.set_level(logging.WARNING, "gazerig.config")


def test_files_of_before_say_the_same(caplog: pytest.LogCaptureFixture) -> None:
    assert load_rig(str(BEFORE / "maker.yaml")) == load_rig("maker")
    assert load_rig("desk", str(BEFORE / "shy.yaml")) == load_rig("desk", "shy")
    planned = load_rules("boxing")  # since then there is an action planner
    assert load_rules(str(BEFORE / "boxing.yaml")) == replace(
        planned, planner=ActionPlannerParams()
    )
    lines = [record.message for record in caplog.records]
    assert len(lines) == len(set(lines)) == 12 + 3 + 3
    maker = f"{BEFORE}/maker.yaml"
    assert (
        f"{maker}:40: joints.eyes_pan.servo_deg_s is called joints.eyes_pan.servo_speed_deg_s now; "
        "its old name is read for this version only"
    ) in lines
    load_rig(maker)
    assert len(caplog.records) == len(lines)  # once


def test_what_is_named_as_now_is_not_reported(caplog: pytest.LogCaptureFixture) -> None:
    for rig in ("desk", "feetech", "maker"):
        load_rig(rig)
    assert not caplog.records


def test_both_names_at_once_are_refused(tmp_path: Path) -> None:
    text = (BEFORE / "shy.yaml").read_text(encoding="utf-8")
    old = "    pull_least: 0.3"
    assert old in text
    mine = tmp_path / "shy.yaml"
    mine.write_text(text.replace(old, f"{old}\n    min_salience: 0.4", 1), encoding="utf-8")
    with pytest.raises(ConfigError) as refused:
        load_rig("desk", str(mine))
    (line,) = str(refused.value).splitlines()
    assert re.search(
        r"shy\.yaml:\d+: gaze\.head\.pull_least: is the old name of min_salience", line
    )


def test_saving_writes_the_names_of_now(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    mine = tmp_path / "maker.yaml"
    shutil.copy(BEFORE / "maker.yaml", mine)
    before = mine.read_text(encoding="utf-8")
    saved = save_rig(mine, {"joints.eyes_pan.servo_deg_s": 500.0}, NOW)
    assert [change.key for change in saved.changes] == ["joints.eyes_pan.servo_speed_deg_s"]
    after = mine.read_text(encoding="utf-8")
    expected = before.replace("servo_deg_s:", "servo_speed_deg_s:")
    expected = expected.replace("linkage:", "transmission_points:")
    assert after == expected.replace("servo_speed_deg_s: 600.0", "servo_speed_deg_s: 500.0", 1)
    caplog.clear()
    assert load_rig(str(mine)).joints["eyes_pan"].servo_speed_deg_s == 500.0
    assert not caplog.records


def test_a_file_with_old_names_is_untouched_where_nothing_changes(tmp_path: Path) -> None:
    mine = tmp_path / "maker.yaml"
    shutil.copy(BEFORE / "maker.yaml", mine)
    assert save_rig(mine, {"joints.eyes_pan.servo_deg_s": 600.0}, NOW).backup is None
    assert mine.read_bytes() == (BEFORE / "maker.yaml").read_bytes()


def test_old_keys_are_understood_while_the_rig_runs() -> None:
    rig = load_rig("desk")
    other = changed(rig, {"gaze.head.pull_least": 0.3, "guard.stuck": {"stuck_ms": 200.0}})
    camera = changed(rig, {"camera_care.give_up_s": 30.0, "motion.confirm_pictures": 4})
    assert (camera.camera_recovery.give_up_s, camera.motion.confirm_frames) == (30.0, 4)
    camera = changed(rig, {"camera_care.give_up_s": 30.0, "motion.confirm_pictures": 4})
    assert (camera.camera_recovery.give_up_s, camera.motion.confirm_frames) == (30.0, 4)
    assert (other.gaze.head.min_salience, other.guard.stall.detection_ms) == (0.3, 200.0)
    assert value_of(other, "guard.stuck.stuck_ms") == 200.0
    assert changed(rig, {"gaze.top_down.rules.wait.pull": 0.6}).gaze.top_down.rules[
        "wait"
    ].salience == pytest.approx(0.6)


def test_no_file_elsewhere_can_be_named_by_an_old_key(tmp_path: Path) -> None:
    for changes in (
        {"gaze.scanpath.walk": "/etc/passwd.yaml"},
        {"gaze": {"scanpath": {"walk": "/etc/passwd.yaml"}}},
    ):
        with pytest.raises(ConfigError, match="only files in"):
            AllowedFolder(tmp_path).changes(changes)


def test_the_table_leads_from_keys_that_are_gone_to_keys_that_are_there() -> None:
    paper = (ROOT / "docs" / "config-changes.md").read_text(encoding="utf-8")
    for old, new in renamed.RIG.items():
        *above, last = old.split(".")
        if above == ["guard", "stall"]:  # itself another name
            assert renamed.RIG["guard.stuck"] == "stall"
        params: type | None = Rig
        for step in above:
            shape = shapes_of(params)[step] if params is not None else None
            if shape is not None:
                params = shape.params or (shape.inner.params if shape.inner else None)
            if step in ("joints", "rules"):
                wild = params
                params = None
            elif step == "*":
                params = wild
        assert params is not None and new in shapes_of(params), old
        assert last not in shapes_of(params), old
        assert f"`{old}`" in paper and f"`{new}`" in paper, old


def test_a_recording_of_before_is_run_with_the_models_of_now(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """Its configuration, and a change while it ran, have the old names."""
    recording = RunRecording(BEFORE / "names.mcap")
    for old in ("stale_picture_ms:", "camera_care:", "confirm_pictures:"):
        assert old in recording.info.config_yaml
    found = rerun(recording)
    assert found.ticks == 79 and (found.differs or "").startswith("gaze")
    assert not [line for line in caplog.messages if "yaml" in line]  # a recording cannot be mended


def test_a_recording_with_old_names_gives_the_same_to_the_bit(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "run.mcap"
    words = ("--mock", "--fast", "--no-page", "--seconds", "0.5", "--record", str(file))
    assert typed("run", *words) == 0, capfd.readouterr().err
    recording = RunRecording(file)
    text = recording.info.config_yaml
    for new, old in (
        ("frame_timeout_ms:", "stale_picture_ms:"),
        ("camera_recovery:", "camera_care:"),
        ("confirm_frames:", "confirm_pictures:"),
    ):
        assert text.count(new) == 1
        text = text.replace(new, old)
    recording.info = replace(recording.info, config_yaml=text)
    found = rerun(recording)
    assert found.same and found.ticks == found.agreeing > 90
    assert found.tx_same is True
