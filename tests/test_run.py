"""The command, end to end: picture to servo bytes, in processes of its own."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

MEDIA = Path(__file__).parents[2] / "shared" / "media"
MODELS = Path(__file__).parents[2] / "shared" / "models"
DESK = Path(__file__).parents[1] / "config" / "rigs" / "desk.yaml"
GAZERIG = [sys.executable, "-c", "from robot.cli.main import main; main()"]


def gazerig(*words: str, timeout: float = 120.0) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*GAZERIG, *words], capture_output=True, text=True, timeout=timeout, check=False
    )


def figures(*words: str) -> dict[str, Any]:
    done = gazerig("run", "--mock", "--fast", "--summary", "-", *words)
    assert done.returncode == 0, done.stderr
    parsed: dict[str, Any] = json.loads(done.stdout)
    return parsed


@pytest.fixture(scope="module")
def visitor() -> dict[str, Any]:
    """One round of the visitor: comes, moves, waves, leaves and comes back."""
    return figures("--seconds", "44", "--seed", "1")


def test_summary_tells_all_it_promises(visitor: dict[str, Any]) -> None:
    promised = {
        "seconds", "wall_seconds", "ticks", "overruns", "faces_seen", "pictures", "fixations",
        "saccades", "blinks", "target_share", "part_share", "gaze_error_deg", "limited", "bus",
        "stopped_by",
    }  # fmt: skip
    assert promised <= set(visitor)
    assert {"tx_bytes", "rx_bytes", "errors"} <= set(visitor["bus"])
    assert visitor["stopped_by"] == "seconds" and visitor["overruns"] == 0
    assert visitor["ticks"] == pytest.approx(44 * 200, abs=2)


def test_the_head_looks_at_the_visitor(visitor: dict[str, Any]) -> None:
    share = visitor["target_share"]
    nobody = sum(share.get(kind, 0.0) for kind in ("rest", "search", "glance"))
    assert share["face"] > 0.6 and share["hand"] > 0.02 and nobody > 0.02
    assert len(visitor["part_share"]) == 8
    assert visitor["gaze_error_deg"]["median"] < 0.3
    assert visitor["gaze_error_deg"]["p95"] < 2.0
    assert visitor["bus"]["errors"] == {}
    assert 1.5 < visitor["saccades"] / visitor["seconds"] < 4.5
    assert 5 <= visitor["blinks"] <= 40


def test_e59_same_seed_same_bytes_in_another_process() -> None:
    one, again = (figures("--seconds", "14", "--seed", "1") for _ in range(2))
    assert one.pop("wall_seconds") > 0.0 and again.pop("wall_seconds") > 0.0
    assert again == one
    assert re.fullmatch(r"[0-9a-f]{64}", again["bus"]["tx_sha256"])
    other = figures("--seconds", "14", "--seed", "2")
    assert other["bus"]["tx_sha256"] != again["bus"]["tx_sha256"]


def test_boxing_shows_the_papers_five_behaviours_with_their_latencies() -> None:
    run = figures("--scene", "boxing")
    seen = run["behaviours"]
    for name in ("punch", "attack", "face", "wave", "reach"):
        assert seen[name]["seen"] == seen[name]["of"] > 0, name
    assert seen["punch"]["latency_s"] <= 0.4 and seen["wave"]["latency_s"] <= 0.4
    assert run["seconds"] == pytest.approx(45.0, abs=0.1)


def test_a_heat_map_of_a_face_is_a_picture(tmp_path: Path) -> None:
    out = tmp_path / "heat.png"
    run = figures("--scene", "face-to-face", "--seconds", "10", "--heatmap", str(out))
    picture = cv2.imread(str(out))
    assert run["target_share"]["face"] > 0.9
    assert picture is not None and picture.shape[0] > 400 and picture.std() > 10.0


def photo(path: Path) -> Path:
    data = pytest.importorskip("skimage.data", reason="scikit-image ships the photo")
    cv2.imwrite(str(path), np.ascontiguousarray(data.astronaut()[:, :, ::-1]))
    return path


def test_a_photo_is_looked_at_and_gives_the_same_bytes_twice(tmp_path: Path) -> None:
    picture = photo(tmp_path / "photo.png")
    runs = [figures("--video", str(picture), "--seconds", "4") for _ in range(2)]
    assert runs[0]["faces_seen"] == runs[0]["pictures"] >= 35
    assert runs[0]["target_share"]["face"] > 0.9
    assert runs[0]["bus"] == runs[1]["bus"]


@pytest.mark.skipif(not MEDIA.is_dir(), reason=f"films are not at {MEDIA}")
@pytest.mark.parametrize("network", ["mtcnn", "yunet"])
def test_a_film_of_two_talking_people(network: str, tmp_path: Path) -> None:
    rig = tmp_path / "rig.yaml"
    # Faces are what is asked about: motion is left out, and half the rate will do.
    text = DESK.read_text(encoding="utf-8")
    text = text.replace("  enabled: true  # look", "  enabled: false  # look")
    text = text.replace("rate_hz: 200.0  # Hz, 20", "rate_hz: 100.0  # Hz, 20")
    if network == "yunet":
        (model,) = MODELS.glob("*.onnx")
        text = re.sub(r"kind: mtcnn", "kind: yunet", text)
        text = re.sub(r'model_file: ""', f"model_file: {model}", text)
    rig.write_text(text, encoding="utf-8")
    run = figures(str(rig), "--video", str(MEDIA / "Megamind.avi"), "--seconds", "11.3")
    assert run["pictures"] >= 268
    assert run["faces_seen"] >= 0.95 * run["pictures"]
    assert run["target_share"]["face"] > 0.8


def test_signals_park_and_switch_torque_off() -> None:
    for number in (signal.SIGINT, signal.SIGTERM):
        process = subprocess.Popen(
            [*GAZERIG, "run", "--mock", "--no-page", "--summary", "-"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        # What start-up set on the servos is told once torque is on.
        assert process.stderr is not None
        assert any("Indirect Addresses set" in line for line in iter(process.stderr.readline, ""))
        time.sleep(3.0)
        process.send_signal(number)
        out, err = process.communicate(timeout=30)
        assert process.returncode == 0, err
        name = signal.Signals(number).name
        assert f"stopped by {name}: parked, torque off" in err
        run = json.loads(out)
        assert run["stopped_by"] == name
        assert run["target_share"].get("face", 0.0) > 0.0


def test_losing_the_bus_is_a_fault_with_its_cause(tmp_path: Path) -> None:
    rig = tmp_path / "rig.yaml"
    desk = DESK.read_text(encoding="utf-8")
    # The servo bus comes first in the file; a camera has the same key.
    assert desk.index("give_up_s: 60.0") < desk.index("geometry:")
    rig.write_text(desk.replace("give_up_s: 60.0", "give_up_s: 1.0", 1), encoding="utf-8")
    process = subprocess.Popen(
        [*GAZERIG, "run", str(rig), "--mock", "--no-page", "--seconds", "30", "--summary", "-"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    # What start-up set on the servos is told once torque is on.
    assert process.stderr is not None
    assert any("Indirect Addresses set" in line for line in iter(process.stderr.readline, ""))
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
    for child in children.read_text(encoding="ascii").split():
        os.kill(int(child), signal.SIGKILL)
    out, err = process.communicate(timeout=30)
    assert process.returncode == 1
    assert "port lost" in err and "torque-off could not be sent" in err
    assert json.loads(out)["stopped_by"].startswith("fault: ")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--mock", "--video", "nowhere.avi"), "nowhere.avi"),
        (("--mock", "--video", "."), "."),
        (("--mock", "--camera", "97"), "97"),
        (("--scene", "visitor"), "/dev/ttyUSB0"),
        (("--mock", "--scene", "circus"), "circus"),
        (("--mock", "--oak"), "no OAK camera found"),
        (("--mock", "--scene", "visitor", "--video", "x.avi"), "exclude each other"),
        (("--mock", "--fast", "--video", "x.avi"), "--seconds"),
        (("--fast", "--scene", "visitor", "--seconds", "1"), "--mock"),
        ((), "nothing to look at"),
        (("--mock", "--page", "8080"), "HOST:PORT"),
        (("nosuchrig", "--mock"), "nosuchrig"),
        (("--mock", "--profile", "giant"), "giant"),
    ],
)
def test_what_a_person_can_mend_is_one_line_and_exit_code_2(
    words: tuple[str, ...], message: str
) -> None:
    done = gazerig("run", "--no-page", *words, timeout=30)
    assert done.returncode == 2, done.stderr
    assert message in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.skipif(os.geteuid() == 0, reason="root may open every port")
def test_a_port_without_rights_names_the_cure(tmp_path: Path) -> None:
    port = tmp_path / "tty"
    port.touch(mode=0)
    text = DESK.read_text(encoding="utf-8")
    rig = tmp_path / "rig.yaml"
    rig.write_text(text.replace("/dev/ttyUSB0", str(port)), encoding="utf-8")
    done = gazerig("run", str(rig), "--scene", "visitor", "--no-page")
    assert done.returncode == 2 and "dialout" in done.stderr


def test_check_and_schema(tmp_path: Path) -> None:
    assert gazerig("check").returncode == 0
    schema = json.loads(gazerig("schema").stdout)
    assert schema["additionalProperties"] is False and "joints" in schema["properties"]
    rig = tmp_path / "bad.yaml"
    text = DESK.read_text(encoding="utf-8")
    text = text.replace("max_speed_deg_s: 200.0", "max_speed_deg_s: 9000.0", 1)
    text = text.replace("id: 9 ", "id: 8 ").replace("name: desk", "nmae: desk")
    rig.write_text(text, encoding="utf-8")
    done = gazerig("check", str(rig))
    assert done.returncode == 2
    for part in ("max_speed_deg_s", "id 8 is already that of neck_pitch", "nmae", "name"):
        assert part in done.stderr
    lines = [line for line in done.stderr.splitlines() if line.startswith(f"{rig}:")]
    assert len(lines) >= 4 and all(re.match(rf"{re.escape(str(rig))}:\d+: ", s) for s in lines)


def test_a_recorded_run_is_run_again_to_the_same_bytes(tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    run = figures("--seconds", "4", "--record", str(file))
    assert run["stopped_by"] == "seconds" and file.stat().st_size > 10_000
    again = gazerig("replay", str(file), "--rerun")
    assert again.returncode == 0, again.stderr
    words = re.sub(r"\s+", " ", again.stdout + again.stderr)
    assert "ticks are the same to the bit; the bytes on the bus are the same" in words
    refused = gazerig("run", "--mock", "--fast", "--seconds", "1", "--record", str(file))
    assert refused.returncode == 2 and "is there already" in refused.stderr
