"""Shipped characters and rule sets: they load, differ, and have the described effects."""

from dataclasses import replace
from math import pi, sin

import numpy as np
import pytest
from attention_scene import body, looking, percept

from gazerig.config.load import read_yaml, shipped_names, shipped_path
from gazerig.config.schema import load_rig
from gazerig.gaze.attention.attention import Attention
from gazerig.gaze.attention.bottom_up import BottomUp
from gazerig.gaze.attention.idle import Idle
from gazerig.gaze.attention.top_down import TopDown

pytestmark = pytest.mark.usefixtures("ideal_servos")

CHARACTERS = shipped_names("characters")


def hands_about_a_face(t_s):
    """Show a face that sways a little, and two raised hands that move for a while now and then."""
    w = 2 * pi * np.array([0.15, 0.9, 1.3])
    # Bursts of all sizes: from hardly a motion to a wild wave, never in step.
    size = np.array([0.01, 0.12 * max(0.0, sin(0.31 * t_s)) ** 2, 0.2 * sin(0.17 * t_s) ** 4])
    aside, speed = size * np.sin(w * t_s), size * w * np.cos(w * t_s)
    rows = ((1.0, 0.0, 0.0), (0.8, 0.3, -0.05), (0.85, -0.3, -0.05))
    return percept(t_s, *(
        body(k + 1, "hand" if k else "face", (x, y + aside[k], z), (0.0, speed[k], 0.0))
        for k, (x, y, z) in enumerate(rows)
    ))  # fmt: skip


def face_share(gaze):
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
    kinds = [model.choose(hands_about_a_face(t), looking(), t).kind for t in times]
    return kinds.count("face") / len(kinds)


@pytest.mark.parametrize("name", CHARACTERS)
def test_a_character_lies_over_the_desk_rig_and_changes_all_it_names(name):
    plain, other = load_rig("desk"), load_rig("desk", name)
    assert other.gaze != plain.gaze
    assert replace(other, gaze=plain.gaze) == plain  # manners only, never wires or limits

    def differ(given, before, after, key):
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


def test_a_rig_of_its_own_rules_keeps_them_alone_under_a_character(tmp_path):
    own = tmp_path / "own.yaml"
    text = shipped_path("rigs", "maker").read_text()
    rule = "gaze:\n  top_down: {rules: {wait: {look_at: face, salience: 0.9}}}\n"
    own.write_text(text.replace("gaze:  # differences", rule + "  # differences"), "utf-8")
    rules = load_rig(str(own), "sleepy").gaze.top_down.rules
    assert list(rules) == ["wait"] and rules["wait"].salience == 0.35
