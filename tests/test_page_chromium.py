"""A person at a browser and a simulated rig: stop, look, move joints, tune; no one else.

The rig ticks in simulated time, slower than real, so that it leaves the processor to the
browser.
"""

import itertools
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, cast

import pytest
from browser import RARE_DRAWING, Browser, browsing
from page_person import (
    PACE_S,
    STOP,
    UNHURRIED_FRAMES,
    Person,
    Rig,
    beside,
    everywhere,
    resumed,
    running,
    saying,
    seen_at,
)
from present import present
from shown_page import wait_for

from gazerig.config.allowed_folder import AllowedFolder
from gazerig.config.load import shipped_path
from gazerig.config.schema import load_rig
from gazerig.gaze.types import Vec3
from gazerig.robot.model.commands import Ask, LookAt, Stop


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


def follow(person: Person, *, on: bool) -> None:
    """Press the button until the head looks at the pointer, or no longer does."""

    def is_set() -> bool:
        if person.run(POINTER_ON) is not on:
            person.click(POINTER)
        return person.run(POINTER_ON) is on

    wait_for(is_set, f"the pointer {'on' if on else 'off'}")


def test_stop_takes_the_torque_off_until_it_is_asked_back(at_the_rig: tuple[Rig, Person]) -> None:
    rig, person = at_the_rig
    person.click(STOP)
    wait_for(lambda: "STOP was pressed on the page (browser " in rig.robot.stopped, "the stop")
    wait_for(lambda: present(rig.newest).guard_result.level == "torque_off", "torque off")
    wait_for(lambda: person.reads("Torque is off", "Resume"), "the words")
    resumed(rig, person)


def test_the_space_bar_stops_but_not_while_somebody_types(at_the_rig: tuple[Rig, Person]) -> None:
    rig, person = at_the_rig
    person.open("Tune")
    before = len(rig.orders)
    field = beside("find", "input")
    person.fill(field, "saccade")
    wait_for(lambda: person.reads("human_peak"), "what is found")
    person.space()
    person.type("peak")
    wait_for(lambda: not person.reads("human_base"), "what is not found any more")
    assert person.reads("human_peak")
    assert person.run(f"{field}.value") == "saccade peak"
    assert not rig.robot.stopped and rig.orders[before:] == []
    # On a button in focus a space would press it; here it stops, and nothing else.
    person.run(f"{beside('find', 'input')}.blur(); {saying('save')}.focus()")
    person.space()
    wait_for(lambda: "the space bar was pressed on the page (" in rig.robot.stopped, "the stop")
    wait_for(lambda: len(rig.orders) > before, "the tick that obeyed")
    assert len(rig.orders) == before + 1
    resumed(rig, person)


def test_stop_stays_in_sight_when_the_panels_are_shut(at_the_rig: tuple[Rig, Person]) -> None:
    _, person = at_the_rig
    covered = (
        "(() => { const r = document.querySelector('#rig-stop').getBoundingClientRect();"
        "return [[.1, .1], [.5, .5], [.9, .9]].map(([x, y]) => document.elementFromPoint("
        "r.x + r.width * x, r.y + r.height * y).closest('#rig-stop') !== null); })()"
    )
    assert person.run(covered) == [True, True, True]
    inside = "(() => { const r = document.querySelector('#rig-stop').getBoundingClientRect();"
    inside += "return r.top >= 0 && r.bottom <= innerHeight && r.left >= 0; })()"
    assert person.run(inside) is True
    # It is no part of what viser draws, so nothing that viser does can take it away.
    assert person.run("document.querySelector('#root') === null") is True


def test_a_slider_moves_the_wish_of_its_joint(at_the_rig: tuple[Rig, Person]) -> None:
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
        lambda: cast(Any, rig.orders[-1])._replace(who="") == LookAt(None), "the rig being let go"
    )


def test_buttons_ask_and_the_picture_leads(at_the_rig: tuple[Rig, Person]) -> None:
    rig, person = at_the_rig
    person.open("Steer")
    person.click(saying("guard"))
    wait_for(lambda: rig.orders[-1:] == [Ask("behaviour", "guard")], "the behaviour")
    person.click("document.querySelector('[data-panel=camera] img')", 0.2)
    wait_for(lambda: isinstance(rig.orders[-1], LookAt), "the click in the picture")
    wait_for(lambda: present(rig.newest).target.kind == "puppet", "the head being led")
    person.click(saying("look freely"))
    wait_for(lambda: present(rig.newest).target.kind != "puppet", "the head being free")


def test_a_target_is_dragged_through_the_scene(at_the_rig: tuple[Rig, Person]) -> None:
    rig, person = at_the_rig
    person.open("Watch")

    # Elements above it may grow between looking and clicking, which then hits something else.
    def unfolded() -> bool:
        if person.run(f"{saying('view', 'summary')}?.parentElement.open") is True:
            return True
        person.clicked(saying("view", "summary"))
        return False

    wait_for(unfolded, "the views")
    person.click(saying("both"))
    person.open("Steer")
    view = "document.querySelector('#view').contentWindow"
    person.run(f"{view}.drawScene = true")
    there = (0.5, -0.25, 0.2)  # no label before it
    rig.robot.command(LookAt(there, stay=True))
    wait_for(lambda: present(rig.newest).gaze.gaze_point_world_m == pytest.approx(there), "a look")
    # The target to drag starts where the page last knew the head to look. It is behind the rig:
    # once it says what was asked for afterwards, it knows of the look too.
    rig.robot.command(Ask("behaviour", "attack"))
    wait_for(
        lambda: person.run(f"{saying('attack')}.ariaPressed") == "true",
        "the page knowing of the look",
    )
    box = beside("drag a target", "input")

    def shown() -> bool:  # a second click would hide it
        return person.run(f"{box}?.checked") is True or (person.clicked(box) and False)

    wait_for(shown, "the target")
    # Charts in the drawers are canvases too.
    scene = f"{view}.document.querySelector('canvas[data-engine]')"
    rect = f"(() => {{ const r = {scene}.getBoundingClientRect();"
    rect += "const f = document.querySelector('#view').getBoundingClientRect();"
    bounds: Any = person.run(rect + "return [f.x + r.x, f.y + r.y, r.width, r.height]; })()")
    x, y, width, height = bounds
    canvas = (x, y, width, height)
    arrow, farther = ((*there[:2], there[2] + up) for up in (0.08, 0.2))
    before = len(rig.orders)

    # A drag that began next to a gizmo not yet drawn would turn the view permanently.
    def dragged() -> bool:
        if any(isinstance(order, LookAt) for order in rig.orders[before:]):
            return True
        start, end = seen_at(arrow, canvas), seen_at(farther, canvas)
        if person.lights_up(*start):
            person.drag(start, end)
        return False

    wait_for(dragged, "the target being dragged")
    wait_for(
        lambda: present(rig.newest).target.p_world_m[2] > there[2] + 0.08, "the head following"
    )
    # Along the arrow and nowhere else.
    assert present(rig.newest).target.p_world_m[:2] == pytest.approx(there[:2], abs=1e-3)
    person.click(saying("look freely"))
    wait_for(lambda: present(rig.newest).target.kind != "puppet", "the head being free")
    person.run(f"{view}.drawScene = false")


def test_the_head_looks_at_the_pointer_until_it_rests(at_the_rig: tuple[Rig, Person]) -> None:
    rig, person = at_the_rig
    person.run("document.querySelector('#view').scrollIntoView()")
    follow(person, on=True)
    width, height, left, top = cast(
        Any,
        person.run(
            "(() => { const r = document.querySelector('#view').getBoundingClientRect();"
            "return [r.width, r.height, r.x, r.y]; })()"
        ),
    )
    # A pointer that rests is sent again: only another point is that of the second place.
    before = len(rig.orders)
    for across, count in ((0.45, 1), (0.55, 2)):
        person._mouse("mouseMoved", left + across * width, top + 0.5 * height, "none")
        wait_for(
            lambda n=count: len({look.p_world_m for look in rig.orders[before:]}) >= n,  # type: ignore[misc]
            "the pointer's point",
        )
    for look in rig.orders[before:]:
        assert isinstance(look, LookAt) and look.pointer and look.who.startswith("browser ")
    wait_for(lambda: person.reads("looks at the pointer of browser "), "who leads")
    rig.pace_s = 0.01  # as fast as real time
    wait_for(lambda: not present(rig.newest).client_control.active, "the pointer letting go")
    assert present(rig.newest).client_control.end_reason == "not renewed"
    rig.pace_s = PACE_S
    follow(person, on=False)
    before = len(rig.orders)
    person._mouse("mouseMoved", left + 0.5 * width, top + 0.4 * height, "none")
    person.wait_for_frames(UNHURRIED_FRAMES)
    assert rig.orders[before:] == []


def test_the_head_follows_a_finger_and_the_view_does_not_turn(
    at_the_rig: tuple[Rig, Person],
) -> None:
    rig, person = at_the_rig
    box = "document.querySelector('#view').getBoundingClientRect()"
    width, height = cast(Any, person.run(f"[{box}.width, {box}.height]"))
    left, top = cast(Any, person.run(f"[{box}.x, {box}.y]"))

    def touch(kind: str, *across: float) -> None:
        points = [{"x": left + x * width, "y": top + 0.5 * height} for x in across]
        person.tab.ask("Input.dispatchTouchEvent", type=kind, touchPoints=points)

    follow(person, on=True)
    touch("touchStart", 0.45)
    before, shifts = len(rig.orders), itertools.cycle((0.0, 0.004))

    def points() -> list[Vec3]:
        assert all(isinstance(look, LookAt) and look.pointer for look in rig.orders[before:])
        return [present(look.p_world_m) for look in rig.orders[before:]]

    def moves_on(across: float, found: Callable[[], bool]) -> bool:
        touch("touchMove", across + next(shifts))
        return found()

    def is_near(point: Vec3, other: Vec3, distance_m: float) -> bool:
        return math.dist(point, other) < distance_m

    def settled() -> bool:  # the view may still be on its path to the place it starts at
        person.wait_for_frames(UNHURRIED_FRAMES)
        found = points()
        return len(found) > 2 and is_near(found[-1], found[-3], 0.001)

    wait_for(lambda: moves_on(0.48, settled), "the finger's point")
    first = points()[-1]
    # A finger that rests is sent again, so the next point may still be that of the place before.
    wait_for(
        lambda: moves_on(0.55, lambda: not is_near(points()[-1], first, 0.02)),
        "the finger's next point",
    )
    # The view has not turned: the finger's first place is still the same point.
    wait_for(lambda: moves_on(0.48, lambda: is_near(points()[-1], first, 0.003)), "the first point")
    touch("touchEnd")

    def rests() -> bool:  # twice as long as the page waits before it sends a place again
        count = len(rig.orders)
        person.run("window.rested = false; setTimeout(() => { window.rested = true }, 500)")
        wait_for(lambda: person.run("window.rested") is True, "half a second of the page")
        return len(rig.orders) == count

    wait_for(rests, "the finger being gone")
    follow(person, on=False)


def test_the_space_bar_stops_in_the_frame_of_the_view_too(at_the_rig: tuple[Rig, Person]) -> None:
    rig, person = at_the_rig
    view = "document.querySelector('#view')"
    person.run(f"{view}.focus(); {view}.contentWindow.focus()")
    assert person.run(f"document.activeElement === {view}") is True
    person.space()
    wait_for(lambda: "the space bar was pressed on the page (" in rig.robot.stopped, "the stop")
    resumed(rig, person)


def test_a_drawer_opens_by_its_tab_and_closes_by_escape(at_the_rig: tuple[Rig, Person]) -> None:
    _, person = at_the_rig
    selected = "document.querySelector('#tab-health').getAttribute('aria-selected')"
    focus = "document.activeElement.id"
    person.run("document.querySelector('#tab-watch').focus()")
    for _ in ("steer", "play", "tune", "health"):
        person.press("ArrowRight", "ArrowRight", 39)
    assert person.run(focus) == "tab-health" and person.run(selected) == "false"
    person.press("\r", "Enter", 13)
    wait_for(lambda: person.run(selected) == "true", "the drawer")
    assert person.run("document.querySelector('#drawer-health').checkVisibility()") is True
    person.press("Escape", "Escape", 27)
    wait_for(lambda: person.run(selected) == "false", "the drawer being shut")
    assert person.run(focus) == "tab-health"
    assert person.run("document.querySelector('#drawer').checkVisibility()") is False


def test_a_parameter_is_found_changed_marked_and_put_back(at_the_rig: tuple[Rig, Person]) -> None:
    rig, person = at_the_rig
    key = "ranges.neck_yaw_deg"
    (label,) = (k.key for k in rig.tuning.parameters() if k.key == key)
    person.open("Tune")
    person.fill(beside("find", "input"), key)
    name = f"{label} (deg)"
    before = rig.tuning.values()[key]

    def moved() -> bool:  # again, if the list was still being built and the slider went aside
        person.click(beside(name, "input[type=range]"), 0.25)
        person.wait_for_frames(UNHURRIED_FRAMES)
        return rig.tuning.values()[key] != before

    wait_for(moved, "the value in force")
    wait_for(lambda: person.reads(f"● {name}", "not saved"), "the mark")
    # Another program changes it: the control shows that.
    rig.tuning.set({key: 44.0})
    shown = f"({beside('● ' + name, 'input')})?.value"
    wait_for(lambda: person.run(shown) == "44", "the value another program set")
    person.click(saying("revert to the file"))
    wait_for(lambda: rig.tuning.values()[key] == before, "what the file says")
    wait_for(lambda: person.reads("all saved"), "no mark")


def test_what_breaks_a_rule_is_refused_in_words_and_goes_back(
    at_the_rig: tuple[Rig, Person],
) -> None:
    rig, person = at_the_rig
    person.open("Tune")
    person.fill(beside("find", "input"), "joints.neck_yaw.gains")
    name = "neck_yaw.gains"
    field = beside(name, "input")
    before = wait_for(lambda: person.run(f"({field})?.value"), "the field")
    person.fill(field, "[99999, 0, 0]")
    person.press("\r", "Enter", 13)
    wait_for(lambda: person.reads("16383"), "the rule")
    wait_for(lambda: person.run(f"{field}.value") == before, "the control going back")
    assert rig.tuning.unsaved() == ()


def test_what_is_in_force_is_saved_in_a_new_file_with_its_comments(
    at_the_rig: tuple[Rig, Person], tmp_path: Path
) -> None:
    rig, person = at_the_rig
    rig.tuning.set({"park_deg.neck_pitch": -3.0})
    person.open("Tune")
    wait_for(lambda: person.reads("not saved"), "the mark")
    file = tmp_path / "tuned at midnight.yaml"
    cast(Any, present(rig.audience._page)._on_request)._handler._paths = AllowedFolder(
        tmp_path
    )  # as if the rig's file were there
    person.fill(beside("save as", "input"), str(file))
    person.press("\r", "Enter", 13)
    wait_for(lambda: person.reads(f"saved in {file}", "all saved"), "the words")
    assert load_rig(str(file)).park_deg["neck_pitch"] == -3.0
    before = shipped_path("rigs", "desk").read_text(encoding="utf-8")
    saved = file.read_text(encoding="utf-8")
    comments = [line for line in before.splitlines() if line.startswith("#")]
    assert comments and all(line in saved for line in comments)


def test_a_character_is_laid_over_the_rig(at_the_rig: tuple[Rig, Person]) -> None:
    rig, person = at_the_rig
    person.open("Steer")
    person.click(saying("shy"))
    wait_for(lambda: rig.tuning.character_name == "shy", "the character")
    wait_for(lambda: person.run(f"{saying('shy')}.ariaPressed") == "true", "the page saying so")


def test_who_did_not_stop_is_asked_about_other_hands(at_the_rig: tuple[Rig, Person]) -> None:
    rig, person = at_the_rig
    rig.robot.command(Stop("somebody tripped", "ana"))
    wait_for(lambda: person.reads("Torque is off: somebody tripped"), "the words")
    resumed(rig, person, "Is no hand in the mechanism?")


def test_on_a_phone_stop_is_in_sight_and_nothing_covers_it(at_the_rig: tuple[Rig, Person]) -> None:
    rig, person = at_the_rig
    phone = {"width": 360, "height": 640, "deviceScaleFactor": 1, "mobile": True}
    person.tab.ask("Emulation.setDeviceMetricsOverride", **phone)
    try:
        wait_for(lambda: person.run("innerWidth") == 360, "the phone")
        test_stop_stays_in_sight_when_the_panels_are_shut(at_the_rig)
        person.click(STOP)
        wait_for(lambda: rig.robot.stopped, "the stop")
        resumed(rig, person)
    finally:
        desk = {"width": 1100, "height": 760, "deviceScaleFactor": 1, "mobile": False}
        person.tab.ask("Emulation.setDeviceMetricsOverride", **desk)


def test_names_are_words_and_never_run(at_the_rig: tuple[Rig, Person]) -> None:
    rig, person = at_the_rig
    evil = "<img src=x onerror='window.evil=1'><script>window.evil=1</script>"
    shown = [rig.robot.command(Stop(evil, evil))]
    wait_for(lambda: person.reads("<img src=x"), "the words as they are")
    assert shown and person.run("window.evil === undefined") is True
    assert person.run(f"{everywhere('img[src=x]')}.length") == 0
    resumed(rig, person, "Is no hand in the mechanism?")


def test_a_stop_that_gets_lost_is_sent_again(at_the_rig: tuple[Rig, Person]) -> None:
    rig, person = at_the_rig
    lost: list[Any] = []
    hear = present(present(rig.audience._page)._on_request)

    def deaf_at_first(asked: dict[str, object]) -> str | None:
        if asked.get("do") == "stop" and len(lost) < 3:
            lost.append(asked)
            return "refused: not now"
        return hear(asked)

    present(rig.audience._page)._on_request = deaf_at_first
    try:
        person.click(STOP)
        wait_for(lambda: rig.robot.stopped, "the stop")
        wait_for(lambda: person.reads("Torque is off") and person.reads("STOP"), "the words")
        assert len(lost) == 3
    finally:
        present(rig.audience._page)._on_request = hear
    resumed(rig, person)


# The last: the browser leaves the rig of the others.
@pytest.mark.slow
def test_without_the_token_there_is_one_line_and_with_it_the_page(tab: Browser) -> None:
    with running("127.0.0.2") as (rig, url):
        person = Person(tab)
        with_token, url = url, url.partition("?")[0]
        tab.go(url)
        wait_for(lambda: person.reads("refused: open the address with the token"), "the refusal")
        assert not person.reads("STOP")
        tab.go(with_token)
        wait_for(lambda: person.reads("STOP", "Steer"), "the page")
        assert "token" not in str(person.run("location.href + document.cookie"))
        person.click(STOP)
        wait_for(lambda: rig.robot.stopped, "the stop")
