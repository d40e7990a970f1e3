"""The command run in simulated time, end to end: from picture to servo bytes."""

import json
import re
from typing import Any

import cv2
import numpy as np
import pytest
from command_line import figures, gazerig, typed
from slow_rigs import at_rate

from gazerig.config.schema import load_rig
from gazerig.features.lab.report.gaze_trace import PHASES
from gazerig.features.lab.simulated_run import simulate
from gazerig.robot.recording.read import RunRecording
from gazerig.robot.run.options import RunOptions


def test_a_round_of_the_visitor_who_comes_moves_waves_leaves_and_comes_back(tmp_path):
    slow = at_rate(tmp_path, "desk", 50.0)
    asked = RunOptions(True, True, seed=1, scene="visitor", rig=slow, seconds=44.0)
    visitor = simulate(load_rig(slow), asked)
    figures: dict[str, Any] = visitor.figures
    assert {"wall_seconds", "faces_seen", "pictures", "fixations"} <= set(figures)
    assert figures["stopped_by"] == "seconds" and figures["overruns"] == 0
    assert figures["ticks"] == pytest.approx(44 * 50, abs=2)
    bus = figures["bus"]
    assert bus["errors"] == {} and bus["tx_bytes"] > 0 and bus["rx_bytes"] > 0
    share = figures["target_share"]
    nobody = sum(share.get(kind, 0.0) for kind in ("rest", "search", "glance"))
    assert share["face"] > 0.6 and share["hand"] > 0.02 and nobody > 0.02
    assert 1.5 < figures["saccades"] / figures["seconds"] < 5.5
    assert 5 <= figures["blinks"] <= 40
    trace = visitor.trace
    resting = trace.slow() & (trace.column("phase") != PHASES.index("saccade"))
    off_deg = trace.column("off").mean(axis=1)[resting]
    assert np.median(off_deg) < 0.3
    # A new target waits a reaction time and the gap after a saccade.
    assert np.percentile(off_deg, 95.0) < 6.5


def test_e59_before_a_photo_same_seed_same_bytes_in_another_process(tmp_path):
    data = pytest.importorskip("skimage.data", reason="scikit-image ships the photo")
    photo = str(tmp_path / "photo.png")
    cv2.imwrite(photo, np.ascontiguousarray(data.astronaut()[:, :, ::-1]))
    rig = at_rate(tmp_path, "desk", 50.0)
    words = (rig, "--video", photo, "--seconds", "2", "--seed")
    recording = tmp_path / "run.mcap"
    record = ("--record", str(recording), "--summary", "-")
    done = gazerig("run", "--mock", "--fast", *record, *words, "1")
    assert done.returncode == 0, done.stderr
    assert RunRecording(recording).end.stopped_by == "seconds"
    one: dict[str, Any] = json.loads(done.stdout)
    again = figures(*words, "1")
    assert one.pop("wall_seconds") > 0.0 and again.pop("wall_seconds") > 0.0
    assert again == one
    assert again["faces_seen"] == again["pictures"] >= 17
    assert again["target_share"]["face"] > 0.8  # after a reaction time
    assert re.fullmatch(r"[0-9a-f]{64}", again["bus"]["tx_sha256"])
    others = {figures(rig, "--seconds", "0.5", "--seed", seed)["bus"]["tx_sha256"] for seed in "12"}
    assert len(others) == 2


FAULTS = (
    (("--mock", "--video", "nowhere.avi"), "nowhere.avi"),
    (("--scene", "visitor"), "/dev/ttyUSB0"),
    (("--mock", "--scene", "visitor", "--video", "x.avi"), "exclude each other"),
    (("--mock", "--fast", "--video", "x.avi"), "--seconds"),
    (("--fast",), "--fast needs --mock"),
    (("--port", "/dev/ttyNOPE"), "no serial port /dev/ttyNOPE"),
    ((), "nothing to look at"),
    (("--mock", "--page", "8080"), "HOST:PORT"),
    (("nosuchrig", "--mock"), "nosuchrig"),
    (("--mock", "--scene", "circus"), "circus"),
    (("--mock", "--profile", "giant"), "giant"),
)


def test_what_a_person_can_mend_is_one_line_and_exit_code_2(capfd):
    for words, message in FAULTS:
        code, said = typed("run", "--no-page", *words), capfd.readouterr().err
        assert (code, message in said, said.count("\n")) == (2, True, 1), said
