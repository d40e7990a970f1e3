"""Attention: rules, recorded decisions, and what moves beside a face."""

from collections.abc import Callable
from math import hypot, pi, sin

import pytest
from attention_scene import FACE, Row, attention, body, look, waving

from gazerig.gaze.attention.attention import Attention
from gazerig.gaze.attention.top_down import Rule, TopDown, TopDownParams
from gazerig.gaze.types import Salience, Target


def by(
    look_at: str, salience: float = 0.9, point_world_m: tuple[float, float, float] | None = None
) -> Attention:
    rule = Rule(look_at, salience, point_world_m)
    return attention(TopDownParams(behaviour="wait", rules={"wait": rule}))


def test_a_rule_may_name_one_body() -> None:
    crowd = FACE, body(7, "face", (2.0, 0.5, 0.0))
    target = look(by("id:7"), 0.0, *crowd)
    assert (target.id, target.salience, target.top_down) == (7, 0.9, True)
    assert look(by("id:8"), 0.0, *crowd).top_down is False


def test_a_rule_may_name_a_place_with_or_without_bodies_about() -> None:
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
def test_a_rule_says_one_thing(
    look_at: str, point: tuple[float, float, float] | None, rule: str
) -> None:
    with pytest.raises(ValueError, match=rule):
        Rule(look_at, 0.5, point)


def test_behaviours_are_listed_and_forgotten_at_a_reset() -> None:
    model = TopDown(TopDownParams())
    assert model.behaviours == ("wait", "guard", "attack")
    model.behave("guard")
    model.reset(0.0)
    assert model.behaviour == "wait"


def test_every_decision_carries_the_pulls_of_the_winner_and_the_next_three() -> None:
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


def test_boredom_changes_the_comparison_and_moves_no_head() -> None:
    model = attention()
    times = [9.0 + k / 30 for k in range(30)]
    looks = [look(model, t, FACE, waving(1.0)) for t in times]
    assert {look.kind for look in looks} == {"hand"}
    assert looks[-1].salience == pytest.approx(looks[0].salience)
    assert looks[-1].saliences[0].habituation == pytest.approx(1.0 - 0.2 * 29 / 30)


def test_a_target_that_leaves_the_field_is_left() -> None:
    model = attention()
    assert look(model, 9.0, FACE, waving(2.0)).kind == "hand"
    assert look(model, 9.1, FACE, waving(2.0, x=-0.5)).kind == "face"


# Bodies alone: a face with two fists at the chin, looked at 30 times a second. The tests of
# Mitake et al. 4, with camera, tracker and head: test_behaviours.


def boxer() -> list[Row]:
    return [
        body(1, "face", (1.0, 0.0, 0.0)),
        body(2, "hand", (0.88, 0.12, -0.15)),
        body(3, "hand", (0.88, -0.12, -0.15)),
    ]


def lived(scene: Callable[[float], list[Row]], seconds: float) -> list[tuple[float, Target]]:
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


def moved(rows: list[Row], i: int, by: tuple[float, float, float]) -> list[Row]:
    return [
        (row[0], row[1], tuple(a + b for a, b in zip(row[2], by, strict=True)), row[3])
        if row[0] == i
        else row
        for row in rows
    ]


def first(looks: list[tuple[float, Target]], kind: str, after_s: float) -> float:
    return next(t for t, look in looks if t >= after_s and look.kind == kind) - after_s


def test_a_hand_that_goes_on_waving_gets_a_glance() -> None:
    def waves(t: float) -> list[Row]:
        swing = 0.15 * sin(2 * pi * 1.5 * (t - 2.0)) if t >= 2.0 else 0.0
        return moved(boxer(), 2, (0.0, swing, 0.1))

    on = [t for t, look in lived(waves, 4.9) if look.kind == "hand" and t >= 2.0]
    assert 2.0 < on[0] < 2.4 and 0.3 < len(on) / 30.0 < 1.6
    assert on[-1] < 4.0


def test_a_hand_that_sinks_is_no_target() -> None:
    def sinks(t: float) -> list[Row]:
        down = min(0.5, max(0.0, t - 2.0))
        return moved(boxer(), 2, (0.0, 0.0, 0.3 - down))

    assert all(look.kind == "face" for t, look in lived(sinks, 4.0) if t > 1.5)


def test_a_lowered_hand_that_moves_counts_for_the_person() -> None:
    def signs(t: float) -> list[Row]:
        return moved(boxer(), 2, (0.0, 0.15 * sin(2 * pi * 1.5 * t), -0.1))

    looks = lived(signs, 5.0)
    assert sum(look.kind == "face" for _, look in looks) / len(looks) > 0.9  # a glance as it begins
    hand = next(one for one in looks[60][1].saliences if one.kind == "hand")
    assert hand.translation > 1.0 and hand.total < 0.15


@pytest.mark.parametrize(("from_s", "looked"), [(0.5, False), (2.8, True)])
def test_a_sign_that_reaches_the_face_is_no_wave(from_s: float, looked: bool) -> None:
    """The hand of one who has signed for long is not looked at, that of one who begins is."""

    def signs(t: float) -> list[Row]:
        up = 0.1 * sin(2 * pi * 1.5 * t) - 0.1 if t >= from_s else -0.1
        raised = 0.25 * sin(pi * (t - 3.0) / 0.7) if 3.0 <= t < 3.7 else 0.0
        return moved(boxer(), 2, (0.0, 0.0, up + raised))

    looks = lived(signs, 4.0)
    assert any(look.kind == "hand" for t, look in looks if t >= 3.0) is looked


def test_who_waves_after_signing_is_looked_at() -> None:
    def waves(t: float) -> list[Row]:
        low = 0.15 * sin(2 * pi * 1.5 * t)
        return moved(boxer(), 2, (0.0, low, -0.1 if t < 3.0 else 0.1))

    assert first(lived(waves, 6.0), "hand", 3.0) <= 0.8


def test_something_that_keeps_moving_behind_a_person_gets_a_glance() -> None:
    def moving(t: float) -> list[Row]:
        swing = 0.6 * sin(2 * pi * 0.5 * (t - 2.0)) if t >= 2.0 else 0.0
        return [boxer()[0], body(4, "thing", (1.5, 1.0 + swing, 0.0))]

    looks = lived(moving, 8.0)
    away = [t for t, look in looks if look.kind == "thing"]
    assert away and 2.0 <= away[0] <= 2.5
    assert 0.2 <= len(away) / 30 <= 1.2


def test_onsets_that_follow_each_other_lose_their_salience() -> None:
    def flickering(t: float) -> list[Row]:
        seen = t >= 1.0 and t % 1.0 < 0.5
        return [boxer()[0], *([body(int(9 + t), "thing", (1.5, 1.0, 0.0))] if seen else [])]

    looks = lived(flickering, 12.0)
    away = [t for t, look in looks if look.kind == "thing"]
    assert away and away[0] < 1.1
    assert sum(t >= 4.0 for t in away) / 30 < 0.1 * 8.0


def test_a_hand_that_reaches_in_is_noticed_though_it_holds_still() -> None:
    def reaching(t: float) -> list[Row]:
        return [*boxer(), *([body(4, "hand", (0.6, 0.5, 0.0))] if t >= 2.0 else [])]

    looks = lived(reaching, 4.0)
    assert first(looks, "hand", 2.0) <= 0.05
    noticed = next(look for t, look in looks if look.id == 4)
    assert noticed.why == "hand 4: onset 1.00"
    assert first(looks, "face", 2.0) <= 1.0
