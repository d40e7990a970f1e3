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
CLOSE_TO_THE_RIG = "initialCameraPosition=0.45,-0.3,0.2&initialCameraLookAt=0,0,0.12"


def irises(browser: Browser) -> np.ndarray:
    """Pixels (n, 2) of the rig's blue irises, the only strong blue left of the panel."""
    png = np.frombuffer(browser.photograph(), np.uint8)
    scene = present(cv2.imdecode(png, cv2.IMREAD_COLOR))[:, : browser.width_px - PANEL_PX].astype(
        int
    )
    blue, green, red = scene[..., 0], scene[..., 1], scene[..., 2]
    return np.argwhere((blue > red + 70) & (blue > green + 20))


def test_page_shows_a_head_that_turns() -> None:
    def eyes() -> np.ndarray | None:
        seen = irises(browser)
        return seen if len(seen) > 30 else None

    def eyes_elsewhere() -> bool:
        seen = eyes()
        return seen is not None and bool(np.linalg.norm(seen.mean(axis=0) - before) > 4.0)

    def reads(*said: str) -> bool:
        words = browser.words()
        return all(word in words for word in said)

    with browsing(WINDOW_SMALL_PX) as browser, running_page() as (page, url):
        # Who is late sees the whole scene; pictures are drawn for a browser alone.
        feed = PageFeed(page)
        feed.state = feed.state._replace(errors={"timeout": 3})
        feed.tick = feed.turned({"neck_yaw": -0.3})
        feed.show()
        browser.go(url)
        wait_for(lambda: reads("STOP"), "the page")
        browser.run(f"document.querySelector('#view').src = '/view/?{CLOSE_TO_THE_RIG}'")
        Person(browser).open("Watch")
        feed.show(GREY)
        wait_for(lambda: reads("the rig has sent nothing"), "the silence")
        shown = "document.querySelector('[data-panel=camera] img').naturalWidth"
        camera = browser.ask("Runtime.evaluate", expression=shown)["result"]
        assert camera.get("value") == GREY.shape[1]
        before = wait_for(eyes, "the rig's eyes").mean(axis=0)
        feed.tick = feed.turned({"neck_yaw": 0.4})
        with going_on(lambda: feed.show(GREY)):
            wait_for(eyes_elsewhere, "the turn of the head")
            wait_for(lambda: reads("face 1: mouth", "behaviour wait adds", "fixate"), "the words")
            Person(browser).open("Health")
            wait_for(lambda: reads("no answer 3 times", "guard: ok"), "the health")
        # Six servos without feedback: a person is informed before torque is switched on again.
        maker = PageFeed(page, "maker")
        with going_on(lambda: maker.show(GREY, stopped="a test")):
            wait_for(lambda: reads("6 of 6 joints without feedback", "Resume"), "the other rig")
            browser.run("document.querySelector('#rig-words button').click()")
            wait_for(lambda: reads("6 joints without feedback jump to their places"), "the warning")
        here = url.partition("?")[0]
        own = (here, here.replace("http", "ws", 1), "data:", f"blob:{here}")
        assert [asked for asked in browser.asked_for if not asked.startswith(own)] == []
        assert any(asked.startswith(here) for asked in browser.asked_for)
