"""Field of view, eq 1, rules and the winner (Mitake et al.). Checks: docs/checks.md."""

from math import radians

import numpy as np
import pytest

from gaze.angles import rotation
from gaze.attention import Attention, AttentionParams
from gaze.bottom_up import BottomUp, BottomUpParams, slide_loom_spin
from gaze.field_of_view import FieldOfView, FieldOfViewParams
from gaze.idle import Idle, IdleParams
from gaze.top_down import Rule, TopDown, TopDownParams
from gaze.types import Bodies, GazeState, Percept

IDENTITY = rotation((0.0, 0.0, 0.0))


def looking(eye_yaw_deg: float = 0.0) -> GazeState:
    eye = (radians(eye_yaw_deg), 0.0)
    return GazeState(
        (0, 0, 0), (0, 0, 0), eye, eye, IDENTITY, (0, 0, 0), (0, 0.03, 0), (0, -0.03, 0), 1.0, 1.0
    )


def body(
    id: int, kind: str, p: tuple[float, float, float], v: tuple[float, float, float] = (0, 0, 0)
) -> tuple[int, str, tuple[float, ...], tuple[float, ...]]:
    return id, kind, p, v


def percept(t: float, *rows: tuple[int, str, tuple[float, ...], tuple[float, ...]]) -> Percept:
    ids, kinds, places, speeds = zip(*rows, strict=True) if rows else ((), (), (), ())
    n = len(ids)
    return Percept(
        t,
        Bodies(
            ids,
            kinds,
            np.array(places, float).reshape(n, 3),
            np.array(speeds, float).reshape(n, 3),
            np.zeros((n, 3)),
            np.full(n, 0.1),
        ),
    )


def attention(**params: float) -> Attention:
    return Attention(
        AttentionParams(**params),
        FieldOfView(FieldOfViewParams()),
        BottomUp(BottomUpParams(smoothing_s=0.0)),
        TopDown(TopDownParams()),
        Idle(IdleParams()),
    )


def test_e45_eq_1_does_not_depend_on_the_length_of_e() -> None:
    rng = np.random.default_rng(1)
    v, w, e = rng.normal(size=(3, 40, 3))
    once, fivefold = slide_loom_spin(v, w, e), slide_loom_spin(v, w, 5.0 * e)
    for a, b in zip(once, fivefold, strict=True):
        assert np.abs(a - b).max() <= 1e-9


def test_terms_of_eq_1_are_slide_loom_and_spin() -> None:
    v, w = np.array([[1.0, 2.0, 0.0]]), np.array([[3.0, 0.0, 4.0]])
    slide, loom, spin = slide_loom_spin(v, w, np.array([2.0, 0.0, 0.0]))
    assert (slide[0], loom[0], spin[0]) == pytest.approx((2.0, 1.0, 3.0))


def test_far_motion_pulls_less_than_near_motion() -> None:
    model = BottomUp(BottomUpParams(smoothing_s=0.0))
    seen = percept(
        0.0, body(1, "hand", (1, 0, 0), (0, 1, 0)), body(2, "hand", (4, 0, 0), (0, 1, 0))
    )
    total = model.step(seen.bodies, (0, 0, 0), 0.0).total
    assert total[0] == pytest.approx(4.0 * total[1]) and total[0] == pytest.approx(2.0)


def test_pulls_rise_with_the_time_constant() -> None:
    model = BottomUp(BottomUpParams(smoothing_s=0.1))
    seen = percept(0.0, body(1, "hand", (1, 0, 0), (0, 1, 0)))
    for k in range(11):
        total = model.step(seen.bodies, (0, 0, 0), k * 0.01).total
    assert total[0] == pytest.approx(2.0 * (1.0 - np.exp(-1.0)), rel=0.02)


@pytest.mark.parametrize(
    ("yaw", "pitch", "seen"),
    [(0, 0, True), (95, 0, True), (105, 0, False), (0, 55, True), (0, 65, False), (0, -70, True),
     (0, -80, False), (-95, 0, True), (70, 50, False), (180, 0, False)],
)  # fmt: skip
def test_field_of_both_eyes(yaw: float, pitch: float, seen: bool) -> None:
    y, p = radians(yaw), radians(pitch)
    far = (100 * np.cos(p) * np.cos(y), 100 * np.cos(p) * np.sin(y), 100 * np.sin(p))
    view = FieldOfView(FieldOfViewParams())
    assert view.visible(percept(0.0, body(1, "x", far)).bodies, looking()).tolist() == [seen]


def test_field_turns_with_the_eyes() -> None:
    view = FieldOfView(FieldOfViewParams())
    behind = percept(0.0, body(1, "x", (-0.5, 100.0, 0.0))).bodies
    assert view.visible(behind, looking(40.0)).tolist() == [True]
    assert view.visible(behind, looking(-40.0)).tolist() == [False]


FACE = body(1, "face", (1.0, 0.0, 0.0))


def waving(t: float, speed: float) -> Percept:
    return percept(t, FACE, body(2, "hand", (0.8, 0.3, -0.1), (0.0, speed, 0.0)))


def test_the_face_wins_over_a_resting_hand_and_loses_to_a_waving_one() -> None:
    model = attention()
    still = model.choose(waving(0.0, 0.05), looking(), 0.0)
    assert (still.kind, still.top_down, still.pull) == ("face", True, 0.5)
    moved = model.choose(waving(0.5, 1.0), looking(), 0.5)
    assert (moved.kind, moved.top_down) == ("hand", False)
    assert moved.shift == still.shift + 1
    assert "slide" in moved.why and "rule wait" in still.why


def test_nearly_equal_pulls_do_not_flicker() -> None:
    model, kinds = attention(), []
    for k in range(60):
        speed = 0.2 * (1.05 if k % 2 else 0.95)  # its pull swings about the face's 0.5
        kinds.append(model.choose(waving(k / 30, speed), looking(), k / 30).kind)
    assert sum(a != b for a, b in zip(kinds, kinds[1:], strict=False)) <= 1


def test_a_winner_is_kept_for_the_shortest_time() -> None:
    model = attention(shortest_ms=300.0)
    model.choose(waving(0.0, 0.0), looking(), 0.0)
    assert model.choose(waving(0.2, 2.0), looking(), 0.2).kind == "face"
    assert model.choose(waving(0.4, 2.0), looking(), 0.4).kind == "hand"


def test_of_two_faces_the_nearer_is_kept_until_the_other_is_clearly_nearer() -> None:
    model = attention(shortest_ms=0.0)

    def two(t: float, other_m: float) -> Percept:
        return percept(t, FACE, body(5, "face", (other_m, 0.3, 0.0)))

    assert model.choose(two(0.0, 1.5), looking(), 0.0).id == 1
    assert model.choose(two(1.0, 0.9), looking(), 1.0).id == 1
    assert model.choose(two(2.0, 0.6), looking(), 2.0).id == 5


def test_a_lost_target_is_waited_for_and_then_left() -> None:
    model = attention()
    seen = model.choose(percept(0.0, FACE), looking(), 0.0)
    waited = model.choose(percept(0.1), looking(), 0.1)
    assert (waited.p_world_m, waited.why) == (seen.p_world_m, "lost, waiting")
    assert waited.shift == seen.shift
    left = model.choose(percept(1.5), looking(), 1.5)
    assert (left.kind, left.id) == ("rest", -1)


def test_stale_pictures_tell_nothing() -> None:
    model = attention(stale_ms=400.0)
    model.choose(percept(0.0, FACE), looking(), 0.0)
    assert model.choose(percept(0.0, FACE), looking(), 0.3).why != "lost, waiting"
    assert model.choose(percept(0.0, FACE), looking(), 0.5).why == "lost, waiting"
    assert model.choose(None, looking(), 3.0).kind == "rest"


def test_behaviours_follow_their_rules() -> None:
    model = attention(shortest_ms=0.0)
    both = percept(0.0, FACE, body(9, "attack_target", (0.8, -0.2, 0.0)))
    assert model.choose(both, looking(), 0.0).id == 1
    model.top_down.behave("attack")
    chosen = model.choose(
        percept(0.1, FACE, body(9, "attack_target", (0.8, -0.2, 0.0))), looking(), 0.1
    )
    assert (chosen.id, chosen.pull, chosen.top_down) == (9, 0.9, True)
    with pytest.raises(ValueError, match="no rule for behaviour 'dance'; rules: attack"):
        model.top_down.behave("dance")
    with pytest.raises(ValueError, match="has no rule"):
        TopDownParams(behaviour="x", rules={"wait": Rule("face", 0.5)})
