"""The health of servos, loop and picture in words and colours, and why the gaze is where it is."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TypeVar, cast

import cv2
import numpy as np
import pytest
import viser
from desk import GAZE_JOINTS
from shown_page import SNAPSHOT
from six_joints import SIX, TELLS_NOTHING, of_six

from gazerig.config.schema import load_rig
from gazerig.drivers.types import BusHealth
from gazerig.gaze.types import Salience
from gazerig.robot.app.rig_description import shape_of
from gazerig.robot.control.tick_text import health_text
from gazerig.robot.dashboard.feed.live_feed import News, OverlayChoices
from gazerig.robot.dashboard.feed.page_process import REPLAY
from gazerig.robot.dashboard.page_view import PageView
from gazerig.robot.dashboard.panels.attention_panel import saliences, winner
from gazerig.robot.dashboard.panels.joint_charts import JointCharts, JointSeries
from gazerig.robot.dashboard.panels.panel import PanelView
from gazerig.robot.dashboard.panels.servo_health import (
    NO_FEEDBACK,
    health,
    servo_table,
    strain_of_heat,
    strain_of_load,
    strain_of_voltage,
)
from gazerig.robot.dashboard.requests.outbox import Outbox
from gazerig.robot.dashboard.view.head_view import lid_edges
from gazerig.robot.dashboard.view.overlays import OverlayPanel
from gazerig.robot.dashboard.widgets.widget import Html, Widget
from gazerig.robot.dashboard.widgets.widgets import Widgets
from gazerig.robot.model.types import (
    CommandedPose,
    LoopFigures,
    SeenCamera,
    SeenFixation,
    SeenSaccade,
    ServoLimits,
    Servos,
    Snapshot,
    Trail,
)

AHEAD = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
LIMITS = ServoLimits((55.0,) * 9, (65.0,) * 9, (3.8,) * 9, (6.7,) * 9, (0.5,) * 9)
WELL = Servos(
    (30.0,) * 9, (5.0,) * 9, (0.1,) * 9, (True,) * 9, ("",) * 9, (0.0,) * 9, (0,) * 9, LIMITS
)
REST = (0.0,) * 9
T = TypeVar("T")


def snapshot(t_s: float = 1.0) -> Snapshot:
    eyes = ((0.03, 0.031, 0.14), (0.03, -0.031, 0.14))
    sight = ((1.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    return Snapshot(
        t_s=t_s, measured_rad=REST, desired_rad=REST, R_world_head=AHEAD,
        p_world_head_m=(0.03, 0.0, 0.14), p_world_eyes_m=eyes, gaze_world=sight, lids=(0.8, 0.8),
        p_world_target_m=(1.0, 0.0, 0.14), target_name="thing <4>", why="slide <0.4>",
        phase="pursue", level="ok", reasons=(), faces=(), bodies=(), rate_hz=200.0,
        health="bus ok", behaviour="wait", servos=WELL,
        timing=LoopFigures(200.0, 0.04, 0.21, 0.9, 0, 3, 5.0), frame_age_s=0.06,
        commanded_pose=CommandedPose(AHEAD, (0.03, 0.0, 0.14), eyes, sight, (0.8, 0.8)),
        camera=SeenCamera(AHEAD, (0.05, 0.0, 0.18), 1.2, 1.6), field_deg=(100.0, 60.0, 60.0, 75.0),
        trail=(Trail(t_s, REST, REST, REST),),
        events=(SeenSaccade(0.5, 0.05, 5.0, 180.0), SeenFixation(0.2, 0.3, "LE")),
        joints=GAZE_JOINTS,
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


def test_without_limits_nothing_is_coloured() -> None:
    hot = WELL._replace(temperature_c=(90.0,) * 9, limits=None)
    assert strain_of_heat(hot, 0) == ""
    assert strained(servo_table(hot, GAZE_JOINTS)) == 0


def strained(html: str) -> int:
    """How many figures are coloured."""
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


def test_what_was_not_measured_is_a_dash_and_no_zero() -> None:
    unread = WELL._replace(temperature_c=(None,) * 9, voltage_v=(None,) * 9, unanswered=())
    assert servo_table(unread, GAZE_JOINTS).count(">-</td>") == 27


def test_a_servo_that_tells_nothing_has_no_figures() -> None:
    table = servo_table(TELLS_NOTHING, SIX, SIX)
    assert table.count(f">{NO_FEEDBACK}</td>") == 6 and "not noticed" in table
    assert " %" not in table and ">-</td>" not in table  # a load of 0 is none that was measured
    assert "eyes pan" in table and "neck" not in table
    assert NO_FEEDBACK not in servo_table(WELL, GAZE_JOINTS)


def test_only_the_joints_nobody_measures_are_without_figures() -> None:
    table = servo_table(WELL, GAZE_JOINTS, ("left_upper_lid",))
    assert table.count(f">{NO_FEEDBACK}</td>") == 1 and table.count("+10 %") == 8
    silent = servo_table(WELL._replace(age_s=(1.25,) * 9), GAZE_JOINTS, GAZE_JOINTS)
    assert silent.count("silent for 1.2 s") == 9  # a board that is gone is told all the same


def test_loop_figures_are_told_and_coloured_when_late() -> None:
    said = health(snapshot())
    for words in ("200.0 Hz", "0.04 ms", "0.21 ms", "0.90 ms", "3 slots overrun", "60 ms</b> old"):
        assert words in said
    assert strained(said) == 0
    late = replace(snapshot(), timing=LoopFigures(200.0, 0.1, 2.0, 4.0, 2, 2, 5.0))
    assert strained(health(late)) == 2
    assert "no frame yet" in health(replace(snapshot(), frame_age_s=None))


def test_the_winner_comes_first_term_by_term_and_runs_no_markup() -> None:
    tugs = (
        Salience(4, "thing", 0.41, 0.0, 0.0, 0.0, 0.0, 1.0, 0.41),
        Salience(1, "<b>", 0.02, 0.0, 0.0, 0.0, 0.5, 0.6, 0.3),
    )
    shot = replace(snapshot(), saliences=tugs, character="shy", conversation="listen")
    said = saliences(shot)
    assert said.index("thing 4") < said.index("&lt;b&gt; 1")
    assert "translation 0.41" in said and "translation 0.02 rule 0.50" in said
    assert "looming 0.00</div>" not in said
    assert "0.60 &times;&ensp;0.30" in said
    named = winner(shot)
    for words in ("thing &lt;4&gt;", "because it moves", "behaviour: wait", "character: shy",
                  "conversation: listen"):  # fmt: skip
        assert words in named
    assert "wanders" in saliences(snapshot()) and "slide &lt;0.4&gt;" in winner(snapshot())


def as_it_is(shot: Snapshot) -> Snapshot:
    return shot


# --- on a page --------------------------------------------------------------------------


@pytest.fixture(scope="module")
def server():
    made = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield made
    made.stop()


def watched() -> tuple[Widgets, PanelView]:
    """Panels that a browser shows."""
    widgets = Widgets()
    panel = PanelView(widgets)
    widgets.join("a browser", lambda: None)
    return widgets, panel


def words_of(widgets: Widgets) -> str:
    """Everything that is written in the panels, in whatever drawer."""
    every = widgets._widgets.values()
    titles = [str(one.props.get("title", "")) for one in every if type(one) is Widget]
    return " ".join([one.content for one in every if isinstance(one, Html)] + titles)


@pytest.mark.parametrize(("made", "last"), [(as_it_is, "neck roll"), (of_six, "right lower lid")])
def test_panel_takes_snapshots_and_fills_its_tabs(
    made: Callable[[Snapshot], Snapshot], last: str
) -> None:
    widgets, panel = watched()
    shots = tuple(made(snapshot(0.04 * k)) for k in range(51))
    for shot in shots:
        panel.update((shot,))
        panel.show()
    said = words_of(widgets)
    for words in (
        "thing &lt;4&gt;", "51 saccades", "51 rests", last, "the last 30 seconds",
        "saccades a second", "bus ok",
    ):  # fmt: skip
        assert words in said
    charts = panel.traces.charts
    assert len(charts) == 3
    assert all(len(cast("list[float]", chart.props["x"])) > 40 for chart in charts)
    panel.update((made(snapshot(0.0)),))
    for _ in range(26):
        panel.show()
    again = words_of(widgets)
    assert "51 saccades" not in again and "1 saccade<" in again
    panel.silent()
    assert "the rig has sent nothing" in panel.silence.content
    panel.update((made(snapshot(0.1)),))
    assert panel.silence.content == ""


def test_what_nobody_measured_is_drawn_and_named_otherwise() -> None:
    _, panel = watched()
    view = panel.traces

    def shown(t_s: float, estimated: tuple[str, ...]) -> list[bool]:
        shot = of_six(snapshot(t_s), estimated)
        panel.update((shot,))
        panel.draw_all()
        panel.show()
        named = [chart.names()[2] == "estimated, not measured" for chart in view.charts]
        lines = [cast("list[list[str]]", chart.props["lines"]) for chart in view.charts]
        assert named == [line[2][1] == "estimated" for line in lines]
        assert named == ["no feedback" in chart.title for chart in view.charts]
        return named

    assert shown(1.0, SIX) == [True, True, True]
    assert "> measured<" not in view.key.content and "estimated" in view.key.content
    assert "no measurements" in panel.estimation_note.content
    before = view.charts
    assert shown(1.1, SIX) == [True, True, True]
    assert view.charts is before  # what stays as it is is not made again
    assert shown(1.2, ("left_lower_lid",)) == [False, False, True]
    assert "> measured<" in view.key.content and "estimated" in view.key.content
    assert panel.estimation_note.content == ""
    assert shown(1.3, ()) == [False, False, False]
    assert "estimated" not in view.key.content


class Nobody:
    """A stop button and an ear that take whatever they are told."""

    def tell(self, state: Mapping[str, object]) -> None:
        self.reported = dict(state)


def test_who_comes_late_sees_all_panels_as_they_are_now(
    server: viser.ViserServer,
) -> None:
    button = Nobody()
    widgets = Widgets()
    view = PageView(server, widgets, Outbox(None), button.tell)  # type: ignore[arg-type]
    view.show(News((replace(snapshot(1.0), target_name="the first"),), None, ended=False))
    for k in range(20):  # nobody looks
        view.show(News((snapshot(1.1 + 0.1 * k),), None, ended=False))
    last = replace(of_six(snapshot(4.0)), target_name="the last", stopped="a test")
    view.show(News((last,), None, ended=False))
    known = {"stopped": "a test", "silent": False, "without_feedback": 6}
    assert button.reported.items() >= known.items()
    panel = view._panel
    widgets.join("a browser", lambda: None)
    view.show(News((), None, ended=False))
    assert "the last" in panel.winner.content and NO_FEEDBACK in panel.health.content
    assert len(panel.traces.charts) == 3 and "no feedback" in panel.traces.charts[0].title


def test_the_menu_of_traces_is_that_of_the_rig() -> None:
    traces = JointSeries()
    view = JointCharts(Widgets().panel("watch"))
    traces.add(snapshot(1.0))
    view.show(traces)
    assert view.what.options == ("yaw", "pitch", "left eye", "right eye", "neck")
    view.what.value = "neck"
    view.show(traces)
    assert "neck, roll" in view.charts[-1].title
    traces.add(of_six(snapshot(2.0)))
    view.show(traces)
    assert view.what.options == ("yaw", "pitch", "left eye", "right eye")
    assert view.what.value == "yaw" and "lower lids" in view.charts[-1].title
    view.what.value = "left eye"
    view.show(traces)
    titles = " ".join(chart.title for chart in view.charts)
    assert len(view.charts) == 4 and titles.count("both eyes") == 2
    assert "left upper lid" in titles and "left lower lid" in titles


def test_layers_are_seen_where_they_are_wanted(server: viser.ViserServer) -> None:
    view = OverlayPanel(server.scene)

    def seen() -> set[str]:
        nodes = {"ghost": "/ghost", "camera": "/camera", "eyes": "/field_left"}
        handles = server.scene._handle_from_node_name
        return {name for name, node in nodes.items() if node in handles and handles[node].visible}

    edges = lid_edges(shape_of(load_rig("desk")))
    view.show(snapshot(), OverlayChoices(ghost=True, camera=True, eyes=True), edges)
    assert seen() == {"ghost", "camera", "eyes"}
    view.show(snapshot(), OverlayChoices(ghost=False, camera=True, eyes=False), edges)
    assert seen() == {"camera"}
    view.show(
        replace(snapshot(), commanded_pose=None, camera=None, field_deg=None),
        OverlayChoices(eyes=True),
        edges,
    )
    assert seen() == set()


def test_a_recording_without_pictures_says_so(server: viser.ViserServer) -> None:
    widgets = Widgets()
    view = PageView(server, widgets, Outbox(None), Nobody().tell)  # type: ignore[arg-type]
    state = {"at_s": 1.0, "duration_s": 9.0, "playing": False, "speed": 1.0, "sought_s": None}
    assert view._panel.image.data == b""
    without = {**state, "pictures": False}
    view.show(News((snapshot(),), None, ended=False, others=((REPLAY, without),)))
    shown = cv2.imdecode(np.frombuffer(view._panel.image.data, np.uint8), cv2.IMREAD_GRAYSCALE)
    assert shown is not None and 0.01 < (shown > 180).mean() < 0.1  # words on a dark ground


def test_bus_faults_are_told_in_plain_words() -> None:
    errors = {"timeout": 74, "rearmed": 1, "late computer": 0, "pulse": 2}
    said = health_text(BusHealth(0, 0, errors))
    assert said == "bus: pulse 2 times, torque on again 1 time, no answer 74 times"
    assert health_text(BusHealth(0, 0, {})) == "bus ok"


def test_a_recording_that_stands_still_is_no_silent_rig(server: viser.ViserServer) -> None:
    button = Nobody()
    view = PageView(server, Widgets(), Outbox(None), button.tell)  # type: ignore[arg-type]
    state = {"at_s": 1.0, "duration_s": 9.0, "playing": False, "speed": 1.0, "sought_s": None}
    view.show(News((snapshot(),), None, ended=False, others=((REPLAY, state),)))
    view.silent()
    assert button.reported["recording"] is True and "silent" not in button.reported


def test_the_age_of_the_frame_is_said_once() -> None:
    shot = replace(SNAPSHOT, frame_age_s=0.073, perception="frame 73 ms old | face 1 at 0.94 m")
    said = health(shot)
    assert said.count("73 ms") == 1 and "<div>face 1 at 0.94 m</div>" in said
    assert "<div>no face</div>" in health(replace(shot, perception="no face"))
    blind = health(replace(shot, frame_age_s=None, perception="no frame yet"))
    assert blind.count("no frame yet") == 1
