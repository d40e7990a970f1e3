"""Drawer Play: buttons, the timeline of the tracks that play, and what it sends."""

from dataclasses import replace

from msgspec import structs
from shown_page import SNAPSHOT
from ticked_rig import Outbox

from gazerig.robot.control.track_choices import TrackInfo
from gazerig.robot.dashboard.panels.play_panel import PlayPanel, SoundWaves, timeline_html
from gazerig.robot.dashboard.widgets.widgets import Widgets
from gazerig.robot.model.commands import EndTrack, Play
from gazerig.robot.model.control_source import FINISHED, TrackState

SHOW = TrackState(
    4, "show", 12.0, 60.0, owns=("neck_yaw", "jaw"), who="stage", sound="/a/hello.wav",
    limited="neck_yaw: slower by 1.2", clock="sound",
)  # fmt: skip
INFO = TrackInfo(
    "show", "a <b>song</b>", 60.0, 1.2,
    sound="/a/hello.wav", cues=(("verse", 30.0),), layers=("head", "jaw"),
)  # fmt: skip


class NoWaves(SoundWaves):
    def get(self, path: str) -> None:
        return None


class Drawer:
    """The drawer of a rig with three tracks."""

    def __init__(self) -> None:
        self.outbox = Outbox()
        self.panel = PlayPanel(Widgets().panel("play"), self.outbox)  # type: ignore[arg-type]
        self.panel._waves = NoWaves()
        self.panel.offer(["tilt", "none", "show"])
        self.panel.add_infos([structs.asdict(INFO)])

    def show(self, t_s: float, *tracks: TrackState) -> None:
        self.panel.show(replace(SNAPSHOT, t_s=t_s, tracks=tracks))


def test_buttons_speed_and_loop() -> None:
    drawer = Drawer()
    panel = drawer.panel
    assert panel.tracks is not None and panel.tracks.options == ("none", "show", "tilt")
    panel.speed.receive_input(1.5, "5")  # nothing plays yet
    panel.tracks.receive_input("show", "5")
    panel.loops.receive_input(True, "5")
    panel.tracks.receive_input("none", "5")
    assert drawer.outbox.asked == [
        (Play("show", 1.5), "5"), (Play("", 1.5, loop=True), "5"),
    ]  # fmt: skip


def test_a_playing_track_is_ended() -> None:
    drawer = Drawer()
    drawer.show(1.0, SHOW, replace_state(SHOW, number=5, name="tilt", position_s=0.5))
    panel = drawer.panel
    assert panel.tracks is not None and panel.tracks.current == "tilt"
    assert panel.which.options == ("all", "show", "tilt")
    panel.which.receive_input("show", "5")
    drawer.show(1.1, SHOW)  # too soon to be drawn
    assert panel.tracks.current == "tilt"
    drawer.show(1.3, SHOW)
    assert panel.tracks.current == "show"
    panel.end.receive_input("end", "5")
    panel.which.receive_input("all", "5")
    panel.end.receive_input("end", "5")
    assert [asked for asked, _ in drawer.outbox.asked] == [EndTrack("show"), EndTrack()]
    drawer.show(9.0)
    assert panel.tracks.current == "none" and "no track plays" in panel.timeline.content


def replace_state(state: TrackState, **changes: object) -> TrackState:
    return structs.replace(state, **changes)


def test_the_timeline_shows_position_owners_cues_and_limits() -> None:
    html = timeline_html((SHOW,), {"show": INFO}, NoWaves())
    for words in (
        "12.0 of 60.0 s, sound clock", "verse", "head, jaw; owns neck_yaw, jaw", "started by stage",
        "show: neck_yaw: slower by 1.2", "show at 12.0 s",
    ):  # fmt: skip
        assert words in html, words
    ended = replace_state(SHOW, end_reason="stage has ended it")
    assert "show has ended: stage has ended it" in timeline_html((ended,), {}, NoWaves())
    done = replace_state(SHOW, end_reason=FINISHED, limited="")
    assert "note" not in timeline_html((done,), {}, NoWaves())


def test_the_list_describes_all_tracks_and_escapes_texts() -> None:
    listed = Drawer().panel.list.content
    assert "a &lt;b&gt;song&lt;/b&gt;" in listed and "1.20 times slower" in listed
    assert "hello.wav" in listed
