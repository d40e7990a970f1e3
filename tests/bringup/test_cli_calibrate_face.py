"""calibrate face as it is typed: keys, scripts, what is written and what is not."""

import os
import socket
import time
from datetime import datetime
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from command_line import Invoked, answers_in, invoked
from commands_started import PATIENCE_S, OnTerminal
from hypothesis import given
from hypothesis import strategies as st
from page_visitor import Visitor
from served_rigs import rig_files

from gazerig.config.save import save_rig
from gazerig.config.schema import load_rig
from gazerig.drivers.errors import DriverError, SetupError
from gazerig.features.bringup.cli.calibrate import face as cli_face
from gazerig.features.bringup.cli.calibration_keys import (
    BUTTONS,
    Keys,
    PageKeys,
    key_and_count,
    split_words,
)
from gazerig.robot.app.run_observers import stop_only_handler
from gazerig.robot.model.commands import Ask, Command, Jog, LookAt, Resume, Stop
from gazerig.robot.model.face_geometry import PARTS_FACE_M
from gazerig.robot.remote.client import RequestRejected, RobotClient


def run(*words: str) -> Invoked:
    return invoked("calibrate", "face", *words)


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    return Path(rig_files(tmp_path)["desk"])


def script(tmp_path: Path, *lines: str) -> tuple[str, str]:
    return "--answers", answers_in(tmp_path, *lines)


# --- what is written


def test_the_offsets_steered_to_are_in_the_rig_file(rig: Path, tmp_path: Path) -> None:
    before = rig.read_text("utf-8")
    answers = script(
        tmp_path,
        "left 2", "up", "",  # nose: step 5
        "+", "down", "enter",  # left eye: step 10
        "skip",
        "-", "-", "-", "right 3", "enter",  # mouth: step 1
        "back", "down 2", "",  # mouth again, from there
        "end", "y",
    )  # fmt: skip
    done = run(str(rig), "--mock", *answers)
    assert done.code == 0, done.err
    moved = {"N": (10.0, 5.0), "LE": (0.0, -10.0), "M": (-3.0, -2.0)}
    found = load_rig(str(rig)).face_parts_mm
    assert set(found) == set(moved)
    for part, (left, up) in moved.items():
        x, y, z = (v * 1e3 for v in PARTS_FACE_M[part])
        assert found[part] == pytest.approx((x, y + left, z + up), abs=0.06)
    (backup,) = tmp_path.glob("desk.yaml.bak-*")
    assert backup.read_text("utf-8") == before
    assert "# The desk rig" in rig.read_text("utf-8")
    assert "face_parts_mm.N: (not in the file) -> [0.0, 10.0, 5.0]" in done.err
    assert "parked, torque off" in done.err and "your left eye: steer" in done.err


def test_it_begins_where_the_rig_has_the_part(rig: Path, tmp_path: Path) -> None:
    save_rig(rig, {"face_parts_mm.N": (-2.0, 5.0, 0.0)}, datetime(2026, 1, 1))
    done = run(str(rig), "--mock", "--yes", *script(tmp_path, "left", "", "q"))
    assert done.code == 0, done.err
    assert load_rig(str(rig)).face_parts_mm["N"] == (-2.0, 10.0, 0.0)


def test_all_eight_parts_on_somebody_who_walks_about(rig: Path, tmp_path: Path) -> None:
    words = ("--mock", "--yes", "--scene", "face-to-face")
    done = run(str(rig), *words, *script(tmp_path, *8 * ("up", "")))
    assert done.code == 0, done.err
    found = load_rig(str(rig)).face_parts_mm
    assert all(found[c][2] == pytest.approx(p[2] * 1e3 + 5.0) for c, p in PARTS_FACE_M.items())
    assert "stopped by the last part" in done.err


def test_a_shipped_rig_is_copied_not_written(tmp_path: Path) -> None:
    refused = run("desk", "--mock")
    assert refused.code == 2 and "desk.yaml" in refused.err
    assert "head turns" not in refused.err
    out = tmp_path / "copy.yaml"
    done = run("desk", "--mock", "--yes", "--out", str(out), *script(tmp_path, "up", "", "q"))
    assert done.code == 0, done.err
    assert load_rig(str(out)).face_parts_mm["N"] == (0.0, 0.0, 5.0)


# --- what cannot be


@pytest.mark.parametrize(
    ("words", "lines", "code", "says"),
    [
        ((), ("skip", "q"), 0, "nothing"),
        ((), ("", "q", "n"), 0, "nothing"),
        ((), ("left", "sideways"), 2, "'sideways' is no key: left, right, up"),
        ((), ("left", ""), 2, "no key left"),
        ((), ("", "q"), 2, "no answer left to: write these 1"),
        (("--scene", "nowhere"), ("q",), 2, "unknown; scenes: boxing"),
        (("--camera", "0", "--video", "x.png"), ("q",), 2, "exclude each other"),
        (("--port", "/dev/null"), ("q",), 2, "exclude each other"),
    ],
)
def test_nothing_chosen_a_no_or_what_is_wrong_writes_nothing(
    rig: Path, tmp_path: Path, words: tuple[str, ...], lines: tuple[str, ...], code: int, says: str
) -> None:
    before = rig.read_bytes()
    done = run(str(rig), "--mock", *words, *script(tmp_path, *lines))
    assert done.code == code and says in done.err, done.err
    assert rig.read_bytes() == before and not list(tmp_path.glob("*.bak-*"))


def test_nothing_to_look_at_is_said(rig: Path) -> None:
    done = run(str(rig))
    assert done.code == 2 and "nothing to look at: give " in done.err


def test_without_a_face_it_says_so_and_a_script_ends(
    rig: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cli_face, "_SCRIPT_WAITS_S", 2.0)
    wall = tmp_path / "wall.png"
    cv2.imwrite(str(wall), np.full((120, 160, 3), 128, np.uint8))
    words = ("--mock", "--video", str(wall))
    done = run(str(rig), *words, *script(tmp_path, "left", "", "q"))
    assert done.code == 2, done.err
    assert "no face is seen: sit before the camera" in done.err
    assert "no face is seen for 2 s" in done.err and "torque off" in done.err


# --- keys


def test_what_a_terminal_sends_for_keys() -> None:
    keys, rest = split_words("\x1b[A\x1b[B\x1bOC\x1b[1;5Dwasd+-=\rnb\x1b[3~\x1bOPQ\x1b[")
    assert keys == [
        "up", "down", "right", "left", "up", "left", "down", "right", "larger", "smaller",
        "larger", "enter", "skip", "back", "end",
    ]  # fmt: skip
    assert rest == "\x1b["


@given(st.lists(st.sampled_from(["\x1b[A", "\x1bOB", "w", "\n", "\x1b[1;2C", "x"])), st.data())
def test_keys_are_the_same_however_the_bytes_are_cut(sent: list[str], data: st.DataObject) -> None:
    text = "".join(sent)
    cut = data.draw(st.integers(0, len(text)))
    first, rest = split_words(text[:cut])
    second, left = split_words(rest + text[cut:])
    assert first + second == split_words(text)[0] and left == ""


@given(st.text(st.sampled_from("\x1b[O;0123ABw~ \x00é"), max_size=40))
def test_no_bytes_are_lost_or_stop_it(text: str) -> None:
    _, rest = split_words(text)
    assert text.endswith(rest) and len(rest) <= len(text)


def test_lines_of_a_script() -> None:
    assert key_and_count(" Left 12 ") == ("left", 12)
    assert key_and_count("") == ("enter", 1)
    for line in ("left -1", "left x", "left 0", "left 100000", "hop"):
        with pytest.raises(SetupError, match="is no key"):
            key_and_count(line)


# --- on a terminal


def sitting_at(rig: Path, *words: str) -> OnTerminal:
    """Begin to calibrate a face on a terminal."""
    return OnTerminal("calibrate", "face", str(rig), "--mock", "--yes", *words)


def test_keys_typed_move_the_gaze_and_are_written(rig: Path) -> None:
    with sitting_at(rig, "--no-page") as sitting:
        sitting.reads("1/8 the tip of your nose: 0 mm")
        sitting.types(b"\x1b[D")
        sitting.reads("5 mm left")
        sitting.enters(lambda: sitting.types(b"\r"), "2/8 your left eye")
        assert "the page" not in sitting.before
        sitting.types(b"q")
        assert sitting.ends() == 0, sitting.said
    assert load_rig(str(rig)).face_parts_mm == {"N": (0.0, 5.0, 0.0)}


# Parking takes a bounded time, in which a starved machine does not reach the end.
def test_ctrl_c_parks_and_writes_nothing(rig: Path) -> None:
    before = rig.read_bytes()
    with sitting_at(rig, "--no-page") as sitting:
        sitting.reads("1/8 the tip of your nose: 0 mm")
        sitting.types(b"\x1b[D")
        sitting.reads("5 mm left")
        sitting.types(b"\x03")
        assert sitting.ends() == 1, sitting.said
    assert "stopped by SIGINT: parked, torque off" in sitting.said
    assert "nothing written" in sitting.said and rig.read_bytes() == before


# --- on the page


@pytest.mark.slow
def test_buttons_of_the_page_steer_side_by_side_with_keys(rig: Path) -> None:
    with socket.socket() as trial:
        trial.bind(("127.0.0.1", 0))
        port = trial.getsockname()[1]
    url = f"http://127.0.0.1:{port}"
    with sitting_at(rig, "--page", f"127.0.0.1:{port}") as sitting:
        sitting.reads(f"the page is at {url}/?token=")
        sitting.reads("\n")
        visitor = Visitor(f"{url}/?token={sitting.before.strip()}")
        sitting.reads("1/8 the tip of your nose: 0 mm")
        visitor.ask({"steer": "left"})
        sitting.reads("5 mm left, 0 mm up")
        sitting.types(b"w")
        sitting.reads("5 mm left, 5 mm up")
        # No client controls the head meanwhile: it would leave the measured face.
        visitor.ask({"do": "look_at", "p_world_m": [1.0, 0.5, 0.0]})
        sitting.enters(lambda: visitor.ask({"steer": "enter"}), "2/8 your left eye")
        visitor.ask({"steer": "down"})
        sitting.reads("0 mm across, 5 mm down")
        sitting.enters(lambda: visitor.ask({"steer": "enter"}), "3/8")
        visitor.ask({"steer": "end"})
        sitting.reads("stopped by you: parked, torque off")
        assert sitting.ends() == 0, sitting.said
    found = load_rig(str(rig)).face_parts_mm
    usual = {part: tuple(v * 1e3 for v in PARTS_FACE_M[part]) for part in ("N", "LE")}
    assert set(found) == {"N", "LE"}
    assert found["N"] == pytest.approx((usual["N"][0], 5.0, 5.0), abs=0.06)
    x, y, z = usual["LE"]
    assert found["LE"] == pytest.approx((x, y, z - 5.0), abs=0.06)


def test_a_page_that_cannot_be_is_said_before_anything_moves(rig: Path) -> None:
    done = run(str(rig), "--mock", "--page", "here")
    assert done.code == 2 and "not HOST:PORT" in done.err
    assert "head turns" not in done.err


class NoKeys(Keys):
    """Another source, of which nothing comes unless it is given."""

    def __init__(self) -> None:
        self.inside = False
        self.given: list[str] = []

    def __enter__(self) -> "NoKeys":
        self.inside = True
        return self

    def __exit__(self, *_: object) -> None:
        self.inside = False

    def next(self, ready: bool) -> Any:
        return self.given.pop(0) if self.given else None


def test_buttons_and_keys_come_one_by_one() -> None:
    others = NoKeys()
    with PageKeys(others) as keys:
        assert others.inside and keys.next(True) is None
        others.given = ["up"]
        assert keys.press("left") is None and keys.press("enter") is None
        assert [keys.next(False) for _ in range(4)] == ["left", "enter", "up", None]
        with pytest.raises(ValueError, match="'jump' is no key: left, right, up"):
            keys.press("jump")
        assert "too many keys" in str([keys.press("left") for _ in range(200)][-1])
        waiting = 0
        while keys.next(True) is not None:
            waiting += 1
        assert 0 < waiting < 200
        assert keys.press("right") is None
    assert not others.inside


def test_what_is_on_the_buttons_is_what_keys_there_are() -> None:
    words = ("left", "right", "up", "down", "+", "-", "", "skip", "back", "end")
    assert set(BUTTONS) == {key_and_count(word)[0] for word in words}


def test_while_buttons_lead_the_page_can_only_stop_and_resume() -> None:
    given: list[Command] = []
    order = stop_only_handler(given.append)
    order(Stop("a test"))
    order(Resume())
    for asked in (LookAt((1.0, 0.0, 0.0)), Jog((("neck_yaw", 0.1),)), Ask("behaviour", "guard")):
        with pytest.raises(ValueError, match="steer the head now"):
            order(asked)
    assert given == [Stop("a test"), Resume()]


def test_eyes_on_one_linkage_meet_a_part_by_their_mean_line_of_sight(tmp_path: Path) -> None:
    rig = tmp_path / "mine.yaml"
    words = ("maker", "--mock", "--yes", "--out", str(rig))
    done = run(*words, *script(tmp_path, "", "end"))
    assert done.code == 0, done.err
    assert "N:" in rig.read_text()


# --- gazerig stop


def goes_on(running: RobotClient) -> None:
    """Resume as soon as the stop has held as long as stops do."""
    end_s = time.monotonic() + PATIENCE_S
    while True:
        try:
            return running.resume()
        except RequestRejected as refused:
            assert "lasts at least" in str(refused) and time.monotonic() < end_s, refused
            time.sleep(1.2)  # who asks sooner is refused for that


def test_a_head_that_is_steered_over_a_face_can_be_stopped_and_told_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = Path(rig_files(tmp_path)["desk"])
    # Both processes look there; a path of its own keeps other rigs that run here out of it.
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with sitting_at(rig, "--no-page") as sitting:
        sitting.reads("1/8 the tip of your nose: 0 mm")
        with RobotClient.connect() as running:
            assert running.pid == sitting.pid
            for order in (
                lambda: running.look_at(1.0, 0.0, 0.3),
                lambda: running.set("loop.rate_hz", 90.0),
            ):
                with pytest.raises((DriverError, ValueError), match="is being calibrated"):
                    order()
            running.stop("a finger")
            assert running.status()["stopped"] == "a finger"
            sitting.reads(f"stopped by process {os.getpid()}: a finger; torque off")
            goes_on(running)
            assert not running.status()["stopped"]
        sitting.types(b"q")
        assert sitting.ends() == 0, sitting.said
    assert not list(tmp_path.glob("**/*.sock"))
