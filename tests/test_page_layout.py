"""The page in every state on a desk, a laptop and a phone: all in sight, nothing cut off."""

import itertools
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from browser import RARE_DRAWING, Browser, browsing
from page_layout import boxes, faults, value, violations
from shown_page import SNAPSHOT, running_page, wait_for

from gazerig.robot.dashboard.feed.camera_overlay import encode
from gazerig.robot.dashboard.feed.page_process import PageProcess
from gazerig.robot.model.control_source import ControlSource, control_sentence
from gazerig.robot.model.types import Snapshot

SIZES = {
    "desk": (1600, 1000),
    "laptop": (1280, 720),
    "phone": (390, 844),
    "least": (640, 480),
    "small": (800, 600),
    "narrow": (1000, 700),
}
TABS = ("watch", "steer", "tune", "health")
MENUS = {"track": ("none", "nod", "shake", "surprised", "sleepy"), "lids": ("wink left",)}
LEADS = {
    "awake": ControlSource(),
    "stopped": ControlSource("stopped", "", "STOP was pressed on the page (browser 1a2b)"),
    "jogging": ControlSource("joint", "browser 1a2b", "neck_yaw at 17.2 deg", ("neck_yaw",), 0.0),
    "led by a click": ControlSource("person", "browser 1a2b", "look at 0.9 0.1 0.25", (), 0.0),
    "hold": ControlSource(),
    "bus lost": ControlSource(),
    "busy": ControlSource(),
}
CHANGES: dict[str, dict[str, Any]] = {
    "busy": {"busy": "the computer is too busy: 12% of ticks came late (worst 38 ms)"},
    "stopped": {"stopped": LEADS["stopped"].description, "level": "torque_off"},
    "hold": {"level": "hold", "reasons": ("neck_pitch: no feedback for 120 ms: all joints hold",)},
    "bus lost": {
        "headline": "the torque is off: the servo bus is lost: /dev/ttyUSB0 is not there",
        "level": "torque_off",
        "reasons": ("the servo bus is lost: /dev/ttyUSB0 is not there",),
        "health": "bus lost: /dev/ttyUSB0 is not there, tried again every 0.5 s",
    },
}


def snapshot(state: str) -> Snapshot:
    leader = LEADS[state]
    words = control_sentence(leader, 12.0)
    headline = words if leader.overrides_gaze else "looks at person 3 (left eye)"
    changes = {"headline": headline, **CHANGES.get(state, {})}
    return replace(SNAPSHOT, t_s=12.0, control_source=leader, **changes)


class Shown:
    """A page in a browser, and what feeds it."""

    def __init__(self, browser: Browser, page: PageProcess) -> None:
        self.browser, self.page = browser, page
        self.t_s = 0.0

    def state(self, name: str) -> None:
        """Show a state and wait until the page shows it."""
        self.t_s += 1.0
        shot = replace(snapshot(name), t_s=self.t_s)
        self.page.show(shot)
        said = "['headline', 'busy'].map(id => document.getElementById(id).textContent)"

        def says() -> bool:
            self.t_s += 0.01
            self.page.show(replace(shot, t_s=self.t_s))
            return bool(value(self.browser, said) == [shot.headline, shot.busy])

        wait_for(says, f"the headline of {name}")

    def size(self, name: str) -> None:
        width, height = SIZES[name]
        shape = {"width": width, "height": height, "deviceScaleFactor": 1}
        self.browser.ask("Emulation.setDeviceMetricsOverride", **shape, mobile=False)
        wait_for(lambda: value(self.browser, "innerWidth") == width, name)

    def theme(self, name: str) -> None:
        features = [{"name": "prefers-color-scheme", "value": name}]
        self.browser.ask("Emulation.setEmulatedMedia", features=features)

    def tab(self, name: str) -> None:
        """Open a drawer, or close it if it is open."""
        self.browser.run(f"document.querySelector('#tab-{name}').click()")


@pytest.fixture(scope="module")
def shown() -> Iterator[Shown]:
    with browsing(SIZES["laptop"], RARE_DRAWING) as browser, running_page() as (page, url):
        page.offer(MENUS)
        page.show(snapshot("awake"))
        page.show_frame(encode(np.full((400, 640, 3), (140, 120, 100), np.uint8)))
        browser.go(url)
        shown = Shown(browser, page)
        wait_for(lambda: value(browser, "document.querySelector('#camera img') !== null"), "it")
        yield shown


@pytest.fixture(scope="module", params=SIZES)
def size(shown: Shown, request: pytest.FixtureRequest) -> str:
    """Set the window's size; pytest runs all tests of one size before it sets the next."""
    shown.size(str(request.param))
    return str(request.param)


@pytest.mark.parametrize("state", LEADS)
def test_nothing_is_cut_off_covered_or_too_small(shown: Shown, state: str, size: str) -> None:
    shown.state(state)
    assert faults(shown.browser) == []
    # STOP is at its usual place, whatever else is shown.
    stop = boxes(shown.browser)["rig-stop"]
    assert stop is not None and stop[3] - stop[1] >= 44.0


def apart(one: tuple[float, ...] | None, other: tuple[float, ...] | None) -> bool:
    if one is None or other is None:
        return True
    beside = one[2] <= other[0] + 1 or other[2] <= one[0] + 1
    return beside or one[3] <= other[1] + 1 or other[3] <= one[1] + 1


@pytest.mark.parametrize("tab", TABS)
def test_a_drawer_leaves_head_stop_and_buttons_in_sight(shown: Shown, tab: str, size: str) -> None:
    shown.state("awake")
    shown.tab(tab)
    try:
        assert faults(shown.browser) == []
        found = boxes(shown.browser)
        for part in ("stage", "camera", "rig-stop", "moves", "tabs"):
            assert apart(found["drawer"], found[part]), f"the drawer lies over {part}"
        left, top, right, bottom = found["stage"] or (0.0, 0.0, 0.0, 0.0)
        width, height = SIZES[size]
        if size == "phone":
            assert right - left == width and bottom - top > 0.2 * height
        elif size in ("least", "small", "narrow"):
            assert right - left >= 0.4 * width and bottom - top > 0.4 * height
        else:
            assert right - left >= 0.6 * width and bottom - top > 0.6 * height
    finally:
        shown.tab(tab)


@pytest.mark.parametrize("size", ["laptop"], indirect=True)
def test_what_is_not_new_is_grey_and_has_its_age(shown: Shown, size: str) -> None:
    script = """['#stage', '#camera .picture'].map(name => {
      const part = document.querySelector(name), age = part.querySelector('.age');
      return [part.matches('.stale'), age.checkVisibility() ? age.textContent : ''];
    })"""

    def stale() -> bool:
        (view, view_age), (picture, picture_age) = value(shown.browser, script)
        words = view_age.startswith("as it was ") and view_age.endswith(" s ago")
        return bool(view and words and picture and picture_age.endswith(" s old"))

    wait_for(stale, "the age of what is shown")
    greys = itertools.cycle(range(100, 140))

    def fresh() -> bool:
        shown.state("awake")
        shown.page.show_frame(encode(np.full((400, 640, 3), next(greys), np.uint8)))
        return bool(value(shown.browser, script) == [[False, ""], [False, ""]])

    wait_for(fresh, "the new view and picture")


@pytest.mark.parametrize("size", ["desk", "laptop"], indirect=True)
@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("tab", ["", *TABS])
def test_axe_finds_nothing_serious(shown: Shown, tab: str, theme: str, size: str) -> None:
    shown.state("awake")
    shown.theme(theme)
    if tab:
        shown.tab(tab)
    # While a drawer fades in, its words have little contrast.
    still = "document.getAnimations().every((each) => each.playState != 'running')"
    wait_for(lambda: value(shown.browser, still) is True, "the end of all transitions")
    try:
        assert violations(shown.browser) == []
    finally:
        if tab:
            shown.tab(tab)
        shown.theme("light")
