"""People of a world are bodies: limbs keep their lengths, and nothing jumps."""

from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest
from world_scripts import WORLDS, shipped_world

from gazerig.features.world.body_motion import SEGMENTS
from gazerig.features.world.figure import Figures
from gazerig.features.world.timeline import HEAD_M
from gazerig.features.world.world_scene import WorldScene
from gazerig.gaze.types import Floats
from gazerig.sim_mock.scenes.script import Act, PersonScript, SceneScript, ThingScript

STEP_S = 0.02


@cache
def figures(name: str) -> Figures:
    return Figures(shipped_world(name), 3)


class Film(NamedTuple):
    """A round of a world every 20 ms: places (n, segments, 3), rotations (n, segments, 3, 3)."""

    p_m: Floats
    R: Floats


@cache
def film(name: str) -> Film:
    from scipy.spatial.transform import Rotation

    round_s = figures(name).script.round_s
    found = [figures(name).segments(t_s) for t_s in np.arange(0.0, round_s, STEP_S).tolist()]
    quats = np.array([one.quat for one in found])
    turns = Rotation.from_quat(quats.reshape(-1, 4), scalar_first=True).as_matrix()
    return Film(np.array([one.p_m for one in found]), turns.reshape(*quats.shape[:2], 3, 3))


def people(name: str) -> list[str]:
    return list(figures(name).script.people)


def places(name: str, segment: str) -> Floats:
    return film(name).p_m[:, figures(name).row[segment]]


def turns(name: str, segment: str) -> Floats:
    return film(name).R[:, figures(name).row[segment]]


def angles_deg(a: Floats, b: Floats) -> Floats:
    return np.degrees(np.arccos(np.clip((a * b).sum(axis=-1), -1.0, 1.0)))


@pytest.mark.parametrize("name", WORLDS)
def test_limbs_keep_their_lengths(name: str):
    for who in people(name):
        body = figures(name).measures[who]
        lengths = {
            ("upper_arm", "forearm"): body.upper_arm_m,
            ("forearm", "hand"): body.forearm_m,
            ("thigh", "shank"): body.thigh_m,
            ("shank", "foot"): body.shank_m,
        }
        for side in ("left", "right"):
            for (a, b), length in lengths.items():
                ends = [places(name, f"{who}/{side}_{part}") for part in (a, b)]
                found = np.linalg.norm(ends[0] - ends[1], axis=1)
                assert np.abs(found - length).max() <= 2e-3, (who, side, a)


@pytest.mark.parametrize("name", WORLDS)
def test_nothing_jumps_also_where_a_round_begins_again(name: str):
    around = np.concatenate((film(name).p_m, film(name).p_m[:1]))
    moved = np.linalg.norm(np.diff(around, axis=0), axis=2).max(axis=0)
    for segment, away_m in zip(figures(name).names, moved.tolist(), strict=True):
        fast = segment.endswith(("hand", "forearm"))
        most_m_s = 9.0 if fast else 6.0 if segment.endswith("foot") else 5.0
        assert away_m < most_m_s * STEP_S, segment


@pytest.mark.parametrize("name", WORLDS)
def test_joints_stay_within_what_people_can_do(name: str):
    most = {
        "elbow": 151.0, "knee": 151.0, "wrist": 56.0, "head": 85.0, "neck": 50.0, "eye": 45.0,
        "walk": 45.0, "up": 30.0,
    }  # fmt: skip
    for who in people(name):
        R = {segment: turns(name, f"{who}/{segment}") for segment in SEGMENTS}
        found = {part: angles_deg(R["head"][:, :, 0], R[below][:, :, 0])
                 for part, below in (("head", "torso"), ("neck", "neck"))}  # fmt: skip
        speed = np.gradient(places(name, f"{who}/pelvis")[:, :2], STEP_S, axis=0)
        pace = np.linalg.norm(speed, axis=1)
        aside = angles_deg(speed / np.maximum(pace, 0.1)[:, None], R["pelvis"][:, :2, 0])
        found["up"] = np.degrees(np.arcsin(R["head"][:, 2, 0]))
        found["walk"] = np.where(pace > 0.5, aside, 0.0)  # people walk ahead
        for side in ("left", "right"):
            upper, fore, hand = (
                R[f"{side}_{part}"][:, :, 2] for part in ("upper_arm", "forearm", "hand")
            )
            found["elbow"], found["wrist"] = angles_deg(upper, fore), angles_deg(fore, hand)
            thigh, shank = R[f"{side}_thigh"], R[f"{side}_shank"][:, :, 2]
            found["knee"] = angles_deg(thigh[:, :, 2], shank)
            found["eye"] = angles_deg(R[f"{side}_eye"][:, :, 0], R["head"][:, :, 0])
            # A knee bends to the back alone.
            assert (thigh[:, :, 0] * shank).sum(axis=1).min() > -0.02, who
            for joint, at in found.items():
                assert at.max() <= most[joint], (who, side, joint, at.argmax() * STEP_S)


@pytest.mark.parametrize("name", WORLDS)
def test_a_foot_that_stands_does_not_slide(name: str):
    for who in people(name):
        ankle_m = figures(name).measures[who].ankle_m
        for foot in ("left_foot", "right_foot"):
            below = turns(name, f"{who}/{foot}") @ np.array((0.115, 0.0, -ankle_m))
            balls = places(name, f"{who}/{foot}") + below
            height = balls[:, 2] + figures(name).script.neck_height_m
            assert height.min() > -0.004
            stands = (height[1:] < 0.003) & (height[:-1] < 0.003)
            slid_m = np.linalg.norm(np.diff(balls[:, :2], axis=0), axis=1)[stands]
            assert slid_m.max() < 0.012 and slid_m.mean() < 0.0005, (who, foot)


def test_a_boxer_s_fist_goes_to_the_head_and_spins_only_then():
    scene = WorldScene("boxing", Figures(shipped_world("boxing"), 3))
    assert scene.behaviours
    first = next(event for event in scene.events() if event.name == "punch")
    fists = [
        next(one for one in scene.things(t_s) if one.id == 0)
        for t_s in np.arange(first.start_s, first.end_s, 0.02).tolist()
    ]
    away = [float(np.linalg.norm(np.subtract(one.p_world_m, HEAD_M))) for one in fists]
    assert away[0] > 0.55 and min(away) < 0.38
    assert max(abs(one.spin_rad_s) for one in fists) > 3.0
    quiet = [one.spin_rad_s for one in scene.things(1.0)]
    assert max(map(abs, quiet)) < 0.5


# --- Every act of a person moves its own segments, during its time, and no others


AT_S = 3.0
ROUND_S = 18.0

# The act, the person who does it, and the segments that it moves most.
CASES: dict[str, tuple[Act, ...]] = {
    "walk": (Act(AT_S, "walk", "front"), Act(9.0, "walk", "behind")),
    "turn": (Act(AT_S, "turn", "window"), Act(6.0, "turn", "head")),
    "speak": (Act(AT_S, "speak"),),
    "nod": (Act(AT_S, "nod"),),
    "wave": (Act(AT_S, "wave"),),
    "pass": (Act(AT_S, "pass", "ben", thing="cup"), Act(8.0, "nod")),
    "guard": (Act(AT_S, "guard", for_s=4.0),),
    "punch": (Act(AT_S, "punch", "head"),),
}
MOVES = {
    "nod": ("left_eye", 0.008, "left_foot", 0.0),
    "walk": ("left_foot", 0.25, "", 0.0),
    "turn": ("left_upper_arm", 0.05, "pelvis", 0.02),
    "speak": ("lips", 0.004, "right_hand", 0.0),
}
"""A segment that moves and its least way, one that stays and its longest, where others are."""
ARM_ACTS = ("wave", "punch")


@cache
def acting(acts: tuple[Act, ...], start: str = "behind", *, cup: bool = False) -> Figures:
    people = {"anna": PersonScript(start, acts=acts), "ben": PersonScript("chair_left", look=1)}
    things = {"cup": ThingScript("anna")} if cup else {}
    return Figures(SceneScript(people, round_s=ROUND_S, things=things), 2)


def still(cup: bool = False) -> Figures:
    return acting((), cup=cup)


@cache
def still_m(t_s: float, cup: bool) -> Floats:
    return still(cup).segments(t_s).p_m


def moved_m(acts: tuple[Act, ...], *, cup: bool = False) -> dict[str, float]:
    """Return the largest distance of each segment of anna from its position without the acts."""
    one = acting(acts, cup=cup)
    found = dict.fromkeys(SEGMENTS, 0.0)
    for t_s in np.arange(AT_S, AT_S + 4.0, 0.05).tolist():
        away = np.linalg.norm(one.segments(t_s).p_m - still_m(t_s, cup), axis=1)
        for segment in SEGMENTS:
            found[segment] = max(found[segment], float(away[one.row[f"anna/{segment}"]]))
    return found


@pytest.mark.parametrize("name", sorted(CASES))
def test_an_act_moves_what_it_says_and_not_before_it_begins(name: str):
    acts, cup = CASES[name], name == "pass"
    found = moved_m(acts, cup=cup)
    moves, least_m, stays, most_m = MOVES.get(name, ("right_hand", 0.15, "right_foot", 0.0))
    assert found[moves] > least_m and (not stays or found[stays] <= most_m)
    if name in ARM_ACTS:
        assert found["left_hand"] < 0.5 * found["right_hand"]
    before_s = AT_S - 0.8  # a path is averaged over some time
    same = acting(acts, cup=cup).segments(before_s).p_m - still(cup).segments(before_s).p_m
    assert np.abs(same).max() < (0.12 if name == "nod" else 1e-9)


# --- People of a world keep out of its furniture and of each other


_BETWEEN_M = 0.03
"""Shapes that collide are a little larger than what is seen; hands may touch."""


def owner(model: Any, geom: int) -> str:
    return str(model.body(int(model.geom_bodyid[geom])).name)


@pytest.mark.parametrize("name", WORLDS)
def test_people_stay_out_of_the_furniture_and_of_each_other(mujoco: Any, name: str):
    from gazerig.features.world.figure_model import PeoplePlacer
    from gazerig.features.world.model import world_spec

    world = figures(name)
    model = world_spec(world, None).compile()
    data = mujoco.MjData(model)
    people = PeoplePlacer(model, world)
    owners = [owner(model, i) for i in range(model.ngeom)]
    solid = [i for i in range(model.ngeom) if model.geom_contype[i] and "/" in owners[i]]
    room = [i for i in range(model.ngeom) if owners[i] in ("room", "stand")]
    whose = np.array([one.split("/")[0] for one in owners])
    bound = model.geom_rbound
    half_m = 3.4 if world.script.room == "hall" else 2.6
    for t_s in np.arange(0.3, world.script.round_s, 1.31).tolist():
        people.place(data, t_s)
        mujoco.mj_kinematics(model, data)
        seen = [i for i in solid if abs(data.geom_xpos[i, 1]) < half_m]
        for k, one in enumerate(seen):
            others = np.array([*room, *seen[:k]])
            others = others[whose[others] != whose[one]]
            apart = np.linalg.norm(data.geom_xpos[others] - data.geom_xpos[one], axis=1)
            for other in others[apart < bound[one] + bound[others]].tolist():
                found = mujoco.mj_geomDistance(model, data, one, other, 0.1, None)
                names = owners[one], owners[other], t_s
                assert found > -_BETWEEN_M or "hand" in names[0] + names[1], names
