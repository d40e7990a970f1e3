"""A script of a world that cannot be played is refused with file, line, key and cure."""

from pathlib import Path

import pytest
from world_scripts import read

from gazerig.config.faults import ConfigError

PAGE = (Path(__file__).parents[3] / "docs" / "worlds.md").read_text()

HEAD = "room: living-room\nround_s: 20.0\npeople:\n  anna:\n    start: {start}\n    acts:\n"


def refused(tmp_path, acts: str, start: str = "door", more: str = "") -> str:
    file = tmp_path / "own.yaml"
    file.write_text(HEAD.format(start=start) + acts + more)
    with pytest.raises(ConfigError) as caught:
        read(file)
    return str(caught.value)


REFUSED = """
door       | 7 | {at_s: 0, do: dance}          | walk
door       | 7 | {at_s: 0, do: walk, to: moon} | no 'moon' here; it has behind, chair_left
door       | 7 | {at_s: 1, do: sit}            | there is no seat at door; walk to one
chair_left | 7 | {at_s: 1, do: walk, to: door} | add `stand` before walk
door       | 6 | {at_s: 1, do: walk, to: front} | began it at door; let it end
"""
"""Start of a person, line of the fault, the act and the words of its refusal."""


@pytest.mark.parametrize("row", REFUSED.strip().splitlines())
def test_an_act_that_cannot_be_done_is_refused_at_its_line(tmp_path, row):
    start, line, act, said = map(str.strip, row.split("|"))
    text = refused(tmp_path, f"      - {act}\n", start)
    assert f"own.yaml:{line}:" in text and said in text, text


def test_two_people_cannot_be_at_one_place_at_once(tmp_path):
    text = refused(tmp_path, "      - {at_s: 1, do: nod}\n", "front", "  ben:\n    start: front\n")
    assert "anna is at front then; choose another place or time" in text and ":9:" in text


def test_a_cup_that_somebody_else_holds_cannot_be_passed(tmp_path):
    more = (
        "  ben:\n    start: chair_right\n    acts:\n"
        "      - {at_s: 4, do: pass, to: anna, thing: cup}\nthings:\n  cup: {held_by: anna}\n"
    )
    text = refused(tmp_path, "      - {at_s: 1, do: nod}\n", "chair_left", more)
    assert "anna holds cup then; let anna pass it" in text and ":11:" in text


def test_the_example_on_the_page_can_be_played(tmp_path):
    file = tmp_path / "page.yaml"
    file.write_text(PAGE.split("```yaml\n")[1].split("```")[0])
    assert read(file).people["anna"].acts[-1].to == "door"


@pytest.mark.parametrize(
    ("act", "more", "said"),
    [
        ("{at_s: 1, do: glance, yaw_deg: 20}", "", "needs room: none"),
        ("{at_s: 1, do: nod}", "things:\n  a: {kind: pinwheel}\n", "need room: none"),
    ],
)
def test_what_only_a_scene_without_a_room_has_is_refused_in_a_room(tmp_path, act, more, said):
    assert said in refused(tmp_path, f"      - {act}\n", "front", more)
