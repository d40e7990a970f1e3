"""Events of gaze, people and tracks are those of the ticks, each once and in order."""

from pathlib import Path
from typing import get_args

import pytest
from commanded_robot import running_desk
from slow_rigs import at_rate

import gazerig
from gazerig.robot.loop.events import EventKind, TickFeed
from gazerig.robot.model.commands import Play

SCENE = """\
description: a person leaves and returns
room: none
round_s: 12.0
places: {front: {x_m: 1.0, y_m: 0.0, height_m: 1.2}, away: {x_m: -1.5, y_m: -2.6, height_m: 1.2}}
people:
  visitor:
    start: front
    acts: [{at_s: 1.0, do: step, to: away, for_s: 1.0}, {at_s: 6.0, do: step, to: front, for_s: 1.0}]
"""

pytestmark = pytest.mark.usefixtures("ideal_servos")


def test_every_saccade_blink_and_track_of_the_ticks_is_an_event():
    feed = TickFeed()
    with running_desk() as running:
        ticks = running.go(4.0)
        running.order(Play("nod"))
        ticks += running.go(4.0)
    for tick in ticks:
        feed.update(tick)
    found = [event for event in feed.events() if event.kind != "message"]
    times = {kind: [e.t_s for e in found if e.kind == kind] for kind in get_args(EventKind)}
    saccades = ticks[-1].gaze.saccades - ticks[0].gaze.saccades
    assert saccades > 8 and abs(len(times["saccade_start"]) - saccades) <= 1
    pairs = list(zip(times["saccade_start"], times["saccade_landing"], strict=False))
    assert len(pairs) >= saccades - 1
    assert all(0.0 < landing - start < 0.3 for start, landing in pairs)
    blinks = sum(b.gaze.blink > a.gaze.blink for a, b in zip(ticks, ticks[1:], strict=False))
    assert len(times["blink"]) == blinks > 0
    assert [e.subject for e in found if e.kind == "track_finished"] == ["nod"]
    numbers = [event.number for event in feed.events()]
    assert numbers == list(range(1, len(numbers) + 1))
    assert [e.number for e in feed.events(numbers[-3])] == numbers[-2:]


def test_people_arrive_and_leave_once(tmp_path: Path):
    (scene := tmp_path / "quick.yaml").write_text(SCENE)
    with gazerig.open(at_rate(tmp_path, "desk", 50.0), fast=True, scene=str(scene)) as head:
        head.step(9.0)
        events = list(head.events(0.0, kinds=("person_arrived", "person_left", "target")))
        texts = [event.text for event in head.events(0.0)]
    turns = [e.kind for e in events if e.subject == 1 and e.kind != "target"]
    assert turns == ["person_arrived", "person_left", "person_arrived"]
    assert any(e.kind == "target" and str(e.subject).startswith("face ") for e in events)
    assert not {e.text for e in events} & set(texts)
