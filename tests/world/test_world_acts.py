"""Every act of a person moves its own segments, during its time, and no others."""

from functools import cache

import numpy as np
import pytest

from gazerig.features.world.figure import SEGMENTS, Figures
from gazerig.gaze.types import Floats
from gazerig.sim_mock.scenes.script import Act, PersonScript, SceneScript, ThingScript

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
HEAD_ACTS = ("nod", "shake", "look_at")
ARM_ACTS = ("wave", "point", "reach", "push", "punch", "feint")


@cache
def figures(acts: tuple[Act, ...], start: str = "behind", *, cup: bool = False) -> Figures:
    people = {"anna": PersonScript(start, acts=acts), "ben": PersonScript("chair_left", look=1)}
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
