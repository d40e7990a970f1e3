"""A person at a browser and a simulated rig: see it, stop, look, move joints, tune; no one else.

The rig ticks in simulated time, slower than real, so that it leaves the processor to the
browser.
"""

from collections.abc import Iterator
from math import degrees
from typing import Any, cast

import cv2
import numpy as np
import pytest
from browser import RARE_DRAWING, Browser, browsing
from desk import GAZE_JOINTS, LIDS
from msgspec import structs
from page_person import (
    STOP,
    UNHURRIED_FRAMES,
    Person,
    Rig,
    beside,
    resumed,
    running,
    saying,
)
from present import present
from shown_page import wait_for

from gazerig.robot.model.commands import Ask, Jog, LookAt, LookAtPixel, Play


@pytest.fixture(scope="module")
def tab() -> Iterator[Browser]:
    # Only one test judges pixels of the scene.
    with browsing((1000, 700), RARE_DRAWING) as tab:
        yield tab


@pytest.fixture(scope="module")
def opened(tab: Browser) -> Iterator[tuple[Rig, Person]]:
    """Return a rig, and a person who has opened its page."""
    with running() as (rig, url):
        tab.go(url)
        person = Person(tab)
        wait_for(lambda: person.reads("STOP", "Steer"), "the page")
        person.open("Steer")
        wait_for(lambda: person.reads("behaviour", "joints", "neck yaw"), "the controls")
        # On a rig that may be real the pointer takes control only on request.
        assert person.run(POINTER_ON) is False
        yield rig, person


@pytest.fixture
def at_the_rig(opened: tuple[Rig, Person]) -> tuple[Rig, Person]:
    """Return both, the rig not stopped: a rig left stopped by a test would fail all others."""
    rig, person = opened
    if rig.robot.stopped:
        resumed(rig, person)
    return rig, person


PANEL_PX = 370
POINTER = "document.querySelector('#pointer')"
POINTER_ON = f"{POINTER}.getAttribute('aria-pressed') === 'true'"


def irises(tab: Browser) -> np.ndarray | None:
    """Pixels (n, 2) of the rig's blue irises, the only strong blue left of the panel."""
    png = np.frombuffer(tab.photograph(), np.uint8)
    scene = present(cv2.imdecode(png, cv2.IMREAD_COLOR))[60:600, : tab.width_px - PANEL_PX]
    blue, green, red = (scene[..., channel].astype(int) for channel in range(3))
    seen = np.argwhere((blue > red + 70) & (blue > green + 20))
    return seen if len(seen) > 30 else None


def test_the_page_shows_a_head_that_turns_and_asks_no_other_site(at_the_rig):
    rig, person = at_the_rig
    loading = "document.querySelector('#stage').classList.contains('loading')"
    draw = "document.querySelector('#view').contentWindow.drawScene = {}"
    person.open("Watch")
    wait_for(lambda: not person.run(loading), "the head")
    with rig.hurrying():
        wait_for(lambda: person.reads("looks at person ", "fixate"), "the words")
    person.open("Health")
    wait_for(lambda: person.reads("bus ok", "guard: ok", "neck yaw"), "the health")
    assert not person.reads("faces by")  # no picture is searched in a computed scene
    person.run(draw.format("true"))

    def elsewhere() -> bool:
        seen = irises(person.tab)
        return seen is not None and bool(np.linalg.norm(seen.mean(axis=0) - before) > 4.0)

    def turn(yaw_rad: float) -> None:
        """Turn the head, with open eyes straight ahead."""
        eyes = {name: 0.0 for name in GAZE_JOINTS if "eye" in name}
        pose = eyes | dict.fromkeys(LIDS, 0.2) | {"neck_yaw": yaw_rad}
        rig.robot.command(Jog(tuple(pose.items()), stay=True))
        with rig.hurrying():
            wait_for(lambda: abs(rig.desired_deg() - degrees(yaw_rad)) < 0.1, "the turn")

    turn(-0.3)
    before = wait_for(lambda: irises(person.tab), "the rig's eyes").mean(axis=0)
    turn(0.2)
    wait_for(elsewhere, "the turn of the head on the page")
    person.run(draw.format("false"))
    rig.robot.command(Jog(()))
    here = rig.address.partition("?")[0]
    own = (here, here.replace("http", "ws", 1), "data:", f"blob:{here}")
    assert [asked for asked in person.tab.asked_for if not asked.startswith(own)] == []
    assert any(asked.startswith(here) for asked in person.tab.asked_for)


def test_stop_and_the_space_bar_take_the_torque_off_until_it_is_asked_back(at_the_rig):
    rig, person = at_the_rig
    person.click(STOP)
    wait_for(lambda: "STOP was pressed on the page (browser " in rig.robot.stopped, "the stop")
    wait_for(lambda: present(rig.newest).guard_result.level == "torque_off", "torque off")
    wait_for(lambda: person.reads("Torque is off", "Resume"), "the words")
    resumed(rig, person)
    person.open("Tune")
    before = len(rig.orders)
    field = beside("save as", "input")
    person.fill(field, "my")
    person.space()
    person.type("head")
    person.wait_for_frames(UNHURRIED_FRAMES)
    assert person.run(f"{field}.value") == "my head"
    assert not rig.robot.stopped and rig.orders[before:] == []
    # On a button in focus a space would press it; here it stops, and nothing else.
    person.run(f"{field}.select(); {field}.blur(); {saying('save')}.focus()")
    person.space()
    wait_for(lambda: "the space bar was pressed on the page (" in rig.robot.stopped, "the stop")
    wait_for(lambda: len(rig.orders) > before, "the tick that obeyed")
    assert len(rig.orders) == before + 1
    resumed(rig, person)


def test_a_slider_moves_the_wish_of_its_joint(at_the_rig):
    rig, person = at_the_rig
    person.open("Steer")
    slider = beside("neck yaw", "input[type=range]")

    def moved() -> bool:  # again, if the panels were still being built and the slider went aside
        person.clicked(slider, 0.8)  # of -70..70, within half of the thumb's width
        person.wait_for_frames(UNHURRIED_FRAMES)
        return abs(rig.desired_deg() - 46.0) < 8.0

    wait_for(moved, "the wish")

    def shown_deg() -> float:
        return float(cast(str, person.run(f"{slider}.value")))

    wait_for(lambda: abs(shown_deg() - rig.desired_deg()) < 0.2, "the slider and the wish agreeing")
    person.click(saying("look freely"))
    wait_for(
        lambda: structs.replace(cast(Any, rig.orders[-1]), who="") == LookAt(None),
        "the rig being let go",
    )
    assert cast(Any, rig.orders[-1]).who.startswith("browser ")


def test_buttons_ask_and_the_picture_leads(at_the_rig):
    rig, person = at_the_rig
    person.open("Talk")
    person.click(saying("listen"))
    # Of all orders: the pointer on its way gives orders, too.
    wait_for(lambda: Ask("conversation", "listen") in rig.orders, "the conversation")
    person.click(saying("nod", "#moves button"))
    wait_for(lambda: isinstance(rig.orders[-1], Play), "the track")
    person.click("document.querySelector('#camera canvas')", 0.2)
    wait_for(lambda: isinstance(rig.orders[-1], LookAtPixel), "the click in the picture")
    assert rig.orders[-1].captured_s is not None
    wait_for(lambda: present(rig.newest).target.kind == "puppet", "the head being led")
    wait_for(lambda: person.reads("makes it look at"), "the headline")
    person.open("Steer")
    person.click(saying("look freely"))
    wait_for(lambda: present(rig.newest).target.kind != "puppet", "the head being free")


def test_a_parameter_is_changed_marked_and_put_back(at_the_rig):
    rig, person = at_the_rig
    key = "gaze.lids.blinks_per_min"
    before = rig.tuning.get()[key]
    person.open("Tune")
    person.fill(beside("blinks", "input[type=number]"), "25")
    person.run(f"{beside('blinks', 'input[type=number]')}.blur()")
    wait_for(lambda: rig.tuning.get()[key] == 25, "the value in force")
    with rig.hurrying():
        wait_for(lambda: person.reads("● blinks", "1 not saved"), "the mark")
        person.click(saying("revert to the file"))
        wait_for(lambda: rig.tuning.get()[key] == before, "what the file says")
        wait_for(lambda: person.reads("all saved"), "no mark")
