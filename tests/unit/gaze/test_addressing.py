"""Who addresses the head: looks, their end, talk among people, posters, several people."""

import pytest
from attention_scene import body, percept
from msgspec.structs import replace

from gazerig.gaze.angles import rotation, sub, yaw_pitch
from gazerig.gaze.attention.addressing import AddressingModel
from gazerig.gaze.types import Face

HEAD = (0.0, 0.0, 0.2)
ANN, BEN = (1.2, 0.5, 0.3), (1.2, -0.5, 0.3)
RATE_HZ = 20


def face(id, p, at=HEAD, **fields):
    """Return a face that is turned to a point."""
    R = rotation((*yaw_pitch(sub(at, p)), 0.0))
    looks = {"looks_at_head": at is HEAD, "off_head_rad": 0.0 if at is HEAD else 1.2}
    given = {"speaks": False, "has_moved": True, **looks, **fields}
    return Face(id, p, (0.0, 0.0, 0.0), R, (p,) * 8, 0.9, **given)


def seen(t_s, *faces, hidden=False):
    """Return a frame of faces; hidden: with Ben, whose face is not visible."""
    rows = [body(one.id, "face", one.p_world_m) for one in faces]
    rows += [body(2, "face", BEN)] * hidden
    return replace(percept(t_s, *rows), faces=faces)


def play(model, seconds, start_s, *faces, **other):
    """Show the same frame for some time; return what each tick of it reports."""
    times = [start_s + k / RATE_HZ for k in range(round(seconds * RATE_HZ))]
    return [model.step(seen(t, *faces, **other), HEAD, t) for t in times]


def first(found):
    return [one[0].person if one else None for one in found]


def test_a_look_addresses_the_head_after_its_time_and_until_some_time_after_it():
    model = AddressingModel()
    play(model, 0.2, 0.0, face(7, ANN))
    play(model, 0.1, 0.2, face(7, ANN, looks_at_head=None))  # uncertain frames do not end it
    found = first(play(model, 0.7, 0.3, face(7, ANN)))
    assert found == [None] * 3 + [7] * 11  # .45 s, seen .15 s late
    found = play(model, 3.0, 1.0, face(7, ANN, BEN))
    assert sum(map(bool, found)) == 30 - 1  # of the time since the last look, .95
    assert found[0][0].since_s == pytest.approx(-0.15)
    shares = [one[0].confidence for one in found if one]
    assert shares == sorted(shares, reverse=True) and 0.0 <= shares[-1] < shares[0] < 0.9


def test_a_short_look_a_far_one_and_an_uncertain_one_do_not_address_it():
    for one in (
        face(1, ANN, looks_at_head=None),
        face(1, (2.6, 0.0, 0.3)),
        face(1, ANN, has_moved=False),
    ):
        assert not any(play(AddressingModel(), 5.0, 0.0, one))
    model = AddressingModel()
    for k in range(8):  # glances of .4 s
        assert not any(play(model, 0.4, float(k), face(1, ANN)))
        assert not any(play(model, 0.6, k + 0.4, face(1, ANN, BEN)))


def test_a_frame_of_another_look_begins_it_anew():
    model = AddressingModel()
    play(model, 0.4, 0.0, face(1, ANN))
    play(model, 0.05, 0.4, face(1, ANN, BEN))
    assert first(play(model, 1.0, 0.45, face(1, ANN))) == [None] * 9 + [1] * 11


def test_who_has_left_addresses_nobody():
    model = AddressingModel()
    play(model, 1.0, 0.0, face(1, ANN))
    found = play(model, 1.0, 1.0)
    assert found[5] and not found[12]


def test_lifeless_faces_never_count():
    model = AddressingModel()
    for k in range(200):
        frame = seen(k / RATE_HZ, face(3, ANN))
        frame = replace(frame, bodies=replace(frame.bodies, lifeless=(3,)))
        assert not model.step(frame, HEAD, frame.captured_s)


def test_people_who_talk_with_each_other_address_it_only_when_they_have_finished():
    mutual = face(1, ANN, BEN), face(2, BEN, ANN)
    speaks = face(1, ANN, BEN, speaks=True), face(2, BEN, (9.0, 0.0, 0.0))
    for talk in (mutual, speaks, mutual[:1]):
        hidden = len(talk) == 1
        model = AddressingModel()
        play(model, 1.0, 0.0, *talk, hidden=hidden)
        for k in range(5):  # they glance at the head in turn, longer than a look takes
            begin_s = 1.0 + 2.0 * k
            assert not any(play(model, 1.0, begin_s, face(1, ANN), *talk[1:], hidden=hidden))
            assert not any(play(model, 1.0, begin_s + 1.0, *talk, hidden=hidden))
        found = first(play(model, 4.0, 11.0, face(1, ANN), face(2, BEN)))
        assert found[:38] == [None] * 38 and found[-1] == 1


def test_an_onlooker_does_not_keep_a_person_from_addressing_it():
    model = AddressingModel()
    play(model, 1.0, 0.0, face(1, ANN, speaks=True), face(2, BEN, ANN))
    found = play(model, 1.5, 1.0, face(1, ANN), face(2, BEN))
    assert [one.person for one in found[-1]] == [1]  # the onlooker only glances at it


def test_the_first_of_several_people_keeps_the_head():
    model = AddressingModel()
    play(model, 1.0, 0.0, face(2, BEN))
    both = play(model, 2.0, 1.0, face(1, ANN), face(2, BEN))
    assert {*first(both)} == {2} and [one.person for one in both[-1]] == [2, 1]
    later = first(play(model, 2.0, 3.0, face(1, ANN), face(2, BEN, ANN)))
    assert later[0] == 2 and later[-1] == 1
