"""Looks of a person that are worth following, and where to."""

from math import radians
from types import SimpleNamespace

import pytest
from attention_scene import body, percept
from msgspec.structs import replace

from gazerig.gaze.angles import direction, rotation
from gazerig.gaze.attention.followed_look import FollowedLook
from gazerig.gaze.types import Face

EYE = (0.0, 0.1, 0.3)
PLACE = (1.0, 0.1, 0.3)
AT_HEAD = (-1.0, 0.0, 0.0)
LEFT = (0.0, 1.0, 0.0)


def seen(t_s, way, *rows, id=3):
    """Return a frame of a face that looks in a direction, with its head to the front."""
    face = Face(id, PLACE, EYE, rotation((0.0, 0.0, 0.0)), (PLACE,) * 8, 0.9, gaze_world=way)
    return replace(percept(t_s, *rows), faces=(face,))


def dice(share=0.79):
    return SimpleNamespace(random=lambda: share, uniform=lambda low, high: low + 10.0 * high)


def looked(*ways, rows=(), share=0.79):
    """Return what is followed of looks of .2 s each, two frames apart."""
    model, found = FollowedLook(dice(share)), []
    for k, way in enumerate(ways):
        model.step(seen(0.5 + k, way, *rows), 3, EYE)
        found.append(model.step(seen(0.7 + k, way, *rows), 3, EYE))
        assert model.step(seen(0.7 + k, LEFT, *rows), 3, EYE) is None  # the same frame
    return found


def test_a_look_goes_to_the_body_on_its_line_or_into_its_direction():
    nothing, near, aside = (1.0, 0.6, 0.3), (1.2, 1.1, 0.3), (1.22, 1.1, 0.3)
    nearest, own, beyond = (1.05, 2.1, 0.3), (1.0, 0.44, 0.3), (1.0, 0.46, 0.3)
    for places, there in (
        ((), nothing), ((near,), near), ((aside,), nothing), ((own,), nothing), ((beyond,), beyond),
        ((near, nearest, near), nearest),
    ):  # fmt: skip
        rows = tuple(body(7 + k, "thing", place) for k, place in enumerate(places))
        first, then = looked(AT_HEAD, LEFT, rows=rows)
        assert first is None and then is not None and then.p_world_m == pytest.approx(there)
        assert then.seconds == pytest.approx(8.5 if there == nothing else 14.8)
    assert looked(AT_HEAD, LEFT, rows=(body(7, "face", near),))[1] is None


def test_only_a_settled_turn_away_from_the_head_is_followed_and_not_each():
    assert looked(AT_HEAD, LEFT, share=0.8)[1] is None
    # Turned by 14 deg and by 16; 19 deg past the head and 21.
    for first, then, followed in ((90, 104, False), (90, 106, True), (180, 161, False),
                                  (180, 159, True)):  # fmt: skip
        ways = (direction((radians(yaw), 0.0)) for yaw in (first, then))
        assert (looked(*ways)[1] is not None) is followed
    # Three seconds from one to the next.
    several = looked(AT_HEAD, LEFT, AT_HEAD, LEFT, AT_HEAD, LEFT)
    assert [one is not None for one in several] == [False, True, False, False, False, True]
    model = FollowedLook(dice())
    for t, id, way in ((0.5, 3, AT_HEAD), (0.7, 3, AT_HEAD), (1.5, 4, LEFT), (1.7, 4, LEFT)):
        assert model.step(seen(t, way, id=id), id, EYE) is None, "of each person anew"
