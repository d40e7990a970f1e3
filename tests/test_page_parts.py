"""Elements of the page: shapes, words, traces, and the picture with its detections."""

import json
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from desk import GAZE_JOINTS
from msgspec import structs
from outside_package import install, on_path
from shown_page import AHEAD, SNAPSHOT
from ticked_rig import Outbox

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import DetectedFace, Detections, MovingBlob
from gazerig.gaze.types import PARTS, Face, Salience
from gazerig.robot.control.track_choices import TrackInfo
from gazerig.robot.dashboard.feed.camera_overlay import IMAGE_WIDTH_PX, draw_detections
from gazerig.robot.dashboard.panels.attention_panel import salience_bars, target_text
from gazerig.robot.dashboard.panels.event_timeline import STRIP_S, Timeline
from gazerig.robot.dashboard.panels.joint_charts import MOST_POINTS, JointSeries
from gazerig.robot.dashboard.panels.package_panels import PagePanels, core_panels
from gazerig.robot.dashboard.panels.play_panel import PlayPanel, SoundWaves
from gazerig.robot.dashboard.panels.servo_health import (
    alarms,
    health_table,
)
from gazerig.robot.dashboard.widgets.widgets import Client, Widgets
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


# --- Drawer Play: the list of tracks


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
