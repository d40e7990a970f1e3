"""Controls of the page: menus, joints and parameters, in every browser."""

import asyncio
import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import radians

import pytest
import viser
from desk import GAZE_JOINTS
from page_visitor import PATIENCE_S
from shown_page import PARAM, SNAPSHOT
from six_joints import SIX, of_six

from gazerig.config.parameters import parameters, values
from gazerig.config.schema import load_rig
from gazerig.robot.control.command_handler import plain
from gazerig.robot.dashboard.control_tabs import LeadView
from gazerig.robot.dashboard.inbox import (
    parse_request,
    request_message,
)
from gazerig.robot.dashboard.jog_panel import ESTIMATED, MEASURED, JogPanel, measured_table
from gazerig.robot.dashboard.page_feed import News
from gazerig.robot.dashboard.param_control import (
    ParamControl,
    hint,
    label,
    read,
    slides,
    step_of,
    written,
)
from gazerig.robot.dashboard.param_panel import found, group_of
from gazerig.robot.model.command_json import as_json, from_json
from gazerig.robot.model.commands import Ask, Command, Jog
from gazerig.robot.remote.param_info import JsonValue, ParamInfo

# --- controls -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def server() -> Iterator[viser.ViserServer]:
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield server
    server.stop()


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


def touch(server: viser.ViserServer, handle: object, value: object) -> None:
    """What viser does when the browser with number 5 sends another value."""
    event = viser.GuiEvent(None, 5, handle)  # type: ignore[type-var]
    handle._impl.value = value  # type: ignore[attr-defined]
    (callback,) = handle._impl.update_cb  # type: ignore[attr-defined]
    asyncio.run_coroutine_threadsafe(callback(event), server._event_loop).result(PATIENCE_S)


def test_menus_become_buttons_that_ask(server: viser.ViserServer) -> None:
    mouth = Mouth()
    tab = server.gui.add_tab_group().add_tab("lead")
    lead = LeadView(server, tab, mouth)  # type: ignore[arg-type]
    lead.offer("behaviour", ["wait", "guard"])
    lead.offer("steer", ["left", "right"])
    lead.characters(["none", "calm"], "none")
    touch(server, lead._menus["behaviour"], "guard")
    touch(server, lead._menus["steer"], "left")
    assert lead._characters is not None
    touch(server, lead._characters, "calm")
    assert mouth.parse_request == [
        (Ask("behaviour", "guard"), "5"),
        ({"steer": "left"}, "5"),
        ({"do": "character", "name": "calm"}, "5"),
    ]
    lead.show(replace(SNAPSHOT, behaviour="<b>"))
    assert "behaviour <b>&lt;b&gt;</b>" in lead._words.content


def jogging(server: viser.ViserServer) -> tuple[JogPanel, Mouth]:
    mouth = Mouth()
    view = JogPanel(server.gui, server.gui.add_tab_group().add_tab("joints"), mouth)  # type: ignore[arg-type]
    ends = {
        f"joints.{j}.{end}_deg": v for j in GAZE_JOINTS for end, v in (("min", -30), ("max", 40.0))
    }
    view.values(ends)
    return view, mouth


def test_every_joint_has_a_slider_with_its_limits(server: viser.ViserServer) -> None:
    view, _ = jogging(server)
    assert tuple(view._sliders) == GAZE_JOINTS
    assert {(s.min, s.max) for s in view._sliders.values()} == {(-30.0, 40.0)}
    view.values({"joints.neck_yaw.min_deg": -10.0, "joints.neck_yaw.max_deg": 10.0})
    assert (view._sliders["neck_yaw"].min, view._sliders["neck_yaw"].max) == (-10.0, 10.0)


def test_a_slider_jogs_and_then_follows_its_joint(server: viser.ViserServer) -> None:
    view, mouth = jogging(server)
    slider = view._sliders["neck_yaw"]
    yaw = GAZE_JOINTS.index("neck_yaw")
    view.show(replace(SNAPSHOT, t_s=1.0))
    assert (
        slider.value == pytest.approx(5.7) and mouth.parse_request == []
    )  # 0.1 rad, and nobody asked
    touch(server, slider, 20.0)
    assert mouth.parse_request == [(Jog((("neck_yaw", radians(20.0)),)), "5")]

    def wished(t_s: float, desired_deg: float, stopped: str = "") -> float:
        desired = tuple(radians(desired_deg) if i == yaw else 0.1 for i in range(9))
        view.show(replace(SNAPSHOT, t_s=t_s, desired_rad=desired, stopped=stopped))
        return float(slider.value)

    assert wished(1.1, 6.0) == 20.0  # not yet obeyed
    assert wished(1.2, 20.0) == 20.0  # obeyed; the joint is still on its way
    assert wished(5.0, 20.0) == 20.0
    assert wished(5.2, -3.0) == 20.0
    assert wished(5.8, -3.0) == pytest.approx(5.7)  # somebody let go elsewhere
    touch(server, slider, 20.0)
    assert wished(5.9, 20.0, "a test") == pytest.approx(5.7)  # a stop lets go at once


def test_the_table_shows_wish_and_measured() -> None:
    table = measured_table(replace(SNAPSHOT, desired_rad=(radians(12.34),) * 9))
    assert table.count("12.3") == 9 and table.count("5.7") == 9 and "neck yaw" in table


def test_what_nobody_measured_has_a_column_of_its_own() -> None:
    assert ESTIMATED not in measured_table(SNAPSHOT)
    table = measured_table(of_six(SNAPSHOT))
    assert f">{ESTIMATED}</td>" in table and f">{MEASURED}</td>" not in table
    assert "eyes pan" in table and "20.0" in table and "neck" not in table
    mixed = measured_table(of_six(SNAPSHOT, SIX[:1]))
    lines = mixed.split("<tr>")
    assert mixed.index(f">{MEASURED}<") < mixed.index(f">{ESTIMATED}<")
    cells = [line.split("<td style='text-align:right'>")[1:] for line in lines[1:]]
    assert [cell.partition("<")[0] for cell in cells[0]] == ["10.0", "", "20.0"]
    assert [cell.partition("<")[0] for cell in cells[1]] == ["11.0", "21.0", ""]


def test_sliders_are_those_of_the_rig(server: viser.ViserServer) -> None:
    mouth = Mouth()
    view = JogPanel(server.gui, server.gui.add_tab_group().add_tab("joints"), mouth)  # type: ignore[arg-type]
    rig = values(load_rig("maker"))
    view.values(rig)
    assert tuple(view._sliders) == SIX
    lid = view._sliders["left_lower_lid"]
    assert (lid.min, lid.max) == tuple(
        rig[f"joints.left_lower_lid.{e}_deg"] for e in ("min", "max")
    )
    view.show(of_six(SNAPSHOT))
    assert view._sliders["eyes_pan"].value == pytest.approx(20.0)
    touch(server, lid, 5.0)
    assert mouth.parse_request == [(Jog((("left_lower_lid", radians(5.0)),)), "5")]
    view.show(SNAPSHOT)  # of another rig: nothing to follow, and nothing breaks


# --- parameters ---------------------------------------------------------------------------------


def test_a_parameter_is_read_as_the_rig_writes_it() -> None:
    data = {**PARAM._asdict(), "choices": [1, -1], "length": None, "items": None}
    assert ParamInfo.from_json(json.loads(json.dumps(data))) == PARAM._replace(choices=(1, -1))
    older = {"says" if name == "description" else name: one for name, one in data.items()}
    assert ParamInfo.from_json(older) == PARAM._replace(choices=(1, -1))


def test_a_hint_says_all_there_is_to_know() -> None:
    words = hint(PARAM._replace(choices=("a", "b")))
    for part in ("a.b", "how far", "0 to 10 deg", "a, b", "default 1.0 deg", "next tick"):
        assert part in words
    assert label(PARAM, True) == "● a.b (deg)" and label(PARAM, False) == "a.b (deg)"


@pytest.mark.parametrize(("low", "high"), [(0.0, 1.0), (-35.0, 35.0), (0.3, 0.7), (10.0, 1e5)])
def test_a_slider_has_some_hundred_round_steps(low: float, high: float) -> None:
    step = step_of(low, high)
    assert 190 <= (high - low) / step <= 501
    assert f"{step:.0e}"[0] in "125"


def test_what_a_slider_cannot_set_finely_is_typed() -> None:
    assert slides(PARAM, 1.0)
    assert not slides(PARAM._replace(high=1e6), 1.0)
    assert not slides(PARAM, 11.0)
    assert not slides(PARAM._replace(optional=True, default=None), 1.0)
    assert slides(PARAM._replace(optional=True), 1.0)
    assert not slides(PARAM._replace(optional=True), None)
    assert not slides(PARAM._replace(kind="list"), (1.0, 2.0))


@pytest.mark.parametrize(
    ("kind", "value"),
    [("number", 1e-7), ("number", 3.0), ("whole", 7), ("text", "a b"), ("list", [1.0, 2.5])],
)
def test_what_is_written_is_read_again(kind: str, value: JsonValue) -> None:
    param = PARAM._replace(kind=kind, default=value)
    assert read(param, written(param, value)) == value


def test_what_cannot_be_read_is_refused_with_an_example() -> None:
    with pytest.raises(ValueError, match=r"a\.b: '1,5' is no number; write it like 1\.0"):
        read(PARAM, "1,5")
    assert read(PARAM._replace(optional=True), "null") is None


def test_a_slider_makes_room_where_null_comes_into_force(server: viser.ViserServer) -> None:
    param = PARAM._replace(optional=True)
    tab = server.gui.add_tab_group().add_tab("null")
    with tab:
        slider = ParamControl(server.gui, param, 1.0, False, ignore, ignored, 0.0)
        typed = ParamControl(server.gui, param, None, False, ignore, ignored, 1.0)
    assert slider.can_show(2.0) and not slider.can_show(None)
    assert typed.can_show(None) and typed.can_show(2.0)
    typed.show(2.0, False)
    assert typed._handle.value == "2.0"


@pytest.mark.parametrize("name", ["maker", "feetech", "desk"])
def test_every_parameter_of_every_rig_becomes_a_control(
    server: viser.ViserServer, name: str
) -> None:
    rig = load_rig(name)
    now, texts = values(rig), {}
    sent = json.loads(
        json.dumps([plain(param._asdict()) for param in parameters(rig, load_rig("desk"))])
    )
    places = [ParamInfo.from_json(data) for data in sent]
    assert {param.key for param in places} == set(now)
    tab = server.gui.add_tab_group().add_tab(name)
    refused: list[str] = []
    with tab:
        for param in places:
            if param.kind in ("list", "mapping") or param.key.startswith("joints."):
                value = json.loads(json.dumps(plain(now[param.key])))
                control = ParamControl(server.gui, param, value, False, ignore, refused.append, 0.0)
                control.show(value, True)
                assert hint(param).startswith(param.key)
                if control._form is not None:
                    texts[param.key] = str(control._handle.value)
                    assert read(param, texts[param.key]) == value
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
