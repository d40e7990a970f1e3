"""People of a world are bodies: limbs keep their lengths, and nothing jumps."""

import pickle
from functools import cache
from math import cos, radians, sin
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from world_scripts import WORLDS, shipped_world

from gazerig.features.world.body_shape import body_segments
from gazerig.features.world.faces import look_angles
from gazerig.features.world.figure import SEGMENTS, Figures
from gazerig.features.world.rotations import rotation_matrix
from gazerig.features.world.timeline import HEAD_M
from gazerig.features.world.world_scene import WorldScene
from gazerig.gaze.types import Floats
from gazerig.robot.description.person_shape import WORLD_LOOKS
from gazerig.sim_mock.scenes.script import Act, PersonScript, PlaceScript, SceneScript
from gazerig.sim_mock.scenes.timeline import TimedAct

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


def place(name: str, segment: str, t_s: float) -> Floats:
    all_of_them = figures(name)
    return all_of_them.segments(t_s).p_m[all_of_them.row[segment]]


def _rotation(quat: Floats) -> Floats:
    return np.asarray(Rotation.from_quat(quat, scalar_first=True).as_matrix())


def axes(name: str, segment: str, t_s: float) -> Floats:
    all_of_them = figures(name)
    return _rotation(all_of_them.segments(t_s).quat[all_of_them.row[segment]])


def angles_deg(a: Floats, b: Floats) -> Floats:
    return np.degrees(np.arccos(np.clip((a * b).sum(axis=-1), -1.0, 1.0)))


@pytest.mark.parametrize("name", WORLDS)
def test_all_numbers_are_finite_and_faces_are_above_the_floor(name: str) -> None:
    assert np.isfinite(film(name).p_m).all() and np.isfinite(film(name).R).all()
    for who in people(name):
        above = places(name, f"{who}/head")[:, 2] + figures(name).script.neck_height_m
        assert above.min() > 0.7 and above.max() < 2.0, who


@pytest.mark.parametrize("name", WORLDS)
def test_limbs_keep_their_lengths(name: str) -> None:
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
                assert found == pytest.approx(np.full(len(found), length), abs=2e-3)


ANSUR = {
    "upper_arm": ((0.3112, 0.0172, 1.6285), (0.3352, 0.0175, 1.7562)),
    "forearm": ((0.2413, 0.0152, 1.6285), (0.2679, 0.0154, 1.7562)),
    "thigh": ((0.3795, 0.0447, 1.6285), (0.4092, 0.0492, 1.7562)),
    "shank": ((0.4032, 0.0271, 1.6285), (0.4188, 0.0266, 1.7562)),
}
"""Mean, standard deviation and mean stature of 1986 women and 4082 men, m: Gordon et al. (2014),
2012 Anthropometric survey of U.S. Army personnel. Acromion to radiale, radiale to stylion, and
differences of the heights of trochanterion, lateral epicondyle of the femur and lateral malleolus,
of which the deviation is the upper height's."""


@pytest.mark.parametrize("name", WORLDS)
def test_limbs_are_as_long_as_peoples_and_look_so(name: str) -> None:
    """Within two standard deviations of either sex, of the joints' places and of what is drawn."""
    for who, body in figures(name).measures.items():
        drawn = body_segments(body, WORLD_LOOKS[figures(name).script.people[who].look], False)
        for limb, below in (("upper_arm", "forearm"), ("forearm", "hand"), ("thigh", "shank"),
                            ("shank", "foot")):  # fmt: skip
            low = min((mean - 2.0 * sd) / stature for mean, sd, stature in ANSUR[limb])
            high = max((mean + 2.0 * sd) / stature for mean, sd, stature in ANSUR[limb])
            joints = [places(name, f"{who}/left_{part}")[0] for part in (limb, below)]
            length = float(np.linalg.norm(joints[0] - joints[1]))
            assert low <= length / body.stature_m <= high, (who, limb)
            for side in ("left", "right"):
                mesh = drawn[f"{side}_{limb}"].mesh.vertices
                # A limb is drawn from its joint down, its end rounded about the next joint.
                assert -mesh[:, 2].min() == pytest.approx(length, abs=0.08), (who, limb)


@pytest.mark.parametrize("name", WORLDS)
def test_nothing_jumps_also_where_a_round_begins_again(name: str) -> None:
    around = np.concatenate((film(name).p_m, film(name).p_m[:1]))
    moved = np.linalg.norm(np.diff(around, axis=0), axis=2).max(axis=0)
    for segment, away_m in zip(figures(name).names, moved.tolist(), strict=True):
        fast = segment.endswith(("hand", "forearm"))
        most_m_s = 9.0 if fast else 6.0 if segment.endswith("foot") else 5.0
        assert away_m < most_m_s * STEP_S, segment


@pytest.mark.parametrize("name", WORLDS)
def test_joints_stay_within_what_people_can_do(name: str) -> None:
    most = {"elbow": 151.0, "knee": 151.0, "wrist": 56.0, "head": 85.0, "eye": 45.0}
    for who in people(name):
        R = {segment: turns(name, f"{who}/{segment}") for segment in SEGMENTS}
        found = {"head": angles_deg(R["head"][:, :, 0], R["torso"][:, :, 0])}
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
def test_a_foot_that_stands_does_not_slide(name: str) -> None:
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


def test_the_same_seed_gives_the_same_motion_in_another_process_and_another_seed_not() -> None:
    script = shipped_world(WORLDS[0])
    one, other = Figures(script, 5), Figures(script, 6)
    again: Figures = pickle.loads(pickle.dumps(one))
    for t_s in (1.234, 17.0, 200.0):
        assert (one.segments(t_s).p_m == again.segments(t_s).p_m).all()
        assert (one.segments(t_s).quat == again.segments(t_s).quat).all()
    assert any(
        (one.segments(t_s).quat != other.segments(t_s).quat).any() for t_s in (3.0, 11.0, 19.0)
    )


def test_a_scene_says_where_faces_truly_are() -> None:
    scene = WorldScene("living-room", Figures(shipped_world("living-room")))
    t_s = 20.0
    (anna,) = scene.people(t_s)
    all_of_them = scene.figures
    head = all_of_them.row["anna/head"]
    found = all_of_them.segments(t_s)
    R = _rotation(found.quat[head])
    away = np.array(anna.p_world_face_m) - found.p_m[head]
    assert R.T @ away == pytest.approx(-np.array(all_of_them.measures["anna"].skull_m), abs=1e-6)
    assert anna.hand is not None or scene.things(t_s) == ()


def test_who_speaks_moves_the_lips_four_to_five_times_a_second() -> None:
    all_of_them = figures("living-room")
    (spoken,) = [one for one in all_of_them.timelines["anna"] if one.start_s == 28.0]
    moments_s = np.arange(spoken.start_s, spoken.end_s, 0.01)

    def open_m(t_s: float) -> float:
        R = axes("living-room", "anna/head", t_s)
        return float(
            (
                R.T
                @ (place("living-room", "anna/lips", t_s) - place("living-room", "anna/head", t_s))
            )[2]
        )

    heights = np.array([open_m(t_s) for t_s in moments_s.tolist()])
    moves = heights - heights.mean()
    rate_hz = np.fft.rfftfreq(len(moves), 0.01)[np.abs(np.fft.rfft(moves)).argmax()]
    assert 3.5 < rate_hz < 5.5 and np.ptp(heights) > 0.005
    assert np.ptp([open_m(t_s) for t_s in (18.1, 18.5, 18.9)]) < 1e-6


def test_eyes_are_on_who_is_looked_at_and_lids_blink() -> None:
    off = []
    for t_s in np.arange(40.8, 42.8, 0.02).tolist():
        eye = place("conversation", "mia/left_eye", t_s)
        way = np.subtract(HEAD_M, eye) / np.linalg.norm(np.subtract(HEAD_M, eye))
        off.append(float(angles_deg(axes("conversation", "mia/left_eye", t_s)[:, 0], way)))
    assert np.median(off) < 5.0
    up = turns("conversation", "ben/head")[:, :, 2]
    shut = (up * turns("conversation", "ben/left_lid")[:, :, 0]).sum(axis=1) < -0.5
    blinks = int((np.diff(shut.astype(int)) > 0).sum())
    assert 8 <= blinks * 60.0 / figures("conversation").script.round_s <= 26


def test_a_cup_goes_from_hand_to_hand_and_stays_upright() -> None:
    all_of_them = figures("conversation")
    for t_s, who, side in ((20.0, "anna", "left"), (40.0, "ben", "right"), (70.0, "anna", "left")):
        hand = place("conversation", f"{who}/{side}_hand", t_s)
        assert np.linalg.norm(place("conversation", "thing/cup", t_s) - hand) < 0.12
    assert turns("conversation", "thing/cup")[:, 2, 2].min() > 1.0 - 1e-6
    (given,) = [one for one in all_of_them.timelines["anna"] if one.act.do == "pass"]
    middle_s = 0.5 * (given.start_s + given.end_s)
    hands = [place("conversation", f"{who}_hand", middle_s) for who in ("anna/left", "ben/right")]
    assert np.linalg.norm(hands[0] - hands[1]) < 0.25


def test_a_child_pushes_the_head() -> None:
    (push,) = [one for one in figures("crowd").timelines["tim"] if one.act.do == "push"]
    nearest = min(
        float(np.linalg.norm(place("crowd", "tim/right_hand", t_s) - np.array(HEAD_M)))
        for t_s in np.arange(push.start_s, push.end_s, 0.02).tolist()
    )
    assert 0.02 < nearest < 0.08


def test_a_boxer_s_fist_goes_to_the_head_and_spins_only_then() -> None:
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


def test_seeds_vary_when_a_boxer_punches_and_only_by_what_the_script_allows() -> None:
    script = shipped_world("boxing")
    starts = {
        seed: [one.start_s for one in Figures(script, seed).timelines["rival"]] for seed in range(6)
    }
    assert len({tuple(one) for one in starts.values()}) == 6
    for found in starts.values():
        for act, start_s in zip(script.people["rival"].acts, found, strict=True):
            assert abs(start_s - act.at_s) <= act.vary_s + 1e-9


def test_processes_share_a_motion_and_without_its_file_compute_the_same(tmp_path: Path) -> None:
    script = shipped_world("living-room")
    one = Figures(script, 3, tmp_path / "people.npy")
    assert pickle.loads(pickle.dumps(one)).shared == one.shared
    alone = pickle.loads(pickle.dumps(one)).segments(7.123)  # there is no file yet
    one.share()
    reads = pickle.loads(pickle.dumps(one))
    assert isinstance(reads._table.base, np.memmap)
    for found in (alone, reads.segments(7.123)):
        np.testing.assert_array_equal(found.p_m, one.segments(7.123).p_m)
        np.testing.assert_array_equal(found.quat, one.segments(7.123).quat)


def test_a_world_sent_to_another_process_computes_its_people_once() -> None:
    scene = WorldScene("living-room", Figures(shipped_world("living-room")))
    again, figures = pickle.loads(pickle.dumps((scene, scene.figures)))
    assert again.figures is figures
    assert (again.name, again.round_s) == (scene.name, scene.round_s)


def test_a_rotation_matrix_is_that_of_its_quaternion() -> None:
    for turn in Rotation.random(20, rng=np.random.default_rng(3)):
        found = rotation_matrix(turn.as_quat(scalar_first=True))
        np.testing.assert_allclose(found, turn.as_matrix(), atol=1e-12)


def test_a_head_does_not_turn_to_what_is_behind_it() -> None:
    """Somebody who looks at a place behind stays ahead with the head; the eyes do what they can."""
    t_s = np.arange(0.0, 4.0, 0.01)
    eyes, ahead = np.tile((0.0, 0.0, 1.6), (len(t_s), 1)), np.zeros(len(t_s))
    places = {
        name: np.tile((cos(angle), sin(angle), 1.6), (len(t_s), 1))
        for name, angle in (("aside", radians(60.0)), ("behind", radians(170.0)))
    }
    turned = {}
    for name in places:
        act = TimedAct(Act(at_s=1.0, do="look_at", to=name), 1.0, 1.0)
        first = np.tile((1.0, 0.0, 1.6), (len(t_s), 1))
        rng = np.random.default_rng(0)
        found = look_angles(t_s, (act,), first, places, eyes, ahead, "head", rng)
        turned[name] = float(np.degrees(found.yaw[len(t_s) // 2 :]).mean())
    assert turned["aside"] > 40.0
    assert abs(turned["behind"]) < 5.0


def test_only_a_hand_before_the_camera_is_to_be_looked_at() -> None:
    """A hand that reaches for a thing on the floor is below the picture all the time."""
    found = {}
    for name, height_m in (("level", 1.0), ("floor", 0.2)):
        script = SceneScript(
            {"p": PersonScript("near", acts=(Act(at_s=1.0, do="reach", to="it", for_s=2.8),))},
            round_s=5.0,
            places={
                "near": PlaceScript(0.75, 0.0, facing_deg=180.0),
                "it": PlaceScript(0.5, 0.1, height_m=height_m),
            },
        )
        events = WorldScene(name, Figures(script)).events()
        found[name] = [event.name for event in events]
    assert found == {"level": ["reach"], "floor": []}
