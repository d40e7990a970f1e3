"""Film the page of a rig in a living room: MUJOCO_GL=egl python docs/figures/make_page_film.py.

The rig's time is simulated and goes on slowly, so that a browser without a graphics card has
the time to draw it; each picture stands in the film for as long as it was true.
"""

import re
import sys
import threading
import time
from io import BytesIO
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "helpers"))

from browser import SLOW_DRAWING, Browser, browsing  # noqa: E402
from PIL import Image  # noqa: E402
from shown_page import free_port, wait_for  # noqa: E402

from gazerig.config.schema import load_rig  # noqa: E402
from gazerig.robot.loop.tick import Tick  # noqa: E402
from gazerig.robot.loop.tick_stream import Observers  # noqa: E402
from gazerig.robot.run.observers import RunObservers  # noqa
from gazerig.robot.run.options import RunOptions  # noqa: E402
from gazerig.robot.run.run import Run  # noqa

OUT = Path(__file__).parents[1] / "page.webp"
MOST_BYTES = 1_500_000
WINDOW_PX, SHOWN_PX = (1280, 800), (960, 600)
SECONDS, SHORTEST_S = 7.0, 0.08
BEGIN_S = 12.6
"""Time of the rig at which somebody sits before it and begins to talk."""
QUICK_S, SLOW_S = 0.002, 0.06
"""Real seconds that a tick takes, before the film and in it."""
PRESSED = {3.0: "wink", 5.4: "nod"}
"""Seconds from the start of the film -> the button that is pressed."""


class Film:
    """A rig that goes on by steps, and the pictures of its page."""

    def __init__(self, browser: Browser) -> None:
        self._browser = browser
        self._said: list[str] = []
        self.pace_s = QUICK_S
        self._now_s = 0.0
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()
        lines = wait_for(
            lambda: [x for x in self._said if "the page is at " in x] or None, "the page"
        )
        browser.go(lines[0].rpartition(" ")[2])

    def _run(self) -> None:
        """Make the rig and let it go on: what renders belongs to the thread that made it."""
        made = Run(load_rig("desk"), RunOptions(mock=True, fast=True, seed=3, world="living-room"))
        say = self._said.append
        made.options = RunOptions(page=f"127.0.0.1:{free_port()}")
        people, observers = RunObservers(made, say, say), Observers[Tick](say)
        people.attach(observers)
        made.robot.start(made.clock)
        people.open()
        clock, tick_s = made.clock, 1.0 / made.loop.rate_hz
        try:
            while not self._over.wait(self.pace_s):
                clock.sleep_until(clock.now_s() + tick_s)
                self._now_s = clock.now_s()
                observers.update(made.robot.tick(self._now_s, tick_s))
        finally:
            made.robot.stop()
            people.close("the end of the film")
            made.close()

    def now_s(self) -> float:
        """Return the rig's time."""
        return self._now_s

    def wait_for_scene(self) -> None:
        """Wait until the page is there and somebody has sat down before the head."""
        wait_for(lambda: "looks a" in self._browser.words() or None, "the page")
        while self.now_s() < BEGIN_S and self._thread.is_alive():
            time.sleep(0.05)
        self.pace_s = SLOW_S

    def keeps_up(self) -> bool:
        """Return whether the page shows the rig as it is: not silent, and without old pictures."""
        return not re.search(r"is silent|as it was \d", self._browser.words())

    def press(self, name: str) -> None:
        """Press one of the buttons under the head."""
        find = (
            f"[...document.querySelectorAll('#moves button')].find(b => b.innerText === '{name}')"
        )
        self._browser.run(f"{find}.click()")

    def picture(self) -> Image.Image:
        """Return the page as it is now."""
        seen = Image.open(BytesIO(self._browser.photograph())).convert("RGB")
        return seen.resize(SHOWN_PX, Image.Resampling.LANCZOS)

    def close(self) -> None:
        """End rig and page."""
        self._over.set()
        self._thread.join()


def main() -> None:
    """Write docs/page.webp."""
    pictures: list[tuple[float, Image.Image]] = []
    with browsing(WINDOW_PX, SLOW_DRAWING) as browser:
        film = Film(browser)
        try:
            film.wait_for_scene()
            start_s, presses = film.now_s(), dict(PRESSED)
            while (at_s := film.now_s() - start_s) < SECONDS:
                for when_s in [one for one in presses if one <= at_s]:
                    film.press(presses.pop(when_s))
                late = not pictures or at_s - pictures[-1][0] >= SHORTEST_S
                if late and film.keeps_up():
                    pictures.append((at_s, film.picture()))
        finally:
            film.close()
    times_s = [at_s for at_s, _ in pictures] + [SECONDS]
    lengths = [round(1000 * (b - a)) for a, b in zip(times_s[:-1], times_s[1:], strict=True)]
    first, *others = [picture for _, picture in pictures]
    for quality in (80, 65, 50, 40, 30):
        first.save(
            OUT,
            save_all=True,
            append_images=others,
            duration=lengths,
            loop=0,
            quality=quality,
            method=4,
        )
        if OUT.stat().st_size <= MOST_BYTES:
            break
    print(f"{OUT}: {len(pictures)} pictures, {OUT.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
