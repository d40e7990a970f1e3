"""Controls of the page: menus, joints and parameters, in every browser."""

import json
from collections.abc import Mapping
from dataclasses import replace
from math import radians

import pytest
from desk import GAZE_JOINTS
from shown_page import PARAM, SNAPSHOT
from six_joints import SIX, of_six

from gazerig.config.parameters import parameters, values
from gazerig.config.schema import load_rig
from gazerig.robot.control.command_handler import plain
from gazerig.robot.dashboard.feed.live_feed import News
from gazerig.robot.dashboard.panels.controls import LeadPanel
from gazerig.robot.dashboard.panels.jog_panel import ESTIMATED, JogPanel, estimated_joints_note
from gazerig.robot.dashboard.panels.param_control import (
    ParamControl,
    fits_slider,
    format_value,
    hint,
    label,
    read,
    slider_step,
)
from gazerig.robot.dashboard.panels.param_panel import ParamState, found, group_of
from gazerig.robot.dashboard.requests.inbox import (
    parse_request,
    request_message,
)
from gazerig.robot.dashboard.widgets.widget import Slider, TextField
from gazerig.robot.dashboard.widgets.widgets import Container, Widgets
from gazerig.robot.model.command_json import as_json, from_json
from gazerig.robot.model.commands import Ask, Command, Jog, LookAt
from gazerig.robot.model.parameter import JsonValue, Parameter

# --- controls -----------------------------------------------------------------------------------


@pytest.fixture
def place() -> Container:
    return Widgets().panel("steer")


class Mouth:
    """Keeps what is parse_request."""

    def __init__(self) -> None:
        self.parse_request: list[tuple[object, str]] = []

    def command(self, command: Command, who: str) -> bool:
        self.parse_request.append((command, who))
        return True

    def ask(self, data: Mapping[str, object], who: str) -> bool:
        self.parse_request.append((dict(data), who))
        return True


WHO = "panels-5"


class Scene:
    """A scene that holds the target to drag."""

    visible = True
    position = (0.0, 0.0, 0.0)

    def add_transform_controls(self, name: str, **of_it: object) -> "Scene":
        return self

    def on_update(self, do: object) -> None:
        """Nobody drags here."""


def test_menus_become_buttons_that_ask(place: Container) -> None:
    mouth, freed = Mouth(), []
    lead = LeadPanel(place, Scene(), mouth, lambda: freed.append(True))  # type: ignore[arg-type]
    lead.offer("behaviour", ["wait", "guard"])
    lead.offer("steer", ["left", "right"])
    lead.characters(["none", "calm"], "none")
    lead.menus["behaviour"].arrived("guard", WHO)
    lead.menus["steer"].arrived("left", WHO)
    lead.menus["character"].arrived("calm", WHO)
    lead.free.arrived("look freely", WHO)
    assert mouth.parse_request == [
        (Ask("behaviour", "guard"), WHO),
        ({"steer": "left"}, WHO),
        ({"do": "character", "name": "calm"}, WHO),
        (LookAt(None), WHO),
    ]
    assert freed == [True]
    lead.show(replace(SNAPSHOT, behaviour="guard"))
    assert (lead.menus["behaviour"].current, lead.menus["character"].current) == ("guard", "none")


def jogging(place: Container) -> tuple[JogPanel, Mouth]:
    mouth = Mouth()
    view = JogPanel(place, mouth)  # type: ignore[arg-type]
    ends = {
        f"joints.{j}.{end}_deg": v for j in GAZE_JOINTS for end, v in (("min", -30), ("max", 40.0))
    }
    view.values(ends)
    return view, mouth


def test_every_joint_has_a_slider_with_its_limits(place: Container) -> None:
    view, _ = jogging(place)
    assert tuple(view.sliders) == GAZE_JOINTS
    assert {slider.ends for slider in view.sliders.values()} == {(-30.0, 40.0)}
    view.values({"joints.neck_yaw.min_deg": -10.0, "joints.neck_yaw.max_deg": 10.0})
    assert view.sliders["neck_yaw"].ends == (-10.0, 10.0)


def test_a_slider_jogs_and_then_follows_its_joint(place: Container) -> None:
    view, mouth = jogging(place)
    slider = view.sliders["neck_yaw"]
    yaw = GAZE_JOINTS.index("neck_yaw")
    view.show(replace(SNAPSHOT, t_s=1.0))
    assert (
        slider.value == pytest.approx(5.7) and mouth.parse_request == []
    )  # 0.1 rad, and nobody asked
    slider.arrived(20.0, WHO)
    assert mouth.parse_request == [(Jog((("neck_yaw", radians(20.0)),)), WHO)]

    def wished(t_s: float, desired_deg: float, stopped: str = "") -> float:
        desired = tuple(radians(desired_deg) if i == yaw else 0.1 for i in range(9))
        view.show(replace(SNAPSHOT, t_s=t_s, desired_rad=desired, stopped=stopped))
        return float(slider.value)

    assert wished(1.1, 6.0) == 20.0  # not yet obeyed
    assert wished(1.2, 20.0) == 20.0  # obeyed; the joint is still on its way
    assert wished(5.0, 20.0) == 20.0
    assert wished(5.2, -3.0) == 20.0
    assert wished(5.8, -3.0) == pytest.approx(5.7)  # somebody let go elsewhere
    slider.arrived(20.0, WHO)
    assert wished(5.9, 20.0, "a test") == pytest.approx(5.7)  # a stop lets go at once


def test_angles_that_nobody_measured_are_called_so(place: Container) -> None:
    assert estimated_joints_note(SNAPSHOT) == ""
    assert f"all joints: {ESTIMATED}" in estimated_joints_note(of_six(SNAPSHOT))
    one = estimated_joints_note(of_six(SNAPSHOT, SIX[1:2]))
    assert f">{SIX[1].replace('_', ' ')}: {ESTIMATED}" in one
    view, _ = jogging(place)
    view.show(of_six(SNAPSHOT))
    assert ESTIMATED in str(view.estimated_joints_note.content)
    view.show(SNAPSHOT)
    assert view.estimated_joints_note.content == ""


def test_sliders_are_those_of_the_rig(place: Container) -> None:
    mouth = Mouth()
    view = JogPanel(place, mouth)  # type: ignore[arg-type]
    rig = values(load_rig("maker"))
    view.values(rig)
    assert tuple(view.sliders) == SIX
    lid = view.sliders["left_lower_lid"]
    assert lid.ends == tuple(rig[f"joints.left_lower_lid.{e}_deg"] for e in ("min", "max"))
    view.show(of_six(SNAPSHOT))
    assert view.sliders["eyes_pan"].value == pytest.approx(20.0)
    lid.arrived(5.0, WHO)
    assert mouth.parse_request == [(Jog((("left_lower_lid", radians(5.0)),)), WHO)]
    view.show(SNAPSHOT)  # of another rig: nothing to follow, and nothing breaks


# --- parameters ---------------------------------------------------------------------------------


def test_a_parameter_is_read_as_the_rig_writes_it() -> None:
    data = {**PARAM._asdict(), "choices": [1, -1], "length": None, "items": None}
    assert Parameter.from_json(json.loads(json.dumps(data))) == PARAM._replace(choices=(1, -1))


def test_a_hint_says_all_there_is_to_know() -> None:
    words = hint(PARAM._replace(choices=("a", "b")))
    for part in ("a.b", "how far", "0 to 10 deg", "a, b", "default 1.0 deg", "next tick"):
        assert part in words
    assert label(PARAM, True) == "● a.b (deg)" and label(PARAM, False) == "a.b (deg)"


@pytest.mark.parametrize(("low", "high"), [(0.0, 1.0), (-35.0, 35.0), (0.3, 0.7), (10.0, 1e5)])
def test_a_slider_has_some_hundred_round_steps(low: float, high: float) -> None:
    step = slider_step(low, high)
    assert 190 <= (high - low) / step <= 501
    assert f"{step:.0e}"[0] in "125"


def test_what_a_slider_cannot_set_finely_is_typed() -> None:
    assert fits_slider(PARAM, 1.0)
    assert not fits_slider(PARAM._replace(high=1e6), 1.0)
    assert not fits_slider(PARAM, 11.0)
    assert not fits_slider(PARAM._replace(optional=True, default=None), 1.0)
    assert fits_slider(PARAM._replace(optional=True), 1.0)
    assert not fits_slider(PARAM._replace(optional=True), None)
    assert not fits_slider(PARAM._replace(kind="list"), (1.0, 2.0))


@pytest.mark.parametrize(
    ("kind", "value"),
    [("number", 1e-7), ("number", 3.0), ("whole", 7), ("text", "a b"), ("list", [1.0, 2.5])],
)
def test_what_is_written_is_read_again(kind: str, value: JsonValue) -> None:
    param = PARAM._replace(kind=kind, default=value)
    assert read(param, format_value(param, value)) == value


def test_what_cannot_be_read_is_refused_with_an_example() -> None:
    with pytest.raises(ValueError, match=r"a\.b: '1,5' is no number; write it like 1\.0"):
        read(PARAM, "1,5")
    assert read(PARAM._replace(optional=True), "null") is None


def test_a_slider_makes_room_where_null_comes_into_force(place: Container) -> None:
    param = PARAM._replace(optional=True)
    slider = ParamControl(place, param, 1.0, False, ignore, ignored, 0.0)
    typed = ParamControl(place, param, None, False, ignore, ignored, 1.0)
    assert slider.can_show(2.0) and not slider.can_show(None)
    assert typed.can_show(None) and typed.can_show(2.0)
    typed.show(2.0, False)
    assert typed.field.value == "2.0"


@pytest.mark.parametrize("name", ["maker", "feetech", "desk"])
def test_every_parameter_of_every_rig_becomes_a_control(place: Container, name: str) -> None:
    rig = load_rig(name)
    now, texts = values(rig), {}
    sent = json.loads(
        json.dumps([plain(param._asdict()) for param in parameters(rig, load_rig("desk"))])
    )
    places = [Parameter.from_json(data) for data in sent]
    assert {param.key for param in places} == set(now)
    refused: list[str] = []
    for param in places:
        value = json.loads(json.dumps(plain(now[param.key])))
        control = ParamControl(place, param, value, False, ignore, refused.append, 0.0)
        control.show(value, True)
        assert hint(param).startswith(param.key)
        if isinstance(control.field, TextField):
            texts[param.key] = control.field.value
            assert read(param, texts[param.key]) == value
        elif isinstance(control.field, Slider):
            assert control.field.checked(control.field.value) == value
        control.remove()
    if name == "maker":
        assert texts["joints.eyes_pan.transmission_points"].startswith("[[-32.0, 1068.0], [")
        linkage = next(
            param for param in places if param.key == "joints.eyes_pan.transmission_points"
        )
        assert "next start" in hint(linkage) and "default" not in hint(linkage)
    assert refused == []


def ignored(words: str) -> None:
    raise AssertionError(words)


def ignore(key: str, value: object) -> None:
    """A control that is only looked at asks for nothing."""
    raise AssertionError(f"{key} was asked to be {value}")


def test_search_takes_every_word() -> None:
    parameters = (PARAM, PARAM._replace(key="guard.speed", group="guard", description="how fast"))
    assert found("how FAR", parameters) == ["a.b"]
    assert found("how", parameters) == ["a.b", "guard.speed"] and found("how not", parameters) == []
    assert group_of(PARAM._replace(group="joints.neck_yaw.more")) == "joints.neck_yaw"
    assert group_of(PARAM._replace(group="")) == "rig"


def test_orders_survive_the_way_of_the_page() -> None:
    order = Jog((("neck_yaw", 0.25),))
    data = parse_request(
        request_message("7", json.dumps(as_json(order), separators=(",", ":")).encode())
    )[1]
    assert from_json(json.loads(data)) == order
    assert News((), None, False).others == ()


def test_who_searches_before_the_parameters_have_come_finds_them_then() -> None:
    widgets, mouth = Widgets(), Mouth()
    state = ParamState(widgets, widgets.panel("tune"), mouth)  # type: ignore[arg-type]
    client = widgets.join("browser 1", lambda: None).name
    find = next(one for one in widgets._widgets.values() if one.props.get("label") == "find")
    find.arrived("how far", client)
    assert sliders(widgets) == []
    state.params([PARAM._asdict()])
    state.values({"values": {"a.b": 3.0}, "unsaved": ["a.b"], "path": "/rigs/mine.yaml"})
    (slider,) = sliders(widgets)
    assert slider.value == 3.0 and slider.label == "● a.b (deg)"
    slider.arrived(4.0, client)
    assert mouth.parse_request == [({"do": "set", "changes": {"a.b": 4.0}}, f"{client}:tuning")]
    state.values({"values": {"a.b": 3.5}, "unsaved": []})
    assert slider.value == 4.0  # not yet answered: it stays where the hand has put it
    state.answered(f"{client}:tuning")
    assert slider.value == 3.5 and slider.label == "a.b (deg)"


def sliders(widgets: Widgets) -> list[Slider]:
    return [one for one in widgets._widgets.values() if isinstance(one, Slider)]
