"""The scenes: closed forms that move as people can, and the events they ask about.

Run as a program this file writes tests/golden/scenes.txt anew.
"""

from collections.abc import Iterable
from math import degrees, dist
from pathlib import Path

import numpy as np
import pytest

from gazerig.config.faults import ConfigError
from gazerig.config.shipped_files import shipped_names
from gazerig.robot.run.surroundings import load_scene
from gazerig.sim_mock.scenes.scene import Scene

SCENES = Path(__file__).parents[2] / "golden" / "scenes.txt"
DT_S = 0.02
SCRIPT = """round_s: 20.0
room: none
places:
  here: {x_m: 1.0, y_m: 0.0, height_m: 1.2}
  there: {x_m: 1.0, y_m: 0.5, height_m: 1.2}
people:
  anna:
    start: here
    acts:
"""


def times(scene: Scene) -> list[float]:
    """Return the instants of one round and a little of the next."""
    return np.arange(0.0, scene.round_s + 0.5, DT_S).tolist()


@pytest.mark.parametrize("name", shipped_names("scenes"))
def test_nobody_jumps_and_no_thing_is_faster_than_a_fist(name):
    scene = load_scene(name)
    before_people, before = scene.people(0.0), {t.id: t for t in scene.things(0.0)}
    for t_s in times(scene)[1:]:
        people, things = scene.people(t_s), {t.id: t for t in scene.things(t_s)}
        for old, new in zip(before_people, people, strict=True):
            assert dist(old.p_world_face_m, new.p_world_face_m) / DT_S < 2.7, t_s  # walking
            turn = abs(new.face_yaw_pitch_rad[0] - old.face_yaw_pitch_rad[0])
            assert degrees(min(turn, abs(turn - 2 * np.pi))) / DT_S < 250.0, t_s
        for id_ in before.keys() & things.keys():
            assert dist(before[id_].p_world_m, things[id_].p_world_m) / DT_S < 5.0, t_s
            assert before[id_].kind == things[id_].kind
        before_people, before = people, things


@pytest.mark.parametrize(
    ("acts", "line", "rule"),
    [
        ("      - {at_s: 1, do: punch, to: head}\n", 10, "without a room a person can only walk"),
        ("      - {at_s: 1, do: walk, to: moon}\n", 10, "the script has no 'moon' here; it has here"),
        ("      - {at_s: 1, do: look_at, to: bob}\n", 10, "has no 'bob' here"),
        ("      []\nthings: {a: {kind: hand, at: moon}}\n", 11, "no place 'moon'"),
    ],
)  # fmt: skip
def test_a_script_that_cannot_be_played_is_refused_at_its_line(tmp_path, acts, line, rule):
    file = tmp_path / "own.yaml"
    file.write_text(SCRIPT + acts)
    with pytest.raises(ConfigError) as caught:
        load_scene(str(file))
    assert f"own.yaml:{line}:" in str(caught.value) and rule in str(caught.value)


def test_a_script_of_ones_own_is_played_and_its_seed_varies_it(tmp_path):
    file = tmp_path / "own.yaml"
    walks = "- {at_s: 5, do: walk, to: there, vary_s: 2}\n      - {at_s: 12, do: walk, to: here}"
    file.write_text(f"{SCRIPT}      {walks}\n")
    one, same, other = (load_scene(str(file), seed) for seed in (0, 0, 1))
    assert one.people(5.5) == same.people(5.5) != other.people(5.5)
    assert one.people(9.0)[0].p_world_face_m == pytest.approx((1.0, 0.5, 0.25))


def text(values: Iterable[object]) -> str:
    return " ".join(f"{x:z.3f}" if isinstance(x, float) else str(x) for x in values)


def played(name: str) -> str:
    """Return where all are in a round, metres and radians, and what a gaze should follow."""
    scene, lines = load_scene(name), [name]
    for t_s in np.linspace(0.0, 1.1 * scene.round_s, 67).tolist():
        people, things = scene.people(t_s), scene.things(t_s)
        rows = [
            (*p.p_world_face_m, *p.face_yaw_pitch_rad, p.speaks, *(p.hand or ())) for p in people
        ]
        rows += [(t.id, t.kind, *t.p_world_m, t.spin_rad_s, t.turned_rad, t.person) for t in things]
        lines.append(text((t_s, *map(text, rows))))
    for event in scene.events():
        lines.append(text((*event[:5], *event.place_world_m, *event[6:])))
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("name", shipped_names("scenes"))
def test_a_scene_is_as_it_was_reviewed(name):
    assert played(name) in SCENES.read_text(encoding="utf-8")


if __name__ == "__main__":
    SCENES.write_text("".join(map(played, shipped_names("scenes"))), encoding="utf-8")
