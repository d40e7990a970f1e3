"""The panels at the page's door: who may see them, what a flood costs, and a person at them."""

import json
import threading
import time
from collections.abc import Iterator
from typing import Any

import cv2
import numpy as np
import pytest
from browser import RARE_DRAWING, browsing
from page_at_the_door import ELSEWHERE, PATIENCE_S, Rig, opened
from page_person import Person, beside
from shown_page import wait_for
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.connection import Connection

from gazerig.robot.dashboard.widgets.widgets import RECEIVED_BYTES

PANELS = "/rig/panels"


@pytest.fixture(scope="module")
def near() -> Iterator[Rig]:
    with opened("127.0.0.1") as rig:
        yield rig


def said(there: Connection) -> dict[str, Any]:
    """The next message of text."""
    while True:
        message = there.recv(timeout=PATIENCE_S)
        if isinstance(message, str):
            data: dict[str, Any] = json.loads(message)
            return data


@pytest.mark.parametrize(
    "wrong", [{"origin": ELSEWHERE}, {"origin": None}, {"Cookie": "gazerig=no"}, {"Cookie": ""}]
)
def test_the_panels_are_for_those_who_may_come_in(near: Rig, wrong: dict[str, str | None]) -> None:
    with pytest.raises(InvalidStatus) as refused:
        near.knock(PANELS, **wrong)
    assert refused.value.response.status_code == 403


def test_what_is_shown_comes_and_what_is_done_is_heard(near: Rig) -> None:
    widgets = near.door.widgets
    heard: list[object] = []
    panel = widgets.panel("health")
    slider = panel.slider("neck", (-10.0, 10.0), 0.1, 0.0)
    slider.on_change(lambda value, client: heard.append((value, widgets.browser(client))))
    image = panel.image("heat map")
    ana = f"{near.cookie}; {near.door._name_cookie}=ana"
    with near.knock(PANELS, Cookie=ana) as there:
        numbers = {props["kind"]: number for number, props in said(there)["put"]}
        image.show(b"a picture")
        data = there.recv(timeout=PATIENCE_S)
        assert data == numbers["image"].to_bytes(4, "big") + b"a picture"
        there.send(json.dumps({"set": [numbers["slider"], 4.5]}))
        wait_for(lambda: len(heard) > 0, "the slider")
        assert heard == [(4.5, near.door.browsers.name("ana"))]
        there.send(json.dumps({"set": [numbers["slider"], 99]}))
        assert "goes from -10 to 10" in said(there)["say"][0]["text"]
        there.send("no JSON")
        assert said(there)["say"][0]["refused"] is True
    panel.clear()


def test_a_long_message_ends_its_connection_and_no_other(near: Rig) -> None:
    with near.knock(PANELS) as rude, near.knock(PANELS) as polite:
        rude.send(json.dumps({"set": [1, "x" * RECEIVED_BYTES]}))
        with pytest.raises(ConnectionClosed):
            for _ in range(100):
                rude.recv(timeout=PATIENCE_S)
        near.door.widgets.notify("still here")
        assert said(polite)["say"][0]["text"] == "still here"


def test_a_flood_of_one_browser_does_not_hold_up_a_stop(near: Rig) -> None:
    slider = near.door.widgets.panel("health").slider("neck", (0.0, 1.0), 0.1, 0.0)
    over = threading.Event()
    slider.on_change(lambda value, client: over.wait(0.05))  # as slow as a rig that is busy
    before = len(near.stops)
    with near.knock(PANELS) as there:
        for k in range(600):
            there.send(json.dumps({"set": [slider.place.number, (k % 10) / 10.0]}))
        start_s = time.monotonic()
        assert near.post(b'{"do": "stop", "why": "a test"}')[0] == 204
        assert len(near.stops) == before + 1
        assert time.monotonic() - start_s < 0.5 * PATIENCE_S
        over.set()  # else the browser's farewell waits for the rest of the flood
    slider.remove()


def test_who_leaves_is_forgotten(near: Rig) -> None:
    widgets = near.door.widgets
    gone: list[str] = []
    widgets.on_leave(gone.append)
    with near.knock(PANELS):
        wait_for(lambda: widgets.is_watched, "the browser")
    wait_for(lambda: len(gone) > 0 and not widgets.is_watched, "the end")


# --- a person at a browser ----------------------------------------------------------------


def key(person: Person, name: str, number: int, text: str = "") -> None:
    for kind in ("keyDown", "keyUp"):
        person.tab.ask(
            "Input.dispatchKeyEvent", type=kind, key=name, code=name,
            windowsVirtualKeyCode=number, text=text,
        )  # fmt: skip


def enter(person: Person) -> None:
    key(person, "Enter", 13, "\r")


def test_a_person_types_ticks_and_clicks(near: Rig) -> None:
    widgets = near.door.widgets
    heard: list[object] = []
    steer = widgets.panel("steer")
    slider = steer.slider("neck yaw", (-70.0, 70.0), 0.5, 0.0, hint="moves the joint, slowly")
    slider.on_change(lambda value, client: heard.append(value))
    box = steer.checkbox("drag a target", value=False)
    box.on_change(lambda on, client: heard.append(on))
    typed = steer.text("gains", "[1, 2]")
    typed.on_change(lambda text, client: heard.append(text))
    image = widgets.panel("camera").image("what the camera sees", pick=True)
    field = beside("neck yaw", "input[type=number]")

    def hears(value: object) -> None:
        wait_for(lambda: heard == [value], f"{value}")
        heard.clear()

    with browsing((1100, 760), RARE_DRAWING) as tab:
        person = Person(tab)
        tab.go(f"{near.url}/?token={near.door.token}")
        wait_for(lambda: person.reads("Steer"), "the page")
        person.open("Steer")
        # A number that is still being typed is another number.
        person.fill(field, "45")
        assert heard == []
        enter(person)
        hears(45)
        key(person, "ArrowUp", 38)
        hears(45.5)
        person.fill(field, "-3")
        slider.value = 12.0  # what comes meanwhile does not take the place of what is typed
        person.wait_for_frames(3)
        assert person.run(f"{field}.value") == "-3" and heard == []
        key(person, "Escape", 27)
        assert person.run(f"{field}.value") == "12" and heard == []
        assert person.run("document.querySelector('#drawer').hidden") is False
        person.fill(field, "7")
        person.run(f"{field}.blur()")
        hears(7)
        # A refusal is returned, in words.
        person.fill(field, "500")
        enter(person)
        wait_for(lambda: person.reads("goes from -70 to 70"), "the refusal")
        wait_for(lambda: person.run(f"{field}.value") == "7", "the value in force")
        person.run(f"{beside('drag a target', 'input')}.focus()")
        enter(person)  # the space bar is STOP
        hears(value=True)
        person.fill(beside("gains", "input"), "[3, 4]")
        assert heard == []
        enter(person)
        hears("[3, 4]")
        picked(near, person, image)
    for panel in ("steer", "camera"):
        widgets.panel(panel).clear()


def picked(near: Rig, person: Person, image: Any) -> None:
    """A click in the picture sends its place, also if the picture does not fill its area."""
    image.show(cv2.imencode(".png", np.zeros((100, 200, 3), np.uint8))[1].tobytes())
    element = "document.querySelector('[data-panel=camera] img')"
    wait_for(lambda: person.run(f"{element}?.naturalWidth === 200"), "the picture")
    person.run(f"{element}.style.height = '400px'")
    near.asked.clear()
    person.click(element, 0.25)
    wait_for(lambda: len(near.asked) > 0, "the click")
    assert near.asked[0]["pick"]["x"] == pytest.approx(0.25, abs=0.02)
    assert near.asked[0]["pick"]["y"] == pytest.approx(0.5, abs=0.02)
    mark = "document.querySelector('[data-panel=camera] .mark')"
    focused = f"{element}.focus(); document.hasFocus() && document.activeElement === {element}"
    wait_for(lambda: person.run(focused) is True, "the focus on the picture")
    key(person, "ArrowRight", 39)
    wait_for(lambda: person.run(f"{mark}.hidden === false") is True, "the cross")
    enter(person)
    wait_for(lambda: len(near.asked) > 1, "the cross's place")
    assert near.asked[1]["pick"]["x"] == pytest.approx(0.29, abs=0.02), near.asked
