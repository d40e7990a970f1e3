"""Actions on the page reach the rig: menus, joints, parameters; and its answers return."""

import json
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from math import radians
from typing import Any, NamedTuple

import msgspec
import pytest
from page_visitor import PATIENCE_S
from shown_page import PARAM, SNAPSHOT, wait_for
from stand_in import StandIn
from test_tuning import Bench

from gazerig.config.load import ConfigError
from gazerig.config.parameters import parameters, values
from gazerig.config.schema import load_rig
from gazerig.gaze.types import Vec3
from gazerig.robot.app.param_store import ParamStore
from gazerig.robot.dashboard.feed.page_process import (
    MESSAGE,
    PARAMS,
    VALUES,
    PageProcess,
)
from gazerig.robot.dashboard.feed.publisher import ParamFeed
from gazerig.robot.dashboard.panels.controls import JogPanel
from gazerig.robot.dashboard.panels.param_panel import (
    ParamControl,
    param_hint,
    parse_value,
)
from gazerig.robot.dashboard.requests.inbox import (
    MESSAGE_BYTES,
    REQUEST,
    request_message,
)
from gazerig.robot.dashboard.requests.outbox import Outbox
from gazerig.robot.dashboard.requests.page_requests import PAGE, PageRequestHandler
from gazerig.robot.dashboard.widgets.widget import TextField
from gazerig.robot.dashboard.widgets.widgets import Container, Widgets
from gazerig.robot.model.commands import Command, Jog, LookAt, Stop
from gazerig.robot.model.parameter import Parameter


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


def test_a_request_that_goes_wrong_leaves_ears_for_a_stop() -> None:
    heard: list[object] = []

    def hear(data: dict[str, object]) -> str | None:
        if "do" not in data:
            raise RuntimeError("a fault in this program")
        heard.append(data)
        return "refused: not now"

    with linked(hear) as (_, theirs):
        teller = Outbox(theirs)
        teller.ask({"pick": {}}, "7")
        kind, (who, words) = sent(theirs)
        assert (kind, who) == (MESSAGE, "7") and "a fault in this program" in words
        theirs.send(request_message("7", b'{"do": no JSON'))
        theirs.send(REQUEST + b"7 no JSON either")
        teller.command(Stop("a test"), "8:tuning")
        wait_for(lambda: heard == [msgspec.to_builtins(Stop("a test"))], "the stop")
        answers = [sent(theirs) for _ in range(3)]
        assert (MESSAGE, ["8:tuning", "refused: not now"]) in answers


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


def test_a_rig_that_takes_nothing_holds_up_nobody() -> None:
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with ours, theirs:
        teller = Outbox(theirs)
        taken = [teller.ask({"pick": "x" * 10_000}, "7") for _ in range(300)]
        assert taken[0] and not taken[-1]
        assert not teller.ask({"pick": "x" * MESSAGE_BYTES}, "7")
    assert not teller.command(Stop("a test"), "7")  # the rig is gone


# --- what the rig makes of it -----------------------------------------------------------------


class Heard(NamedTuple):
    hear: PageRequestHandler
    orders: list[Command]
    tuning: ParamStore


CLOSE = "gaze.lids.close_ms"


@pytest.fixture
def heard() -> Heard:
    orders: list[Command] = []
    tuning = Bench("desk").tuning

    def point(x: float, y: float) -> Vec3 | None:
        return (1.0, x, y) if x < 0.9 else None

    hear = PageRequestHandler(
        orders.append,
        tuning,
        point,
        refusals=(ConfigError,),
    )
    return Heard(hear, orders, tuning)


def test_what_is_no_order_is_refused_with_the_rule(heard: Heard) -> None:
    words = heard.hear({"do": "jog", "angles_rad": [["the tail", "a"]]})
    assert words is not None and words.startswith("refused: Expected `float`")
    unchecked = {"do": "tune", "changes": [["guard.max_speed", 1e9]]}
    words = heard.hear(unchecked)
    assert words is not None and words.startswith("refused") and heard.orders == []
    for nonsense in ({}, {"pick": {"x": "1"}}, {"tune": 3}):
        words = heard.hear(nonsense)
        assert words is not None and words.startswith("refused")


def test_a_click_in_the_picture_is_looked_at(heard: Heard) -> None:
    assert heard.hear({"pick": {"x": 0.5, "y": 1}}) is None
    assert heard.orders == [LookAt((1.0, 0.5, 1.0), who=PAGE)]
    words = heard.hear({"pick": {"x": 0.95, "y": 0.5}})
    assert words is not None and "no camera image" in words


def test_the_feed_tells_all_once_and_then_what_changed(heard: Heard) -> None:
    tuning, sent, room = heard.tuning, [], [5]

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
    assert keys == [param.key for param in tuning.parameters() if param.live == PARAM.live]
    values = {k: v for kind, d in sent if kind == VALUES for k, v in d["values"].items()}
    assert list(values) == keys and values[CLOSE] == 75.0
    before = len(sent)
    feed.step()
    assert len(sent) == before
    tuning.set({CLOSE: 90.0})
    feed.step()
    ((kind, state),) = sent[before:]
    assert (kind, state["values"], state["path"]) == (VALUES, {CLOSE: 90.0}, str(tuning.path))


# --- Controls of the page: menus, joints and parameters, in every browser


@pytest.fixture
def place() -> Container:
    return Widgets().panel("steer")


def test_a_slider_that_was_moved_follows_its_joint_again_after_a_stop(place: Container) -> None:
    asked: list[Command] = []
    outbox: Any = StandIn()
    outbox.command = lambda command, who: asked.append(command)
    view = JogPanel(place, outbox)
    view.update_ranges({"joints.neck_yaw.min_deg": -30, "joints.neck_yaw.max_deg": 40.0})
    slider = view.sliders["neck_yaw"]
    view.show(replace(SNAPSHOT, t_s=1.0))
    assert slider.ends == (-30.0, 40.0) and slider.value == pytest.approx(5.7) and asked == []
    slider.receive_input(20.0, "panels-5")
    assert asked == [Jog((("neck_yaw", radians(20.0)),))]
    view.show(replace(SNAPSHOT, t_s=1.1))
    assert slider.value == 20.0
    view.show(replace(SNAPSHOT, t_s=1.2, stopped="a test"))
    assert slider.value == pytest.approx(5.7)


# --- parameters ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["maker", "feetech", "desk"])
def test_every_live_parameter_of_every_rig_becomes_a_control(place: Container, name: str) -> None:
    rig = load_rig(name)
    now, texts = values(rig), {}
    sent = msgspec.json.encode(parameters(rig, load_rig("desk")))
    places = msgspec.json.decode(sent, type=list[Parameter])
    assert {param.key for param in places} == set(now)
    for param in (one for one in places if one.live == PARAM.live):
        value = json.loads(json.dumps(now[param.key]))
        control = ParamControl(place, param, value, ignore)
        control.show(value, True)
        assert param_hint(param).startswith(param.key)
        if isinstance(control.field, TextField):
            texts[param.key] = control.field.value
            assert parse_value(param, texts[param.key]) == value
        else:
            assert control.field.check_value(control.field.value) == value


def ignore(key: str, value: object, client: str) -> None:
    """A control that is only looked at asks for nothing."""
    raise AssertionError(f"{key} was asked to be {value} by {client}")
