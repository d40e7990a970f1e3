"""Every file of examples/, run as its reader does, but in simulated time; what it shows is true."""

import re
import runpy
import socket
import sys
from collections.abc import Callable
from contextlib import nullcontext
from math import hypot
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest
from fakes.talking_head import TalkingHead
from papers import ROOT
from slow_rigs import at_rate

import gazerig

pytestmark = pytest.mark.usefixtures("ideal_servos")

EXAMPLES = ROOT / "examples"
Shown = Callable[..., list[str]]


@pytest.fixture
def shown(monkeypatch, capsys, tmp_path) -> Shown:
    """Return what runs an example and returns the lines that it prints."""
    opened = gazerig.open

    def in_simulated_time(rig: str = "desk", **options: Any) -> gazerig.SimulatedHead:
        assert options.pop("mock", False) or options.pop("fast", False), "it would move real servos"
        file = Path(at_rate(tmp_path, rig, 40.0))
        file.write_text(file.read_text("utf-8") + "motion: {enabled: false}\n", "utf-8")
        return opened(str(file), fast=True, **options)

    def run(name: str, *words: str) -> list[str]:
        monkeypatch.setattr(gazerig, "open", in_simulated_time)
        monkeypatch.setattr(sys, "argv", [name, *words])
        runpy.run_path(str(EXAMPLES / name), run_name="__main__")
        return capsys.readouterr().out.splitlines()

    return run


def numbers(line: str) -> list[float]:
    return [float(one) for one in re.findall(r"[-+]?\d+(?:\.\d+)?", line)]


def test_the_gaze_runs_round_the_circle_and_the_visitor_is_printed_where_he_is(shown):
    lines = shown("circle.py")
    gaze = [numbers(line) for line in lines]
    assert len(lines) == 12 and all(line.startswith("arrived") for line in lines)
    middle = sum(yaw for yaw, _ in gaze) / 12, sum(pitch for _, pitch in gaze) / 12
    sizes = [hypot(yaw - middle[0], pitch - middle[1]) for yaw, pitch in gaze]
    assert 9.0 < min(sizes) < max(sizes) < 14.0  # 20 cm, a metre ahead
    assert abs(middle[0]) < 1.0
    lines = shown("people.py")
    places = [numbers(line.split(":")[1]) for line in lines if line.startswith("  person 1")]
    assert len(places) >= 13
    assert all(0.5 < ahead < 1.5 and abs(left) < 0.6 for ahead, left, _ in places)
    assert max(left for _, left, _ in places) > 0.15  # steps aside
    assert sum("looks at face 1" in line for line in lines) > 10


def test_own_detectors_cameras_and_rules_lead_the_gaze(shown, monkeypatch):
    states = gazerig.SimulatedHead.states
    with monkeypatch.context() as patch:  # drawn pictures take time
        patch.setattr(
            gazerig.SimulatedHead,
            "states",
            lambda head, rate_hz, seconds: states(head, rate_hz=rate_hz, seconds=2.5),
        )
        lines = shown("own_detector.py")
    assert len(lines) == 10 and sum(
        "1 seen, looks at face 1" in line for line in lines[4:]
    ) > 0.9 * len(lines[4:])
    lines = shown("own_camera.py")
    assert sum("at lamp 1," in line for line in lines) > 25
    yaws = [numbers(line.split("gaze")[1])[0] for line in lines[4:]]
    assert max(yaws) > 12.0 and min(yaws) < -12.0
    assert max(abs(numbers(line.split("gaze")[1])[1]) for line in lines[4:]) < 6.0
    lines = shown("own_attention.py")
    assert sum("at point," in line for line in lines[1:]) == len(lines) - 1
    assert all(numbers(line.split("gaze")[1])[0] > 3.0 for line in lines[2:])  # to the left


def test_moods_and_loudness_move_the_jaw_and_tracks_the_head(shown):
    lines = shown("face.py")
    jaw = {line.split()[0]: numbers(line)[0] for line in lines}
    assert jaw["surprised"] == pytest.approx(12.0, abs=1.0)
    assert jaw["happy"] == pytest.approx(4.0, abs=1.0)
    assert abs(jaw["neutral"]) < 1.0
    assert jaw["speaking:"] > 8.0
    nod, shake, bow = shown("track.py")
    lowest = [numbers(line)[-1] for line in (nod, shake, bow)]
    assert nod.startswith("nod takes") and bow.startswith("bow takes")
    assert lowest[2] < lowest[0] - 3.0 and lowest[0] < lowest[1] - 4.0


def test_the_second_head_looks_where_the_first_does(shown):
    lines = shown("two_heads.py")
    yaws = [numbers(line.split("yaw")[1]) for line in lines[10:]]
    assert len(yaws) > 20
    # The second is on the left, so what is ahead of the first is to its right.
    assert all(other < one - 10.0 for one, other in yaws)
    assert max(one for one, _ in yaws) - min(one for one, _ in yaws) > 10.0
    assert max(other for _, other in yaws) - min(other for _, other in yaws) > 8.0


def test_the_own_door_passes_words_on_and_a_key_starts_a_track(monkeypatch, shown):
    head, words = TalkingHead(), iter((b"listening\n", b"sing", b"\xff", b"speaking"))
    port = SimpleNamespace(bind=lambda address: None, recv=lambda most: next(words))
    monkeypatch.setattr(gazerig, "connect", lambda **_: nullcontext(head))
    monkeypatch.setattr(socket, "socket", lambda **_: nullcontext(port))
    with pytest.raises(StopIteration):
        shown("own_door.py")
    assert head.states == ["listening", "speaking"]
    for example in ("osc.py", "midi.py", "gpio.py"):
        with pytest.raises(SystemExit, match="pip install"):
            shown(example)
    player = Mock()
    player.play.side_effect = (
        Mock(**{"reply.text.return_value": "nod takes 1 s"}),
        gazerig.Refused("stopped"),
    )
    monkeypatch.setattr(gazerig, "connect", lambda **_: nullcontext(player))
    key = SimpleNamespace(type="note_on", velocity=9, note=60)
    mido = SimpleNamespace(open_input=lambda: nullcontext([key, key]))
    monkeypatch.setitem(sys.modules, "mido", mido)
    assert shown("midi.py")[-2:] == ["nod takes 1 s", "stopped"]


def test_the_sweep_shows_what_speeds_do_and_repeats_itself(shown):
    lines = shown("sweep.py")
    rows = [numbers(line) for line in lines[1:]]
    met = {(eyes, head): gaze_s for eyes, head, gaze_s, _ in rows}
    assert len(met) == 4
    assert met[150.0, 120.0] >= met[500.0, 120.0]  # the head limits a gaze that is far aside
    assert all(met[eyes, 30.0] > met[eyes, 120.0] for eyes in (150.0, 500.0))
    again = runpy.run_path(str(EXAMPLES / "sweep.py"))["measure"](500.0, 120.0)
    assert again[0] == pytest.approx(met[500.0, 120.0], abs=0.0051)  # two decimals
