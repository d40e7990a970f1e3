"""Every file of examples/, run as its reader does, but in simulated time; what it shows is true."""

import re
import runpy
import socket
import sys
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from math import hypot
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest
from fakes.talking_head import TalkingHead
from papers import ROOT

import gazerig
from gazerig.drivers.types import DetectedFace, DetectedPalm, ImageArray
from gazerig.drivers.vision.body_detector import BodyDetector
from gazerig.drivers.vision.face import detector

pytestmark = pytest.mark.usefixtures("ideal_servos")

EXAMPLES = ROOT / "examples"
Shown = Callable[..., list[str]]


@pytest.fixture
def shown(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Shown:
    """Return what runs an example and returns the lines that it prints."""
    opened = gazerig.open

    def in_simulated_time(rig: str = "desk", **options: Any) -> gazerig.SimulatedHead:
        assert options.pop("mock", False) or options.pop("fast", False), "it would move real servos"
        return opened(rig, fast=True, **options)

    def run(name: str, *words: str) -> list[str]:
        monkeypatch.setattr(gazerig, "open", in_simulated_time)
        monkeypatch.setattr(sys, "argv", [name, *words])
        runpy.run_path(str(EXAMPLES / name), run_name="__main__")
        return capsys.readouterr().out.splitlines()

    return run


def numbers(line: str) -> list[float]:
    return [float(one) for one in re.findall(r"[-+]?\d+(?:\.\d+)?", line)]


def test_the_gaze_runs_round_the_circle(shown: Shown) -> None:
    lines = shown("circle.py")
    gaze = [numbers(line) for line in lines]
    assert len(lines) == 12 and all(line.startswith("arrived") for line in lines)
    middle = sum(yaw for yaw, _ in gaze) / 12, sum(pitch for _, pitch in gaze) / 12
    sizes = [hypot(yaw - middle[0], pitch - middle[1]) for yaw, pitch in gaze]
    assert 9.0 < min(sizes) < max(sizes) < 14.0  # 20 cm, a metre ahead
    assert abs(middle[0]) < 1.0


def test_the_visitor_is_printed_where_the_visitor_is(shown: Shown) -> None:
    lines = shown("people.py")
    places = [numbers(line.split(":")[1]) for line in lines if line.startswith("  person 1")]
    assert len(places) >= 13
    assert all(0.5 < ahead < 1.5 and abs(left) < 0.6 for ahead, left, _ in places)
    assert max(left for _, left, _ in places) > 0.15  # steps aside
    assert sum("looks at face 1" in line for line in lines) > 10


@pytest.mark.slow
def test_the_own_detector_leads_the_gaze_to_the_drawn_visitor(shown: Shown) -> None:
    lines = shown("own_detector.py")
    assert sum("1 seen, looks at face 1" in line for line in lines[4:]) > 0.9 * len(lines[4:])


def test_the_own_camera_s_lamp_is_followed(shown: Shown) -> None:
    lines = shown("own_camera.py")
    assert sum("at lamp 1," in line for line in lines) > 25
    yaws = [numbers(line.split("gaze")[1])[0] for line in lines[4:]]
    assert max(yaws) > 12.0 and min(yaws) < -12.0
    assert max(abs(numbers(line.split("gaze")[1])[1]) for line in lines[4:]) < 6.0


def test_the_own_rule_decides_what_is_looked_at(shown: Shown) -> None:
    lines = shown("own_attention.py")
    assert sum("at point," in line for line in lines[1:]) == len(lines) - 1
    assert all(numbers(line.split("gaze")[1])[0] > 3.0 for line in lines[2:])  # to the left


def test_the_jaw_follows_moods_and_loudness(shown: Shown) -> None:
    lines = shown("face.py")
    jaw = {line.split()[0]: numbers(line)[0] for line in lines}
    assert jaw["surprised"] == pytest.approx(12.0, abs=1.0)
    assert jaw["happy"] == pytest.approx(4.0, abs=1.0)
    assert abs(jaw["neutral"]) < 1.0
    assert jaw["speaking:"] > 8.0


def test_tracks_move_the_head_as_far_as_they_say(shown: Shown) -> None:
    nod, shake, bow = shown("track.py")
    lowest = [numbers(line)[-1] for line in (nod, shake, bow)]
    assert nod.startswith("nod takes") and bow.startswith("bow takes")
    assert lowest[2] < lowest[0] - 3.0 and lowest[0] < lowest[1] - 4.0


def test_the_second_head_looks_where_the_first_does(shown: Shown) -> None:
    lines = shown("two_heads.py")
    yaws = [numbers(line.split("yaw")[1]) for line in lines[10:]]
    assert len(yaws) > 20
    # The second is on the left, so what is ahead of the first is to its right.
    assert all(other < one - 10.0 for one, other in yaws)
    assert max(one for one, _ in yaws) - min(one for one, _ in yaws) > 10.0
    assert max(other for _, other in yaws) - min(other for _, other in yaws) > 8.0


class Drawn(BodyDetector):
    """Finds a green face and a red palm."""

    def __init__(self) -> None:
        pass

    def find(self, image: ImageArray) -> tuple[DetectedFace, ...]:
        x, y, width, height = cv2.boundingRect(np.ascontiguousarray(image[..., 1]))
        return (DetectedFace((x, y, width, height), np.zeros((5, 2)), 0.9),) if width else ()

    def palms(self, image: ImageArray, *_: Any) -> tuple[DetectedPalm, ...]:
        x, y, width, height = cv2.boundingRect(np.ascontiguousarray(image[..., 2]))
        return (DetectedPalm((x + width / 2.0, y + height / 2.0), height, 0.9),) if width else ()


def webcam_frames() -> Iterator[tuple[bool, ImageArray | None]]:
    """Draw a person at .8 m whose right hand is held up, punches, and drops, 20 a second."""
    for k in range(80):
        away_m, down_m = (0.25, 0.05) if 30 <= k < 40 else (0.58, 0.5 if k >= 50 else 0.2)
        image = np.zeros((720, 640, 3), np.uint8)
        cv2.rectangle(image, (270, 100), (370, 217), (0, 255, 0), -1)  # .163 m high
        px_m = 0.9 * 640 / away_m
        half = round(0.095 * px_m / 2.0)
        x, y = 320 - round(0.1 * px_m), 158 + round(down_m * px_m)
        cv2.rectangle(image, (x - half, y - half), (x + half, y + half), (0, 0, 255), -1)
        yield True, image
    yield True, np.zeros((720, 640, 3), np.uint8)  # nobody
    yield False, None


def test_the_hand_before_a_webcam_moves_the_fist_of_the_opponent(
    shown: Shown, monkeypatch: pytest.MonkeyPatch
) -> None:
    opponent = pytest.importorskip("gazerig.features.world.opponent_motion")
    drawn, fists = webcam_frames(), []
    head = SimpleNamespace(move_opponent=lambda *at_m: fists.append(at_m))
    camera = SimpleNamespace(read=lambda: next(drawn))
    monkeypatch.setattr(cv2, "VideoCapture", {0: camera}.__getitem__)
    monkeypatch.setattr(detector, "face_detector", lambda params: Drawn())
    monkeypatch.setattr(gazerig, "connect", lambda **_: nullcontext(head))
    assert shown("box_by_hand.py", "0") == []
    assert len(fists) == 80
    ready, hit, low = fists[10], fists[35], fists[70]
    assert ready == pytest.approx((0.7, 0.1, 0.01), abs=0.03)  # your right is the head's left
    assert hit == pytest.approx((0.37, 0.1, 0.16), abs=0.03)
    assert low[2] == pytest.approx(-0.29, abs=0.03)
    motion = opponent.OpponentMotion((0.7, 0.0, 0.0))
    for number in range(400):
        if number % 5 == 0:
            motion.set_target(fists[number // 5], 0.01 * number)
        motion.step(number)
    assert "punch" in [event.name for event in motion.events]


def test_the_own_door_passes_words_on(monkeypatch: pytest.MonkeyPatch, shown: Shown) -> None:
    head, words = TalkingHead(), iter((b"listening\n", b"sing", b"\xff", b"speaking"))
    port = SimpleNamespace(bind=lambda address: None, recv=lambda most: next(words))
    monkeypatch.setattr(gazerig, "connect", lambda **_: nullcontext(head))
    monkeypatch.setattr(socket, "socket", lambda **_: nullcontext(port))
    with pytest.raises(StopIteration):
        shown("own_door.py")
    assert head.states == ["listening", "speaking"]


@pytest.mark.slow
def test_the_sweep_shows_what_speeds_do_and_repeats_itself(shown: Shown) -> None:
    lines = shown("sweep.py")
    rows = [numbers(line) for line in lines[1:]]
    met = {(eyes, head): gaze_s for eyes, head, gaze_s, _ in rows}
    assert len(met) == 4
    assert met[150.0, 120.0] >= met[500.0, 120.0]  # the head limits a gaze that is far aside
    assert all(met[eyes, 30.0] > met[eyes, 120.0] for eyes in (150.0, 500.0))
    again = runpy.run_path(str(EXAMPLES / "sweep.py"))["measure"](500.0, 120.0)
    assert again[0] == pytest.approx(met[500.0, 120.0], abs=0.0051)  # two decimals


# ---- the list


def listed() -> dict[str, int]:
    """Return the examples of the README with their lines."""
    text = (EXAMPLES / "README.md").read_text(encoding="utf-8")
    return {name: int(n) for name, n in re.findall(r"\| \[(\w+\.py)\]\(\1\) \| (\d+) \|", text)}


def test_the_readme_lists_every_example_with_its_lines() -> None:
    there = {path.name: len(path.read_text("utf-8").splitlines()) for path in EXAMPLES.glob("*.py")}
    assert listed() == there


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.name)
def test_an_example_is_short_and_says_what_it_shows_and_how_to_run_it(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 60
    assert "\nShows: " in text and f"\nRun:   python examples/{path.name}" in text


def test_every_example_is_judged_here() -> None:
    judged = re.findall(r'shown\("(\w+\.py)"', Path(__file__).read_text(encoding="utf-8"))
    assert set(judged) == {path.name for path in EXAMPLES.glob("*.py")}
