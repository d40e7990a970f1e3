"""A person at a browser and a simulated rig: stop, lead, move joints, tune; nobody else.

The rig ticks in simulated time, slower than real, so that it leaves the processor to the
browser.
"""

import importlib.util
import json
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from math import degrees
from pathlib import Path
from types import ModuleType
from typing import Any, cast

import numpy as np
import pytest
from desk import GAZE_JOINTS
from present import present
from shown_page import free_port, wait_for

from gazerig.config.allowed_folder import AllowedFolder
from gazerig.config.load import shipped
from gazerig.config.schema import load_rig
from gazerig.gaze.types import Vec3
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.param_store import ParamStore
from gazerig.robot.app.run_observers import RunObservers
from gazerig.robot.control.loop import LoopCount, Tick
from gazerig.robot.dashboard.page_view import _HALF_WIDTH as HALF_WIDTH
from gazerig.robot.dashboard.page_view import VIEWS
from gazerig.robot.model.commands import Ask, LookAt, Renew, Stop

pytestmark = pytest.mark.own_timeouts


def load_browser() -> ModuleType:
    """The browser's driver, which stands in another test file."""
    spec = importlib.util.spec_from_file_location(
        "browser_of_the_page", Path(__file__).with_name("test_page.py")
    )
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


browser_of_the_page = load_browser()


YAW = GAZE_JOINTS.index("neck_yaw")
TICK_S = 0.01
PACE_S = 0.04  # real seconds a tick


class Rig:
    """A simulated rig with a page, ticked by a thread."""

    def __init__(self, host: str = "127.0.0.1") -> None:
        made = assemble(load_rig("desk"), RunOptions(mock=True, fast=True, seed=0, scene="visitor"))
        self.made, self.robot = made, made.robot
        self.tuning = ParamStore(made.live, self.robot.command, "desk")
        self.said: list[str] = []
        # Not fast: the page is for real time, of which these ticks are a slow imitation.
        options = RunOptions(page=f"{host}:{free_port()}")
        say = self.said.append
        self.audience = RunObservers(made, options, say, say, self.tuning)
        self.newest: Tick | None = None
        self.pace_s = PACE_S
        self.orders: list[Any] = []
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._tick_on)

    def open(self) -> str:
        self.robot.start(self.made.clock)
        self.audience.open()
        self._thread.start()
        words = wait_for(lambda: self.saying("the page is at "), "the page's address")
        return str(words).rpartition(" ")[2]

    def saying(self, part: str) -> str | None:
        return next((line for line in self.said if part in line), None)

    def _tick_on(self) -> None:
        clock = self.made.clock
        while not self._over.wait(self.pace_s):
            clock.sleep_until(clock.now_s() + TICK_S)
            tick = self.robot.tick(clock.now_s(), TICK_S)
            self.newest = tick
            self.orders += [o for o in tick.commands if not isinstance(o, Renew)]
            self.audience.update(tick)

    def desired_deg(self) -> float:
        assert self.newest is not None
        return degrees(self.newest.desired_rad[YAW])

    def close(self) -> None:
        self._over.set()
        self._thread.join()
        self.robot.stop()
        self.audience.close(LoopCount(0, 0, "the end of the test"))
        self.made.close()


class Person:
    """Who sits at the browser: looks for things by what they say, clicks and types."""

    def __init__(self, tab: object) -> None:
        self.tab = tab

    def run(self, script: str) -> object:
        answer = self.tab._ask(  # type: ignore[attr-defined]
            "Runtime.evaluate", expression=script, returnByValue=True
        )
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def reads(self, *words: str) -> bool:
        said = self.tab.words()  # type: ignore[attr-defined]
        return all(word in said for word in words)

    def place(self, element: str, across: float = 0.5) -> tuple[float, float] | None:
        """Where an element is, once it stays there; brought into view where it is not."""
        found = self.run(
            f"(() => {{ const e = {element}; if (!e || !e.getClientRects().length) return null;"
            "let r = e.getBoundingClientRect();"
            "if (r.top < 0 || r.bottom > innerHeight) { e.scrollIntoView({block: 'center'});"
            "r = e.getBoundingClientRect(); }"
            f"return [r.x + r.width * {across}, r.y + r.height / 2]; }})()"
        )
        return None if found is None else (found[0], found[1])  # type: ignore[index]

    def click(self, element: str, across: float = 0.5) -> None:
        def steady() -> tuple[float, float] | None:
            first = self.place(element, across)
            return first if first is not None and first == self.place(element, across) else None

        x, y = wait_for(steady, f"a place to click: {element}")
        for kind, button in (("mouseMoved", "none"), ("mousePressed", "left")):
            self._mouse(kind, x, y, button)
        self._mouse("mouseReleased", x, y, "left")

    def _mouse(self, kind: str, x: float, y: float, button: str) -> None:
        self.tab._ask(  # type: ignore[attr-defined]
            "Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, clickCount=1
        )

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Move the mouse as a hand does: there first, then with the button down, step by step."""
        (x, y), (to_x, to_y) = start, end
        self._mouse("mouseMoved", x - 3.0, y, "none")
        self._mouse("mouseMoved", x, y, "none")
        self.wait_for_frames(3)
        self._mouse("mousePressed", x, y, "left")
        for step in range(1, 6):
            share = step / 5.0
            self._mouse("mouseMoved", x + share * (to_x - x), y + share * (to_y - y), "left")
        self._mouse("mouseReleased", to_x, to_y, "left")

    def wait_for_frames(self, count: int) -> None:
        """Wait until the browser has drawn so often: what was sent to it is then to be seen."""
        self.run(
            "window.framesDrawn = 0; (function more() { window.framesDrawn += 1;"
            f"if (window.framesDrawn < {count}) requestAnimationFrame(more); }})()"
        )
        wait_for(lambda: self.run("window.framesDrawn") == count, f"{count} frames")

    def press(self, key: str, code: str, number: int) -> None:
        for kind in ("keyDown", "keyUp"):
            self.tab._ask(  # type: ignore[attr-defined]
                "Input.dispatchKeyEvent",
                type=kind, key=key, code=code, windowsVirtualKeyCode=number, text=key,
            )  # fmt: skip

    def space(self) -> None:
        self.press(" ", "Space", 32)

    def type(self, text: str) -> None:
        self.tab._ask("Input.insertText", text=text)  # type: ignore[attr-defined]


def saying(words: str, kind: str = "button, [role=tab], label") -> str:
    """The element that says so, whatever is written smaller beside it."""
    return (
        f"[...document.querySelectorAll({json.dumps(kind)})].find("
        f"e => e.textContent.trim() === {json.dumps(words)} && e.getClientRects().length)"
    )


def beside(words: str, kind: str) -> str:
    """The control of a kind that a label names."""
    return f"({saying(words, 'label')})?.closest('.mantine-Flex-root').querySelector('{kind}')"


def seen_at(p_world_m: Vec3, canvas: tuple[float, float, float, float]) -> tuple[float, float]:
    """Where in the window a point of the first view is; canvas: left, top, width, height in px."""
    eye, look_at = (np.array(place) for place in VIEWS["both"])
    ahead = (look_at - eye) / np.linalg.norm(look_at - eye)
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    away = np.array(p_world_m) - eye
    left, top, width, height = canvas
    scale_px = 0.5 * width / HALF_WIDTH / (away @ ahead)
    x, y = away @ right * scale_px, away @ np.cross(right, ahead) * scale_px
    return left + 0.5 * width + x, top + 0.5 * height - y


STOP = "document.querySelector('#rig-stop')"


@contextmanager
def running(host: str = "127.0.0.1") -> Iterator[tuple[Rig, str]]:
    rig = Rig(host)
    try:
        yield rig, rig.open()
    finally:
        rig.close()


@pytest.fixture(scope="module")
def tab() -> Iterator[object]:
    # Nothing is judged by the scene's pixels here, and only one test reaches into it.
    rare = browser_of_the_page.RARE_DRAWING
    with browser_of_the_page.browsing((1100, 760), rare) as tab:
        yield tab


@pytest.fixture(scope="module")
def at_the_rig(tab: Any) -> Iterator[tuple[Rig, Person]]:
    with running() as (rig, url):
        tab.go(url)
        person = Person(tab)
        wait_for(lambda: person.reads("STOP", "behaviour", "guard: "), "the page")
        yield rig, person


def resumed(rig: Rig, person: Person, question: str = "Fingers out?") -> None:
    assert rig.newest is not None
    held_s = rig.newest.t_s + 2.1
    rig.pace_s = 0.001
    wait_for(lambda: present(rig.newest).t_s > held_s, "the time that a stop holds at least")
    rig.pace_s = PACE_S
    person.click(saying("Resume …"))
    assert rig.robot.stopped  # not without being asked again
    wait_for(lambda: person.reads(question), "the question")
    person.click(saying("Yes, resume"))
    wait_for(lambda: not rig.robot.stopped, "the rig going on")
    wait_for(lambda: not person.reads("Torque is off"), "the page going on")


def test_stop_takes_the_torque_off_until_it_is_asked_back(
    at_the_rig: tuple[Rig, Person],
) -> None:
    rig, person = at_the_rig
    person.click(STOP)
    wait_for(lambda: "STOP was pressed on the page (browser " in rig.robot.stopped, "the stop")
    wait_for(lambda: present(rig.newest).guard_result.level == "torque_off", "torque off")
    wait_for(lambda: person.reads("Torque is off", "Resume"), "the words")
    resumed(rig, person)


def test_the_space_bar_stops_but_not_while_somebody_types(
    at_the_rig: tuple[Rig, Person],
) -> None:
    rig, person = at_the_rig
    person.click(saying("tuning"))
    person.click(beside("find", "input"))
    before = len(rig.orders)
    person.type("saccade")
    person.space()
    person.type("peak")
    wait_for(lambda: person.reads("human_peak"), "what is found")
    assert person.run(f"{beside('find', 'input')}.value") == "saccade peak"
    assert not rig.robot.stopped and rig.orders[before:] == []
    # On a button in focus a space would press it; here it stops, and nothing else.
    person.run(f"{beside('find', 'input')}.blur(); {saying('joints')}.focus()")
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
    root = "document.querySelector('#root').contains(document.querySelector('#rig-stop'))"
    assert person.run(root) is False


def test_a_slider_moves_the_wish_of_its_joint(at_the_rig: tuple[Rig, Person]) -> None:
    rig, person = at_the_rig
    person.click(saying("joints"))
    person.click(beside("neck yaw", ".mantine-Slider-track"), 0.8)
    wait_for(lambda: abs(rig.desired_deg() - 42.0) < 6.0, "the wish")  # 0.8 of -70..70
    person.click(saying("let go: look freely"))
    wait_for(
        lambda: cast(Any, rig.orders[-1])._replace(who="") == LookAt(None), "the rig being let go"
    )


def test_buttons_ask_and_the_picture_leads(at_the_rig: tuple[Rig, Person]) -> None:
    rig, person = at_the_rig
    person.click(saying("lead"))
    person.click(saying("guard"))
    wait_for(lambda: rig.orders[-1:] == [Ask("behaviour", "guard")], "the behaviour")
    picture = "[...document.querySelectorAll('img')].find(i => i.naturalWidth > 100 && "
    picture += "i.parentElement.previousElementSibling?.textContent === 'camera')"
    person.click(picture, 0.2)
    wait_for(lambda: isinstance(rig.orders[-1], LookAt), "the click in the picture")
    wait_for(lambda: present(rig.newest).target.kind == "puppet", "the head being led")
    person.click(saying("look freely again"))
    wait_for(lambda: present(rig.newest).target.kind != "puppet", "the head being free")


def test_a_target_is_dragged_through_the_scene(at_the_rig: tuple[Rig, Person]) -> None:
    rig, person = at_the_rig
    person.click(saying("lead"))
    person.run("window.drawScene = true")
    there = (0.7, 0.1, 0.3)
    rig.robot.command(LookAt(there, stay=True))
    wait_for(lambda: present(rig.newest).target.p_world_m == there, "the head being led")
    wait_for(lambda: person.reads("a user chose this point"), "the page knowing of it")
    person.click(beside("drag a target", "input"))
    rect = "(() => { const r = document.querySelector('canvas').getBoundingClientRect();"
    bounds: Any = person.run(rect + "return [r.x, r.y, r.width, r.height]; })()")
    x, y, width, height = bounds
    canvas = (x, y, width, height)
    arrow, farther = ((0.7, 0.1, 0.3 + up) for up in (0.08, 0.2))
    before = len(rig.orders)

    # A drag that begins beside a gizmo not yet drawn would turn the view for good.
    person.wait_for_frames(20)

    def dragged() -> bool:
        person.drag(seen_at(arrow, canvas), seen_at(farther, canvas))
        return any(isinstance(order, LookAt) for order in rig.orders[before:])

    wait_for(dragged, "the target being dragged")
    wait_for(lambda: present(rig.newest).target.p_world_m[2] > 0.38, "the head following")
    # Along the arrow and nowhere else.
    assert present(rig.newest).target.p_world_m[:2] == pytest.approx(there[:2], abs=1e-3)
    person.click(saying("look freely again"))
    wait_for(lambda: present(rig.newest).target.kind != "puppet", "the head being free")
    person.run("window.drawScene = false")


def test_a_parameter_is_found_changed_marked_and_put_back(
    at_the_rig: tuple[Rig, Person],
) -> None:
    rig, person = at_the_rig
    key = "ranges.neck_yaw_deg"
    (label,) = (k.key for k in rig.tuning.parameters() if k.key == key)
    person.click(saying("tuning"))
    person.run(f"{beside('find', 'input')}.select()")
    person.click(beside("find", "input"))
    person.run(f"{beside('find', 'input')}.select()")
    person.type(key)
    name = f"{label} (deg)"
    before = rig.tuning.values()[key]
    person.click(beside(name, ".mantine-Slider-track"), 0.25)
    wait_for(lambda: rig.tuning.values()[key] != before, "the value in force")
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
    person.click(saying("tuning"))
    person.click(beside("find", "input"))
    person.run(f"{beside('find', 'input')}.select()")
    person.type("joints.neck_yaw.gains")
    name = "neck_yaw.gains"
    field = beside(name, "input")
    before = wait_for(lambda: person.run(f"({field})?.value"), "the field")
    person.click(field)
    person.run(f"{field}.select()")
    person.type("[99999, 0, 0]")
    person.press("\r", "Enter", 13)
    wait_for(lambda: person.reads("refused", "16383"), "the rule")
    wait_for(lambda: person.run(f"{field}.value") == before, "the control going back")
    assert rig.tuning.unsaved() == ()


def test_what_is_in_force_is_saved_in_a_new_file_with_its_comments(
    at_the_rig: tuple[Rig, Person], tmp_path: Path
) -> None:
    rig, person = at_the_rig
    rig.tuning.set({"park_deg.neck_pitch": -3.0})
    person.click(saying("tuning"))
    wait_for(lambda: person.reads("not saved"), "the mark")
    file = tmp_path / "tuned at midnight.yaml"
    cast(Any, present(rig.audience._page)._on_request)._handler._paths = AllowedFolder(
        tmp_path
    )  # as if the rig's file lay there
    person.click(beside("save as", "input"))
    person.type(str(file))
    person.press("\r", "Enter", 13)
    wait_for(lambda: person.reads(f"saved in {file}", "all saved"), "the words")
    assert load_rig(str(file)).park_deg["neck_pitch"] == -3.0
    before = shipped("rigs", "desk").read_text(encoding="utf-8")
    saved = file.read_text(encoding="utf-8")
    comments = [line for line in before.splitlines() if line.startswith("#")]
    assert comments and all(line in saved for line in comments)


def test_a_character_is_laid_over_the_rig(at_the_rig: tuple[Rig, Person]) -> None:
    rig, person = at_the_rig
    person.click(saying("lead"))
    person.click(saying("shy"))
    wait_for(lambda: rig.tuning.character_name == "shy", "the character")
    wait_for(lambda: person.reads("character shy"), "the page saying so")


def test_who_did_not_stop_is_asked_about_other_hands(at_the_rig: tuple[Rig, Person]) -> None:
    rig, person = at_the_rig
    rig.robot.command(Stop("somebody tripped", "ana"))
    wait_for(lambda: person.reads("Torque is off: somebody tripped"), "the words")
    resumed(rig, person, "Is no hand in the mechanism?")


def test_on_a_phone_stop_is_at_the_top_and_nothing_covers_it(
    at_the_rig: tuple[Rig, Person],
) -> None:
    rig, person = at_the_rig
    phone = {"width": 360, "height": 640, "deviceScaleFactor": 1, "mobile": True}
    person.tab._ask("Emulation.setDeviceMetricsOverride", **phone)  # type: ignore[attr-defined]
    try:
        wait_for(lambda: person.run("innerWidth") == 360, "the phone")
        test_stop_stays_in_sight_when_the_panels_are_shut(at_the_rig)
        top: Any = person.run("document.querySelector('#rig-stop').getBoundingClientRect().top")
        assert top < 40
        person.click(STOP)
        wait_for(lambda: rig.robot.stopped, "the stop")
        resumed(rig, person)
    finally:
        desk = {"width": 1100, "height": 760, "deviceScaleFactor": 1, "mobile": False}
        person.tab._ask("Emulation.setDeviceMetricsOverride", **desk)  # type: ignore[attr-defined]


def test_names_are_words_and_never_run(at_the_rig: tuple[Rig, Person]) -> None:
    rig, person = at_the_rig
    evil = "<img src=x onerror='window.evil=1'><script>window.evil=1</script>"
    shown = [rig.robot.command(Stop(evil, evil))]
    wait_for(lambda: person.reads("STOPPED: <img src=x"), "the words as they are")
    assert shown and person.run("window.evil === undefined") is True
    assert person.run("document.querySelectorAll('img[src=x]').length") == 0
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
def test_without_the_token_there_is_one_line_and_with_it_the_page(tab: Any) -> None:
    with running("127.0.0.2") as (rig, url):
        person = Person(tab)
        with_token, url = url, url.partition("?")[0]
        tab.go(url)
        wait_for(lambda: person.reads("refused: open the address with the token"), "the refusal")
        assert not person.reads("STOP")
        tab.go(with_token)
        wait_for(lambda: person.reads("STOP", "guard: "), "the page")
        assert "token" not in str(person.run("location.href + document.cookie"))
        person.click(STOP)
        wait_for(lambda: rig.robot.stopped, "the stop")
