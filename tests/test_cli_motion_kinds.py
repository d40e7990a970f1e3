"""calibrate, jog, home, look-at and monitor as typed, on hobby, STS and mixed rigs."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from mixed_rig import mixed_text
from typer.testing import CliRunner

from gazerig.config.load import shipped
from gazerig.config.schema import load_rig
from gazerig.robot.app.emulation import emulated_lines
from gazerig.robot.cli.messages import holding, left_alone
from gazerig.robot.cli.motion import app
from gazerig.sim_mock.pty.client import PtyBuses


def run(*words: str) -> Any:
    return CliRunner().invoke(app, words)


@pytest.fixture
def rigs(tmp_path: Path) -> dict[str, str]:
    """Return the paths of rigs of one's own by kind."""
    texts = {name: shipped("rigs", name).read_text("utf-8") for name in ("maker", "feetech")}
    paths = {}
    for name, text in {**texts, "mixed": mixed_text()}.items():
        paths[name] = str(tmp_path / f"{name}.yaml")
        Path(paths[name]).write_text(text, encoding="utf-8")
    return paths


def script(tmp_path: Path, *lines: str) -> str:
    file = tmp_path / "answers"
    file.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
    return str(file)


# --- calibrate


def test_a_hobby_joint_is_steered_and_its_places_are_written(
    rigs: dict[str, str], tmp_path: Path
) -> None:
    # Begin at the proposed pulse; straight ahead; left end, read as 9; right end; the rest agreed.
    words = ("", "+10", "-10", "", "1600", "", "9", "-170", "", "-6", "", "", "y")
    answers = script(tmp_path, *words)
    path = rigs["maker"]
    done = run("calibrate", path, "--mock", "--joint", "eyes_pan", "--answers", answers)
    assert done.exit_code == 0, done.stderr
    joint = load_rig(path).joints["eyes_pan"]
    places = dict(joint.transmission_points)
    assert places[0.0] == 1500.0 and places[9.0] == 1600.0 and places[-6.0] == 1430.0
    assert len(places) == 5
    assert (joint.min_deg, joint.max_deg) == (-4.0, 7.0)
    assert "[-6, 1430]" in Path(path).read_text("utf-8")
    assert "-6 deg: 1430" in done.stdout and "Keep your fingers out" in done.stderr
    assert list(tmp_path.glob("maker.yaml.bak-*"))


def test_a_lower_lid_s_ends_are_written_for_that_lid_alone(
    rigs: dict[str, str], tmp_path: Path
) -> None:
    before = load_rig(rigs["maker"]).lid_joints
    words = ("", "1480", "", "3", "1560", "", "-5", "", "y")
    answers = script(tmp_path, *words)
    words = ("--mock", "--joint", "right_lower_lid", "--more", "0", "--pulses", "1400:1600")
    done = run("calibrate", rigs["maker"], *words, "--answers", answers)
    assert done.exit_code == 0, done.stderr
    lids = load_rig(rigs["maker"]).lid_joints
    assert (lids.right_lower_shut_deg, lids.right_lower_open_deg) == (-5.0, 3.0)
    assert lids.left_lower_shut_deg == before.left_lower_shut_deg
    assert load_rig(rigs["maker"]).park_deg["right_lower_lid"] == -5.0


def test_an_sts_joint_is_calibrated_by_hand(rigs: dict[str, str], tmp_path: Path) -> None:
    answers = script(tmp_path, "turn -150", "", "turn 330", "", "turn -160", "", "y")
    done = run("calibrate", rigs["feetech"], "--mock", "--joint", "neck_roll", "--answers", answers)
    assert done.exit_code == 0, done.stderr
    joint = load_rig(rigs["feetech"]).joints["neck_roll"]
    assert joint.sign == -1 and joint.zero_step == pytest.approx(2068, abs=8)


def test_an_sts_joint_is_calibrated_by_motion(rigs: dict[str, str]) -> None:
    path = Path(rigs["feetech"])
    narrow = re.sub(
        r"(neck_roll:\n.*\n.*\n)    min_deg: -25.0\n    max_deg: 25.0",
        r"\1    min_deg: -3.0\n    max_deg: 4.0",
        path.read_text("utf-8"),
    )
    path.write_text(narrow, encoding="utf-8")
    words = ("--mock", "--joint", "neck_roll", "--by", "motion", "--yes", "--margin", "1")
    done = run("calibrate", str(path), *words)
    assert done.exit_code == 0, done.stderr
    # The emulated stops lie 4 deg beyond the range: -7..8.
    joint = load_rig(str(path)).joints["neck_roll"]
    assert joint.sign == 1 and joint.max_deg == pytest.approx(6.5, abs=0.7)
    assert "no watchdog" in done.stderr


def test_the_middle_of_an_sts_servo_can_be_set(rigs: dict[str, str], tmp_path: Path) -> None:
    words = ("turn 60", "", "turn 150", "", "turn -320", "", "turn 170", "", "n")
    answers = script(tmp_path, *words)
    done = run("calibrate", rigs["feetech"], "--mock", "--joint", "neck_roll", "--set-middle",
               "--answers", answers)  # fmt: skip
    assert done.exit_code == 0, done.stderr
    assert re.search(r"its place is 2048 now \(offset -?\d+\)", done.stderr)


def test_joints_of_several_buses_are_calibrated_in_one_go(
    rigs: dict[str, str], tmp_path: Path
) -> None:
    hobby = ("", "", "1560", "", "5", "1440", "", "-5")
    yaw = ("turn 150", "", "turn -300", "", "turn 150", "")
    pitch = ("turn -110", "", "turn 220", "", "turn -110", "")
    answers = script(tmp_path, *hobby, *yaw, *pitch, "y")
    words = ["--joint", "eyes_tilt", "--joint", "neck_yaw", "--joint", "neck_pitch", "--more", "0"]
    words += ["--margin", "1", "--mock", "--answers", answers]
    done = run("calibrate", rigs["mixed"], *words)
    assert done.exit_code == 0, done.stderr
    joints = load_rig(rigs["mixed"]).joints
    assert len(joints["eyes_tilt"].transmission_points) == 3
    assert joints["neck_yaw"].zero_step is not None and joints["neck_pitch"].sign == -1


@pytest.mark.parametrize(
    ("kind", "words", "says"),
    [
        ("maker", ("--by", "motion"), "hobby servos do not tell where they are"),
        ("maker", ("--pulses", "900"), "two pulse widths in us"),
        ("maker", ("--pulses", "400:2000"), "within 500:2500 us"),
        ("maker", ("--set-middle",), "only Feetech STS servos"),
        ("mixed", ("--set-middle", "--joint", "neck_yaw"), "only Feetech STS servos"),
        ("feetech", ("--set-middle", "--dry-run"), "exclude each other"),
        ("maker", ("--joint", "neck_yaw"), "no such joint; there is eyes_pan"),
        ("maker", ("--joint", "eyes_pan", "--answers", "EMPTY"), "no answer left to"),
    ],
)
def test_what_cannot_be_is_said(
    rigs: dict[str, str], tmp_path: Path, kind: str, words: tuple[str, ...], says: str
) -> None:
    before = Path(rigs[kind]).read_bytes()
    (empty := tmp_path / "empty").touch()
    words = tuple(str(empty) if word == "EMPTY" else word for word in words)
    done = run("calibrate", rigs[kind], "--mock", *words)
    assert done.exit_code == 2 and says in done.stderr, done.stderr
    assert Path(rigs[kind]).read_bytes() == before


def test_places_on_several_lines_are_refused_before_anything_moves(rigs: dict[str, str]) -> None:
    path = Path(rigs["maker"])
    text = path.read_text("utf-8")
    line = next(line for line in text.splitlines() if "[-24, 1801]" in line)
    spread = "    transmission_points:\n      - [-24, 1801]\n      - [0, 1510]\n      - [24, 1188]"
    path.write_text(text.replace(line, spread), encoding="utf-8")
    done = run("calibrate", str(path), "--mock", "--joint", "eyes_tilt")
    assert done.exit_code == 2 and "spread over several lines" in done.stderr
    assert "gets no pulses" not in done.stderr


# --- monitor


def test_monitor_shows_every_kind_in_one_table(rigs: dict[str, str]) -> None:
    done = run("monitor", rigs["mixed"], "--mock", "--once")
    assert done.exit_code == 0, done.stderr
    rows = {line.split()[0]: line.split() for line in done.stdout.splitlines()[1:9]}
    assert rows["eyes_pan"][1:] == ["0", "-", "-", "none", "-", "-", "-", "-", "off", "-"]
    assert rows["neck_yaw"][1] == "neck:7" and rows["neck_yaw"][-1] == "none"
    assert rows["neck_pitch"][1] == "tilt:1" and "us/step" in done.stdout
    assert "reckoned from the pulse" in done.stdout


def test_monitor_of_a_mixed_rig_as_json(rigs: dict[str, str]) -> None:
    done = run("monitor", rigs["mixed"], "--mock", "--json", "--seconds", "0")
    told = json.loads(done.stdout.splitlines()[0])["joints"]
    assert told["eyes_pan"]["measured"] is False and told["neck_yaw"]["measured"] is True


# --- moving


@pytest.fixture
def served(rigs: dict[str, str]) -> Iterator[tuple[str, str, PtyBuses]]:
    """Return the mixed rig, what --port wants for its emulated buses, and what serves them."""
    with PtyBuses() as buses:
        paths = buses.start(emulated_lines(load_rig(rigs["mixed"])))
        given = ",".join(f"{name}={path}" if name else path for name, path in paths.items())
        yield rigs["mixed"], given, buses


def test_on_real_wires_hobby_servos_are_asked_for_first(
    served: tuple[str, str, PtyBuses],
) -> None:
    rig, ports, buses = served
    refused = run("jog", rig, "neck_yaw", "5", "--port", ports)
    assert refused.exit_code == 2 and "say --yes" in refused.stderr
    assert "torque on" not in refused.stderr
    assert all(one["target"] == 0 for one in json.loads(buses.command("status"))["servos"])
    words = ("--port", ports, "--yes", "--speed", "60", "--seconds", "0")
    done = run("jog", rig, "eyes_pan", "8", *words)
    assert done.exit_code == 0, done.stderr
    assert "go to their parking place at once" in done.stderr
    assert "torque on: 2 servos hold where they are, 6 hobby servos" in done.stderr
    assert re.search(r"eyes_pan: wished 8\.0, is reckoned at \d\.\d deg", done.stderr)
    assert "parked, torque off on all servos" in done.stderr
    assert all(one["target"] == 0 for one in json.loads(buses.command("status"))["servos"])


def test_home_opens_all_four_lids() -> None:
    done = run("home", "maker", "--mock", "--speed", "60")
    assert done.exit_code == 0, done.stderr
    assert "left_lower_lid: wished 22.0, is reckoned at 22.0" in done.stderr
    assert "pulses on: 6 hobby servos" in done.stderr


def test_look_at_of_a_maker_s_head_says_what_it_cannot_do() -> None:
    words = ("maker", "1", "-0.2", "0.1", "--mock", "--seconds", "1.5", "--no-park")
    done = run("look-at", *words)
    assert done.exit_code == 0, done.stderr
    assert "mean line of sight" in done.stderr and "vergence: none" in done.stderr
    assert "head:" not in done.stderr and "reckoned, not measured" in done.stderr


def test_what_servos_do_alone_is_said_for_the_kinds_that_there_are(rigs: dict[str, str]) -> None:
    mixed = left_alone(load_rig(rigs["mixed"]))
    assert "watchdog" in mixed and "Feetech" in mixed and "Maestro" in mixed
    assert left_alone(load_rig("desk")) == "the Dynamixel servos' own watchdog stops them"
    assert "watchdog" not in left_alone(load_rig("feetech"))
    assert holding(load_rig("desk")) == "torque on: 9 servos hold where they are"
