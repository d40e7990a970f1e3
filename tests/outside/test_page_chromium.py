"""A person at a browser and a simulated rig: stop, look, move joints, tune; no one else.

The rig ticks in simulated time, slower than real, so that it leaves the processor to the
browser.
"""

from collections.abc import Iterator
from typing import Any, cast

import pytest
from browser import RARE_DRAWING, Browser, browsing
from msgspec import structs
from page_person import (
    STOP,
    UNHURRIED_FRAMES,
    Person,
    Rig,
    beside,
    everywhere,
    resumed,
    running,
    saying,
)
from present import present
from shown_page import wait_for

from gazerig.robot.model.commands import Ask, LookAt, LookAtPixel, Play, Stop


@pytest.fixture(scope="module")
def tab() -> Iterator[Browser]:
    # Nothing is judged by the scene's pixels here, and only one test reaches into it.
    with browsing((1100, 760), RARE_DRAWING) as tab:
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


POINTER = "document.querySelector('#pointer')"
POINTER_ON = f"{POINTER}.getAttribute('aria-pressed') === 'true'"


def test_stop_takes_the_torque_off_until_it_is_asked_back(at_the_rig: tuple[Rig, Person]):
    rig, person = at_the_rig
    person.click(STOP)
    wait_for(lambda: "STOP was pressed on the page (browser " in rig.robot.stopped, "the stop")
    wait_for(lambda: present(rig.newest).guard_result.level == "torque_off", "torque off")
    wait_for(lambda: person.reads("Torque is off", "Resume"), "the words")
    resumed(rig, person)


def test_the_space_bar_stops_but_not_while_somebody_types(at_the_rig: tuple[Rig, Person]):
    rig, person = at_the_rig
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


def test_a_slider_moves_the_wish_of_its_joint(at_the_rig: tuple[Rig, Person]):
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


def test_buttons_ask_and_the_picture_leads(at_the_rig: tuple[Rig, Person]):
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


def test_a_parameter_is_changed_marked_and_put_back(at_the_rig: tuple[Rig, Person]):
    rig, person = at_the_rig
    key = "gaze.lids.blinks_per_min"
    before = rig.tuning.get()[key]
    person.open("Tune")
    person.fill(beside("blinks", "input[type=number]"), "25")
    person.run(f"{beside('blinks', 'input[type=number]')}.blur()")
    wait_for(lambda: rig.tuning.get()[key] == 25, "the value in force")
    wait_for(lambda: person.reads("● blinks", "1 not saved"), "the mark")
    person.click(saying("revert to the file"))
    wait_for(lambda: rig.tuning.get()[key] == before, "what the file says")
    wait_for(lambda: person.reads("all saved"), "no mark")


def test_names_are_words_and_never_run(at_the_rig: tuple[Rig, Person]):
    rig, person = at_the_rig
    evil = "<img src=x onerror='window.evil=1'><script>window.evil=1</script>"
    rig.robot.command(Stop(evil, who=evil))
    wait_for(lambda: person.reads("<img src=x"), "the words as they are")
    assert person.run("window.evil === undefined") is True
    assert person.run(f"{everywhere('img[src=x]')}.length") == 0
    resumed(rig, person, "Is no hand in the mechanism?")
