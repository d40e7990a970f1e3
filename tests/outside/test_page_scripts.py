"""The page's scripts in Chromium, with a rig that says what a test wants."""

from collections.abc import Iterator
from typing import Any, cast

import cv2
import numpy as np
import pytest
from browser import RARE_DRAWING, Browser, browsing
from msgspec.structs import replace
from page_person import STOP, Person, beside, everywhere, saying
from page_stub import PICTURE, RIG, RUN, YOU, Stub, serving
from shown_page import wait_for

from gazerig.robot.model.reply import ControlSource, TrackState
from gazerig.robot.net.topics import PanelContent

GREY = cv2.imencode(".jpg", np.full((400, 640, 3), 120, np.uint8))[1].tobytes()


@pytest.fixture(scope="module")
def tab() -> Iterator[Browser]:
    with browsing((1100, 760), RARE_DRAWING) as tab:
        yield tab


@pytest.fixture(scope="module")
def served() -> Iterator[tuple[Stub, str]]:
    with serving() as (stub, url):
        yield stub, url


@pytest.fixture
def page(tab: Browser, served: tuple[Stub, str]) -> tuple[Stub, Person]:
    """Return a stub that is as it was at first, and a person who has opened its page."""
    stub, url = served
    stub.reset()
    return stub, opened(tab, url)


@pytest.fixture(scope="module", autouse=True)
def silent() -> Iterator[tuple[Stub, Person]]:
    """Another page, opened before all others, whose rig falls silent then."""
    with browsing((1100, 760), RARE_DRAWING) as tab, serving() as (stub, url):
        person = opened(tab, url)
        stub.send("picture", PICTURE, GREY)
        yield stub, person


def opened(tab: Browser, url: str) -> Person:
    """Open the page, and wait until its scripts have come."""
    tab.go(url)
    person = Person(tab)
    wait_for(
        lambda: person.run("document.querySelectorAll('#drawer .field').length > 20"), "the panels"
    )
    return person


def headline(person: Person) -> str:
    return cast(str, person.run("document.querySelector('#headline').textContent"))


# --- STOP ---------------------------------------------------------------------------------


def test_a_stop_is_sent_until_it_is_confirmed_and_resuming_asks_about_a_hand(page):
    stub, person = page
    lost: list[dict[str, Any]] = []

    def lose_three(asked: dict[str, Any]) -> dict[str, Any] | None:
        if asked["do"] != "stop" or len(lost) >= 3:
            return None
        lost.append(asked)
        return {"refused": "not now"}

    stub.answer = lose_three
    person.click(STOP)
    wait_for(lambda: len(stub.orders("stop")) > 3, "the stops")
    wait_for(lambda: not person.reads("stopping…"), "the confirmation")
    assert lost[0]["why"] == "STOP was pressed on the page"
    # Resuming asks about the hand that may be in the mechanism.
    guessed = {name: replace(one, estimated=True) for name, one in stub.state.joints.items()}
    stub.show(stopped=f"STOP was pressed on the page ({YOU})", level="torque_off", joints=guessed)
    person.click(saying("Resume …"))
    wait_for(lambda: person.reads("Fingers out?", "jump to their places"), "the question")
    stub.show(stopped="STOP was pressed on the page (browser 9z9z)")
    person.click(saying("Resume …"))
    wait_for(
        lambda: person.reads("Not stopped here", "Is no hand in the mechanism?"),
        "the other question",
    )
    assert stub.orders("resume") == []
    person.click(saying("Yes, resume"))
    wait_for(lambda: stub.orders("resume") == [{"do": "resume", "confirmed": True}], "the order")


def test_stop_and_space_work_without_any_other_script(tab, served):
    stub, url = served
    stub.reset()
    stub.missing = {"page.js", "elements.js", "webcam.js", "words.js", "stage.js"}
    tab.go(url)
    person = Person(tab)
    wait_for(lambda: person.run("document.querySelector('#rig-words') !== null"), "the page")

    def stopped(press: Any) -> bool:
        before = len(stub.orders("stop"))
        press()
        person.wait_for_frames(2)
        return len(stub.orders("stop")) > before

    wait_for(lambda: stopped(lambda: person.click(STOP)), "a stop by the button")
    wait_for(lambda: stopped(person.space), "a stop by the space bar")
    # Also with the focus in the frame of the view.
    person.run("document.querySelector('#view').focus()")
    wait_for(lambda: stopped(person.space), "a stop by the space bar over the view")


# --- the head and what it looks at --------------------------------------------------------


def test_the_first_panel_says_why_and_headline_and_ring_name_the_same_part(page):
    stub, person = page
    (someone,) = stub.state.people
    person.open("Watch")
    stub.show(people=(replace(someone, speaks=True),))
    wait_for(lambda: person.reads(f"looks at person {someone.id}", "who speaks, for"), "the words")
    assert not person.reads("translation")
    person.click(saying("why: the terms of the equation", "summary"))
    wait_for(lambda: person.reads("translation", "habituation"), "the terms")
    stub.show(people=(someone,))
    number = 1

    def shown(part: str, eyes_at: str) -> str:
        """Show a picture of a moment in which a part is the target and the eyes are at another."""
        nonlocal number
        gaze = replace(
            stub.state.gaze, target=f"face {someone.id}: {part}", part=part, kind="face",
            point_m=someone.parts_m[eyes_at],
        )  # fmt: skip
        stub.show(gaze=gaze, headline=f"looks at person {someone.id} ({part})")
        number += 1
        stub.send("picture", replace(PICTURE, number=number, captured_s=stub.state.t_s), GREY)
        person.wait_for_frames(2)
        return headline(person)

    wait_for(lambda: "(mouth)" in shown("mouth", "mouth"), "the first part")
    # The next part is chosen before the eyes go there.
    assert "(mouth)" in shown("left eye", "mouth")
    wait_for(lambda: "(left eye)" in shown("left eye", "left eye"), "the landing")
    stub.show(addressed_by=someone.id)
    shown("left eye", "left eye")
    assert person.reads(f"person {someone.id} addresses it")


def test_the_head_looks_at_the_pointer_over_the_view(page):
    stub, person = page
    person.click("document.querySelector('#pointer')")
    box = cast(
        dict[str, float],
        person.run("document.querySelector('#view').getBoundingClientRect().toJSON()"),
    )

    def looked_at(across: float, down: float) -> list[float]:
        """Point at a place of the view, 0..1, and return where the head is to look."""
        stub.asked.clear()
        person.move(box["x"] + across * box["width"], box["y"] + down * box["height"])

        def ordered() -> bool:  # a rig that sends nothing gets no orders
            stub.show()
            return bool(stub.orders("look_at"))

        wait_for(ordered, "an order")
        order = stub.orders("look_at")[-1]
        assert order["pointer"] is True
        return cast(list[float], order["p_world_m"])

    # The viewer is 1 m ahead and 0.2 m above, so that the point is on the line at this height.
    x, y, z = looked_at(0.5, 0.5)
    assert 0.35 < x < 0.5 and abs(y) < 0.01 and abs(z - 0.2) < 0.01
    assert looked_at(0.75, 0.5)[1] > 0.1  # the viewer's right is the head's left
    assert looked_at(0.5, 0.25)[2] > 0.25


# --- panels -------------------------------------------------------------------------------


def test_panels_are_those_of_the_head_and_what_packages_and_clients_say_never_runs(page):
    stub, person = page
    person.open("Steer")
    wait_for(lambda: person.reads("wink left", "bold"), "the choices")
    assert not person.reads("attack") and not person.reads("boxer")
    stub.send("rig", replace(RIG, opponent=True))
    wait_for(
        lambda: person.reads("attack", "guard", "boxer", "move the opponent"), "the boxer's choices"
    )
    evil = "<img src=x onerror='window.evil=1'><script>window.evil=1</script><b>harmless</b>"
    person.open("Watch")
    stub.send("panel", PanelContent("a package's panel", evil))
    person.click(saying("a package's panel", "summary"))
    wait_for(lambda: person.reads("harmless"), "the panel")
    images = f"{everywhere('img[src=x]')}.length"
    in_the_panel = person.run(images)
    stub.show(stopped=evil)
    wait_for(lambda: person.reads("<img src=x"), "the words as they are")
    assert person.run("window.evil === undefined") is True
    assert person.run(images) == in_the_panel


def test_a_refused_value_is_put_back_and_anothers_change_is_shown(page):
    stub, person = page
    key = "gaze.lids.blinks_per_min"
    values = dict(cast(dict[str, Any], stub.usual["get"]))
    person.open("Tune")
    number = beside("blinks", "input[type=number]")
    stub.answer = lambda asked: (
        {"refused": "blinks <b>too</b> many"} if asked["do"] == "set" else None
    )
    # Its values are read twice at first; then nothing but the refusal puts a value back.
    wait_for(lambda: len(stub.orders("unsaved")) == 2, "the values in force")
    person.fill(number, "31")
    person.run(f"{number}.blur()")
    wait_for(lambda: stub.orders("set") == [{"do": "set", "changes": {key: 31}}], "the change")
    wait_for(lambda: person.reads("blinks <b>too</b> many"), "the refusal, as words")
    wait_for(lambda: person.run(f"{number}.value") == f"{values[key]:g}", "the value in force")
    stub.usual["get"] = {**values, key: 23.0}
    stub.usual["unsaved"] = [{"key": key, "old": "17", "new": "23"}]
    stub.send("run", replace(RUN, version=2))
    marked = beside("● blinks", "input[type=number]")
    wait_for(lambda: person.run(f"{marked}?.value") == "23", "the other's value, marked")
    wait_for(lambda: person.reads("1 not saved"), "the count")
    person.click(saying("save"))
    wait_for(lambda: stub.orders("save") == [{"do": "save", "path": None}], "the order to save")


def test_a_track_plays_on_a_timeline_with_its_sound_and_cues(page):
    stub, person = page
    person.open("Play")
    person.click("document.querySelector('#drawer-play input[type=checkbox]')")
    person.click(saying("wave"))
    asked = {"do": "play", "track": "wave", "speed": 1, "loop": True}
    wait_for(lambda: stub.orders("play") == [asked], "the order")
    playing = TrackState(
        "wave", length_s=3.0, sound="/sounds/hello.wav", rounds=0,
        who="ann", number=1, position_s=1.0,
    )  # fmt: skip
    stub.show(tracks=(playing,), control_source=ControlSource("track", "ann", "wave"))
    wait_for(lambda: person.reads("wave: started by ann"), "the track")
    # The sound's outline is half as high as its row: ink in the middle of the row, none above.
    ink = (
        "document.querySelector('canvas.track').getContext('2d').getImageData({}, 1, 1).data[3] > 0"
    )
    wait_for(lambda: person.run(ink.format("201, 31")), "the sound")
    assert not person.run(ink.format("201, 22"))
    person.click("document.querySelector('#drawer-play [data-choice=none]')")
    wait_for(lambda: stub.orders("end_track") == [{"do": "end_track", "track": ""}], "the end")


# --- a rig that has fallen silent


def test_what_no_longer_comes_is_grey_and_stop_says_that_it_cannot_work(silent):
    stub, person = silent
    wait_for(
        lambda: person.reads("as it was") and person.reads("STOP does nothing here"), "the words"
    )
    grey = "getComputedStyle(document.querySelector('{}')).filter.includes('grayscale')"
    assert person.run(grey.format("#camera canvas")) and person.run(grey.format("#view"))
    stub.show()
    stub.send("picture", replace(PICTURE, number=2), GREY)
    wait_for(lambda: not person.reads("STOP does nothing here"), "the connection")
    wait_for(lambda: not person.run(grey.format("#camera canvas")), "a new picture")
