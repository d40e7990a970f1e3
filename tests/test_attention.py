"""Field of view, eq 1, rules and the winner (Mitake et al.). Checks: docs/checks.md."""

from itertools import groupby
from math import cos, exp, inf, radians, sin

import numpy as np
import pytest
from attention_scene import FACE, Row, attention, body, look, looking, percept, salience, waving
from msgspec import structs

from gazerig.gaze.attention.bottom_up import BottomUp, BottomUpParams, motion_terms, saturate
from gazerig.gaze.attention.top_down import Rule, TopDownParams
from gazerig.gaze.field_of_view import visible_bodies
from gazerig.gaze.types import Bodies


def test_e45_eq_1_does_not_depend_on_the_length_of_e() -> None:
    rng = np.random.default_rng(1)
    for v, w, e in rng.normal(size=(40, 3, 3)):
        assert motion_terms(v, w, 5.0 * e) == pytest.approx(motion_terms(v, w, e), abs=1e-9)


def test_terms_of_eq_1_are_translation_looming_and_rotation() -> None:
    v, w, ahead = (1.0, 2.0, 0.0), (3.0, 0.0, 4.0), (2.0, 0.0, 0.0)
    assert motion_terms(v, w, ahead) == pytest.approx((2.0, -1.0, 3.0))
    assert motion_terms((-1.0, 2.0, 0.0), w, ahead) == pytest.approx((2.0, 1.0, 3.0))


def test_motion_saturates_unless_it_comes_nearer_fast() -> None:
    assert saturate(0.2, -0.3, 0.5, inf, 0.5) == pytest.approx(0.5)
    bounded = 0.35 * (1.0 - exp(-1.0 / 0.35))
    assert saturate(0.2, -0.3, 0.5, 0.35, 1.0) == pytest.approx(bounded)
    assert saturate(0.0, 2.0, 0.0, 0.35, 0.5) == pytest.approx(0.5 * (1.0 + bounded))
    assert saturate(0.0, 9.0, 0.0, 0.35, 1.0) == pytest.approx(2.0 + bounded)


def test_what_spins_about_the_line_of_view_is_attended_to_and_what_spins_across_is_not() -> None:
    """Eq 1's third term, in what the eye sees: about the line of view, however far."""
    things = percept(0.0, *(body(n, "thing", (far, 0, 0)) for n, far in ((1, 1), (2, 4), (3, 1))))
    spins = np.array([[0.0, 0, 0], [-6.0, 0, 0], [0, 6.0, 0]])
    turning = structs.replace(things.bodies, w_world_rad_s=spins)
    found = salience(BottomUp(BottomUpParams()), turning, 9.0)
    assert found.rotation == pytest.approx([0.0, 2.0, 0.0])
    assert found.total == pytest.approx([0.0, 0.35 * (1.0 - exp(-2.0 / 0.35)), 0.0])


@pytest.mark.parametrize(
    ("yaw", "pitch", "seen"),
    [(0, 0, True), (95, 0, True), (105, 0, False), (0, 55, True), (0, 65, False), (0, -70, True),
     (0, -80, False), (-95, 0, True), (70, 50, False), (180, 0, False)],
)  # fmt: skip
def test_field_of_both_eyes(yaw: float, pitch: float, seen: bool) -> None:
    y, p = radians(yaw), radians(pitch)
    far = (100 * np.cos(p) * np.cos(y), 100 * np.cos(p) * np.sin(y), 100 * np.sin(p))
    assert bool(visible_bodies(bodies(body(1, "x", far)).rows(), looking())) is seen


def test_the_face_wins_over_a_resting_hand_and_loses_to_a_waving_one() -> None:
    model = attention()
    still = look(model, 0.0, FACE, waving(0.05))
    assert (still.kind, still.top_down, still.salience) == ("face", True, 0.5)
    moved = look(model, 0.5, FACE, waving(1.0))
    assert (moved.kind, moved.top_down) == ("hand", False)
    assert moved.shift == still.shift + 1
    assert "translation" in moved.why and "rule wait" in still.why


def test_nearly_equal_pulls_do_not_flicker() -> None:
    model, kinds = attention(), []
    for k in range(600):
        speed = 0.35 * (1.1 if k // 6 % 2 else 0.9)  # its salience swings about the face's 0.5
        kinds.append(look(model, k / 30, FACE, waving(speed)).kind)
    assert sum(a != b for a, b in zip(kinds[:60], kinds[1:60], strict=False)) <= 1
    stays = [len(list(same)) / 30 for _, same in groupby(kinds)]
    assert len(stays) < 20 and min(stays[1:-1]) > 0.3


def test_a_winner_is_kept_for_the_shortest_time() -> None:
    model = attention(min_dwell_ms=300.0)
    look(model, 0.0, FACE, waving(0.0))
    kept = look(model, 0.2, FACE, waving(2.0))
    assert (kept.kind, kept.saliences[0].kind) == ("face", "face"), "the winner comes first"
    assert kept.saliences[1].total > kept.saliences[0].total
    assert look(model, 0.4, FACE, waving(2.0)).kind == "hand"


def test_of_two_faces_the_nearer_is_kept_until_the_other_is_clearly_nearer() -> None:
    model = attention(min_dwell_ms=0.0)

    for t, other_m, id in ((0.0, 1.5, 1), (1.0, 0.9, 1), (2.0, 0.6, 5)):
        assert look(model, t, FACE, body(5, "face", (other_m, 0.3, 0.0))).id == id


def test_a_lost_target_is_waited_for_and_then_left() -> None:
    model = attention()
    seen = look(model, 0.0, FACE)
    waited = look(model, 0.1)
    assert (waited.p_world_m, waited.why) == (seen.p_world_m, "lost, waiting")
    assert waited.shift == seen.shift
    left = look(model, 1.5)
    assert (left.kind, left.id) == ("rest", -1)


def test_a_target_that_has_left_the_picture_is_waited_for_where_it_was_in_it() -> None:
    model = attention()
    moving = percept(9.0, body(2, "hand", (1.0, 0.3, 0.0), (0.0, 2.0, 0.0)))
    seen = model.choose(moving, looking(), 9.0)
    waited = look(model, 9.1)
    assert (waited.id, waited.p_world_m, waited.why) == (2, seen.p_world_m, "lost, waiting")
    assert model.choose(moving, looking(), 9.2).id == 2
    blind = model.choose(None, looking(), 10.0)
    assert blind.p_world_m == pytest.approx((1.0, 0.7, 0.0)) and blind.why == "lost, waiting"


def test_stale_pictures_tell_nothing() -> None:
    model = attention()
    look(model, 0.0, FACE)
    assert model.choose(percept(0.0, FACE), looking(), 0.3).why != "lost, waiting"
    assert model.choose(percept(0.0, FACE), looking(), 0.5).why == "lost, waiting"
    assert model.choose(None, looking(), 3.0).kind == "rest"


def test_behaviours_follow_their_rules_and_do_not_wait_for_the_end_of_a_fixation() -> None:
    model = attention(min_dwell_ms=5000.0)
    rows = FACE, body(9, "attack_target", (0.8, -0.2, 0.0))
    assert look(model, 0.0, *rows).id == 1
    model.top_down.behave("attack")
    chosen = look(model, 0.05, *rows)
    assert (chosen.id, chosen.salience, chosen.top_down) == (9, 0.9, True)
    with pytest.raises(ValueError, match="no rule for behaviour 'dance'; rules: attack"):
        model.top_down.behave("dance")
    with pytest.raises(ValueError, match="has no rule"):
        TopDownParams(behaviour="x", rules={"wait": Rule("face", 0.5)})


def bodies(*rows: Row) -> Bodies:
    return percept(0.0, *rows).bodies


def test_what_only_one_eye_sees_is_seen() -> None:
    left = (100 * cos(radians(80)), 100 * sin(radians(80)), 0.0)
    right = (left[0], -left[1], 0.0)
    both = bodies(body(1, "x", left), body(2, "x", right)).rows()
    assert visible_bodies(both, looking()).keys() == {1, 2}
    # With the left eye turned in, nothing sees the left body any more, and vice versa.
    turned = structs.replace(looking(), eye_left_rad=(radians(-30), 0.0))
    assert visible_bodies(both, turned).keys() == {2}
    turned = structs.replace(looking(), eye_right_rad=(radians(30), 0.0))
    assert visible_bodies(both, turned).keys() == {1}


def test_ones_own_body_is_not_looked_at_however_it_moves() -> None:
    fist = body(2, "own", (0.4, 0.1, -0.1), (0.0, 3.0, 0.0))
    model = attention()
    assert look(model, 0.0, FACE, fist).kind == "face"
    assert look(attention(), 0.0, fist).kind == "rest"


def test_literal_form_is_eq_1_as_printed_with_e_the_direction_of_gaze() -> None:
    model = BottomUp(BottomUpParams(form="literal", reference=9.0))
    seen = bodies(body(1, "x", (5, 3, 0), (1, 2, 0)), body(2, "x", (1, 0, 0), (1, 2, 0)))
    seen = structs.replace(seen, w_world_rad_s=np.array([[3.0, 0, 4.0], [3.0, 0, 4.0]]))
    for gaze in ((1.0, 0.0, 0.0), (7.0, 0.0, 0.0)):
        saliences = salience(model, seen, 0.0, (1.0, 1.0, 1.0), gaze)
        for term, value in zip(saliences, (2.0, 1.0, 3.0, 0.0, 6.0), strict=True):
            assert term.tolist() == [value, value]
    aside = salience(model, seen, 0.0, gaze=(0.0, 1.0, 0.0))
    assert (aside.translation[0], aside.looming[0], aside.rotation[0]) == (1.0, 2.0, 0.0)


def test_retinal_form_is_relative_to_the_moving_eye() -> None:
    seen = bodies(body(1, "x", (2, 0, 0), (0, 1, 0)), body(2, "x", (2, 0, 0)))
    with_it = salience(BottomUp(BottomUpParams()), seen, 9.0, (0, 1, 0))
    assert with_it.translation.tolist() == [0.0, 1.0]  # what is stationary slides by 0.5 rad/s
    coming = salience(BottomUp(BottomUpParams()), seen, 9.0, (2, 0, 0))
    assert coming.looming.tolist() == [2.0, 2.0]


def test_the_heads_own_motion_makes_what_stands_still_slide() -> None:
    model = attention()
    here, there = looking(), structs.replace(looking(), p_world_head_m=(0.0, 0.01, 0.0))
    model.choose(percept(0.0, FACE), here, 0.0)
    moved = model.choose(percept(0.05, FACE), there, 0.05)
    smoothed = 1.0 - exp(-0.05 / 0.1)
    assert moved.saliences[0].translation == pytest.approx(0.2 / 0.5 * smoothed, rel=0.01)
    model.choose(percept(1.0, FACE), here, 1.0)  # too long ago for a speed
    assert model.choose(percept(1.0, FACE), here, 1.0).saliences[0].translation < 1e-4


def test_what_has_just_come_into_view_pulls_and_that_wears_off() -> None:
    model = BottomUp(BottomUpParams(onset_salience=0.8))
    first, second = body(1, "x", (1, 0, 0)), body(2, "x", (1, 0.3, 0))
    for k in range(11):
        assert salience(model, bodies(first), k / 10).onset.tolist() == [0.0]
    for age in (0.0, 0.25, 0.5, 0.75, 1.0):
        onset = salience(model, bodies(second, first), 1.0 + age).onset
        assert onset.tolist() == pytest.approx([0.8 * exp(-age / 0.5), 0.0])
    model.reset(9.0)
    assert salience(model, bodies(second), 9.0).onset.tolist() == [0.0]


def test_nothing_is_new_in_the_first_moments_but_later_after_an_empty_view() -> None:
    for arrives, onset in ((0.2, 0.0), (0.4, 1.0)):
        model = BottomUp(BottomUpParams())
        for k in range(round(arrives * 20)):
            salience(model, bodies(), k / 20)
        assert salience(model, bodies(FACE), arrives).onset.tolist() == [onset]


@pytest.mark.parametrize(("from_s", "onset"), [(0.3, 0.0), (0.7, 1.0)])
def test_what_moves_in_the_first_moments_has_not_just_begun_to(from_s: float, onset: float) -> None:
    model = BottomUp(BottomUpParams())
    found = []
    for k in range(20):
        speed = 1.0 if k / 20 >= from_s else 0.0
        seen = bodies(body(1, "hand", (1.0, 0.0, 0.0), (0.0, speed, 0.0)))
        found.append(float(salience(model, seen, k / 20).onset[0]))
    assert max(found) == pytest.approx(onset)


@pytest.mark.parametrize(("gap_s", "onset"), [(0.1, 0.0), (0.29, 0.0), (0.4, 1.0)])
@pytest.mark.parametrize("how", ["missed", "out of the field"])
def test_a_blink_of_the_detector_makes_nothing_new(how: str, gap_s: float, onset: float) -> None:
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


def test_nothing_is_new_after_a_pause_of_the_camera() -> None:
    model = BottomUp(BottomUpParams())
    for k in range(11):
        salience(model, bodies(FACE), k / 10)
    back = salience(model, bodies(FACE, body(8, "face", (1, 1, 0))), 3.0)
    assert back.onset.tolist() == [0.0, 0.0]


def test_a_pause_of_the_camera_keeps_smoothed_motion() -> None:
    model, moving = BottomUp(BottomUpParams()), body(1, "x", (1, 0, 0), (0, 1, 0))
    for k in range(100):
        before = salience(model, bodies(moving), k / 10).translation[0]
    still = salience(model, bodies(body(1, "x", (1, 0, 0))), 10.4)
    assert still.translation[0] == pytest.approx(before * exp(-0.5 / 0.1))
