"""Film the page of an emulated rig in a headless Chromium: python docs/make_page_film.py.

The rig's time is simulated and goes on slowly, so that a browser without a graphics card has
the time to draw it; each picture stands in the film for as long as it was true.
"""

import sys
import threading
from io import BytesIO
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from browser import SLOW_DRAWING, Browser, browsing  # noqa: E402
from PIL import Image  # noqa: E402
from shown_page import free_port, wait_for  # noqa: E402

from gazerig.config.schema import load_rig  # noqa: E402
from gazerig.robot.app.assemble import assemble  # noqa: E402
from gazerig.robot.app.options import RunOptions  # noqa: E402
from gazerig.robot.app.run_observers import RunObservers  # noqa: E402
from gazerig.robot.control.loop import LoopCount  # noqa: E402

OUT = Path(__file__).parent / "page.webp"
MOST_BYTES = 3_000_000
WINDOW_PX, SHOWN_PX = (1280, 800), (960, 600)
SECONDS, SHORTEST_S = 8.0, 0.08
WARM_UP_S = 4.0
"""Until the head has found the visitor."""
QUICK_S, SLOW_S = 0.01, 0.08
"""Real seconds that a tick takes, before the film and in it."""
PRESSED = {2.6: "nod", 4.8: "wink", 6.0: "surprised"}
"""Seconds from the start of the film -> the button that is pressed."""


class Film:
    """A rig that goes on by steps, and the pictures of its page."""

    def __init__(self, browser: Browser) -> None:
        self._browser = browser
        self._made = assemble(
            load_rig("desk"), RunOptions(mock=True, fast=True, seed=3, scene="visitor")
        )
        said: list[str] = []
        options = RunOptions(page=f"127.0.0.1:{free_port()}")
        self._observers = RunObservers(self._made, options, said.append, said.append)
        self._made.robot.start(self._made.clock)
        self._observers.open()
        self.pace_s = QUICK_S
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._tick_on)
        self._thread.start()
        lines = wait_for(lambda: [x for x in said if "the page is at " in x] or None, "the page")
        browser.go(lines[0].rpartition(" ")[2])

    def _tick_on(self) -> None:
        clock, tick_s = self._made.clock, 1.0 / self._made.loop.rate_hz
        while not self._over.wait(self.pace_s):
            clock.sleep_until(clock.now_s() + tick_s)
            self._observers.update(self._made.robot.tick(clock.now_s(), tick_s))

    def now_s(self) -> float:
        """Return the rig's time."""
        return self._made.clock.now_s()

    def wait_for_scene(self) -> None:
        """Wait until the page is there and the head looks at the visitor."""
        wait_for(lambda: "looks at person" in self._browser.words() or None, "the page")
        from_s = self.now_s()
        wait_for(lambda: self.now_s() > from_s + WARM_UP_S or None, "the first seconds")
        self.pace_s = SLOW_S

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
        self._made.robot.stop()
        self._observers.close(LoopCount(0, 0, "the end of the film"))
        self._made.close()


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
                if not pictures or at_s - pictures[-1][0] >= SHORTEST_S:
                    pictures.append((at_s, film.picture()))
        finally:
            film.close()
    times_s = [at_s for at_s, _ in pictures] + [SECONDS]
    lengths = [round(1000 * (b - a)) for a, b in zip(times_s[:-1], times_s[1:], strict=True)]
    first, *others = [picture for _, picture in pictures]
    for quality in (80, 65, 50, 35):
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
