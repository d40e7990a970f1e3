"""The action planner of a boxing match: guard, attack or wait, from what is seen."""

from dataclasses import replace
from math import hypot, inf

import numpy as np
import pytest
from attention_scene import attention, body, looking, percept
from msgspec import structs

from gazerig.config.schema import load_rules
from gazerig.gaze.angles import add, norm
from gazerig.gaze.attention.action_planner import (
    ActionPlanner,
    SeenHand,
    approaches,
    hit_places,
    remember_hands,
)
from gazerig.gaze.attention.top_down import PLANNED, TopDownParams
from gazerig.gaze.types import Face

EYE = (0.0, 0.0, 0.0)
NOSE = (1.0, 0.0, 0.0)
TOWARDS = ((-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0))
LEFT, RIGHT = (0.88, 0.12, -0.13), (0.88, -0.12, -0.13)  # fists before the chin
DT_S = 1.0 / 30.0
PLACES = ((0.0, -0.1), (0.06, 0.0), (0.03, 0.03), (0.0, -0.06), (0.0, 0.0), (-0.06, 0.0),
          (-0.03, 0.03), (0.0, 0.1))  # fmt: skip
FACE = Face(
    1, NOSE, (0.0, 0.0, 0.0), TOWARDS, tuple(add(NOSE, (0.0, *off)) for off in PLACES), 0.98
)


def seen(t_s, *rows):
    return structs.replace(percept(t_s, body(1, "face", NOSE), *rows), faces=(FACE,))


def fist(id, p, v=(0.0, 0.0, 0.0)):
    return body(id, "hand", p, v)


def guarding(t_s):
    return seen(t_s, fist(2, LEFT), fist(3, RIGHT))


def punch(t_s, away_m=0.8, speed_m_s=2.5, aside_m=0.0):
    return seen(t_s, fist(2, LEFT), fist(3, (away_m, -0.02 + aside_m, 0.0), (-speed_m_s, 0.0, 0.0)))


class Bout:
    """A planner that sees one frame after the other."""

    def __init__(self):
        self.planner, self.frame = ActionPlanner(), 0

    def see(self, shown, frames, *more, **how):
        """See frames of what is shown at their times; return the plans."""
        first, self.frame = self.frame, self.frame + frames
        times = [k * DT_S for k in range(first, self.frame)]
        return [self.planner.step(shown(t, *more, **how), EYE, t) for t in times]


def actions(plans):
    return {plan.action for plan in plans}


def test_time_to_contact_is_the_way_to_go_over_the_closing_speed():
    (*_, one) = approaches(punch(0.0).bodies, EYE, 0.06)
    assert (one.id, one.kind) == (3, "hand")
    assert one.closing_m_s == pytest.approx(2.5, rel=1e-3)
    assert one.contact_s == pytest.approx(0.5 / 2.5 - 0.06, abs=2e-3)
    assert one.miss_m == pytest.approx(0.02, abs=1e-6)
    (*_, back) = approaches(punch(0.0, speed_m_s=-2.0).bodies, EYE)
    assert (back.contact_s, back.miss_m) == (inf, inf) and back.closing_m_s < 0.0


def test_a_punch_is_guarded_against_after_the_reaction_time_and_its_fist_is_named():
    bout = Bout()
    bout.see(guarding, 5)
    plans = bout.see(punch, 3)
    assert [plan.action for plan in plans] == ["wait", "guard", "guard"]
    assert plans[-1].body_id == 3
    assert plans[-1].text == "guard: hand 3 arrives in 0.20 s"


def test_a_punch_whose_speed_is_certain_is_guarded_against_at_once():
    for sd_m_s, action in ((0.84, "guard"), (0.86, "wait")):
        one = punch(0.0)
        cov = np.array([np.eye(3) * sd_m_s**2] * len(one.bodies.ids))
        sure = structs.replace(one, bodies=structs.replace(one.bodies, v_cov=cov))
        assert ActionPlanner().step(sure, EYE, 0.0).action == action


def test_a_fist_has_come_on_since_its_picture_was_made():
    """At 2.5 m/s from 1.7 m it arrives in 0.56 s, which is no threat yet; 0.2 s later it is."""
    for late_s, action in ((0.0, "wait"), (0.2, "guard")):
        planner = ActionPlanner()
        for t in (np.arange(40) * 0.001).tolist():
            plan = planner.step(punch(t, 1.7), EYE, t + late_s)
        assert plan.action == action


@pytest.mark.parametrize(
    "comes",
    [
        {"speed_m_s": 0.7},
        {"speed_m_s": -2.5},
        {"aside_m": 0.5},
        {"aside_m": 0.25, "speed_m_s": 1.8},  # raised to the guard
        {"away_m": 3.0, "speed_m_s": 2.5},
    ],
)
def test_what_is_no_punch_is_not_guarded_against(comes):
    assert actions(Bout().see(punch, 10, **comes)) == {"wait"}


def test_one_frame_of_a_wrong_speed_is_no_punch():
    bout = Bout()
    for shown in (guarding, punch) * 5:
        assert actions(bout.see(shown, 1)) == {"wait"}


def test_guard_lasts_its_shortest_time_and_a_slower_fist_does_not_end_it():
    bout = Bout()
    plans = bout.see(punch, 3)
    slow = bout.see(punch, 20, away_m=0.5, speed_m_s=0.6)
    assert actions([plans[-1], *slow]) == {"guard"}  # 0.6 * 1.5 > 0.8
    fists = fist(2, LEFT), fist(3, RIGHT)  # no face to attack
    assert actions(bout.see(percept, 1, *fists)) == {"wait"}
    bout.see(punch, 2)
    after = bout.see(percept, 10, *fists)
    kept = sum(plan.action == "guard" for plan in after)
    assert 0.3 - 2 * DT_S < kept * DT_S < 0.3 + DT_S


def opened(t_s, *more, parted):
    z, y = (0.05, 0.25) if parted else (-0.45, 0.16)
    return seen(t_s, *more, fist(2, (0.9, y, z)), fist(3, (0.9, -y, z)))


@pytest.mark.parametrize("parted", [True, False])
def test_an_open_place_is_attacked_once_and_again_after_a_rest(parted):
    bout = Bout()
    assert actions(bout.see(guarding, 9)) == {"wait"}
    plans = bout.see(opened, 75, parted=parted)
    starts = [
        k for k in range(1, 75) if plans[k].action == "attack" and plans[k - 1].action == "wait"
    ]
    assert starts[0] * DT_S == pytest.approx(0.2, abs=DT_S)
    lasts = sum(plan.action == "attack" for plan in plans[: starts[1]])
    assert lasts * DT_S == pytest.approx(0.6, abs=1.5 * DT_S)
    assert (starts[1] - starts[0]) * DT_S == pytest.approx(0.6 + 0.8, abs=2 * DT_S)
    place = plans[starts[0]].p_world_m
    assert place is not None
    assert (place[2] < -0.2) == parted  # the chest, or a side of the face
    assert ("chest" in plans[starts[0]].why) == parted


def test_unseen_hands_are_remembered_and_one_with_a_new_number_replaces_the_nearest():
    left, right = fist(2, LEFT), fist(3, RIGHT, (0.0, 0.0, -1.0))
    known = remember_hands((), seen(0.0, left, right).bodies, FACE, 0.0)
    for t_s, rows, ids in ((0.6, (left,), [2, 3]), (0.7, (left,), [2]), (0.1, (), [2, 3]),
                           (0.1, (left, fist(9, RIGHT)), [2, 9]),
                           (0.1, (fist(9, RIGHT), left, right), [2, 3])):  # fmt: skip
        assert [one.id for one in remember_hands(known, seen(t_s, *rows).bodies, FACE, t_s)] == ids
    *_, lowered = remember_hands(known, seen(0.1, left).bodies, FACE, 0.1)
    assert norm(lowered.off_m) == pytest.approx(0.7) and lowered.off_m[2] < -0.4


@pytest.mark.parametrize(("v_z_m_s", "opens"), [(-1.2, True), (-0.3, False), (1.2, False)])
def test_hands_that_dropped_out_of_the_picture_leave_the_face_open(v_z_m_s, opens):
    """Those that were at rest or on their return to the guard when they were lost still do."""
    bout, v = Bout(), (0.0, 0.0, v_z_m_s)
    bout.see(guarding, 9)
    bout.see(seen, 1, fist(2, LEFT, v), fist(3, RIGHT, v))
    plans = bout.see(seen, 16)
    attacked = [k for k, plan in enumerate(plans, 1) if plan.action == "attack"]
    assert bool(attacked) == opens
    if opens:
        assert attacked[0] * DT_S == pytest.approx(0.2, abs=1.5 * DT_S)
        assert "side of the face is open" in plans[attacked[0] - 1].why


def test_a_punch_ends_an_attack():
    bout = Bout()
    bout.see(guarding, 1)
    assert bout.see(opened, 9, parted=True)[-1].action == "attack"
    assert bout.see(punch, 2)[-1].action == "guard"


def test_a_gap_without_frames_ends_what_was_under_way():
    bout = Bout()
    assert bout.see(punch, 3)[-1].action == "guard"
    assert bout.planner.step(seen(5.0), EYE, 5.0).action == "wait"


# The same through attention.


def planned_attention(planner=True):
    return attention(replace(load_rules("boxing"), planner=planner))


def looks(model, percepts):
    return [model.choose(one, looking(), one.captured_s) for one in percepts]


def test_a_choice_of_the_menu_overrules_the_planner_until_it_is_given_back():
    model = planned_attention()
    assert model.top_down.behaviours == ("attack", "guard", "wait", PLANNED)
    frames = [guarding(k * DT_S) for k in range(20)]
    looks(model, frames[:2])
    model.top_down.behave("attack")
    target = looks(model, frames[2:4])[-1]
    assert (target.kind, target.plan) == ("attack_target", "attack: asked for")
    model.top_down.behave("guard")
    target = looks(model, frames[4:6])[-1]
    assert (target.kind, target.plan) == ("hand", "guard: asked for")
    assert model.top_down.chosen_behaviour == "guard"
    model.top_down.behave("wait")
    punched = [punch(k * DT_S) for k in range(6, 12)]
    assert {one.plan for one in looks(model, punched)} == {"wait: asked for"}
    model.top_down.behave(PLANNED)
    later = [punch(k * DT_S) for k in range(12, 16)]
    assert looks(model, later)[-1].plan.startswith("guard: hand 3 arrives")


def test_a_planner_needs_the_rules_it_chooses_between():
    rules = {"wait": TopDownParams().rules["wait"]}
    with pytest.raises(ValueError, match="behaviour 'guard' has no rule"):
        TopDownParams(rules=rules, planner=True)


def test_the_planner_switched_off_leaves_the_behaviour_of_the_start():
    model = planned_attention()
    looks(model, [punch(k * DT_S) for k in range(4)])
    assert model.top_down.behaviour == "guard"
    model.top_down.retune(TopDownParams())
    assert model.top_down.behaviour == "wait" and not model.top_down.plans


def test_the_line_to_the_chest_passes_below_fists_before_the_chin():
    hands = [SeenHand(2, (-0.12, 0.12, -0.13), 0.0), SeenHand(3, (-0.12, -0.12, -0.13), 0.0)]
    clear = {place.name: place.clear_m for place in hit_places(FACE, hands, EYE)}
    # At 0.88 m the line to a chest 1 m away and 0.3 m below is 0.264 m below the eyes.
    off = 0.13 - 0.264
    assert clear["chest"] == pytest.approx(hypot(0.12, off / hypot(1.0, 0.3)), abs=0.01)
    assert clear["left side of the face"] < clear["chest"] < 0.28
