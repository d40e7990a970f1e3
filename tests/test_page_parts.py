"""Elements of the page: shapes, words, traces, and the picture with its detections."""

import json
import math
import re
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from desk import GAZE_JOINTS
from msgspec import structs
from outside_package import install, on_path
from shown_page import AHEAD, SNAPSHOT
from six_joints import SIX, of_six
from ticked_rig import Outbox

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import DetectedFace, Detections, MovingBlob
from gazerig.gaze.types import PARTS, Face, Salience
from gazerig.robot.control.track_choices import TrackInfo
from gazerig.robot.dashboard.feed.camera_overlay import IMAGE_WIDTH_PX, draw_detections
from gazerig.robot.dashboard.panels.attention_panel import reason_text, salience_bars, target_text
from gazerig.robot.dashboard.panels.event_timeline import STRIP_S, Timeline
from gazerig.robot.dashboard.panels.joint_charts import MOST_POINTS, JointSeries
from gazerig.robot.dashboard.panels.package_panels import PagePanels, core_panels
from gazerig.robot.dashboard.panels.play_panel import PlayPanel, SoundWaves, timeline_html
from gazerig.robot.dashboard.panels.servo_health import (
    alarms,
    health_table,
    no_feedback_note,
    servo_table,
    strain_of_heat,
    strain_of_load,
    strain_of_voltage,
)
from gazerig.robot.dashboard.widgets.widgets import Client, Widgets
from gazerig.robot.model.commands import EndTrack, Play
from gazerig.robot.model.control_source import FINISHED, ControlSource, TrackState
from gazerig.robot.model.types import (
    CommandedPose,
    LoopFigures,
    SeenBlink,
    SeenCamera,
    SeenSaccade,
    ServoLimits,
    Servos,
    Snapshot,
    Trail,
)

LENS = Intrinsics(300.0, 300.0, 319.5, 239.5)
Terms = tuple[float, float, float, float, float]
REST = (0.0,) * 9


def snapshot(t_s: float = 0.0, reasons: tuple[str, ...] = ()) -> Snapshot:
    return replace(
        SNAPSHOT, t_s=t_s, measured_rad=REST, desired_rad=REST,
        target_name="face <3>", why="the rule 'person' pulls", phase="pursue",
        level="limited" if reasons else "ok", reasons=reasons, health="3 lost",
    )  # fmt: skip


def camera_picture() -> tuple[np.ndarray, Detections]:
    picture = np.full((480, 640, 3), 90, np.uint8)
    landmarks = np.array(((300.0, 195), (360, 195), (330, 225), (305, 260), (355, 260)))
    faces = (DetectedFace((258.0, 125.0, 144.0, 190.0), landmarks, 0.98),)
    blobs = (MovingBlob(7, "hand", (0.35, 0.1, 0.8), 0.06),)
    return picture, Detections(1.0, 1, 640, 480, faces, blobs, picture)


def test_target_reason_and_guard_are_told_and_run_no_markup() -> None:
    shot = snapshot(reasons=tuple(f"joint {n}: too <fast>" for n in range(6)))
    for word in ("face &lt;3&gt;", "pursue", "the rule &#x27;person&#x27; pulls"):
        assert word in target_text(shot)
    for word in ("guard: limited", "3 lost", "too &lt;fast&gt; (joint 0, +5)"):
        assert word in health_table(shot)
    assert "too" not in health_table(snapshot()) and alarms(snapshot()) == ""


@pytest.mark.parametrize(
    ("terms", "said"),
    [
        (
            (0.2, 0.3, 0.001, 0.0, 0.0),
            "because it moves (translation 0.20), comes nearer or goes away (looming 0.30)",
        ),
        ((0.0, 0.0, 0.0, 0.0, 0.5), "because the behaviour wait asks for it (0.50)"),
        ((0.0, 0.0, 0.0, 0.0, 0.0), "the rule 'person' pulls"),
    ],
)
def test_why_it_won_is_said_in_a_plain_sentence(terms: Terms, said: str) -> None:
    first = Salience(3, "face", *terms, 1.0, sum(terms))
    shot = replace(snapshot(), saliences=(first,), behaviour="wait")
    assert reason_text(shot) == said and escape(said) in target_text(shot)
    led = replace(shot, control_source=ControlSource("person", "ann", "look at 1 0 0"))
    assert reason_text(led) == shot.why


def test_what_stands_still_shouts() -> None:
    stopped = replace(snapshot(), stopped="somebody pressed <STOP>", level="torque_off")
    assert "somebody pressed &lt;STOP&gt;" in health_table(
        stopped
    ) and "guard: stopped" in health_table(stopped)
    assert alarms(stopped) == ""  # it is shown next to the stop button, once
    held = alarms(replace(snapshot(reasons=("neck_yaw: hot",)), level="hold"))
    assert "class='banner hold'><b>guard: hold" in held and "neck_yaw: hot" in held
    assert "the frame is 2.5 s old" in alarms(replace(snapshot(), frame_age_s=2.5))
    assert "s old" not in alarms(replace(snapshot(), frame_age_s=0.08))


def moving(t_s: float, slope_deg: float = 1.0) -> Snapshot:
    """All joints at t degrees as wished, half as permitted, a quarter as measured."""
    angles = [
        (slope_deg * math.radians(t_s) * share,) * len(GAZE_JOINTS) for share in (1.0, 0.5, 0.25)
    ]
    return replace(snapshot(t_s), trail=(Trail(t_s, *angles),))


def test_traces_keep_half_a_minute_and_start_anew_with_the_clock() -> None:
    traces = JointSeries()
    for tick in range(4500):
        traces.add(moving(0.01 * tick))
    ago_s, angles_deg = traces.table(30.0)
    assert ago_s[0] == pytest.approx(-30.0, abs=0.1)
    assert ago_s[-1] == 0.0
    assert MOST_POINTS / 2 < len(ago_s) <= MOST_POINTS
    assert np.allclose(angles_deg[:, 0, 3], 44.99 + ago_s)
    assert np.allclose(angles_deg[-1, :, 0], (44.99, 22.495, 11.2475))
    assert traces.table(3.0)[0][0] == pytest.approx(-3.0, abs=0.011)
    traces.add(moving(0.0))
    assert len(traces.table(30.0)[0]) == 1


def test_health_says_how_many_joints_nobody_measures() -> None:
    assert no_feedback_note(snapshot()) == ""
    said = "6 of 6 joints without feedback: shown where they should be"
    assert said in no_feedback_note(of_six(snapshot())) and said in health_table(of_six(snapshot()))
    assert "2 of 6 joints" in no_feedback_note(of_six(snapshot(), SIX[:2]))
    limp = of_six(snapshot())
    limp = replace(limp, servos=limp.servos._replace(torque=(True,) + (False,) * 5))
    assert "5 without torque: may be anywhere" in no_feedback_note(limp)


def test_detections_are_drawn_small_and_into_a_copy() -> None:
    picture, detections = camera_picture()
    before = picture.copy()
    drawn = draw_detections(picture, detections, (500.0, 100.0), lens=LENS)
    assert drawn.shape == (480, IMAGE_WIDTH_PX, 3)
    assert np.array_equal(picture, before)
    plain = draw_detections(picture, Detections(1.0, 1, 640, 480), None, lens=LENS)
    changed = np.abs(drawn.astype(int) - plain).sum(axis=2) > 60
    # Face box, left edge; a landmark; the blob at 320 + 300 * 0.35 / 0.8; the gaze point.
    for x_px, y_px in ((258, 220), (300, 194), (452, 300), (500, 100)):
        assert changed[y_px - 18 : y_px + 19, x_px - 18 : x_px + 19].any()
    assert not changed[400:, :].any()


FACING = ((-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0))


def looking(t_s: float, name: str = "face 1: nose", part: str | None = "N") -> Snapshot:
    """A head at the origin that looks straight at a face a metre away."""
    face = Face(1, (1.0, 0.0, 0.0), (0.0,) * 3, FACING, tuple((1.0, 0.0, 0.0) for _ in PARTS), 1.0)
    return replace(
        snapshot(t_s), p_world_head_m=(0.0, 0.0, 0.0),
        p_world_eyes_m=((0.0, 0.03, 0.0), (0.0, -0.03, 0.0)), p_world_target_m=(1.0, 0.0, 0.0),
        target_name=name, phase="fixate", faces=(face,), target_kind=name.split()[0],
        target_part=part,
    )  # fmt: skip


# --- the strip of the last half minute --------------------------------------------------


def test_strip_shows_targets_saccades_blinks_and_the_guard_and_runs_no_markup() -> None:
    timeline = Timeline()
    timeline.update(looking(0.0, "hand <7>", None))
    timeline.update(replace(looking(10.0, "hand <7>", None), worst="hold"))
    jump, shut = SeenSaccade(4.0, 0.05, 12.0), SeenBlink(6.0, 0.3)
    timeline.update(replace(looking(20.0), events=(jump, shut)))
    drawn = timeline.drawing()
    for said in ("hand &lt;7&gt;", "12.0 deg, 50 ms", "blink, 300 ms", "<title>hold</title>"):
        assert said in drawn
    assert "hand <7>" not in drawn
    assert all(0.0 <= float(x) <= 320.0 for x in re.findall(r"<rect x='([-\d.]+)'", drawn))


# --- The health of servos, loop and picture in words and colours, and the reason of the gaze


LIMITS = ServoLimits((55.0,) * 9, (65.0,) * 9, (3.8,) * 9, (6.7,) * 9, (0.5,) * 9)
WELL = Servos(
    (30.0,) * 9, (5.0,) * 9, (0.1,) * 9, (True,) * 9, ("",) * 9, (0.0,) * 9, (0,) * 9, LIMITS
)


def healthy(t_s: float = 1.0) -> Snapshot:
    now = snapshot(t_s)
    pose = CommandedPose(AHEAD, now.p_world_head_m, now.p_world_eyes_m, now.gaze_world, now.lids)
    return replace(
        now, target_name="thing <4>", why="slide <0.4>", health="bus ok", behaviour="wait",
        servos=WELL, timing=LoopFigures(200.0, 0.04, 0.21, 0.9, 0, 3, 5.0), frame_age_s=0.06,
        commanded_pose=pose, camera=SeenCamera(AHEAD, (0.05, 0.0, 0.18), 1.2, 1.6),
        trail=(Trail(t_s, REST, REST, REST),),
        events=(SeenSaccade(0.5, 0.05, 5.0), SeenBlink(0.2, 0.3)),
    )  # fmt: skip


def put(column: tuple[float | None, ...], i: int, value: float | None) -> tuple[float | None, ...]:
    return (*column[:i], value, *column[i + 1 :])


@pytest.mark.parametrize(
    ("celsius", "strain"), [(54.9, ""), (55.0, "near"), (65.0, "over"), (None, "")]
)
def test_heat_is_told_by_what_the_guard_does(celsius: float | None, strain: str) -> None:
    assert strain_of_heat(WELL._replace(temperature_c=put(REST, 2, celsius)), 2) == strain


@pytest.mark.parametrize(("load", "strain"), [(0.5, ""), (-0.51, "near"), (-0.95, "over")])
def test_load_is_told_by_its_size(load: float, strain: str) -> None:
    assert strain_of_load(WELL._replace(load=(load,) * 9), 0) == strain


@pytest.mark.parametrize(("volts", "strain"), [(3.7, "near"), (3.8, ""), (6.8, "near"), (None, "")])
def test_voltage_is_told_by_both_ends(volts: float | None, strain: str) -> None:
    assert strain_of_voltage(WELL._replace(voltage_v=put(REST, 1, volts)), 1) == strain


def strained(html: str) -> int:
    """Number of coloured figures."""
    return html.count("<td class='near'>") + html.count("<td class='over'>")


def test_a_healthy_rig_has_no_alarm_and_every_joint_a_row() -> None:
    table = servo_table(WELL, GAZE_JOINTS)
    assert table.count("<tr") == 10
    assert strained(table) == 0 and "class='fault'" not in table
    assert "neck roll" in table and "+10 %" in table


def test_faults_and_silence_are_said_beside_the_joint() -> None:
    fault = ("", "overload <1>") + ("",) * 7
    table = servo_table(
        WELL._replace(fault=fault, age_s=(0.0, 0.0, 1.25) + (0.0,) * 6), GAZE_JOINTS
    )
    assert "left eye tilt<div class='fault'>" in table and "overload &lt;1&gt;" in table
    assert "right eye pan<div class='fault'>" in table and "silent for 1.2 s" in table
    assert "torque off" in servo_table(WELL._replace(torque=(False,) * 9), GAZE_JOINTS)
    assert "no data of the servos" in servo_table(Servos(), ())


def test_the_winner_comes_first_term_by_term_and_runs_no_markup() -> None:
    tugs = (
        Salience(4, "thing", 0.41, 0.0, 0.0, 0.0, 0.0, 1.0, 0.41),
        Salience(1, "<b>", 0.02, 0.0, 0.0, 0.0, 0.5, 0.6, 0.3),
    )
    shot = replace(healthy(), saliences=tugs, character="shy", conversation="listen")
    said = salience_bars(shot)
    assert said.index("thing 4") < said.index("&lt;b&gt; 1")
    assert "translation 0.41" in said and "translation 0.02 rule 0.50" in said
    assert "looming 0.00</div>" not in said
    assert "0.60 &times;&ensp;0.30" in said
    named = target_text(shot)
    for words in ("thing &lt;4&gt;", "because it moves", "behaviour: wait", "character: shy",
                  "conversation: listen"):  # fmt: skip
        assert words in named
    assert "wanders" in salience_bars(healthy()) and "slide &lt;0.4&gt;" in target_text(healthy())


# --- The page's panels: what browsers are sent, what they may send, and who is sent what


class Tab:
    """A browser's tab without the drawing."""

    def __init__(self, widgets: Widgets) -> None:
        self._widgets = widgets
        self.woken = 0
        self.client: Client = widgets.join("browser 1", self._wake)
        self.images: dict[int, bytes] = {}
        self.seen: dict[int, dict[str, Any]] = {}
        self.notices: list[tuple[str, bool]] = []

    def _wake(self) -> None:
        self.woken += 1

    def read(self) -> list[int]:
        """Take what waits; the numbers of what was put."""
        out = self._widgets.outgoing(self.client)
        if out is None:
            return []
        for one in out.images:
            self.images[int.from_bytes(one[:4], "big")] = one[4:]
        said = json.loads(out.text) if out.text else {}
        for number, props in said.get("put", []):
            self.seen.setdefault(number, {}).update(props)
        for number in said.get("gone", []):
            self.seen.pop(number, None)
        self.notices += [(one["text"], one["refused"]) for one in said.get("say", [])]
        return [number for number, _ in said.get("put", [])]

    def send(self, *message: object) -> None:
        self._widgets.handle_message(self.client, json.dumps(message[0]))


@pytest.fixture
def widgets() -> Widgets:
    return Widgets()


def test_a_slow_browser_gets_only_the_newest_of_each(widgets: Widgets) -> None:
    words, image = widgets.panel("watch").html(), widgets.panel("camera").image("camera")
    tab = Tab(widgets)
    tab.read()
    for k in range(1000):
        words.content = f"words {k}"
        image.show(b"image %d" % k)
    assert len(tab.client.changes) == 1 and len(tab.client.images) == 1
    assert tab.woken == 2  # once for all that waits
    tab.read()
    assert tab.seen[1]["content"] == "words 999" and tab.images == {2: b"image 999"}
    words.content = "words 999"
    assert tab.read() == []


def test_a_drawer_that_is_shut_is_not_sent_until_it_is_opened(widgets: Widgets) -> None:
    camera = widgets.panel("camera").image("camera")
    words = widgets.panel("health").html("guard: ok")
    tab = Tab(widgets)
    tab.send({"seen": ["camera"]})
    assert widgets.is_visible("camera") and not widgets.is_visible("health")
    assert tab.read() == [1]
    words.content = "guard: hold"
    camera.show(b"jpeg")
    assert tab.read() == [] and tab.images == {1: b"jpeg"}
    tab.send({"seen": ["camera", "health"]})
    assert tab.read() == [2] and tab.seen[2]["content"] == "guard: hold"


def test_what_one_does_the_others_see_and_handlers_hear_once(widgets: Widgets) -> None:
    heard: list[tuple[float, str]] = []
    slider = widgets.panel("steer").slider("neck", (-10.0, 10.0), 0.1, 0.0)
    slider.on_change(lambda value, client: heard.append((value, client)))
    one, other = Tab(widgets), Tab(widgets)
    one.read(), other.read()
    one.send({"set": [1, 2.5]})
    assert heard == [(2.5, one.client.name)] and slider.value == 2.5
    assert one.read() == [] and other.read() == [1]
    slider.value = 3.0  # set by the program: no handler is called
    assert len(heard) == 1 and one.read() == [1]
    slider.value = 4.0  # older than what the browser sends before it reads
    one.send({"set": [1, 5.0]})
    one.read(), other.read()
    assert (one.seen[1]["value"], other.seen[1]["value"]) == (3.0, 5.0)


def test_what_a_field_cannot_hold_is_refused_in_words(widgets: Widgets) -> None:
    place, heard = widgets.panel("steer"), list[object]()
    fields: dict[Any, list[object]] = {
        place.slider("neck", (-10.0, 10.0), 0.1, 1.0): [99.0, "1", None, True, [1], 1e400],
        place.checkbox("drag", value=False): [1, "yes", None],
        place.text("find", "neck"): [1, None, "x" * 5000],
        place.choice("group", ("a", "b")): ["c", 1, None],
    }
    tab = Tab(widgets)
    tab.read()
    for number, (field, wrong) in enumerate(fields.items(), 1):
        field.on_change(lambda *given: heard.append(given))
        before = field.props.get("value")
        tab.notices.clear()
        for value in wrong:
            tab.send({"set": [number, value]})
        tab.read()
        assert heard == [] and field.props.get("value") == before
        assert len(tab.notices) == len(wrong) and all(refused for _, refused in tab.notices)
        assert tab.seen[number].get("value") == before  # the browser gets the present value


@pytest.mark.parametrize(
    "text",
    ["no JSON", "[]", "{}", '{"set": 3}', '{"set": [true, 1]}', '{"set": ["1", 1]}', "NaN",
     '{"set": [1, NaN]}', '{"seen": ["nowhere"]}', '{"seen": "watch"}', "[" * 9000],
)  # fmt: skip
def test_nonsense_is_refused_and_changes_nothing(widgets: Widgets, text: str) -> None:
    slider = widgets.panel("steer").slider("neck", (-10.0, 10.0), 0.1, 0.0)
    tab = Tab(widgets)
    tab.read()
    widgets.handle_message(tab.client, text)
    assert slider.value == 0.0 and tab.client.seen >= {"steer", "watch"}
    tab.read()
    assert len(tab.notices) == 1 and tab.notices[0][1]


# --- Drawer Play: buttons, the timeline of the tracks that play, and what it sends


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


# --- Panels of one file, ours and those of packages; a failed one shows why, the page continues


CODE = """
from gazerig.robot.dashboard.panels.package_panels import PagePanel
class Count(PagePanel):
    title = "snapshots"
    def __init__(self): self.n = 0
    def update(self, snapshot): self.n += 1
    def drawing(self): return f"<p>{self.n}</p>"
class Broken(Count):
    title = "broken"
    def update(self, snapshot): raise RuntimeError("no bulb")
class NoPanel: pass
"""
NAMES = {"count": "counter:Count", "broken": "counter:Broken", "none": "counter:NoPanel"}


def contents(widgets: Widgets) -> list[str]:
    return [widget.content for widget in widgets._widgets.values() if hasattr(widget, "content")]


def test_panels_of_packages_are_drawn_and_failures_named(tmp_path: Path) -> None:
    install(tmp_path, "counter", {"gazerig.page_panel": NAMES}, {"counter": CODE})
    with on_path(tmp_path):
        widgets = Widgets()
        panels = PagePanels(widgets.panel("watch"))
        panels.begin()
        for _ in range(3):
            panels.update(looking(0.0))
        panels.draw(0)
        shown = " ".join(contents(widgets))
        assert "<p>3</p>" in shown and "RuntimeError: no bulb" in shown
        assert "is no subclass of PagePanel" in shown
        panels.begin()
        panels.draw(0)
        assert "<p>0</p>" in " ".join(contents(widgets))


def test_panels_of_this_folder_are_found_and_drawn_when_they_are_due() -> None:
    assert list(core_panels()) == [Timeline]
    widgets = Widgets()
    panels = PagePanels(widgets.panel("watch"))
    panels.begin()
    panels.update(looking(0.0))
    panels.draw(Timeline.period - 1)
    assert not any(contents(widgets))
    panels.draw(Timeline.period)
    assert f"the last {STRIP_S:.0f} seconds: looked at" in "".join(contents(widgets))
