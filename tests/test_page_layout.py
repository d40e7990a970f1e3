"""The page in every state on a desk, a laptop and a phone: all in sight, nothing cut off."""

import itertools
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest
from browser import RARE_DRAWING, Browser, browsing
from page_layout import boxes, faults, value, violations
from present import present
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
MENUS = {"track": ("none", "nod", "shake", "surprised", "sleepy"), "lids": ("awake",)}
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
    return replace(SNAPSHOT, t_s=12.0, control_source=leader, control_sentence=words, **changes)


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


def test_a_message_does_not_move_the_head(shown: Shown, size: str) -> None:
    shown.state("awake")
    still = boxes(shown.browser)["stage"]
    for state in ("busy", "stopped", "hold", "bus lost"):
        shown.state(state)
        assert boxes(shown.browser)["stage"] == still, state
    shown.state("awake")


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


@pytest.mark.parametrize("size", ["phone"], indirect=True)
def test_on_a_phone_the_head_is_on_top_then_stop_then_the_buttons(shown: Shown, size: str) -> None:
    shown.state("awake")
    found = {name: box or (0.0,) * 4 for name, box in boxes(shown.browser).items()}
    order = ("stage", "rig-stop", "moves", "extras", "camera", "tabs")
    for upper, lower in zip(order[:-1], order[1:], strict=True):
        assert found[upper][3] <= found[lower][1] + 1, (upper, lower)
    share = (found["stage"][3] - found["stage"][1]) / SIZES["phone"][1]
    assert 0.4 <= share <= 0.5


@pytest.mark.parametrize("size", ["desk", "laptop"], indirect=True)
def test_the_camera_picture_is_large_and_leaves_the_head_free(shown: Shown, size: str) -> None:
    shown.state("awake")
    found = {name: box or (0.0,) * 4 for name, box in boxes(shown.browser).items()}
    stage, camera = found["stage"], found["camera"]
    assert camera[2] - camera[0] >= 320.0
    middle, high = 0.5 * (stage[0] + stage[2]), stage[3] - stage[1]
    assert camera[0] > middle + 0.35 * high  # a head of two thirds of the height is half as wide


def head_share(shown: Shown) -> float:
    """The head's share of its canvas's height: from its top to the start of the neck.

    The head is what differs from a canvas on which nothing is drawn.
    """
    view = "document.querySelector('#view').contentWindow"
    silhouettes: list[np.ndarray] = []

    def picture() -> np.ndarray:
        shown.state("awake")
        shown.browser.run(f"{view}.dispatchEvent(new Event('resize'))")
        left, top, right, bottom = present(boxes(shown.browser)["stage"])
        camera = present(boxes(shown.browser)["camera"])
        right = min(right, camera[0]) if camera[1] < bottom else right  # it covers the corner
        png = shown.browser.photograph_part(left, top, right - left, bottom - top)
        seen = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)
        return np.asarray(present(seen), int)

    def drawn(empty: np.ndarray) -> bool:
        now = picture()
        if now.shape == empty.shape:
            silhouettes.append(np.abs(now - empty).max(axis=2) > 12)
        # Twice the same: camera and canvas have come to rest.
        last = silhouettes[-2:]
        return len(last) == 2 and bool(last[1].any()) and bool((last[0] ^ last[1]).mean() < 0.003)

    empty = picture()
    shown.browser.run(f"{view}.drawScene = true")
    try:
        wait_for(lambda: drawn(empty), "the head")
    finally:
        shown.browser.run(f"{view}.drawScene = false")
    widths = silhouettes[-1].sum(axis=1)
    first = int(np.argmax(widths > 0.02 * len(widths)))
    widest = first + int(np.argmax(widths[first : first + len(widths) // 2]))
    neck = int(widths[widest:].min())
    chin = widest + int(np.argmax(widths[widest:] <= 1.3 * neck))
    return (chin - first) / len(widths)


# At 640x480 the camera's picture, which changes, covers a corner of the head's.
@pytest.mark.parametrize("size", [size for size in SIZES if size != "least"], indirect=True)
def test_the_head_fills_most_of_its_canvas(shown: Shown, size: str) -> None:
    # Parts come one after the other: before the last, two pictures of a slow computer may agree.
    wait_for(lambda: 0.6 <= head_share(shown) <= 0.8, "the whole head in its size")


def test_picture_and_head_change_places_with_one_click(shown: Shown, size: str) -> None:
    shown.state("awake")
    before = boxes(shown.browser)
    swap = "document.querySelector('#swap').click()"
    shown.browser.run(swap)
    try:
        after = boxes(shown.browser)
        picture, head = present(after["camera"]), present(after["stage"])
        was = present(before["stage"])
        assert apart(picture, head)
        # The former large part is small now, and the picture has most of the space.
        assert head[2] - head[0] < 0.5 * (was[2] - was[0]) or size == "phone"
        assert picture[:2] == pytest.approx(was[:2], abs=1.0)
        assert picture[3] == pytest.approx(was[3], abs=1.0)
        # At 640x480 the height limits it.
        assert picture[2] - picture[0] >= (0.6 if size == "least" else 0.7) * SIZES[size][0]
        assert faults(shown.browser) == []
    finally:
        shown.browser.run(swap)


@pytest.mark.parametrize("size", ["desk", "laptop"], indirect=True)
@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("tab", ["", *TABS])
def test_axe_finds_nothing_serious(shown: Shown, tab: str, theme: str, size: str) -> None:
    shown.state("awake")
    shown.theme(theme)
    if tab:
        shown.tab(tab)
    try:
        assert violations(shown.browser) == []
    finally:
        if tab:
            shown.tab(tab)
        shown.theme("light")


@pytest.mark.parametrize("state", [state for state in LEADS if state != "awake"])
def test_axe_finds_nothing_serious_in_other_states(shown: Shown, state: str, size: str) -> None:
    shown.state(state)
    assert violations(shown.browser) == []


BAD = """(() => {
  const bad = document.createElement('div');
  bad.id = 'bad';
  bad.innerHTML = '<button style="position:fixed;left:-20px;top:100px;width:40px"></button>' +
    '<p style="position:fixed;z-index:3;top:200px;font-size:9px;color:#999;background:#aaa">words</p>' +
    '<div style="position:fixed;inset:auto 0 0 0;height:200px;z-index:9"></div>';
  document.body.append(bad);
})()"""


@pytest.mark.parametrize("size", ["laptop"], indirect=True)
def test_what_is_measured_finds_faults_that_are_there(shown: Shown, size: str) -> None:
    shown.state("awake")
    shown.browser.run(BAD)
    try:
        found = " ".join(faults(shown.browser))
        for fault in ("is cut off at the side", "is written in 9.0 px", "is covered by div"):
            assert fault in found
        serious = " ".join(violations(shown.browser))
        assert "button-name" in serious and "color-contrast" in serious
    finally:
        shown.browser.run("document.querySelector('#bad').remove()")
