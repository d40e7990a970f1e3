"""A recording on the page: what is sent as it plays, the slider and its buttons, the commands."""

import json
import re
import time
from collections.abc import Iterator, Mapping, Sequence
from math import radians
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import viser
from present import present
from typer.testing import CliRunner

from gazerig.config.schema import load_rig
from gazerig.config.text import rig_text
from gazerig.drivers.errors import SetupError
from gazerig.robot.app.assemble import Substitutes, assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.cli import replay as cli_replay
from gazerig.robot.control.loop import Tick, run
from gazerig.robot.dashboard.inbox import MESSAGE_BYTES
from gazerig.robot.dashboard.page_process import FRAME, REPLAY, SNAPSHOT, unpack
from gazerig.robot.dashboard.replay import ReplayView, clock, event_list, strip
from gazerig.robot.model.clock import SimulatedClock
from gazerig.robot.model.commands import Ask
from gazerig.robot.recording.gaze_angles import trace_of
from gazerig.robot.recording.playback_clock import PlaybackState
from gazerig.robot.recording.read import RunRecording
from gazerig.robot.recording.recorder import Recorder
from gazerig.robot.recording.replay import Replay, introduction
from gazerig.robot.recording.run_info import RunInfo, versions
from gazerig.robot.recording.snapshot_index import SnapshotIndex

pytestmark = pytest.mark.usefixtures("ideal_servos")

SECONDS = 6.0
RATE_HZ = 200.0


def ticks_of(seconds: float, asked: Sequence[tuple[float, Ask]] = ()) -> list[Tick]:
    made = assemble(
        load_rig("desk"), RunOptions(mock=True, fast=True, seed=0, scene="face-to-face")
    )
    ticks: list[Tick] = []
    left = list(asked)

    def over(s: float) -> str | None:
        while left and s >= left[0][0]:
            made.robot.command(left.pop(0)[1])
        return "over" if s > seconds else None

    made.robot.start(made.clock)
    try:
        run(made.robot, made.clock, made.loop, over, ticks.append)
    finally:
        made.robot.stop()
        made.close()
    return ticks


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


class Screen:
    """A page that accepts messages, and none while it is full."""

    def __init__(self) -> None:
        self.messages: list[bytes] = []
        self.full = False

    def send(self, message: bytes) -> bool:
        if not self.full:
            self.messages.append(message)
        return not self.full

    def of(self, kind: bytes) -> list[bytes]:
        return [message[1:] for message in self.messages if message[:1] == kind]

    def times_s(self, start_s: float) -> list[float]:
        return [unpack(m).t_s - start_s for m in self.messages if m[:1] == SNAPSHOT]

    def states(self) -> list[dict]:
        return [json.loads(body) for body in self.of(REPLAY)]


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
        shown_s = unpack(frames.message(frames.at(at_s))).t_s - start_s
        assert -1e-9 <= min(at_s, frames.duration_s) - shown_s < 0.0201
    assert frames.at(-1.0) == 0


def test_a_snapshot_is_what_the_live_page_would_have_shown(
    frames: SnapshotIndex, ticks: list[Tick]
) -> None:
    snapshot = unpack(frames.message(frames.at(4.0)))
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
    (asked,) = [mark for mark in frames.marks if mark.words.startswith("asked: ask")]
    assert asked.at_s == pytest.approx(2.0, abs=0.011) and asked.kind == "event"


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
    with pytest.raises(SetupError, match="holds no tick"):
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
    return [e for m in screen.messages if m[:1] == SNAPSHOT for e in unpack(m).events]


def test_every_eye_movement_is_told_once_as_it_plays(frames: SnapshotIndex) -> None:
    screen, time_ = Screen(), SimulatedClock()
    replay = Replay(frames, time_)
    replay.ask({"play": True})
    shown(replay, screen, time_, SECONDS + 3.0)
    told = events_of(screen)
    assert len(told) > 20 and len(told) == len(set(told))
    assert told == [e for n in range(len(frames)) for e in unpack(frames.message(n)).events]


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
        told = events_of(screen)
        since_s = before if place_s > before else -1.0  # backwards the page begins anew
        wanted = [
            e for n in range(len(frames)) for e in unpack(frames.message(n)).events
            if frames.at(since_s) * (since_s > 0.0) < n <= frames.at(place_s)
        ]  # fmt: skip
        assert told == wanted and len(told) > 5
        (trail,) = [t for m in screen.messages if m[:1] == SNAPSHOT if (t := unpack(m).trail)]
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
    assert all(not unpack(m).trail for m in screen.messages if m[:1] == SNAPSHOT)


def test_what_is_recalled_fits_into_a_message(frames: SnapshotIndex, ticks: list[Tick]) -> None:
    long = [
        tick._replace(t_s=tick.t_s + k * (SECONDS + 0.01), gaze=tick.gaze)
        for k in range(4) for tick in ticks
    ]  # fmt: skip
    whole = SnapshotIndex(long, (), RATE_HZ)
    assert len(whole.recalled(0, len(whole) - 1)) < MESSAGE_BYTES
    rows = unpack(whole.recalled(0, len(whole) - 1)).trail
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
    assert sum(first["marks"]["saccade"]) == sum(m.kind == "saccade" for m in frames.marks)
    crowded = SimpleNamespace(duration_s=600.0, marks=[frames.marks[0]._replace(
        kind="event", words="x" * 500)] * 5000)  # fmt: skip
    assert len(json.dumps(introduction(crowded))) < 190_000  # type: ignore[arg-type]


def test_requests_are_obeyed_or_refused_in_words(frames: SnapshotIndex) -> None:
    replay = Replay(frames, SimulatedClock())
    assert replay.handle_request({"replay": {"seek_s": 2.0}}) is None
    assert replay.handle_request({"replay": {"step": "next saccade"}}) is None
    assert "between 0.05 and 8" in (replay.handle_request({"replay": {"speed": 100}}) or "")
    assert "cannot be meant" in (replay.handle_request({"replay": None}) or "")
    assert (
        replay.handle_request({"do": "stop", "why": ""})
        == "this is a recording: nothing moves here"
    )


# --- the page's side


class Shelf:
    """A view of a recording with what it asked for, on a server without a browser."""

    def __init__(self, server: viser.ViserServer) -> None:
        self.asked: list[tuple[int, Mapping[str, object]]] = []
        self.view = ReplayView(server.gui, lambda who, what: self.asked.append((who, what)), 10.0)
        self.handles = list(server.gui._gui_input_handle_from_uuid.values())

    def handle(self, label: str):
        (found,) = (h for h in self.handles if getattr(h, "label", None) == label)
        return found

    def by_hand(self, label: str, value: object) -> None:
        """Do what a browser does: the value changes, and the callbacks hear who did it."""
        handle = self.handle(label)
        if value is not None:
            handle._impl.value = value
        event = SimpleNamespace(client=SimpleNamespace(client_id=7), target=handle)
        for callback in handle._impl.update_cb:
            callback(event)


@pytest.fixture
def shelf() -> Iterator[Shelf]:
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        yield Shelf(server)
    finally:
        server.stop()


def state(at_s: float, **more: object) -> dict[str, object]:
    return {"at_s": at_s, "duration_s": 10.0, "playing": False, "speed": 1.0, "sought_s": None,
            **more}  # fmt: skip


def test_the_slider_follows_what_is_played_and_asks_nothing(shelf: Shelf) -> None:
    shelf.view.show(state(2.5, playing=True, speed=0.5))
    assert shelf.handle("time, s").value == 2.5 and shelf.handle("speed").value == "0.5x"
    assert shelf.handle("pause")
    time.sleep(0.3)  # callbacks run in threads of the server
    assert shelf.asked == []
    shelf.view.show(state(3.0))
    assert shelf.handle("play")


def test_what_a_hand_does_is_asked_for(shelf: Shelf) -> None:
    shelf.by_hand("time, s", 4.0)
    shelf.by_hand("play", None)
    shelf.by_hand("speed", "2x")
    shelf.by_hand("next", "saccade")
    shelf.by_hand("previous", "event")
    assert shelf.asked == [
        (7, {"replay": {"seek_s": 4.0}}), (7, {"replay": {"play": True}}),
        (7, {"replay": {"speed": 2.0}}), (7, {"replay": {"step": "next saccade"}}),
        (7, {"replay": {"step": "previous event"}}),
    ]  # fmt: skip


def test_a_slider_in_the_hand_is_not_pulled_back(shelf: Shelf) -> None:
    shelf.view.show(state(1.0, playing=True))
    shelf.by_hand("time, s", 5.0)
    shelf.by_hand("time, s", 6.0)
    shelf.view.show(state(1.1, playing=True))
    assert shelf.handle("time, s").value == 6.0
    shelf.view.show(state(5.0, playing=True, sought_s=5.0))  # an older wish is heard
    assert shelf.handle("time, s").value == 6.0
    shelf.view.show(state(6.02, playing=True, sought_s=6.0))
    assert shelf.handle("time, s").value == 6.02
    shelf.view.show(state(6.5, playing=True, sought_s=6.0))
    assert shelf.handle("time, s").value == 6.5


def test_a_player_takes_every_place_the_slider_can_ask_for(
    shelf: Shelf, frames: SnapshotIndex
) -> None:
    replay = Replay(frames, SimulatedClock())
    shelf.by_hand("time, s", 3.725)
    (_, asked) = shelf.asked[0]
    assert replay.handle_request(json.loads(json.dumps(asked))) is None
    screen = Screen()
    replay.show(screen, 0.0)
    shelf.view.show(screen.states()[0])
    shelf.view.show(screen.states()[0] | {"at_s": 3.8})
    assert shelf.handle("time, s").value == 3.8  # it was heard: the slider is free again


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


# --- the commands


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of two seconds."""
    path = tmp_path_factory.mktemp("recorded") / "run.mcap"
    rig = load_rig("desk")
    info = RunInfo(
        "configs/desk.yaml", rig.profile, rig_text(rig), 0, RATE_HZ, "2026-01-01T00:00:00+00:00",
        scene="face-to-face", mock=True, fast=True, versions=versions(),
    )  # fmt: skip
    recorder = Recorder(path, info, patient=True)
    recorder.open()
    options = RunOptions(mock=True, fast=True, seed=0, scene="face-to-face")
    made = assemble(rig, options, Substitutes(body=recorder.recorded))
    made.robot.start(made.clock)
    try:
        over = recorder.timed(lambda s: "seconds" if s > 2.0 else None)
        run(made.robot, made.clock, made.loop, over, recorder.record)
    finally:
        made.robot.stop()
        made.close()
        recorder.close("seconds", made.sent_digest())
    return path


def said(*arguments: object) -> tuple[int, str]:
    done = CliRunner().invoke(cli_replay.app, [str(a) for a in arguments])
    return done.exit_code, done.output


def test_a_recording_exports_what_the_run_itself_would(recorded: Path) -> None:
    from_file = trace_of(RunRecording(recorded).ticks())
    itself = trace_of(ticks_of(2.0))
    assert len(from_file.time_s) == len(itself.time_s) > 350
    assert np.array_equal(from_file.cyclopean_deg, itself.cyclopean_deg)
    assert np.array_equal(from_file.movement, itself.movement) and from_file.names == itself.names


def test_a_replay_knows_how_the_recorded_rig_was_built(
    recorded: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    built = cli_replay._built(RunRecording(recorded).info.config_yaml)
    recording = RunRecording(recorded)
    frames = SnapshotIndex(recording.ticks(), recording.frames(), RATE_HZ, "shy", built)
    shown = unpack(frames.message(frames.at(1.5)))
    assert shown.ghost is not None and shown.character == "shy" and shown.trail
    assert cli_replay._built("name: desk\n") is None
    assert "no longer valid (recorded.yaml" in capsys.readouterr().err


def test_a_replay_serves_a_page_and_ends(recorded: Path) -> None:
    code, words = said("replay", recorded, "--page", "127.0.0.1:18733", "--seconds", "0")
    assert code == 0 and "the page is starting" in words


def test_a_rerun_says_that_all_is_the_same(recorded: Path) -> None:
    code, words = said("replay", recorded, "--rerun")
    assert code == 0 and "joints recorded: " in words and "run again" in words
    told = re.search(r"(\d+) of (\d+) ticks are the same to the bit", words)
    assert told is not None and told[1] == told[2] and int(told[1]) > 350


def test_a_rerun_with_another_character_shows_both(recorded: Path) -> None:
    code, words = said("replay", recorded, "--rerun", "--character", "shy")
    assert code == 0 and "joints emulated: " in words and "saccades" in words


def test_figures_of_two_runs_stand_side_by_side() -> None:
    was = {"saccades": 3, "gaze_error_deg": {"median": 0.123456}, "events": [1, 2]}
    now = {"saccades": 4, "gaze_error_deg": {"median": None}, "blinks": 1}
    assert list(cli_replay.beside(was, now)) == [
        ("saccades", "3", "4"), ("gaze error deg median", "0.1235", "-"),
        ("events", "2 of them", "-"), ("blinks", "-", "1"),
    ]  # fmt: skip


def test_export_writes_tables(recorded: Path, tmp_path: Path) -> None:
    code, words = said("export", recorded, "--csv", "--out", tmp_path / "seen")
    assert code == 0 and "saccades" in words
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "seen_events.csv", "seen_fixations.csv", "seen_samples.csv", "seen_samples.json",
    ]  # fmt: skip


def test_export_writes_a_data_set_and_not_twice(recorded: Path, tmp_path: Path) -> None:
    wanted = ("export", recorded, "--bids", "--out", tmp_path / "set")
    assert said(*wanted)[0] == 0
    assert (tmp_path / "set/sub-desk/beh").is_dir()
    code, words = said(*wanted)
    assert code == 2 and "choose another --subject or --task" in words
    assert said(*wanted, "--task", "again")[0] == 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("export", "run.mcap"), "one of --csv and --bids"),
        (("export", "run.mcap", "--csv", "--bids"), "one of --csv and --bids"),
        (("export", "run.mcap", "--csv", "--task", "t"), "name files of --bids"),
        (("replay", "run.mcap", "desk"), "need --rerun"),
        (("replay", "run.mcap", "--page", "8080"), "not HOST:PORT"),
        (("replay", "absent.mcap"), "absent.mcap"),
        (("export", "absent.mcap", "--csv"), "absent.mcap"),
    ],
)
def test_what_cannot_be_done_is_one_line(arguments: tuple[str, ...], words: str) -> None:
    code, output = said(*arguments)
    assert code == 2 and words in output and "Traceback" not in output
    assert len(output.strip().splitlines()) == 1


def test_poses_survive_the_packing(frames: SnapshotIndex, ticks: list[Tick]) -> None:
    first = unpack(frames.message(0))
    assert first.R_world_head == ticks[0].pose.R_world_head
    assert abs(first.measured_rad[6] - radians(-12.0)) < radians(0.2)
