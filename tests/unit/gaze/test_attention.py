"""Field of view, eq 1, rules and the winner (Mitake et al.)."""

from itertools import groupby
from math import exp, hypot, inf, pi, radians, sin

import numpy as np
import pytest
from attention_scene import FACE, attention, body, look, looking, percept, salience, waving
from msgspec import structs

from gazerig.gaze.attention.bottom_up import BottomUp, BottomUpParams, motion_terms, saturate
from gazerig.gaze.attention.top_down import Rule, TopDownParams
from gazerig.gaze.field_of_view import visible_bodies
from gazerig.gaze.types import Salience


def test_e45_terms_of_eq_1_do_not_depend_on_the_length_of_e():
    v, w = (1.0, 2.0, 0.0), (3.0, 0.0, 4.0)
    for length in (1.0, 5.0):
        assert motion_terms(v, w, (length, 0.0, 0.0)) == pytest.approx((2.0, -1.0, 3.0))
        assert motion_terms(v, w, (-length, 0.0, 0.0)) == pytest.approx((2.0, 1.0, 3.0))


def test_motion_saturates_unless_it_comes_nearer_fast():
    assert saturate(0.2, -0.3, 0.5, inf, 0.5) == pytest.approx(0.5)
    bounded = 0.35 * (1.0 - exp(-1.0 / 0.35))
    assert saturate(0.2, -0.3, 0.5, 0.35, 1.0) == pytest.approx(bounded)
    assert saturate(0.0, 2.0, 0.0, 0.35, 0.5) == pytest.approx(0.5 * (1.0 + bounded))
    assert saturate(0.0, 9.0, 0.0, 0.35, 1.0) == pytest.approx(2.0 + bounded)


@pytest.mark.parametrize(
    ("yaw", "pitch", "seen"),
    [(0, 0, True), (95, 0, True), (105, 0, False), (0, 55, True), (0, 65, False), (0, -70, True),
     (0, -80, False), (-95, 0, True), (70, 50, False), (180, 0, False)],
)  # fmt: skip
def test_field_of_both_eyes(yaw, pitch, seen):
    y, p = radians(yaw), radians(pitch)
    far = (100 * np.cos(p) * np.cos(y), 100 * np.cos(p) * np.sin(y), 100 * np.sin(p))
    assert bool(visible_bodies(bodies(body(1, "x", far)).rows(), looking())) is seen


def test_an_eye_sees_further_at_its_temple():
    apart = structs.replace(looking(), eye_left_rad=(radians(40.0), 0.0))
    assert visible_bodies(bodies(body(1, "x", (26.0, -97.0, 0.0))).rows(), apart)


def test_the_face_wins_over_a_resting_hand_and_loses_to_a_waving_one():
    model = attention()
    still = look(model, 0.0, FACE, waving(0.05))
    assert (still.kind, still.top_down, still.salience) == ("face", True, 0.5)
    moved = look(model, 0.5, FACE, waving(1.0))
    assert (moved.kind, moved.top_down) == ("hand", False)
    assert moved.shift == still.shift + 1
    assert "translation" in moved.why and "rule wait" in still.why


def test_nearly_equal_pulls_do_not_flicker():
    model, kinds = attention(), []
    for k in range(600):
        speed = 0.35 * (1.1 if k // 6 % 2 else 0.9)  # its salience swings about the face's 0.5
        kinds.append(look(model, k / 30, FACE, waving(speed)).kind)
    assert sum(a != b for a, b in zip(kinds[:60], kinds[1:60], strict=False)) <= 1
    stays = [len(list(same)) / 30 for _, same in groupby(kinds)]
    assert len(stays) < 20 and min(stays[1:-1]) > 0.3


def test_a_winner_is_kept_for_the_shortest_time():
    model = attention(min_dwell_ms=300.0)
    look(model, 0.0, FACE, waving(0.0))
    kept = look(model, 0.2, FACE, waving(2.0))
    assert (kept.kind, kept.saliences[0].kind) == ("face", "face"), "the winner comes first"
    assert kept.saliences[1].total > kept.saliences[0].total
    assert look(model, 0.4, FACE, waving(2.0)).kind == "hand"


def test_of_two_faces_the_nearer_is_kept_until_the_other_is_clearly_nearer():
    model = attention(min_dwell_ms=0.0)

    # After a first look at each:
    for t, other_m, id in ((0.0, 0.9, 5), (0.7, 0.9, 1), (1.7, 0.9, 1), (2.7, 0.6, 5)):
        assert look(model, t, FACE, body(5, "face", (other_m, 0.3, 0.0))).id == id


def test_a_lost_target_is_waited_for_and_then_left():
    model = attention()
    seen = look(model, 0.0, FACE)
    waited = look(model, 0.1)
    assert (waited.p_world_m, waited.why) == (seen.p_world_m, "lost, waiting")
    assert waited.shift == seen.shift
    left = look(model, 1.5)
    assert (left.kind, left.id) == ("rest", -1)


def test_stale_pictures_tell_nothing():
    model = attention()
    look(model, 0.0, FACE)
    assert model.choose(percept(0.0, FACE), looking(), 0.3).why != "lost, waiting"
    assert model.choose(percept(0.0, FACE), looking(), 0.5).why == "lost, waiting"
    assert model.choose(None, looking(), 3.0).kind == "rest"


def test_behaviours_follow_their_rules_and_do_not_wait_for_the_end_of_a_fixation():
    model = attention(min_dwell_ms=5000.0)
    rows = FACE, body(9, "attack_target", (0.8, -0.2, 0.0))
    assert look(model, 0.0, *rows).id == 1
    model.top_down.behave("attack")
    chosen = look(model, 0.05, *rows)
    assert (chosen.id, chosen.salience, chosen.top_down) == (9, 1.4, True)
    with pytest.raises(ValueError, match="no rule for behaviour 'dance'; rules: attack"):
        model.top_down.behave("dance")
    with pytest.raises(ValueError, match="has no rule"):
        TopDownParams(behaviour="x", rules={"wait": Rule("face", 0.5)})


def bodies(*rows):
    return percept(0.0, *rows).bodies


def test_literal_form_is_eq_1_as_printed_with_e_the_direction_of_gaze():
    """Of bodies anywhere, with no smoothing, distance, reference or motion of the eye."""
    model = BottomUp(BottomUpParams(form="literal", reference=9.0))
    seen = bodies(body(1, "x", (5, 3, 0), (1, 2, 0)))
    seen = structs.replace(seen, w_world_rad_s=np.array([[3.0, 0, 4.0]]))
    for gaze, terms in (((7.0, 0.0, 0.0), (2, 1, 3, 0, 6)), ((0.0, 1.0, 0.0), (1, 2, 0, 0, 3))):
        assert (
            tuple(float(term[0]) for term in salience(model, seen, 0.0, (1, 1, 1), gaze)) == terms
        )


def test_the_heads_own_motion_makes_what_stands_still_slide():
    model = attention()
    here, there = looking(), structs.replace(looking(), p_world_head_m=(0.0, 0.01, 0.0))
    model.choose(percept(0.0, FACE), here, 0.0)
    moved = model.choose(percept(0.05, FACE), there, 0.05)
    smoothed = 1.0 - exp(-0.05 / 0.1)
    assert moved.saliences[0].translation == pytest.approx(0.2 / 0.5 * smoothed, rel=0.01)
    model.choose(percept(1.0, FACE), here, 1.0)  # too long ago for a speed
    assert model.choose(percept(1.0, FACE), here, 1.0).saliences[0].translation < 1e-4


def test_what_has_just_come_into_view_pulls_and_that_wears_off():
    model = BottomUp(BottomUpParams(onset_salience=0.8))
    first, second = body(1, "x", (1, 0, 0)), body(2, "x", (1, 0.3, 0))
    for k in range(11):
        assert salience(model, bodies(first), k / 10).onset.tolist() == [0.0]
    for age in (0.0, 0.25, 0.5, 0.75, 1.0):
        onset = salience(model, bodies(second, first), 1.0 + age).onset
        assert onset.tolist() == pytest.approx([0.8 * exp(-age / 0.5), 0.0])
    model.reset(9.0)
    assert salience(model, bodies(second), 9.0).onset.tolist() == [0.0]


@pytest.mark.parametrize(("gap_s", "onset"), [(0.1, 0.0), (0.29, 0.0), (0.4, 1.0)])
@pytest.mark.parametrize("how", ["missed", "out of the field"])
def test_a_blink_of_the_detector_makes_nothing_new(how, gap_s, onset):
    model = BottomUp(BottomUpParams())
    moving = bodies(body(1, "hand", (1, 0, 0), (0, 1, 0)))
    for k in range(21):
        before = salience(model, moving, k / 10).translation[0]
    gone = 2.0
    while (gone := gone + 0.05) < 2.0 + gap_s - 1e-9:
        if how == "missed":
            salience(model, bodies(), gone)
        else:
            salience(model, moving, gone, in_view=False)
    back = salience(model, moving, 2.0 + gap_s)
    assert back.onset.tolist() == [onset]
    if how == "missed":
        assert bool(back.translation[0] > 0.5 * before) is (onset == 0.0)


# ---- Attention: rules, recorded decisions, and what moves beside a face.


def by(look_at, salience=0.9, point_world_m=None):
    rule = Rule(look_at, salience, point_world_m)
    return attention(TopDownParams(behaviour="wait", rules={"wait": rule}))


@pytest.mark.parametrize(("salience", "urgent"), [(0.9, True), (0.8, False)])
def test_what_a_strong_rule_names_is_urgent(salience, urgent):
    assert look(by("point", salience, (1.0, 0.5, 0.6)), 0.0, FACE).urgent is urgent


def test_a_rule_may_name_a_place_with_or_without_bodies_about():
    for seen in ((), (FACE,)):
        target = look(by("point", point_world_m=(1.0, 0.5, 0.6)), 0.0, *seen)
        assert (target.kind, target.id, target.p_world_m) == ("point", -1, (1.0, 0.5, 0.6))
        assert (target.top_down, target.salience, target.why) == (
            True,
            0.9,
            "point: rule wait 0.90",
        )
    model = by("point", 0.5, (1.0, 0.5, 0.6))
    look(model, 0.0, FACE, waving(0.0))
    assert look(model, 0.7, FACE, waving(2.0)).kind == "hand"


@pytest.mark.parametrize(
    ("look_at", "point", "rule"),
    [("id:x", None, 'e.g. "id:7"'), ("id:", None, 'e.g. "id:7"'), ("point", None, "go together"),
     ("face", (1.0, 0.0, 0.0), "go together")],
)  # fmt: skip
def test_a_rule_says_one_thing(look_at, point, rule):
    with pytest.raises(ValueError, match=rule):
        Rule(look_at, 0.5, point)


def test_every_decision_carries_the_pulls_of_the_winner_and_the_next_three():
    model = attention()
    rows = [body(k, "hand", (1.0, 0.1 * k, 0.0), (0.0, 0.02 * k, 0.0)) for k in range(2, 9)]
    target = look(model, 9.0, FACE, *rows)
    assert [salience.id for salience in target.saliences] == [1, 8, 7, 6]
    face, hand = target.saliences[:2]
    assert face == Salience(1, "face", 0.0, 0.0, 0.0, 0.0, 0.5, 1.0, 0.5)
    d = hypot(1.0, 0.8)
    assert hand.translation == pytest.approx(0.16 / d / d / 0.5)
    assert hand.looming == pytest.approx(0.16 * 0.8 / d / d / 0.5)
    assert len(look(model, 9.1, FACE).saliences) == 1


# A face and what moves beside it, looked at 30 times a second. The tests of Mitake et al. 4, with
# camera, tracker and head: test_behaviours.


def lived(scene, seconds):
    """Look at a scene of places; velocities are their differences."""
    model = attention()
    looks = []
    for k in range(round(30 * seconds)):
        t = k / 30
        before = {row[0]: row[2] for row in scene(t - 1 / 30)}
        rows = []
        for i, kind, p, _ in scene(t):
            q = before.get(i, p)
            rows.append((i, kind, p, tuple(30 * (a - b) for a, b in zip(p, q, strict=True))))
        looks.append((t, look(model, t, *rows)))
    return looks


def test_something_that_keeps_moving_behind_a_person_gets_a_glance():
    def moving(t):
        swing = 0.6 * sin(2 * pi * 0.5 * (t - 2.0)) if t >= 2.0 else 0.0
        return [FACE, body(4, "thing", (1.5, 1.0 + swing, 0.0))]

    away = [t for t, look in lived(moving, 8.0) if look.kind == "thing"]
    assert away and 2.0 <= away[0] <= 2.5
    assert 0.2 <= len(away) / 30 <= 1.2


def test_onsets_that_follow_each_other_lose_their_salience():
    def flickering(t):
        seen = t >= 2.0 and t % 1.0 < 0.5
        return [FACE, *([body(int(9 + t), "thing", (1.5, 1.0, 0.0))] if seen else [])]

    away = [t for t, look in lived(flickering, 13.0) if look.kind == "thing"]
    assert away and away[0] < 2.1
    assert sum(t >= 5.0 for t in away) / 30 < 0.1 * 8.0


def test_a_lifeless_face_gets_a_small_share_and_is_not_remembered():
    model, looks = attention(), []
    for k in range(600):
        rows = FACE, body(2 + k // 60, "face", (0.7, 0.4, 0.0))
        seen = percept(k / 20, *rows[: 1 + (k % 60 < 40)])
        bodies = structs.replace(seen.bodies, lifeless=seen.bodies.ids[1:])
        looks.append(model.choose(structs.replace(seen, bodies=bodies), looking(), k / 20).id)
    assert looks.count(1) > 540


@pytest.mark.parametrize("count", [10, 30])
def test_nothing_but_a_face_is_new_soon_after_somebody_has_come(count):
    model = attention()
    for k in range(count):
        look(model, k / 10, FACE)
    found = look(model, count / 10, FACE, body(2, "thing", (0.8, 0.3, 0.0))).saliences
    assert sum(one.onset for one in found) == (count > 20)
