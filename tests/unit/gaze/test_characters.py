"""Shipped characters and rule sets: they load, differ, and have the described effects."""

from dataclasses import replace
from math import pi, sin
from pathlib import Path

import numpy as np
import pytest

from gazerig.config.load import read_yaml, shipped_names, shipped_path
from gazerig.config.rig import GazeConfig
from gazerig.config.schema import load_rig
from gazerig.gaze.angles import rotation
from gazerig.gaze.attention.attention import Attention
from gazerig.gaze.attention.bottom_up import BottomUp
from gazerig.gaze.attention.idle import Idle
from gazerig.gaze.attention.top_down import TopDown
from gazerig.gaze.types import Bodies, GazeState, Percept

pytestmark = pytest.mark.usefixtures("ideal_servos")

CHARACTERS = shipped_names("characters")
AHEAD = GazeState(
    (0, 0, 0), (0, 0, 0), (0, 0), (0, 0), rotation((0.0, 0.0, 0.0)),
    (0, 0, 0), (0, 0.03, 0), (0, -0.03, 0), 1.0, 1.0,
)  # fmt: skip


def hands_about_a_face(t_s: float) -> Percept:
    """Show a face that sways a little, and two raised hands that move for a while now and then."""
    w = 2 * pi * np.array([0.15, 0.9, 1.3])
    # Bursts of all sizes: from hardly a motion to a wild wave, never in step.
    size = np.array([0.01, 0.12 * max(0.0, sin(0.31 * t_s)) ** 2, 0.2 * sin(0.17 * t_s) ** 4])
    p = np.array([[1.0, 0.0, 0.0], [0.8, 0.3, -0.05], [0.85, -0.3, -0.05]])
    v = np.zeros((3, 3))
    p[:, 1] += size * np.sin(w * t_s)
    v[:, 1] = size * w * np.cos(w * t_s)
    ids, kinds = (1, 2, 3), ("face", "hand", "hand")
    return Percept(t_s, Bodies(ids, kinds, p, v, np.zeros((3, 3)), np.full(3, 0.08)))


def face_share(gaze: GazeConfig) -> float:
    rng = np.random.default_rng(0)
    model = Attention(
        replace(gaze.attention, reaction="none"),
        BottomUp(gaze.bottom_up),
        TopDown(gaze.top_down),
        Idle(gaze.idle, rng),
        rng,
        rng,
    )
    times = [k / 15 for k in range(900)]
    kinds = [model.choose(hands_about_a_face(t), AHEAD, t).kind for t in times]
    return kinds.count("face") / len(kinds)


@pytest.mark.parametrize("name", CHARACTERS)
def test_a_character_lies_over_the_desk_rig_and_changes_all_it_names(name: str):
    plain, other = load_rig("desk"), load_rig("desk", name)
    assert other.gaze != plain.gaze
    assert replace(other, gaze=plain.gaze) == plain  # manners only, never wires or limits

    def differ(given: object, before: object, after: object, key: str) -> int:
        if not isinstance(given, dict):
            assert before != after, f"{key} says nothing new"
            return 1
        count = 0
        for name, value in given.items():
            inside = (
                (before[name], after[name])
                if isinstance(before, dict) and isinstance(after, dict)
                else (getattr(before, name), getattr(after, name))
            )
            count += differ(value, *inside, f"{key}.{name}")
        return count

    assert differ(read_yaml(shipped_path("characters", name)).data, plain, other, name) >= 4


def test_the_strong_boxer_keeps_the_face_and_the_weak_one_loses_it():
    weak, plain, strong = (
        face_share(load_rig("desk", name).gaze) for name in ("weak_boxer", None, "strong_boxer")
    )
    assert weak < plain - 0.05 and strong > plain + 0.05


def test_the_bold_look_at_a_face_more_than_the_shy():
    shy, bold = (face_share(load_rig("desk", name).gaze) for name in ("shy", "bold"))
    assert shy < bold - 0.1


def test_a_rig_of_its_own_rules_keeps_them_alone_under_a_character(tmp_path: Path):
    own = tmp_path / "own.yaml"
    text = shipped_path("rigs", "maker").read_text()
    rule = "gaze:\n  top_down: {rules: {wait: {look_at: face, salience: 0.9}}}\n"
    own.write_text(text.replace("gaze:  # differences", rule + "  # differences"), "utf-8")
    rules = load_rig(str(own), "sleepy").gaze.top_down.rules
    assert list(rules) == ["wait"] and rules["wait"].salience == 0.35
