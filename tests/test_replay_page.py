"""The page of a replay: its slider, its events and its words."""

import json
from collections.abc import Iterator, Mapping

import pytest
from replayed_run import RATE_HZ, SECONDS, Screen, ticks_of

from gazerig.robot.control.loop import Tick
from gazerig.robot.dashboard.panels.replay import ReplayView, clock, event_list, strip
from gazerig.robot.dashboard.widgets.widgets import Widgets
from gazerig.robot.model.clock import SimulatedClock
from gazerig.robot.model.commands import Ask
from gazerig.robot.recording.replay import Replay
from gazerig.robot.recording.snapshot_index import SnapshotIndex

pytestmark = pytest.mark.usefixtures("ideal_servos")


@pytest.fixture(scope="module")
def ticks() -> list[Tick]:
    return ticks_of(SECONDS, [(2.0, Ask("behaviour", "wait"))])


@pytest.fixture
def frames(ticks: list[Tick]) -> Iterator[SnapshotIndex]:
    start_s = ticks[0].t_s
    pictures = [(start_s + at_s, b"jpeg at %d" % at_s) for at_s in (1, 3, 5)]
    made = SnapshotIndex(ticks, pictures, RATE_HZ)
    yield made
    made.close()


# --- the page's side


class Shelf:
    """A view of a recording with what it asked for, on a page without a browser."""

    def __init__(self) -> None:
        self.asked: list[tuple[str, Mapping[str, object]]] = []
        place = Widgets().panel("replay")
        self.view = ReplayView(place, lambda who, what: self.asked.append((who, what)), 10.0)


@pytest.fixture
def shelf() -> Shelf:
    return Shelf()


def state(at_s: float, **more: object) -> dict[str, object]:
    return {"at_s": at_s, "duration_s": 10.0, "playing": False, "speed": 1.0, "sought_s": None,
            **more}  # fmt: skip


def test_the_slider_follows_what_is_played_and_asks_nothing(shelf: Shelf) -> None:
    shelf.view.show(state(2.5, playing=True, speed=0.5))
    assert shelf.view.slider.value == 2.5 and shelf.view.speed.value == "0.5x"
    assert shelf.view.play.options == ("pause",)
    assert shelf.asked == []
    shelf.view.show(state(3.0))
    assert shelf.view.play.options == ("play",)


def test_what_a_hand_does_is_asked_for(shelf: Shelf) -> None:
    view = shelf.view
    view.slider.arrived(4.0, "7")
    view.play.arrived("play", "7")
    view.speed.arrived("2x", "7")
    view.steps["next"].arrived("saccade", "7")
    view.steps["previous"].arrived("event", "7")
    assert shelf.asked == [
        ("7", {"replay": {"seek_s": 4.0}}), ("7", {"replay": {"play": True}}),
        ("7", {"replay": {"speed": 2.0}}), ("7", {"replay": {"step": "next saccade"}}),
        ("7", {"replay": {"step": "previous event"}}),
    ]  # fmt: skip


def test_a_slider_in_the_hand_is_not_pulled_back(shelf: Shelf) -> None:
    shelf.view.show(state(1.0, playing=True))
    shelf.view.slider.arrived(5.0, "7")
    shelf.view.slider.arrived(6.0, "7")
    shelf.view.show(state(1.1, playing=True))
    assert shelf.view.slider.value == 6.0
    shelf.view.show(state(5.0, playing=True, sought_s=5.0))  # an older wish is heard
    assert shelf.view.slider.value == 6.0
    shelf.view.show(state(6.02, playing=True, sought_s=6.0))
    assert shelf.view.slider.value == 6.02
    shelf.view.show(state(6.5, playing=True, sought_s=6.0))
    assert shelf.view.slider.value == 6.5


def test_a_player_takes_every_place_the_slider_can_ask_for(
    shelf: Shelf, frames: SnapshotIndex
) -> None:
    replay = Replay(frames, SimulatedClock())
    shelf.view.slider.arrived(3.725, "7")
    (_, asked) = shelf.asked[0]
    assert replay.handle_request(json.loads(json.dumps(asked))) is None
    screen = Screen()
    replay.show(screen, 0.0)
    shelf.view.show(screen.states()[0])
    shelf.view.show(screen.states()[0] | {"at_s": 3.8})
    assert shelf.view.slider.value == 3.8  # it was heard: the slider is free again


def test_words_that_were_recorded_cannot_become_a_page(shelf: Shelf) -> None:
    listed = event_list([(1.0, "<script>alert(1)</script>")], 2.0)
    assert "<script>" not in listed and "&lt;script&gt;" in listed


def test_the_events_about_a_time_are_listed() -> None:
    events = [(float(k), f"event {k}") for k in range(9)]
    listed = event_list(events, 4.5)
    assert [k for k in range(9) if f"event {k}" in listed] == [3, 4, 5, 6]
    assert event_list([], 1.0).count("no event") == 1


def test_marks_are_drawn_where_they_are() -> None:
    drawn = strip({"saccade": [0, 2, 0, 1], "blink": [0, 0, 0, 0]})
    assert drawn.count("<rect") == 2 and "x='85.0'" in drawn and "x='255.0'" in drawn


def test_times_are_written_as_minutes_and_seconds() -> None:
    assert [clock(s) for s in (0.0, 62.3456, 59.9996)] == ["0:00.000", "1:02.346", "1:00.000"]
