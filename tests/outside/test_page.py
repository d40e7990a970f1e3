"""The page shows a head that looks."""

import cv2
import numpy as np
from browser import Browser, browsing
from page_feed import GREY, PageFeed, going_on
from page_person import Person
from present import present
from shown_page import running_page, wait_for

WINDOW_SMALL_PX = (900, 500)  # a processor that does a graphics card's work has less to do
PANEL_PX = 370
LOADING = "document.querySelector('#stage').classList.contains('loading')"


def irises(browser: Browser) -> np.ndarray:
    """Pixels (n, 2) of the rig's blue irises, the only strong blue left of the panel."""
    png = np.frombuffer(browser.photograph(), np.uint8)
    scene = present(cv2.imdecode(png, cv2.IMREAD_COLOR))[
        60:400, : browser.width_px - PANEL_PX
    ].astype(int)
    blue, green, red = scene[..., 0], scene[..., 1], scene[..., 2]
    return np.argwhere((blue > red + 70) & (blue > green + 20))


def test_page_shows_a_head_that_turns():
    def eyes() -> np.ndarray | None:
        seen = irises(browser)
        return seen if len(seen) > 30 else None

    def eyes_elsewhere() -> bool:
        seen = eyes()
        return seen is not None and bool(np.linalg.norm(seen.mean(axis=0) - before) > 4.0)

    with browsing(WINDOW_SMALL_PX) as browser, running_page() as (page, url):
        feed, person = PageFeed(page), Person(browser)
        feed.tick = feed.turned({"neck_yaw": -0.3})
        feed.show()
        browser.go(url)
        wait_for(lambda: person.reads("STOP", "loading the head"), "the page")
        person.open("Watch")
        with going_on(lambda: feed.show(GREY)):
            wait_for(lambda: not person.run(LOADING), "the head")
            before = wait_for(eyes, "the rig's eyes").mean(axis=0)
        feed.tick = feed.turned({"neck_yaw": 0.4})
        with going_on(lambda: feed.show(GREY)):
            wait_for(eyes_elsewhere, "the turn of the head")
            wait_for(lambda: person.reads("looks at person 1 (mouth)", "fixate"), "the words")
            person.open("Health")
            wait_for(lambda: person.reads("bus ok", "guard: ok", "neck yaw"), "the health")
        here = url.partition("?")[0]
        own = (here, here.replace("http", "ws", 1), "data:", f"blob:{here}")
        assert [asked for asked in browser.asked_for if not asked.startswith(own)] == []
        assert any(asked.startswith(here) for asked in browser.asked_for)
