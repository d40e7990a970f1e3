"""The panels at the page's door: who may see them, what a flood costs, and a person at them."""

import json
import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest
from page_at_the_door import PATIENCE_S, Rig, opened
from shown_page import wait_for
from websockets.sync.connection import Connection

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
        there.send("no JSON")
        assert said(there)["say"][0]["refused"] is True
    slider.remove()
    image.remove()


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


# --- a person at a browser ----------------------------------------------------------------
