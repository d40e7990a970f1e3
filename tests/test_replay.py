"""A recording on the page: what is sent as it plays, the slider and its buttons, the commands."""

import json
from collections.abc import Iterator, Mapping
from math import radians
from types import SimpleNamespace

import pytest
from present import present
from replayed_run import RATE_HZ, SECONDS, Screen, ticks_of

from gazerig.drivers.errors import SetupError
from gazerig.robot.control.loop import Tick
from gazerig.robot.dashboard.feed.page_process import FRAME, REPLAY, SNAPSHOT, decode_snapshot
from gazerig.robot.dashboard.panels.replay import ReplayView, event_list, event_strip, format_time
from gazerig.robot.dashboard.requests.inbox import MESSAGE_BYTES
from gazerig.robot.dashboard.widgets.widgets import Widgets
from gazerig.robot.model.clock import SimulatedClock
from gazerig.robot.model.commands import Ask
from gazerig.robot.recording.playback import PlaybackState, Replay, SnapshotIndex, introduction

pytestmark = pytest.mark.usefixtures("ideal_servos")


@pytest.fixture(scope="module")
def ticks() -> list[Tick]:
    return ticks_of(SECONDS, [(2.0, Ask("behaviour", "wait"))])


@pytest.fixture(scope="module")
def frames(ticks: list[Tick]) -> Iterator[SnapshotIndex]:
    start_s = ticks[0].t_s
    pictures = [(start_s + at_s, b"jpeg at %d" % at_s) for at_s in (1, 3, 5)]
    made = SnapshotIndex(ticks, pictures, RATE_HZ)
    yield made
    made.close()


def shown(
    replay: Replay, screen: Screen, clock: SimulatedClock, seconds: float
) -> list[PlaybackState]:
    """Run for some seconds of the watcher's clock; give the states."""
    states: list[PlaybackState] = []
    until_s = clock.now_s() + seconds

    def over(state: PlaybackState) -> bool:
        states.append(state)
        return clock.now_s() >= until_s - 1e-9

    replay.run(screen, over)
    return states


# --- frames


def test_the_snapshot_of_a_time_is_the_last_one_before(
    frames: SnapshotIndex, ticks: list[Tick]
) -> None:
    start_s = ticks[0].t_s
    assert frames.duration_s == pytest.approx(ticks[-1].t_s - start_s)
    assert len(frames) == pytest.approx(50 * SECONDS, abs=2)
    for at_s in (0.0, 1.234, 3.0, frames.duration_s, 99.0):
        shown_s = decode_snapshot(frames.message(frames.at(at_s))).t_s - start_s
        assert -1e-9 <= min(at_s, frames.duration_s) - shown_s < 0.0201
    assert frames.at(-1.0) == 0


def test_a_snapshot_is_what_the_live_page_would_have_shown(
    frames: SnapshotIndex, ticks: list[Tick]
) -> None:
    snapshot = decode_snapshot(frames.message(frames.at(4.0)))
    tick = next(t for t in ticks if t.t_s == snapshot.t_s)
    assert snapshot.measured_rad == tick.joints.position_rad
    assert (
        snapshot.why == tick.target.why
        and snapshot.faces[0].id == present(tick.percept).faces[0].id
    )
    assert snapshot.behaviour == "wait" and snapshot.rate_hz == pytest.approx(200.0, rel=0.01)


def test_pictures_come_with_their_time(frames: SnapshotIndex) -> None:
    assert frames.frame_at(0.9) is None
    found = [frames.frame(present(frames.frame_at(s))) for s in (1.0, 2.9, 3.1, 99.0)]
    assert found == [b"jpeg at 1", b"jpeg at 1", b"jpeg at 3", b"jpeg at 5"]


def test_ten_minutes_stay_small(frames: SnapshotIndex) -> None:
    # 100 MB for ten minutes would still be fine.
    assert frames.packed_bytes / frames.duration_s * 600.0 < 100e6


def test_saccades_blinks_and_orders_can_be_stepped_to(
    frames: SnapshotIndex, ticks: list[Tick]
) -> None:
    last = ticks[-1].gaze
    kinds = [mark.kind for mark in frames.marks]
    assert kinds.count("saccade") == last.saccades > 10
    assert kinds.count("blink") == last.blinks > 0
    (asked,) = [mark for mark in frames.marks if mark.words.startswith("requested: ask")]
    assert asked.at_s == pytest.approx(2.0, abs=0.011) and asked.kind == "event"


@pytest.mark.parametrize("rate_hz", [90.0, 120.0, 333.0])
def test_50_snapshots_a_second_are_kept_at_any_rate(ticks: list[Tick], rate_hz: float) -> None:
    ticked = [tick._replace(t_s=nth / rate_hz) for nth, tick in enumerate(ticks[:1000])]
    made = SnapshotIndex(ticked, (), rate_hz)
    assert len(made) == pytest.approx(min(50.0, rate_hz) * made.duration_s, abs=2)
    made.close()


def test_the_conversation_is_shown_from_when_it_was_asked_for(ticks: list[Tick]) -> None:
    asked = list(ticks[:400])
    asked[200] = asked[200]._replace(commands=(Ask("conversation", "talk"),))
    made = SnapshotIndex(asked, (), RATE_HZ)
    found = [
        decode_snapshot(made.message(made.at(at_s))).conversation for at_s in (0.5, 0.95, 1.05, 1.5)
    ]
    assert found == ["", "", "talk", "talk"]
    made.close()


def test_a_guard_that_holds_is_an_event_once(ticks: list[Tick]) -> None:
    held = [
        tick._replace(
            guard_result=tick.guard_result._replace(level="hold", reasons=("all: old picture",))
        )
        for tick in ticks[810:820]
    ]
    marks = SnapshotIndex([*ticks[800:810], *held, *ticks[820:830]], (), RATE_HZ).marks
    words = [m.words for m in marks if m.words.startswith("guard")]
    assert words == ["guard: hold (all: old picture)"]


def test_a_recording_without_ticks_says_so() -> None:
    with pytest.raises(SetupError, match="contains no tick"):
        SnapshotIndex((), (), RATE_HZ)


# --- what goes to the page


def test_it_shows_its_first_picture_and_waits(frames: SnapshotIndex, ticks: list[Tick]) -> None:
    screen, time_ = Screen(), SimulatedClock(50.0)
    states = shown(Replay(frames, time_), screen, time_, 2.0)
    assert states[-1].at_s == 0.0 and not states[-1].playing
    assert set(screen.times_s(ticks[0].t_s)) == {0.0}
    # A page draws its panels by turns: it gets the frame again, but not for ever.
    assert 25 <= len(screen.times_s(0.0)) < 45
    # The page must not think that the rig has died: it hears something several times a second.
    assert len(screen.of(REPLAY)) >= 8


def test_playing_shows_all_snapshots_in_order_and_each_picture_once(
    frames: SnapshotIndex, ticks: list[Tick]
) -> None:
    screen, time_ = Screen(), SimulatedClock()
    replay = Replay(frames, time_)
    replay.ask({"play": True})
    states = shown(replay, screen, time_, SECONDS + 1.0)
    times = screen.times_s(ticks[0].t_s)
    assert len(set(times)) == len(frames) and times == sorted(times)
    assert screen.of(FRAME) == [b"jpeg at 1", b"jpeg at 3", b"jpeg at 5"]
    assert not states[-1].playing and states[-1].at_s == frames.duration_s
    assert screen.states()[-1]["playing"] is False


def test_fast_forward_leaves_nothing_out(frames: SnapshotIndex, ticks: list[Tick]) -> None:
    screen, time_ = Screen(), SimulatedClock()
    replay = Replay(frames, time_)
    replay.ask({"speed": 8.0})
    replay.ask({"play": True})
    shown(replay, screen, time_, 1.0)
    times = screen.times_s(ticks[0].t_s)
    assert len(set(times)) == len(frames) and times == sorted(times)


def test_a_round_that_comes_late_sends_some_on_the_way(
    frames: SnapshotIndex, ticks: list[Tick]
) -> None:
    screen, time_ = Screen(), SimulatedClock()
    replay = Replay(frames, time_)
    replay.ask({"play": True})
    replay.show(screen, 0.0)
    replay.show(screen, 1.5)
    times = screen.times_s(ticks[0].t_s)
    assert times[-1] == pytest.approx(1.5, abs=0.021) and 15 < len(times) < 40


def events_of(screen: Screen) -> list[object]:
    return [e for m in screen.messages if m[:1] == SNAPSHOT for e in decode_snapshot(m).events]


def test_every_eye_movement_is_told_once_as_it_plays(frames: SnapshotIndex) -> None:
    screen, time_ = Screen(), SimulatedClock()
    replay = Replay(frames, time_)
    replay.ask({"play": True})
    shown(replay, screen, time_, SECONDS + 3.0)
    reported = events_of(screen)
    assert len(reported) > 20 and len(reported) == len(set(reported))
    assert reported == [
        e for n in range(len(frames)) for e in decode_snapshot(frames.message(n)).events
    ]


def test_after_a_leap_the_page_is_told_what_led_there(
    frames: SnapshotIndex, ticks: list[Tick]
) -> None:
    screen, time_ = Screen(), SimulatedClock()
    replay = Replay(frames, time_)
    replay.show(screen, 0.0)
    for place_s in (5.0, 2.0, 4.0):  # forwards, back, and forwards again
        before = screen.times_s(ticks[0].t_s)[-1]
        screen.messages.clear()
        replay.ask({"seek_s": place_s})
        shown(replay, screen, time_, 2.0)
        reported = events_of(screen)
        since_s = before if place_s > before else -1.0  # backwards the page starts again
        wanted = [
            e for n in range(len(frames)) for e in decode_snapshot(frames.message(n)).events
            if frames.at(since_s) * (since_s > 0.0) < n <= frames.at(place_s)
        ]  # fmt: skip
        assert reported == wanted and len(reported) > 3
        (trail,) = [
            t for m in screen.messages if m[:1] == SNAPSHOT if (t := decode_snapshot(m).trail)
        ]
        at_s = [row.t_s - ticks[0].t_s for row in trail]
        assert at_s == sorted(at_s) and at_s[-1] == pytest.approx(place_s, abs=0.021)
        assert at_s[0] == pytest.approx(max(since_s, 0.0), abs=0.1)
        assert sum(s > place_s - 1.4 for s in at_s) == pytest.approx(140, abs=3)


def test_nothing_is_recalled_while_the_slider_is_in_the_hand(frames: SnapshotIndex) -> None:
    screen, time_ = Screen(), SimulatedClock()
    replay = Replay(frames, time_)
    for place_s in (5.0, 1.0, 4.0, 2.0, 4.5, 0.5):
        replay.ask({"seek_s": place_s})
        shown(replay, screen, time_, 0.04)
    assert events_of(screen) == []
    assert all(not decode_snapshot(m).trail for m in screen.messages if m[:1] == SNAPSHOT)


def test_after_two_leaps_in_a_row_the_page_is_told_what_both_passed_over(
    frames: SnapshotIndex,
) -> None:
    screen, time_ = Screen(), SimulatedClock()
    replay = Replay(frames, time_)
    replay.show(screen, 0.0)
    screen.messages.clear()
    for place_s in (2.5, 5.0):
        replay.ask({"seek_s": place_s})
        shown(replay, screen, time_, 0.04)
    shown(replay, screen, time_, 2.0)
    wanted = [
        e for n in range(1, frames.at(5.0) + 1) for e in decode_snapshot(frames.message(n)).events
    ]
    assert events_of(screen) == wanted and len(wanted) > 10


def test_what_is_recalled_fits_into_a_message(frames: SnapshotIndex, ticks: list[Tick]) -> None:
    long = [
        tick._replace(t_s=tick.t_s + k * (SECONDS + 0.01), gaze=tick.gaze)
        for k in range(4) for tick in ticks
    ]  # fmt: skip
    whole = SnapshotIndex(long, (), RATE_HZ)
    assert len(whole.message_with_history(0, len(whole) - 1)) < MESSAGE_BYTES
    rows = decode_snapshot(whole.message_with_history(0, len(whole) - 1)).trail
    assert rows[-1].t_s - rows[0].t_s == pytest.approx(10.0, abs=0.1)
    whole.close()


def test_a_leap_shows_only_where_it_lands(frames: SnapshotIndex, ticks: list[Tick]) -> None:
    screen, time_ = Screen(), SimulatedClock()
    replay = Replay(frames, time_)
    replay.show(screen, 0.0)
    for seek_s in (5.0, 1.0):
        screen.messages.clear()
        replay.ask({"seek_s": seek_s})
        replay.show(screen, time_.now_s())
        assert screen.times_s(ticks[0].t_s) == [pytest.approx(seek_s, abs=0.021)]
        assert screen.of(FRAME) == [b"jpeg at %d" % seek_s]
        (state,) = screen.states()
        assert state["at_s"] == state["sought_s"] == seek_s


def test_what_a_full_page_did_not_take_comes_later(
    frames: SnapshotIndex, ticks: list[Tick]
) -> None:
    screen, time_ = Screen(), SimulatedClock()
    replay = Replay(frames, time_)
    screen.full = True
    replay.ask({"seek_s": 3.5})
    shown(replay, screen, time_, 0.4)
    screen.full = False
    shown(replay, screen, time_, 0.4)
    (at_s,) = set(screen.times_s(ticks[0].t_s))
    assert at_s == pytest.approx(3.5, abs=0.021)
    assert "marks" in screen.states()[0] and screen.states()[0]["at_s"] == 3.5
    assert screen.of(FRAME) == [b"jpeg at 3"]


def test_the_page_is_told_once_what_there_is_and_in_one_message(frames: SnapshotIndex) -> None:
    screen, time_ = Screen(), SimulatedClock()
    replay = Replay(frames, time_)
    replay.ask({"play": True})
    shown(replay, screen, time_, 3.0)
    assert ["marks" in state for state in screen.states()].count(True) == 1
    first = screen.states()[0]
    assert first["pictures"] is True
    assert sum(first["marks"]["saccade"]) == sum(m.kind == "saccade" for m in frames.marks)
    crowded = SimpleNamespace(duration_s=600.0, has_pictures=False, marks=[frames.marks[0]._replace(
        kind="event", words="x" * 500)] * 5000)  # fmt: skip
    assert len(json.dumps(introduction(crowded))) < 190_000  # type: ignore[arg-type]


def test_a_page_that_takes_the_place_of_another_is_told_what_there_is(
    frames: SnapshotIndex,
) -> None:
    screen, time_ = Screen(), SimulatedClock()
    replay = Replay(frames, time_)
    shown(replay, screen, time_, 0.5)
    screen.messages.clear()
    replay.send_introduction_again()
    shown(replay, screen, time_, 0.5)
    assert ["marks" in state for state in screen.states()].count(True) == 1


def test_requests_are_obeyed_or_refused_in_words(frames: SnapshotIndex) -> None:
    replay = Replay(frames, SimulatedClock())
    assert replay.handle_request({"replay": {"seek_s": 2.0}}) is None
    assert replay.handle_request({"replay": {"step": "next saccade"}}) is None
    assert "between 0.05 and 8" in (replay.handle_request({"replay": {"speed": 100}}) or "")
    assert "is invalid" in (replay.handle_request({"replay": None}) or "")
    assert (
        replay.handle_request({"do": "stop", "why": ""})
        == "this is a recording: it cannot move a head"
    )


def test_poses_survive_the_packing(frames: SnapshotIndex, ticks: list[Tick]) -> None:
    first = decode_snapshot(frames.message(0))
    assert first.R_world_head == ticks[0].pose.R_world_head
    assert abs(first.measured_rad[6] - radians(-12.0)) < radians(0.2)


# The page of a replay: its slider, its events and its words


# --- the page's side


class Shelf:
    """A view of a recording with its requests, on a page without a browser."""

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
    view.slider.receive_input(4.0, "7")
    view.play.receive_input("play", "7")
    view.speed.receive_input("2x", "7")
    view.steps["next"].receive_input("saccade", "7")
    view.steps["previous"].receive_input("event", "7")
    assert shelf.asked == [
        ("7", {"replay": {"seek_s": 4.0}}), ("7", {"replay": {"play": True}}),
        ("7", {"replay": {"speed": 2.0}}), ("7", {"replay": {"step": "next saccade"}}),
        ("7", {"replay": {"step": "previous event"}}),
    ]  # fmt: skip


def test_a_slider_in_the_hand_is_not_pulled_back(shelf: Shelf) -> None:
    shelf.view.show(state(1.0, playing=True))
    shelf.view.slider.receive_input(5.0, "7")
    shelf.view.slider.receive_input(6.0, "7")
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
    shelf.view.slider.receive_input(3.725, "7")
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
    drawn = event_strip({"saccade": [0, 2, 0, 1], "blink": [0, 0, 0, 0]})
    assert drawn.count("<rect") == 2 and "x='85.0'" in drawn and "x='255.0'" in drawn


def test_times_are_written_as_minutes_and_seconds() -> None:
    assert [format_time(s) for s in (0.0, 62.3456, 59.9996)] == ["0:00.000", "1:02.346", "1:00.000"]
