"""calibrate face as it is typed: keys, scripts, what is written and what is not."""

import pytest
from command_line import Invoked, answers_in, invoked
from commands_started import OnTerminal
from fakes.runs import simulated

from gazerig.config.schema import load_rig
from gazerig.features.bringup.cli.prompts import (
    split_words,
)
from gazerig.robot.loop.events import TickFeed
from gazerig.robot.model.commands import Command, Resume, Stop
from gazerig.robot.model.face_geometry import PARTS_FACE_M
from gazerig.robot.run.requests import RequestHandler


def run(*words: str) -> Invoked:
    return invoked("calibrate", "face", *words)


def script(tmp_path, *lines: str) -> tuple[str, str]:
    return "--answers", answers_in(tmp_path, *lines)


# --- what is written


def test_the_offsets_steered_to_are_in_the_rig_file(rig, tmp_path):
    before = rig.read_text("utf-8")
    answers = script(
        tmp_path,
        "left 2", "up", "",  # nose
        "down 2", "enter",  # left eye
        "skip",
        "right", "enter",  # mouth
        "back", "down 2", "",  # mouth again, from there
        "end", "y",
    )  # fmt: skip
    done = run(str(rig), "--mock", *answers)
    assert done.code == 0, done.err
    moved = {"N": (10.0, 5.0), "LE": (0.0, -10.0), "M": (-5.0, -10.0)}
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


# --- what cannot be


@pytest.mark.parametrize(
    ("words", "lines", "code", "says"),
    [
        ((), ("skip", "q"), 0, "nothing"),
        ((), ("", "q", "n"), 0, "nothing"),
        ((), ("left", "sideways"), 2, "'sideways' is no key: left, right, up"),
        ((), ("", "q"), 2, "no answer left to: write these 1"),
        (("--camera", "0", "--oak"), ("q",), 2, "exclude each other"),
    ],
)
def test_nothing_chosen_a_no_or_what_is_wrong_writes_nothing(
    rig, tmp_path, words, lines, code, says
):
    before = rig.read_bytes()
    done = run(str(rig), "--mock", *words, *script(tmp_path, *lines))
    assert done.code == code and says in done.err, done.err
    assert rig.read_bytes() == before and not list(tmp_path.glob("*.bak-*"))


# --- keys


def test_what_a_terminal_sends_for_keys():
    keys, rest = split_words("\x1b[A\x1b[B\x1bOC\x1b[1;5Dwasd+-=\rnb\x1b[3~\x1bOPQ\x1b[")
    assert " ".join(keys) == ("up down right left up left down right enter skip back end")
    assert rest == "\x1b["


# --- on a terminal


# Parking takes a bounded time, in which a starved machine does not reach the end.
def test_ctrl_c_parks_and_writes_nothing(rig):
    before = rig.read_bytes()
    with OnTerminal("calibrate", "face", str(rig), "--mock", "--yes") as sitting:
        sitting.reads("the tip of your nose: steer")
        sitting.types(b"n")
        sitting.reads("your left eye: steer")
        sitting.types(b"\x03")
        assert sitting.ends() == 1, sitting.said
    assert "stopped by SIGINT: parked, torque off" in sitting.said
    assert "nothing written" in sitting.said and rig.read_bytes() == before


def test_while_the_terminal_leads_the_page_can_only_stop_and_resume():
    made = simulated("desk")
    given: list[Command] = []
    made.robot.command = given.append  # type: ignore[method-assign,assignment]
    hear = RequestHandler(made, TickFeed(), {}, calibrated=True).answer
    for do, fields in (
        ("look_at", {"p_world_m": [1.0, 0.0, 0.0]}), ("set", {"changes": {}}),
        ("jog", {"angles_rad": []}), ("ask", {"menu": "character", "choice": "shy"}), ("menus", {}),
    ):  # fmt: skip
        assert "is being calibrated" in str(hear({"do": do, **fields})["refused"])
    assert hear({"do": "status"})["ok"] and not given
    hear({"do": "stop", "why": "a test"})
    hear({"do": "resume"})
    assert given == [Stop("a test"), Resume()]
    made.close()
