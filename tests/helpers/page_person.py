"""A person at a browser, and the simulated rig whose page it shows.

The rig ticks in simulated time, slower than real, so that it leaves the processor to the
browser.
"""

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from math import degrees
from typing import Any

from browser import Browser
from desk import GAZE_JOINTS
from fakes.runs import simulated
from present import present
from shown_page import free_port, wait_for

from gazerig.robot.loop.loop import Tick
from gazerig.robot.loop.tick_stream import Observers
from gazerig.robot.model.commands import Renew
from gazerig.robot.run.observers import RunObservers
from gazerig.robot.run.options import RunOptions

YAW = GAZE_JOINTS.index("neck_yaw")
TICK_S = 0.01
PACE_S = 0.04  # real seconds a tick
UNHURRIED_FRAMES = 2
"""Each is drawn 0.1 s after it is asked for; so many later the browser has sent what it had."""


class Rig:
    """A simulated rig with a page, ticked by a thread."""

    def __init__(self) -> None:
        made = simulated()
        self.made, self.robot = made, made.robot
        self.said: list[str] = []
        # Not fast: the page is for real time, of which these ticks are a slow imitation.
        made.options = RunOptions(page=f"127.0.0.1:{free_port()}")
        self.tuning = made.params
        self.audience = RunObservers(made, self.said.append, self.said.append)
        self.observers = Observers[Tick](self.said.append)
        self.audience.attach(self.observers)
        self.newest: Tick | None = None
        self._pace_s = PACE_S
        self.orders: list[Any] = []
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._tick_on)

    def open(self) -> str:
        self.robot.start(self.made.clock)
        self.audience.open()
        self._thread.start()
        words = wait_for(lambda: self.saying("the page is at "), "the page's address")
        self.address = str(words).rpartition(" ")[2]
        return self.address

    def saying(self, part: str) -> str | None:
        return next((line for line in self.said if part in line), None)

    def _tick_on(self) -> None:
        clock = self.made.clock
        while not self._over.wait(self._pace_s):
            clock.sleep_until(clock.now_s() + TICK_S)
            tick = self.robot.tick(clock.now_s(), TICK_S)
            self.newest = tick
            self.orders += [o for o in tick.commands if not isinstance(o, Renew)]
            self.observers.update(tick)

    @contextmanager
    def hurrying(self) -> Iterator[None]:
        """Let its time pass as fast as it can, while a test waits for it."""
        self._pace_s = 0.001
        try:
            yield
        finally:
            self._pace_s = PACE_S

    def desired_deg(self) -> float:
        assert self.newest is not None
        return degrees(self.newest.desired_rad[YAW])

    def close(self) -> None:
        self._over.set()
        self._thread.join()
        self.robot.stop()
        self.audience.close("the end of the test")
        self.made.close()


class Person:
    """A person at the browser, who finds elements by their text, clicks and types."""

    def __init__(self, tab: Browser) -> None:
        self.tab = tab

    def run(self, script: str) -> object:
        answer = self.tab.ask("Runtime.evaluate", expression=script, returnByValue=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def reads(self, *words: str) -> bool:
        said = self.tab.words()
        return all(word in said for word in words)

    def place(self, element: str, across: float = 0.5) -> tuple[float, float] | None:
        """Place of an element; None: missing, or covered, so that it is scrolled."""
        found = self.run(
            f"(() => {{ const e = {element}; if (!e || !e.getClientRects().length) return null;"
            f"const r = e.getBoundingClientRect(), x = r.x + r.width * {across};"
            "const y = r.y + r.height / 2, hit = e.ownerDocument.elementFromPoint(x, y);"
            "const frame = e.ownerDocument.defaultView.frameElement?.getBoundingClientRect();"
            "if (e.contains(hit)) return [x + (frame?.x ?? 0), y + (frame?.y ?? 0)];"
            "e.scrollIntoView({block: 'center'}); return null; })()"
        )
        return None if found is None else (found[0], found[1])  # type: ignore[index]

    def click(self, element: str, across: float = 0.5) -> None:
        """Click on an element once it is visible and does not move."""
        wait_for(lambda: self.clicked(element, across), f"a place to click: {element}")

    def clicked(self, element: str, across: float = 0.5) -> bool:
        """Click on an element if it is visible and does not move; return whether it was."""
        first = self.place(element, across)
        if first is None or first != self.place(element, across):
            return False
        x, y = first
        for kind, button in (("mouseMoved", "none"), ("mousePressed", "left")):
            self._mouse(kind, x, y, button)
        self._mouse("mouseReleased", x, y, "left")
        return True

    def fill(self, field: str, text: str) -> None:
        """Replace the text of a field; again, if the field moved away.

        The page sends one message every 50 ms, the newest: who goes on sooner takes the place of
        what was typed.
        """

        def filled() -> bool:
            self.click(field)
            if (
                self.run(f"{field}?.select(); {field}?.ownerDocument.activeElement === {field}")
                is not True
            ):
                return False
            self.wait_for_frames(UNHURRIED_FRAMES)
            self.type(text)
            self.wait_for_frames(UNHURRIED_FRAMES)
            return self.run(f"{field}?.value") == text

        wait_for(filled, f"{text!r} in {field}")

    def move(self, x: float, y: float) -> None:
        """Move the mouse."""
        self._mouse("mouseMoved", x, y, "none")

    def _mouse(self, kind: str, x: float, y: float, button: str) -> None:
        self.tab.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, clickCount=1)

    def wait_for_frames(self, count: int) -> None:
        """Wait until the browser has drawn n times, so that messages to it are visible."""
        self.run(
            "window.framesDrawn = 0; (function more() { window.framesDrawn += 1;"
            f"if (window.framesDrawn < {count}) requestAnimationFrame(more); }})()"
        )
        wait_for(lambda: self.run("window.framesDrawn") == count, f"{count} frames")

    def open(self, drawer: str) -> None:
        """Open a drawer by its tab, unless it is open."""
        tab = saying(drawer, "[role=tab]")

        def is_open() -> bool:  # a tab that is clicked before its script has come stays shut
            if self.run(f"{tab}?.getAttribute('aria-selected')") == "true":
                return True
            self.clicked(tab)
            return False

        wait_for(is_open, f"the drawer {drawer}")
        if drawer == "Tune":  # most of its controls are in a fold
            fold = "document.querySelector('#drawer-tune details')"
            opened = f"(() => {{ const d = {fold}; if (d) d.open = true; return d !== null }})()"
            wait_for(lambda: self.run(opened), "all parameters")

    def space(self) -> None:
        """Press the space bar."""
        for kind in ("keyDown", "keyUp"):
            self.tab.ask(
                "Input.dispatchKeyEvent",
                type=kind, key=" ", code="Space", windowsVirtualKeyCode=32, text=" ",
            )  # fmt: skip

    def type(self, text: str) -> None:
        self.tab.ask("Input.insertText", text=text)


def everywhere(kind: str) -> str:
    """All elements of a kind, on the page and in the frame of the view."""
    frames = "[document, document.querySelector('#view')?.contentDocument]"
    return f"{frames}.flatMap(d => [...(d?.querySelectorAll({json.dumps(kind)}) ?? [])])"


def saying(words: str, kind: str = "button, [role=tab], label") -> str:
    """The element with this text, without smaller text next to it."""
    return (
        f"{everywhere(kind)}.find("
        f"e => e.textContent.trim() === {json.dumps(words)} && e.getClientRects().length)"
    )


def beside(words: str, kind: str) -> str:
    """The control of a kind that a label names."""
    return f"({saying(words, 'label')})?.parentElement.querySelector('{kind}')"


STOP = "document.querySelector('#rig-stop')"


def resumed(rig: Rig, person: Person, question: str = "Fingers out?") -> None:
    """Switch a stopped rig on again by the page, with confirmation, until it continues."""
    assert rig.newest is not None
    held_s = rig.newest.t_s + 2.1
    with rig.hurrying():
        wait_for(lambda: present(rig.newest).t_s > held_s, "the time that a stop holds at least")
    person.click(saying("Resume …"))
    assert rig.robot.stopped  # not without a second question
    wait_for(lambda: person.reads(question), "the question")

    # A stop that was sent twice lasts longer, and the rig refuses: then the request is repeated.
    def goes_on() -> bool:
        if rig.robot.stopped and not person.clicked(saying("Yes, resume")):
            person.clicked(saying("Resume …"))
        person.wait_for_frames(UNHURRIED_FRAMES)
        return not rig.robot.stopped

    wait_for(goes_on, "the rig going on")
    wait_for(lambda: not person.reads("Torque is off"), "the page going on")


@contextmanager
def running() -> Iterator[tuple[Rig, str]]:
    rig = Rig()
    try:
        yield rig, rig.open()
    finally:
        rig.close()
