"""A participant at a browser: by keyboard alone, with a reload, a lost connection, on a phone."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from browser import Browser, browsing
from page_layout import value, violations
from shown_page import wait_for
from study_at_the_page import CODE, Pages, Tab, serving

from gazerig.features.study.journal import (
    AnswerValue,
    ItemAnswered,
    TrialBegan,
    TrialEnded,
    WriteFailed,
)
from gazerig.features.study.run.study_file import LoadedStudy, load_study

pytestmark = [pytest.mark.browser, pytest.mark.slow]

PHONE, DESK = (390, 844), (1280, 720)
FILM_S = 2.0


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("films") / "film.webm"
    out = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"VP80"), 10.0, (64, 48))  # type: ignore[attr-defined]
    for i in range(int(10 * FILM_S)):
        out.write(np.full((48, 64, 3), 10 * i, np.uint8))
    out.release()
    return path


@pytest.fixture(scope="module")
def study() -> LoadedStudy:
    """Two conditions, a practice trial, a rest between the two, Japanese."""
    study = load_study("nakamoto_1")
    trials = replace(study.design.trials, seconds=FILM_S, practice=1, rest_every=1, rest_s=0.5)
    return replace(study, design=replace(study.design, language="ja", trials=trials))


@pytest.fixture
def pages(study: LoadedStudy, film: Path, tmp_path: Path) -> Iterator[Pages]:
    with serving(study, tmp_path / CODE, dict.fromkeys(study.design.conditions, film)) as pages:
        yield pages


@pytest.fixture(scope="module")
def desk() -> Iterator[Browser]:
    with browsing(DESK) as tab:
        yield tab


@contextmanager
def on_a_phone(tab: Browser) -> Iterator[Browser]:
    """Have a tab as narrow as a phone."""

    def size(width: int, height: int) -> None:
        shape = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        tab.ask("Emulation.setDeviceMetricsOverride", **shape)
        wait_for(lambda: value(tab, "innerWidth") == width, "the size")

    size(*PHONE)
    yield tab
    size(*DESK)


class Participant:
    """The person at the browser."""

    def __init__(self, tab: Browser) -> None:
        self.tab = tab

    def key(self, name: str) -> None:
        text = {"Enter": "\r", "Tab": ""}.get(name, name if len(name) == 1 else "")
        code = {"Enter": 13, "Tab": 9, "Escape": 27}.get(name, 0)
        self.tab.ask(
            "Input.dispatchKeyEvent", type="keyDown", key=name, text=text, windowsVirtualKeyCode=code
        )  # fmt: skip
        self.tab.ask("Input.dispatchKeyEvent", type="keyUp", key=name, windowsVirtualKeyCode=code)

    def sees(self, kind: str) -> None:
        there = f"document.querySelector('#sheet.{kind} h1') !== null"
        wait_for(lambda: value(self.tab, there), f"the page {kind}")

    def says(self, script: str) -> Any:
        return value(self.tab, script)

    def well_made(self) -> None:
        """Nothing is wider than the window, and axe-core finds no serious fault."""
        wide = self.says("document.documentElement.scrollWidth - innerWidth")
        assert (wide, violations(self.tab)) == (0, [])


def kept(pages: Pages) -> list[AnswerValue]:
    return [one.value for one in pages.journal.records if isinstance(one, ItemAnswered)]


def test_a_whole_session_by_keyboard_alone(pages: Pages, desk: Browser) -> None:
    person = Participant(desk)
    desk.go(pages.server.participant_url)
    person.sees("consent")
    assert person.says("document.documentElement.lang") == "ja"
    assert person.says("document.querySelectorAll('input:checked').length") == 0
    person.well_made()
    person.key("Enter")  # consents to nothing that is not ticked
    assert person.says("document.activeElement.id") == "use-agree"
    person.key(" ")
    person.key("Enter")
    person.sees("instructions")
    person.key("Enter")
    for number in range(3):
        person.sees("ready")
        person.key("Enter")
        person.sees("questions")  # when the film has ended
        assert person.says("document.querySelectorAll('input:checked').length") == 0
        person.key("4")
        person.key("Enter")  # the second is still open
        assert person.says("document.querySelector('fieldset.open') !== null")
        person.well_made()
        person.key("2")
        person.key("Enter")
        if number == 1:
            person.sees("rest")
            wait_for(
                lambda: person.says("!document.querySelector('#sheet button').disabled"), "its end"
            )
            person.key("Enter")
    wait_for(lambda: person.says("document.querySelector('textarea') !== null"), "free text")
    person.key("Tab")
    person.key("a")
    person.tab.run("document.querySelector('button[type=submit]').focus()")
    person.key("Enter")
    person.sees("end")
    assert kept(pages) == [4, 2, 4, 2, 4, 2, "a"]
    assert {one.outcome for one in pages.journal.records if isinstance(one, TrialEnded)} == {
        "complete"
    }
    assert all(url.startswith((pages.server.participant_url.partition("?")[0], "blob:"))
               for url in desk.asked_for if not url.startswith(("chrome", "about", "data")))  # fmt: skip


def test_questions_stay_open_where_the_study_permits_it(
    study: LoadedStudy, film: Path, tmp_path: Path, desk: Browser
) -> None:
    free = replace(study, design=replace(study.design, may_skip=True))
    films = dict.fromkeys(study.design.conditions, film)
    with serving(free, tmp_path / CODE, films) as pages:
        tab = Tab(pages.server.participant_url)
        page = tab.page()
        while page["kind"] != "questions":
            page = tab.goes_through(page)
        person = Participant(desk)
        desk.go(pages.server.participant_url)
        person.sees("questions")
        person.well_made()
        person.key("4")
        person.key("Enter")
        person.sees("ready")
        assert kept(pages) == [4, None]


def test_a_reload_loses_no_answer_and_a_film_begins_again(pages: Pages, desk: Browser) -> None:
    person = Participant(desk)
    desk.go(pages.server.participant_url)
    person.sees("consent")
    person.says("document.getElementById('use-agree').click()")
    person.says("document.querySelector('form').requestSubmit()")
    person.sees("instructions")
    person.key("Enter")
    person.sees("ready")
    person.key("Enter")
    person.sees("presentation")
    wait_for(lambda: person.says("document.querySelector('video')?.currentTime > 0.2"), "the film")
    desk.ask("Page.reload")
    wait_for(lambda: person.says("document.querySelector('.again') !== null"), "the words")
    person.key("Enter")
    wait_for(lambda: person.says("document.querySelector('video')?.currentTime > 0.2"), "the film")
    person.says("""Object.defineProperty(document, 'hidden', {get: () => true, configurable: true});
        document.dispatchEvent(new Event('visibilitychange')); delete document.hidden""")
    wait_for(lambda: person.says("document.querySelector('.ready .again') !== null"), "the words")
    person.key("Enter")
    person.sees("questions")
    tries = [one.attempt for one in pages.journal.records if isinstance(one, TrialBegan)]
    assert tries == [0, 1, 2]
    person.key("5")
    desk.ask("Page.reload")
    wait_for(lambda: person.says("document.querySelectorAll('input:checked').length == 1"), "it")
    person.key("Enter")
    person.key("1")
    person.key("Enter")
    person.sees("ready")
    assert kept(pages) == [5, 1]


def test_what_is_not_kept_is_said_and_goes_on_by_itself_on_a_phone(
    pages: Pages, desk: Browser, monkeypatch: pytest.MonkeyPatch
) -> None:
    refusals = 0

    def full(records: object) -> None:
        nonlocal refusals
        refusals += 1
        raise WriteFailed("no space left on device")

    with on_a_phone(desk) as tab:
        person = Participant(tab)
        tab.go(pages.server.participant_url)
        person.sees("consent")
        person.well_made()
        person.says("document.getElementById('use-agree').click()")
        with monkeypatch.context() as now:
            now.setattr(pages.journal, "write", full)
            person.says("document.querySelector('form').requestSubmit()")
            wait_for(
                lambda: person.says("document.querySelector('#notice.not_saved button') !== null"),
                "it",
            )
            person.well_made()
            person.sees("consent")
            person.says("document.querySelector('#notice button').click()")
            wait_for(lambda: refusals > 1, "another try")
        person.sees("instructions")
        person.key("Escape")
        wait_for(lambda: person.says("document.getElementById('leave').open"), "the question")
        person.well_made()
        person.says("document.getElementById('leave-yes').click()")
        person.sees("end")
        assert pages.session.closed


def test_a_browser_that_cannot_show_films_is_told_before_anything_is_asked(pages: Pages) -> None:
    with browsing(DESK) as tab:
        cannot = "HTMLMediaElement.prototype.canPlayType = () => ''"
        tab.ask("Page.addScriptToEvaluateOnNewDocument", source=cannot)
        person = Participant(tab)
        tab.go(pages.server.participant_url)
        person.sees("consent")
        assert "Firefox" in person.says("document.querySelector('#sheet [role=alert]').textContent")
        assert not person.says("document.querySelector('#sheet form') !== null")
        person.well_made()
        experimenter = Tab(pages.server.experimenter_url)
        wait_for(lambda: "cannot play the films" in experimenter.state()["trouble"], "the word")
    assert not pages.journal.records[1:]


def test_a_connection_that_was_lost_comes_back_with_what_was_answered(
    pages: Pages, desk: Browser
) -> None:
    person = Participant(desk)
    desk.go(pages.server.participant_url)
    person.sees("consent")
    pages.server.close()
    person.says("document.getElementById('use-agree').click()")
    person.says("document.querySelector('form').requestSubmit()")
    wait_for(lambda: person.says("document.querySelector('#notice.not_saved') !== null"), "words")
    pages.serve_again()
    person.sees("instructions")
    assert pages.session.consent_given() == (False, False)
    # Another person continues, e.g. the experimenter; the page is notified.
    pages.run.exclude("the end of the test")
    pages.server.notify()
    person.sees("end")
