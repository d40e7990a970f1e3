"""Photograph a study's pages: python docs/study/make_study_pictures.py (9 s, with Chromium)."""

import sys
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

TESTS = Path(__file__).parents[2] / "tests"
sys.path[:0] = [str(TESTS), str(TESTS / "study")]

from browser import browsing  # noqa: E402
from page_layout import value  # noqa: E402
from PIL import Image  # noqa: E402
from shown_page import wait_for  # noqa: E402
from study_at_the_page import CODE, Pages, Tab, serving  # noqa: E402

from gazerig.features.study.pages.experimenter_line import HeadReport, NoHead  # noqa: E402
from gazerig.features.study.run.study_file import load_study  # noqa: E402

OUT = Path(__file__).parent
DESK, PHONE = (1000, 560), (390, 560)
GAP_PX = 20


class Head(NoHead):
    """A head that is well."""

    def report(self) -> HeadReport:
        """Return that it is."""
        return HeadReport("alive")


def photograph(address: str, window_px: tuple[int, int], ready: str, done: str = "") -> Image.Image:
    """Return a page, once a script says that it is there, after another script."""
    with browsing(window_px) as browser:
        browser.go(address)
        wait_for(lambda: value(browser, ready), "the page")
        if done:
            value(browser, done)
        return Image.open(BytesIO(browser.photograph())).convert("RGB")


def on(pages: Pages, kind: str) -> None:
    """Go on to a page of the session."""
    tab = Tab(pages.server.participant_url)
    tab.head = pages.head_has_shown
    page = tab.page()
    while page["kind"] != kind:
        page = tab.goes_through(page)


def main() -> None:
    """Write both pictures."""
    with (
        TemporaryDirectory() as folder,
        serving(load_study("nakamoto_2"), Path(folder) / CODE, {}, None, Head()) as pages,
    ):
        on(pages, "presentation")
        pages.now_s = 12.0
        there = "document.getElementById('head')?.textContent === 'alive'"
        experimenter = photograph(pages.server.experimenter_url, DESK, there)
        pages.head_has_shown()
        there = "document.querySelector('#sheet.questions') !== null"
        answered = "document.querySelectorAll('input')[3].click()"
        url = pages.server.participant_url
        desk, phone = (photograph(url, size, there, answered) for size in (DESK, PHONE))
    both = Image.new("RGB", (desk.width + GAP_PX + phone.width, desk.height), "white")
    both.paste(desk, (0, 0))
    both.paste(phone, (desk.width + GAP_PX, 0))
    both.save(OUT / "study-questions.webp", quality=80, method=6)
    experimenter.save(OUT / "study-experimenter.webp", quality=80, method=6)


if __name__ == "__main__":
    main()
