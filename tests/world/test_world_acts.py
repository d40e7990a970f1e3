"""Every act of a person moves its own segments, during its time, and no others."""

from functools import cache
from typing import get_args

import numpy as np
import pytest

from gazerig.features.world.figure import SEGMENTS, Figures
from gazerig.features.world.timeline import script_faults
from gazerig.gaze.types import Floats
from gazerig.sim_mock.scenes.script import Act, Do, PersonScript, SceneScript, ThingScript

AT_S = 3.0
ROUND_S = 18.0

# The act, the person who does it, and the segments that it moves most.
CASES: dict[str, tuple[Act, ...]] = {
    "walk": (Act(AT_S, "walk", "front"), Act(9.0, "walk", "behind")),
    "step": (Act(AT_S, "step", ahead_m=0.3), Act(6.0, "step", ahead_m=-0.3)),
    "turn": (Act(AT_S, "turn", "window"), Act(6.0, "turn", "head")),
    "look_at": (Act(AT_S, "look_at", "shelf"), Act(6.0, "look_at", "head")),
    "speak": (Act(AT_S, "speak"),),
    "nod": (Act(AT_S, "nod"),),
    "shake": (Act(AT_S, "shake"),),
    "be_hit": (Act(AT_S, "be_hit"),),
    "wave": (Act(AT_S, "wave"),),
    "gesture": (Act(AT_S, "gesture"),),
    "point": (Act(AT_S, "point", "head"),),
    "reach": (Act(AT_S, "reach", "head"),),
    "push": (Act(AT_S, "push", "head"),),
    "pass": (Act(AT_S, "pass", "ben", thing="cup"), Act(8.0, "nod")),
    "guard": (Act(AT_S, "guard", for_s=4.0),),
    "punch": (Act(AT_S, "punch", "head"),),
    "feint": (Act(AT_S, "feint"),),
    "open_guard": (Act(AT_S, "open_guard"),),
}
HEAD_ACTS = ("nod", "shake", "be_hit", "look_at")
ARM_ACTS = ("wave", "point", "reach", "push", "punch", "feint")


@cache
def figures(acts: tuple[Act, ...], start: str = "behind", *, cup: bool = False) -> Figures:
    people = {"anna": PersonScript(start, acts=acts), "ben": PersonScript("chair_left", look=4)}
    things = {"cup": ThingScript("anna")} if cup else {}
    return Figures(SceneScript(people, round_s=ROUND_S, things=things), 2)


def still(cup: bool = False) -> Figures:
    return figures((), cup=cup)


@cache
def still_m(t_s: float, cup: bool) -> Floats:
    return still(cup).segments(t_s).p_m


def moved_m(acts: tuple[Act, ...], *, cup: bool = False) -> dict[str, float]:
    """Return the largest distance of each segment of anna from its position without the acts."""
    one = figures(acts, cup=cup)
    found = dict.fromkeys(SEGMENTS, 0.0)
    for t_s in np.arange(AT_S, AT_S + 4.0, 0.05).tolist():
        away = np.linalg.norm(one.segments(t_s).p_m - still_m(t_s, cup), axis=1)
        for segment in SEGMENTS:
            found[segment] = max(found[segment], float(away[one.row[f"anna/{segment}"]]))
    return found


def test_there_is_a_case_for_every_act() -> None:
    assert set(CASES) | {"sit", "stand", "glance", "spin"} == set(get_args(Do))


@pytest.mark.parametrize("name", sorted(CASES))
def test_an_act_moves_what_it_says_and_not_before_it_begins(name: str) -> None:
    acts, cup = CASES[name], name == "pass"
    found = moved_m(acts, cup=cup)
    if name in ("walk", "step"):
        assert found["pelvis"] > 0.25 and found["left_foot"] > 0.25
    elif name == "turn":
        assert found["left_upper_arm"] > 0.05 and found["pelvis"] < 0.02
    elif name == "speak":
        assert 0.004 < found["lips"] < 0.03 and found["right_hand"] == 0.0
    elif name in HEAD_ACTS:
        assert found["left_eye"] > 0.008 and found["left_foot"] == 0.0
    elif name in ARM_ACTS:
        assert found["right_hand"] > 0.15 and found["right_foot"] == 0.0
        assert found["left_hand"] < 0.5 * found["right_hand"]
    else:
        assert found["right_hand"] > 0.15 and found["right_foot"] == 0.0
    before_s = AT_S - 0.8  # a path is averaged over some time
    same = figures(acts, cup=cup).segments(before_s).p_m - still(cup).segments(before_s).p_m
    assert np.abs(same).max() < (0.12 if name in HEAD_ACTS else 1e-9)


@pytest.mark.parametrize("name", sorted(CASES))
def test_after_an_act_all_is_as_before(name: str) -> None:
    if name == "pass":
        return  # the cup stays with the other one
    one = figures(CASES[name])
    end_s = ROUND_S - 0.3
    names = [row for who, row in one.row.items() if "/left_eye" not in who]
    away = one.segments(end_s).p_m - still().segments(end_s).p_m
    assert np.abs(away[names]).max() < 0.012


def test_who_sits_is_lower_with_the_thighs_level_and_stands_up_again() -> None:
    acts = (Act(1.0, "stand"), Act(5.0, "sit"))
    person = PersonScript("chair_right", acts=acts)
    one = Figures(SceneScript({"anna": person}, round_s=ROUND_S), 0)

    def height(t_s: float) -> float:
        return float(one.segments(t_s).p_m[one.row["anna/pelvis"], 2])

    def thigh(t_s: float) -> Floats:
        p_m = one.segments(t_s).p_m
        return p_m[one.row["anna/left_shank"]] - p_m[one.row["anna/left_thigh"]]

    assert height(3.5) - height(0.0) > 0.3 and height(10.0) == pytest.approx(height(0.0), abs=0.01)
    assert abs(thigh(10.0)[2]) < 0.12 and thigh(3.5)[2] < -0.35


@pytest.mark.parametrize("stature_m", [0.95, 1.3, 1.72, 2.05])
def test_children_and_tall_people_are_as_tall_as_they_say(stature_m: float) -> None:
    script = SceneScript({"anna": PersonScript("front", stature_m=stature_m)}, round_s=4.0)
    assert not list(script_faults(script))
    found = Figures(script, 0).segments(1.0)
    eyes_m = float(found.p_m[Figures(script, 0).row["anna/left_eye"], 2]) + script.neck_height_m
    assert eyes_m == pytest.approx(0.92 * stature_m, rel=0.03)


def test_who_walks_to_where_one_is_stays_there_and_does_not_spin() -> None:
    one = figures((Act(AT_S, "walk", "shelf"),), "shelf")
    found = [one.segments(t_s) for t_s in np.arange(2.0, 9.0, 0.05).tolist()]
    pelvis = one.row["anna/pelvis"]
    places = np.array([at.p_m[pelvis] for at in found])
    turns = np.array([at.quat[pelvis] for at in found])
    assert np.ptp(places, axis=0).max() < 0.05
    assert np.abs(turns @ turns[0]).min() > 0.998
