"""The experimenter's page: who, which condition, how the head is, and the buttons."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from study_at_the_page import CODE, Pages, Tab, serving

from gazerig.features.study.pages.head_link import HeadReport
from gazerig.features.study.presenter import FilmPresenter
from gazerig.features.study.records import Closed, TrialEnded
from gazerig.features.study.run.study_file import LoadedStudy, load_study


class Head:
    """A head that obeys, and says what was asked of it."""

    def __init__(self) -> None:
        self.asked: list[str] = []
        self.now = HeadReport("alive")
        self.gone = False

    def report(self) -> HeadReport:
        return self.now

    def stop(self, why: str) -> str:
        if self.gone:
            raise OSError("the rig does not answer")
        self.asked.append(f"stop: {why}")
        self.now = HeadReport("stopped", why)
        return ""

    def resume(self) -> str:
        self.asked.append("resume")
        self.now = HeadReport("alive")
        return ""


class LosableHead(FilmPresenter):
    """Shows conditions until it is lost."""

    says = ""

    def fault(self) -> str:
        return self.says


@pytest.fixture(scope="module")
def study() -> LoadedStudy:
    return load_study("nakamoto_2")


@pytest.fixture
def head() -> Head:
    return Head()


@pytest.fixture
def shows() -> LosableHead:
    return LosableHead()


@pytest.fixture
def pages(study: LoadedStudy, tmp_path: Path, head: Head, shows: LosableHead) -> Iterator[Pages]:
    with serving(study, tmp_path / CODE, {}, shows, head) as pages:
        yield pages


@pytest.fixture
def participant(pages: Pages) -> Tab:
    tab = Tab(pages.server.participant_url)
    tab.head = pages.head_has_shown
    return tab


@pytest.fixture
def experimenter(pages: Pages) -> Tab:
    return Tab(pages.server.experimenter_url)


def to(tab: Tab, kind: str) -> dict[str, Any]:
    page = tab.page()
    while page["kind"] != kind:
        page = tab.goes_through(page)
    return page


def test_it_names_the_condition_and_the_participant_s_page_does_not(
    study: LoadedStudy, pages: Pages, participant: Tab, experimenter: Tab
) -> None:
    page = to(participant, "presentation")
    state = experimenter.state()
    now = state["session"]
    shown = pages.session.order[0]
    assert (now["participant"], now["trial"], now["of"]) == (CODE, 1, 2)
    assert (now["condition"], now["label"]) == (shown, study.design.conditions[shown].label)
    assert now["showing"] and now["doing"] == "looks at the presentation"
    assert (state["head"], state["headless"], state["silent"]) == ("alive", False, False)
    assert page["film"] is None and shown not in str(page)


def test_answers_are_counted_as_they_are_kept(participant: Tab, experimenter: Tab) -> None:
    page = to(participant, "questions")
    assert experimenter.state()["session"]["answers"] == 0
    participant.goes_through(page)
    assert experimenter.state()["session"]["answers"] == len(page["items"]) == 2


def test_stop_goes_to_the_head_and_is_shown_until_it_is_taken_back(
    head: Head, experimenter: Tab
) -> None:
    assert experimenter.press("stop", why="STOP was pressed on the page") == (204, "")
    assert head.asked == ["stop: STOP was pressed on the page (the experimenter)"]
    assert experimenter.state()["stopped"] == "STOP was pressed on the page (the experimenter)"
    assert experimenter.press("resume", confirmed=True)[0] == 204
    assert experimenter.state()["stopped"] == ""


def test_a_head_that_does_not_take_a_stop_is_said(head: Head, experimenter: Tab) -> None:
    head.gone, head.now = True, HeadReport("late", "nothing heard for 2 s")
    assert experimenter.press("stop", why="now") == (503, "the rig does not answer\n")
    assert experimenter.state()["silent"]


def test_stop_waits_for_no_answer_that_is_being_written(
    pages: Pages, participant: Tab, experimenter: Tab, head: Head, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = to(participant, "questions")

    def slow(records: object) -> None:
        # The stop is taken while the disk still has the answers.
        assert experimenter.press("stop", why="slow disk")[0] == 204
        write(records)  # type: ignore[arg-type]

    write = pages.journal.write
    monkeypatch.setattr(pages.journal, "write", slow)
    participant.goes_through(page)
    assert head.asked


def test_a_pause_holds_the_next_presentation_and_not_the_questions(
    participant: Tab, experimenter: Tab
) -> None:
    page = to(participant, "questions")
    assert experimenter.press("pause") == (204, "")
    paused = participant.goes_through(page)
    assert paused["kind"] == "paused" and experimenter.state()["session"]["paused"]
    assert participant.send(paused["page"], do="begin")[0] in (200, 400)
    assert participant.page()["kind"] == "paused"
    assert experimenter.press("go on") == (204, "")
    assert participant.page()["kind"] == "ready"


def test_a_presentation_is_repeated_only_while_it_is_shown(
    pages: Pages, participant: Tab, experimenter: Tab
) -> None:
    page = to(participant, "ready")
    assert experimenter.press("repeat")[0] == 409
    participant.goes_through(page)
    assert experimenter.press("repeat") == (204, "")
    ended = pages.journal.records[-1]
    assert isinstance(ended, TrialEnded) and ended.outcome == "interrupted"
    again = participant.page()
    assert again["kind"] == "ready" and again["again"]
    assert experimenter.state()["session"]["attempt"] == 1


def test_who_is_excluded_is_so_for_a_reason(
    pages: Pages, participant: Tab, experimenter: Tab
) -> None:
    to(participant, "presentation")
    assert experimenter.press("exclude", why="  ")[0] == 503
    assert experimenter.press("exclude", why="the fire alarm went off") == (204, "")
    closed = pages.journal.records[-1]
    assert isinstance(closed, Closed) and closed.how == "excluded"
    assert closed.reason == "the fire alarm went off"
    assert participant.page()["how"] == "excluded"
    assert experimenter.state()["session"]["how"] == "excluded"
    assert b"fire alarm" not in b"".join(participant.traffic)


def test_a_head_that_is_lost_is_said_to_the_experimenter_alone(
    pages: Pages, participant: Tab, experimenter: Tab, shows: LosableHead
) -> None:
    to(participant, "presentation")
    shows.says = "/dev/ttyUSB0 is gone"
    pages.run.poll()
    assert participant.page()["kind"] == "paused"
    now = experimenter.state()["session"]
    assert (now["fault"], now["paused"]) == ("/dev/ttyUSB0 is gone", True)
    assert b"ttyUSB0" not in b"".join(participant.traffic)


def test_the_program_ends_when_the_experimenter_says_so(pages: Pages, experimenter: Tab) -> None:
    assert experimenter.press("end") == (204, "")
    assert pages.finished == 1


@pytest.mark.parametrize("body", [b"", b"[]", b'{"do": "dance"}', b'{"do": NaN}', b'{"do": []}'])
def test_what_no_button_asks_for_is_refused(pages: Pages, experimenter: Tab, body: bytes) -> None:
    status, words = experimenter.get("/rig/ask", body)
    assert status in (400, 503) and words
    assert pages.run.state().paused is False
