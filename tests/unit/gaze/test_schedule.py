"""Tracks start at a time of day, at an interval, and with the people who come and go."""

from pathlib import Path

import pytest
from attention_scene import IDENTITY, body, percept
from msgspec.structs import replace

import gazerig
from gazerig.gaze.schedule import DAY_S, Schedule, TrackStart
from gazerig.gaze.types import Face

SOMEBODY = Face(7, (1.0, 0.0, 0.3), (0.0, 0.0, 0.0), IDENTITY, ((1.0, 0.0, 0.3),) * 8, 0.9)


def test_times_of_day_and_intervals_start_once_and_over_midnight():
    schedule = Schedule({"show": TrackStart(("0:00", "00:01")), "nod": TrackStart(every_s=50.0)})
    begins_s = DAY_S - 5.5
    found = [(t, schedule.due(None, t, (begins_s + t) % DAY_S)) for t in range(120)]
    assert [(t, names) for t, names in found if names] == [
        (6, ["show"]), (50, ["nod"]), (66, ["show"]), (100, ["nod"]),
    ]  # fmt: skip


def test_people_who_arrive_and_leave_start_tracks_and_posters_none():
    schedule = Schedule({"hello": TrackStart(on="arrival"), "bye": TrackStart(on="departure")})
    found = []
    for t in range(30):
        seen = percept(t, body(7, "face", SOMEBODY.p_world_m))
        bodies = replace(seen.bodies, lifeless=() if 5 <= t < 6 else (7,))
        seen = replace(seen, faces=(SOMEBODY,) * (t < 10), bodies=bodies)
        found += [(t, name) for name in schedule.due(seen, t, t)]
    assert found == [(5, "hello"), (12, "bye")]


def test_a_rig_starts_its_tracks_and_says_what_is_wrong(tmp_path):
    rig = tmp_path / "show.yaml"
    text = Path("config/rigs/minimal.yaml").read_text("utf-8")
    rig.write_text(
        text + 'schedule: {nod: {at: ["0:00"], every_s: 2}, gone: {every_s: 3}}\n', "utf-8"
    )
    said: list[str] = []
    with gazerig.open(str(rig), fast=True, bus="ideal", say=said.append) as head:
        head.step(4.0)
    assert sum("track for schedule: nod" in line for line in said) == 1
    assert any("schedule: no track 'gone'" in line for line in said)
    with pytest.raises(ValueError, match="'25:00' is no time of day"):
        TrackStart(("25:00",))
