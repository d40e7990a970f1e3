"""Events of gaze, people and tracks are those of the ticks, each once and in order."""

from unittest.mock import Mock

import pytest
from gaze_targets import target
from made_ticks import made_tick
from msgspec.structs import replace

from gazerig.gaze.attention.addressing import Addressing
from gazerig.gaze.types import FIRST_THING, ORDERED, Face, Percept
from gazerig.robot.loop.events import TickFeed
from gazerig.robot.loop.head_state import HeadReport
from gazerig.robot.model.reply import Progress, TrackState

TARGETS = {
    1: target(), 2: replace(target(id=2), part="LE"), 3: target(kind="thing", id=FIRST_THING),
    4: target(kind=ORDERED, id=-1),
}  # fmt: skip
"""Faces without and with a part, a moving thing, a point of a client."""
Eyes = tuple[str, int, bool, int]
"""Phase, number of saccades, whether a blink is in progress, and target."""


@pytest.mark.parametrize(
    ("before", "after", "found"),
    [
        (("fixate", 3, False, 1), ("saccade", 4, False, 1),
         [("saccade to face 1", "saccade_start", "face 1")]),
        (("saccade", 4, True, 1), ("saccade", 4, True, 1), []),
        (("saccade", 4, False, 1), ("pursue", 4, False, 1),
         [("the eyes land at face 1", "saccade_landing", "face 1")]),
        (("saccade", 4, True, 1), ("saccade", 5, True, 2),
         [("the eyes land at face 1", "saccade_landing", "face 1"),
          ("the target is face 2: left eye", "target", "face 2: left eye"),
          ("saccade to face 2: left eye", "saccade_start", "face 2: left eye")]),
        (("pursue", 5, False, 1), ("fixate", 5, True, 3),
         [("the target is motion 1", "target", "motion 1"), ("blink", "blink", "")]),
        (("fixate", 5, True, 1), ("fixate", 5, True, 4),
         [("the target is the chosen point", "target", ORDERED)]),
    ],
)  # fmt: skip
def test_what_changes_between_two_ticks_is_an_event(before, after, found):
    feed = TickFeed()
    ticks = [
        made_tick(0.1 * n, gaze={"phase": phase, "saccades": count, "blink": blink},
                  seen=TARGETS[number])
        for n, (phase, count, blink, number) in enumerate((before, after))
    ]  # fmt: skip
    for tick in (*ticks, replace(ticks[0], parking=True)):
        feed.update(tick)
    assert [(e.text, e.kind, e.subject) for e in feed.events()] == found
    assert [(e.number, e.t_s) for e in feed.events()] == [(n + 1, 0.1) for n in range(len(found))]
    assert [e.number for e in feed.events(1)] == [n + 2 for n in range(len(found) - 1)]
    assert (feed.number, feed.ticks) == (len(found), 3)


CUES = (("a", 0.0), ("b", 1.0), ("c", 2.0))


@pytest.mark.parametrize(
    ("before_s", "now_s", "end", "found"),
    [
        (None, 0.0, "", ["nod passes the cue a"]),
        (0.0, 0.999, "", []),
        (0.999, 1.0, "", ["nod passes the cue b"]),
        (
            0.5,
            2.0,
            "finished",
            ["nod passes the cue b", "nod passes the cue c", "nod has finished"],
        ),
        (1.5, 0.5, "", ["nod passes the cue a", "nod passes the cue c"]),  # it has begun again
        (1.5, 1.6, "somebody has ended it", ["nod ended: somebody has ended it"]),
        (None, 0.5, "finished", []),
    ],
)
def test_cues_and_ends_of_tracks_are_events(before_s, now_s, end, found):
    feed, track = TickFeed(), TrackState("nod", cues=CUES, number=7)
    other = TrackState("shake", number=6)
    before = () if before_s is None else (replace(track, position_s=before_s),)
    now = replace(track, position_s=now_s, end_reason=end)
    feed.update(made_tick(tracks=(other, *before)))
    assert feed.progress().tracks == (other, *before)
    for _ in range(2):
        feed.update(made_tick(tracks=(other, now)))
    assert [event.text for event in feed.events()] == found


def test_people_and_messages_are_events():
    feed, follower = TickFeed(), Mock(side_effect=[False, True])
    assert feed.report(0) == HeadReport(None, ()) and feed.progress() == Progress()
    feed.follow(follower)
    nobody, axes = (0.0,) * 3, ((1.0, 0.0, 0.0),) * 3
    sees = Percept(0.0, faces=(Face(4, nobody, nobody, axes, (nobody,) * 8, 1.0),))
    for t_s, who, percept, events in (
        (0.0, None, None, ()), (0.1, 0, None, ()), (0.2, 0, sees, ()), (0.3, 1, sees, ("bus ok",)),
        (2.2, None, None, ()), (2.4, None, None, ()),
    ):  # fmt: skip
        addressed = () if who is None else (Addressing(who, 0.0, 1.0),)
        feed.update(made_tick(t_s, addressed=addressed, percept=percept, events=events))
    assert [(e.text, e.kind, e.subject) for e in feed.events()] == [
        ("person 0 addresses the head", "addressed", 0),
        ("person 4 has arrived", "person_arrived", 4),
        ("bus ok", "message", ""),
        ("person 1 addresses the head", "addressed", 1),
        ("person 1 no longer addresses the head", "addressed", ""),
        ("person 4 has left", "person_left", 4),
    ]
    assert feed.messages() == feed.events()[2:3] == feed.report(2).events[:1]
    assert follower.call_count == 2 and feed.report(6).number == 6
    assert not feed.wait_for_ticks(1, 0.004)
