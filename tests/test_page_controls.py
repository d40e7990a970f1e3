"""Actions on the page reach the rig: menus, joints, parameters; and its answers return."""

import json
import socket
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from math import radians
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from desk import GAZE_JOINTS
from page_visitor import PATIENCE_S
from shown_page import PARAM, SNAPSHOT, wait_for
from six_joints import SIX, of_six
from stand_in import StandIn

from gazerig.config.parameters import parameters, values
from gazerig.config.schema import load_rig
from gazerig.gaze.types import Vec3
from gazerig.robot.control.command_handler import to_plain
from gazerig.robot.dashboard.feed.live_feed import LiveFeed, News, read_waiting
from gazerig.robot.dashboard.feed.page_process import (
    ALL_USERS,
    CHOICES,
    MESSAGE,
    PARAMS,
    VALUES,
    PageProcess,
)
from gazerig.robot.dashboard.feed.publisher import ParamFeed
from gazerig.robot.dashboard.panels.controls import (
    ESTIMATED,
    FirstMenus,
    GazeTargetPanel,
    JogPanel,
    estimated_joints_note,
)
from gazerig.robot.dashboard.panels.param_panel import (
    ALL,
    FIRST,
    ParamControl,
    ParamPanels,
    fits_slider,
    format_value,
    param_group,
    param_label,
    param_tooltip,
    parse_value,
    search_params,
    slider_step,
)
from gazerig.robot.dashboard.requests.inbox import (
    MESSAGE_BYTES,
    REQUEST,
    Inbox,
    is_superseded,
    is_urgent,
    parse_request,
    request_message,
)
from gazerig.robot.dashboard.requests.outbox import Outbox
from gazerig.robot.dashboard.requests.page_requests import PAGE, PageRequestHandler
from gazerig.robot.dashboard.widgets.widget import Slider, TextField
from gazerig.robot.dashboard.widgets.widgets import Container, Widgets
from gazerig.robot.model.command_json import as_json, from_json
from gazerig.robot.model.commands import Ask, Command, Jog, LookAt, Stop, Value
from gazerig.robot.model.parameter import JsonValue, Parameter


@contextmanager
def linked(
    hear: Callable[[dict[str, object]], str | None] | None = None,
) -> Iterator[tuple[PageProcess, socket.socket]]:
    """A page's rig side and the socket that its process would hold."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    page = PageProcess("127.0.0.1", 8080, hear)
    page.join(ours)
    with theirs:
        yield page, theirs
        page.close()


def sent(theirs: socket.socket) -> tuple[bytes, Any]:
    """The next message to the page: its kind, and what its JSON holds."""
    message = theirs.recv(MESSAGE_BYTES)
    return message[:1], json.loads(message[1:])


# --- over the socket ------------------------------------------------------------------------


def test_what_is_asked_is_heard_and_answered() -> None:
    heard: list[dict[str, object]] = []

    def hear(data: dict[str, object]) -> str | None:
        heard.append(data)
        return "refused: too far" if "pick" in data else None

    with linked(hear) as (_, theirs):
        teller = Outbox(theirs)
        assert teller.command(Ask("behaviour", "guard"), "7")
        assert sent(theirs) == (MESSAGE, ["7", None])
        assert teller.ask({"pick": {"x": 0.5, "y": 0.5}}, "8:tuning")
        assert sent(theirs) == (MESSAGE, ["8:tuning", "refused: too far"])
        assert heard == [as_json(Ask("behaviour", "guard")), {"pick": {"x": 0.5, "y": 0.5}}]


def test_a_request_that_goes_wrong_leaves_ears_for_a_stop() -> None:
    heard: list[object] = []

    def hear(data: dict[str, object]) -> str | None:
        if "do" not in data:
            raise RuntimeError("a fault in this program")
        heard.append(data["do"])
        return None

    with linked(hear) as (_, theirs):
        teller = Outbox(theirs)
        teller.ask({"pick": {}}, "7")
        kind, (who, words) = sent(theirs)
        assert (kind, who) == (MESSAGE, "7") and "a fault in this program" in words
        theirs.send(request_message("7", b'{"do": no JSON'))
        theirs.send(REQUEST + b"7 no JSON either")
        teller.command(Stop("a test"), "7")
        wait_for(lambda: heard == ["stop"], "the stop")


def test_a_stop_does_not_wait_behind_what_takes_long() -> None:
    done, heard = threading.Event(), []

    def hear(data: dict[str, object]) -> str | None:
        if data["do"] == "revert":
            assert done.wait(PATIENCE_S)
        heard.append(data["do"])
        return None

    with linked(hear) as (_, theirs):
        teller = Outbox(theirs)
        teller.ask({"do": "revert"}, "7")
        teller.command(Stop("a test"), "7")
        wait_for(lambda: bool(heard), "the stop")
        assert heard == ["stop"]
        done.set()
        wait_for(lambda: heard == ["stop", "revert"], "the rest")


def test_of_a_slider_that_is_dragged_the_last_word_counts() -> None:
    go_on, values = threading.Event(), []

    def hear(data: dict[str, object]) -> str | None:
        assert go_on.wait(PATIENCE_S)
        values.append(data)
        return None

    with linked(hear) as (_, theirs):
        teller = Outbox(theirs)
        for value in range(50):
            teller.ask({"do": "set", "changes": {"gaze.head.lag_ms": value}}, "7")
        teller.ask({"do": "save", "path": None}, "7")
        time.sleep(0.3)
        go_on.set()
        wait_for(lambda: {"do": "save", "path": None} in values, "the last request")
    assert values[-2] == {"do": "set", "changes": {"gaze.head.lag_ms": 49}}
    assert len(values) < 10


def test_only_the_same_change_by_the_same_person_is_overtaken() -> None:
    def change(who: str, key: str) -> bytes:
        return request_message(who, b'{"do":"set","changes":{"%s":1}}' % key.encode())

    assert is_superseded(change("7", "a"), change("7", "a"))
    assert not is_superseded(change("7", "a"), change("8", "a"))
    assert not is_superseded(change("7", "a"), change("7", "b"))
    assert not is_superseded(request_message("7", b'{"do":"save","path":null}'), change("7", "a"))
    assert parse_request(request_message("7:tuning", b'{"a":"b c"}')) == (
        "7:tuning",
        b'{"a":"b c"}',
    )
    assert is_urgent(request_message("7", b'{"do":"stop","why":""}'))
    assert not is_urgent(request_message("7", b'{"do":"revert"}'))


def test_answers_wait_until_the_page_has_room() -> None:
    with linked(lambda data: "x" * 15_000) as (page, theirs):
        for number in range(40):
            Outbox(theirs).command(Ask("behaviour", str(number)), str(number))
        said = []
        wait_for(lambda: len(page._pending_replies) > 0, "a full socket")
        for _ in range(40):
            said.append(sent(theirs)[1][0])
            page._flush_replies()
        assert said == [str(number) for number in range(40)]


def test_a_rig_that_takes_nothing_holds_up_nobody() -> None:
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with ours, theirs:
        teller = Outbox(theirs)
        taken = [teller.ask({"pick": "x" * 10_000}, "7") for _ in range(300)]
        assert taken[0] and not taken[-1]
        assert not teller.ask({"pick": "x" * MESSAGE_BYTES}, "7")
    assert not teller.command(Stop("a test"), "7")  # the rig is gone


def test_words_menus_and_their_way() -> None:
    with linked() as (page, theirs):
        page.offer({"behaviour": ("wait", "guard")})
        page.say("the disk is full")
        news = read_waiting(theirs, LiveFeed())
    assert news.others == (
        (CHOICES, {"behaviour": ["wait", "guard"]}),
        (MESSAGE, [ALL_USERS, "the disk is full"]),
    )


def test_the_ear_tells_once_that_the_page_is_gone() -> None:
    lost: list[bool] = []
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    ours.setblocking(False)
    with ours:
        ear = Inbox(ours, lambda message: None, lambda: lost.append(True))
        theirs.close()
        wait_for(lambda: bool(lost), "the end")
        ear.close()
        assert lost == [True]


# --- what the rig makes of it -----------------------------------------------------------------


class Refused(Exception):
    """As the tuning refuses."""


class Saved(NamedTuple):
    path: Path
    backup: Path | None
    changes: tuple[object, ...] = ()


class OneParam(StandIn):
    """The parameters of a rig that has one."""

    path = Path("/rigs/mine.yaml")
    character_name = "none"

    def __init__(self) -> None:
        self.version = 0
        self.value: Value = 1.0
        self.saved_as: Path | None = None

    def set(self, changes: Mapping[str, Value]) -> tuple[str, ...]:
        if changes.get("a.b") == 99:
            raise Refused("a.b: 99 is above 10")
        self.value = changes["a.b"]
        self.version += 1
        return ("a.b = 2", "a.c = 3 (next start: it is so)")

    def save(self, path: Path | None = None) -> Saved:
        self.saved_as = path
        return Saved(path or self.path, Path("/rigs/mine.yaml.1"))

    def revert(self) -> tuple[str, ...]:
        self.value = 1.0
        return ()

    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(PARAM._replace(key=f"a.{n}") for n in range(100))

    def values(self) -> dict[str, Value]:
        return {f"a.{n}": (1.0, 2.0) for n in range(99)} | {"a.b": self.value}

    def unsaved(self) -> tuple[object, ...]:
        return ()

    def changed_from_defaults(self) -> tuple[object, ...]:
        return ()

    def characters(self) -> tuple[str, ...]:
        return ("none", "calm")

    def apply_character(self, name: str) -> tuple[str, ...]:
        raise Refused(f"unknown character {name}")

    def get(self, prefix: str) -> dict[str, Value]:
        return self.values()


class Heard(NamedTuple):
    hear: PageRequestHandler
    orders: list[Command]
    tuning: OneParam
    saved: list[Path]


@pytest.fixture
def heard() -> Heard:
    orders: list[Command] = []
    saved: list[Path] = []
    tuning = OneParam()

    def point(x: float, y: float) -> Vec3 | None:
        return (1.0, x, y) if x < 0.9 else None

    hear = PageRequestHandler(
        orders.append,
        tuning,
        point,
        steer=lambda way: f"went {way}",
        refusals=(Refused,),
        saved=saved.append,
    )
    return Heard(hear, orders, tuning, saved)


def test_orders_are_obeyed(heard: Heard) -> None:
    for order in (Stop("a test"), LookAt(None), Jog((("neck_yaw", 0.1),))):
        assert heard.hear(json.loads(json.dumps(as_json(order)))) is None
        assert heard.orders[-1] == order._replace(who=PAGE)
    named = Stop("a test", "browser 3")
    assert heard.hear(json.loads(json.dumps(as_json(named)))) is None
    assert heard.orders[-1] == named


def test_what_is_no_order_is_refused_with_the_rule(heard: Heard) -> None:
    words = heard.hear({"do": "jog", "angles_rad": [["the tail", 0.1]]})
    assert words is not None and words.startswith("refused: 'the tail' is not a joint name")
    unchecked = {"do": "tune", "changes": [["guard.max_speed", 1e9]]}
    words = heard.hear(unchecked)
    assert words is not None and words.startswith("refused") and heard.orders == []
    for nonsense in ({}, {"pick": {"x": "1"}}, {"tune": 3}):
        words = heard.hear(nonsense)
        assert words is not None and words.startswith("refused")


def test_a_click_in_the_picture_is_looked_at(heard: Heard) -> None:
    assert heard.hear({"pick": {"x": 0.5, "y": 1}}) is None
    assert heard.orders == [LookAt((1.0, 0.5, 1.0), PAGE)]
    words = heard.hear({"pick": {"x": 0.95, "y": 0.5}})
    assert words is not None and "no camera image" in words


def test_parameters_are_put_in_force_or_refused(heard: Heard) -> None:
    words = heard.hear({"do": "set", "changes": {"a.b": [1, 2]}})
    assert heard.tuning.value == (1, 2)
    assert words == "a.c = 3 (next start: it is so)"  # what did work is seen in the controls
    assert heard.hear({"do": "set", "changes": {"a.b": 99}}) == "refused: a.b: 99 is above 10"
    assert heard.hear({"do": "character", "name": "mad"}) == "refused: unknown character mad"
    assert heard.hear({"do": "revert"}) is not None and heard.tuning.value == 1.0
    assert heard.hear({"steer": "left"}) == "went left"


def test_saving_says_where(heard: Heard) -> None:
    words = heard.hear({"do": "save", "path": None})
    assert words == "saved in /rigs/mine.yaml, what was there is in /rigs/mine.yaml.1"
    assert heard.tuning.saved_as is None and heard.saved == [Path("/rigs/mine.yaml")]
    heard.hear({"do": "save", "path": "~/other.yaml"})
    assert heard.tuning.saved_as == Path.home() / "other.yaml"
    words = heard.hear({"do": "save", "path": "other.yaml"})
    assert words is not None and "absolute path" in words and len(heard.saved) == 2


def test_the_feed_tells_all_once_and_then_what_changed() -> None:
    tuning, sent, room = OneParam(), [], [5]

    def send(message: bytes) -> bool:
        assert len(message) < MESSAGE_BYTES
        if room[0] == 0:
            return False
        room[0] -= 1
        sent.append((message[:1], json.loads(message[1:])))
        return True

    feed = ParamFeed(send, tuning)
    feed.step()
    assert len(sent) == 5  # the page was full; nothing is lost
    room[0] = 100
    feed.step()
    keys = [param["key"] for kind, data in sent if kind == PARAMS for param in data]
    assert keys == [f"a.{n}" for n in range(100)]
    values = {k: v for kind, d in sent if kind == VALUES for k, v in d["values"].items()}
    assert len(values) == 100 and values["a.0"] == [1.0, 2.0]
    before = len(sent)
    feed.step()
    assert len(sent) == before
    tuning.set({"a.b": 5.0})
    feed.step()
    ((kind, state),) = sent[before:]
    assert (kind, state["values"], state["path"]) == (VALUES, {"a.b": 5.0}, "/rigs/mine.yaml")


# --- Controls of the page: menus, joints and parameters, in every browser


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
    lead = GazeTargetPanel(place, Scene(), mouth, lambda: freed.append(True))  # type: ignore[arg-type]
    lead.offer("behaviour", ["wait", "guard"])
    lead.offer("steer", ["left", "right"])
    lead.add_characters(["none", "calm"], "none")
    lead.menus["behaviour"].receive_input("guard", WHO)
    lead.menus["steer"].receive_input("left", WHO)
    lead.menus["character"].receive_input("calm", WHO)
    lead.free.receive_input("look freely", WHO)
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
    view.update_ranges(ends)
    return view, mouth


def test_every_joint_has_a_slider_with_its_limits(place: Container) -> None:
    view, _ = jogging(place)
    assert tuple(view.sliders) == GAZE_JOINTS
    assert {slider.ends for slider in view.sliders.values()} == {(-30.0, 40.0)}
    view.update_ranges({"joints.neck_yaw.min_deg": -10.0, "joints.neck_yaw.max_deg": 10.0})
    assert view.sliders["neck_yaw"].ends == (-10.0, 10.0)


def test_a_slider_jogs_and_then_follows_its_joint(place: Container) -> None:
    view, mouth = jogging(place)
    slider = view.sliders["neck_yaw"]
    yaw = GAZE_JOINTS.index("neck_yaw")
    view.show(replace(SNAPSHOT, t_s=1.0))
    assert (
        slider.value == pytest.approx(5.7) and mouth.parse_request == []
    )  # 0.1 rad, without a request
    slider.receive_input(20.0, WHO)
    assert mouth.parse_request == [(Jog((("neck_yaw", radians(20.0)),)), WHO)]

    def wished(t_s: float, desired_deg: float, stopped: str = "") -> float:
        desired = tuple(radians(desired_deg) if i == yaw else 0.1 for i in range(9))
        view.show(replace(SNAPSHOT, t_s=t_s, desired_rad=desired, stopped=stopped))
        return float(slider.value)

    assert wished(1.1, 6.0) == 20.0  # not yet obeyed
    assert wished(1.2, 20.0) == 20.0  # executed; the joint is still moving
    assert wished(5.0, 20.0) == 20.0
    assert wished(5.2, -3.0) == 20.0
    assert wished(5.8, -3.0) == pytest.approx(5.7)  # another person released it
    slider.receive_input(20.0, WHO)
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
    view.update_ranges(rig)
    assert tuple(view.sliders) == SIX
    lid = view.sliders["left_lower_lid"]
    assert lid.ends == tuple(rig[f"joints.left_lower_lid.{e}_deg"] for e in ("min", "max"))
    view.show(of_six(SNAPSHOT))
    assert view.sliders["eyes_pan"].value == pytest.approx(20.0)
    lid.receive_input(5.0, WHO)
    assert mouth.parse_request == [(Jog((("left_lower_lid", radians(5.0)),)), WHO)]
    view.show(SNAPSHOT)  # of another rig: nothing to follow, and nothing breaks


# --- parameters ---------------------------------------------------------------------------------


def test_a_parameter_is_read_as_the_rig_writes_it() -> None:
    data = {**PARAM._asdict(), "choices": [1, -1], "length": None, "items": None}
    assert Parameter.from_json(json.loads(json.dumps(data))) == PARAM._replace(choices=(1, -1))


def test_a_hint_says_all_there_is_to_know() -> None:
    words = param_tooltip(PARAM._replace(choices=("a", "b")))
    for part in ("a.b", "how far", "0 to 10 deg", "a, b", "default 1.0 deg", "next tick"):
        assert part in words
    assert param_label(PARAM, True) == "● a.b (deg)" and param_label(PARAM, False) == "a.b (deg)"


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
    assert parse_value(param, format_value(param, value)) == value


def test_what_cannot_be_read_is_refused_with_an_example() -> None:
    with pytest.raises(ValueError, match=r"a\.b: '1,5' is no number; write it like 1\.0"):
        parse_value(PARAM, "1,5")
    assert parse_value(PARAM._replace(optional=True), "null") is None


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
        json.dumps([to_plain(param._asdict()) for param in parameters(rig, load_rig("desk"))])
    )
    places = [Parameter.from_json(data) for data in sent]
    assert {param.key for param in places} == set(now)
    refused: list[str] = []
    for param in places:
        value = json.loads(json.dumps(to_plain(now[param.key])))
        control = ParamControl(place, param, value, False, ignore, refused.append, 0.0)
        control.show(value, True)
        assert param_tooltip(param).startswith(param.key)
        if isinstance(control.field, TextField):
            texts[param.key] = control.field.value
            assert parse_value(param, texts[param.key]) == value
        elif isinstance(control.field, Slider):
            assert control.field.check_value(control.field.value) == value
        control.remove()
    if name == "maker":
        assert texts["joints.eyes_pan.transmission_points"].startswith("[[-32.0, 1068.0], [")
        linkage = next(
            param for param in places if param.key == "joints.eyes_pan.transmission_points"
        )
        assert "next start" in param_tooltip(linkage) and "default" not in param_tooltip(linkage)
    assert refused == []


def ignored(words: str) -> None:
    raise AssertionError(words)


def ignore(key: str, value: object) -> None:
    """A control that is only looked at asks for nothing."""
    raise AssertionError(f"{key} was asked to be {value}")


def test_search_takes_every_word() -> None:
    parameters = (PARAM, PARAM._replace(key="guard.speed", group="guard", description="how fast"))
    assert search_params("how FAR", parameters) == ["a.b"]
    assert (
        search_params("how", parameters) == ["a.b", "guard.speed"]
        and search_params("how not", parameters) == []
    )
    assert param_group(PARAM._replace(group="joints.neck_yaw.more")) == "joints.neck_yaw"
    assert param_group(PARAM._replace(group="")) == "rig"


def test_orders_survive_the_way_of_the_page() -> None:
    order = Jog((("neck_yaw", 0.25),))
    data = parse_request(
        request_message("7", json.dumps(as_json(order), separators=(",", ":")).encode())
    )[1]
    assert from_json(json.loads(data)) == order
    assert News((), None, False).others == ()


def test_who_searches_before_the_parameters_have_come_finds_them_then() -> None:
    widgets, mouth = Widgets(), Mouth()
    state = ParamPanels(widgets, widgets.panel("tune"), mouth)  # type: ignore[arg-type]
    client = widgets.join("browser 1", lambda: None).name
    find = next(one for one in widgets._widgets.values() if one.props.get("label") == "find")
    find.receive_input("how far", client)
    assert sliders(widgets) == []
    state.add_params([PARAM._asdict()])
    state.update_values({"values": {"a.b": 3.0}, "unsaved": ["a.b"], "path": "/rigs/mine.yaml"})
    (slider,) = sliders(widgets)
    assert slider.value == 3.0 and slider.label == "● a.b (deg)"
    slider.receive_input(4.0, client)
    assert mouth.parse_request == [({"do": "set", "changes": {"a.b": 4.0}}, f"{client}:tuning")]
    state.update_values({"values": {"a.b": 3.5}, "unsaved": []})
    assert slider.value == 4.0  # not yet answered: it stays at the place of the hand
    state.record_answer(f"{client}:tuning")
    assert slider.value == 3.5 and slider.label == "a.b (deg)"


def test_tune_opens_with_eight_controls_and_a_fold_with_all() -> None:
    widgets, mouth = Widgets(), Mouth()
    tune, freed = widgets.panel("tune"), []
    menus = FirstMenus(tune, mouth, lambda choice, who: freed.append((choice, who)))  # type: ignore[arg-type]
    state = ParamPanels(widgets, tune, mouth)  # type: ignore[arg-type]
    client = widgets.join("browser 1", lambda: None).name
    for name in ("lids", "conversation", "behaviour", "character"):
        menus.offer(name, ["wait", "guard"])
    rig = load_rig("desk")
    known = {param.key: param for param in parameters(rig, rig)}
    state.add_params([known[key]._asdict() for key in FIRST])
    state.update_values({"values": {key: known[key].default for key in FIRST}, "unsaved": []})
    elements = [one.props for one in widgets._widgets.values() if one.props["in"] == "tune"]
    (fold,) = (one for one in elements if one.get("title") == ALL)
    assert fold["open"] is False
    shown = [(one["order"], one["label"]) for one in elements if one is not fold]
    assert max(shown)[0] < fold["order"]  # type: ignore[operator]
    assert [name for _, name in sorted(shown)] == [
        "target", "liveliness", "time on the eyes", "blinks", "head share", "conversation",
        "activity", "character",
    ]  # fmt: skip
    menus.menus["conversation"].receive_input("guard", WHO)
    menus.menus["character"].receive_input("wait", WHO)
    menus.target.receive_input("look straight ahead", WHO)
    menus.target.receive_input("look freely", WHO)
    blinks = next(one for one in sliders(widgets) if one.label.startswith("blinks"))
    blinks.receive_input(30.0, client)
    assert mouth.parse_request == [
        (Ask("conversation", "guard"), WHO),
        ({"do": "character", "name": "wait"}, WHO),
        (LookAt(FirstMenus.AHEAD_M, stay=True), WHO),
        ({"do": "set", "changes": {"gaze.lids.blinks_per_min": 30.0}}, f"{client}:tuning"),
    ]
    assert freed == [("look freely", WHO)]
    state.update_values({"values": {"gaze.lids.blinks_per_min": 40.0}, "unsaved": []})
    state.record_answer(f"{client}:tuning")
    assert blinks.value == 40.0


def sliders(widgets: Widgets) -> list[Slider]:
    return [one for one in widgets._widgets.values() if isinstance(one, Slider)]
