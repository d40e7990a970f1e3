"""The participant's page: nothing of the conditions, nothing twice, nothing lost."""

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from http.client import HTTPConnection
from pathlib import Path
from socket import gethostname
from typing import Any
from urllib.parse import urlsplit

import pytest
from page_visitor import fetch
from study_at_the_page import CODE, EXPERIMENTER, PARTICIPANT, Pages, Tab, answers, serving

from gazerig.features.study.design import Condition
from gazerig.features.study.journal import (
    ConsentGiven,
    ItemAnswered,
    ParticipationClosed,
    TrialBegan,
    TrialEnded,
    WriteFailed,
)
from gazerig.features.study.pages import server
from gazerig.features.study.pages.experimenter_line import HeadReport
from gazerig.features.study.pages.study_files import FOLDER, HEADERS
from gazerig.features.study.run.study_file import LoadedStudy, load_study
from gazerig.features.study.shipped import HOME
from gazerig.features.study.study_run import FilmPresenter
from gazerig.robot.dashboard.door import browsers
from gazerig.robot.dashboard.door.admission import page_url

STUDIES = sorted(path.stem for path in (HOME / "studies").glob("*.yaml"))


@pytest.fixture(scope="module")
def studies() -> dict[str, LoadedStudy]:
    return {name: load_study(name) for name in STUDIES}


def films_of(study: LoadedStudy, folder: Path) -> dict[str, Path]:
    """Films of the conditions, in files that are called after them."""
    films = {key: folder / f"{key}.webm" for key in study.design.conditions}
    for path in films.values():
        path.write_bytes(bytes(range(256)) * 4)
    return films


@pytest.fixture
def pages(studies: dict[str, LoadedStudy], tmp_path: Path) -> Iterator[Pages]:
    study = studies["default_against_papers"]
    with serving(study, tmp_path / CODE, films_of(study, tmp_path)) as pages:
        yield pages


@pytest.fixture
def tab(pages: Pages) -> Tab:
    return Tab(pages.server.participant_url)


def to(tab: Tab, kind: str) -> dict[str, Any]:
    """Go on to the next page of a kind."""
    page = tab.page()
    while page["kind"] != kind:
        page = tab.goes_through(page)
    return page


def whole_session(study: LoadedStudy, folder: Path) -> tuple[list[bytes], list[bytes]]:
    """Every byte that a participant's browser gets: until the debriefing, and with it."""
    folder.mkdir()
    with serving(study, folder / CODE, films_of(study, folder)) as pages:
        tab = Tab(pages.server.participant_url)
        tab.head = pages.head_has_shown
        tab.get("/")
        page = tab.page()
        while page["kind"] != "end":
            before = list(tab.traffic)
            page = tab.goes_through(page)
    ours = [re.sub(rb"(?i)date: .*|127\.0\.0\.1:\d+|study_\d+", b"", one) for one in before]
    return ours, tab.traffic[len(before) :]


def names(study: LoadedStudy) -> set[str]:
    """What would tell a participant which condition it is.

    Words that the questions themselves use, e.g. "robot", tell nothing.
    """
    out: set[str] = set()
    for key, condition in study.design.conditions.items():
        out |= {
            key,
            *condition.params,
            *(v for v in vars(condition).values() if isinstance(v, str)),
        }
    asked = str((study.design.welcome, study.questionnaires))
    return {one for one in out if one and not re.search(rf"\b{re.escape(one)}\b", asked)}


# --- blindness ----------------------------------------


@pytest.mark.parametrize("name", STUDIES)
def test_no_name_of_a_condition_reaches_the_participant(
    studies: dict[str, LoadedStudy], tmp_path: Path, name: str
) -> None:
    study = studies[name]
    traffic, _ = whole_session(study, tmp_path / "session")
    sent = (
        b"\n".join(traffic)
        .replace(HEADERS["Content-Security-Policy"].encode(), b"")
        .decode("latin1")
    )
    assert len(sent) > 5000 and len(names(study)) >= 2
    found = {one for one in names(study) if re.search(rf"(?i)(?<!\w){re.escape(one)}(?!\w)", sent)}
    assert not found


def test_the_traffic_is_the_same_byte_by_byte_whatever_the_conditions_are(
    studies: dict[str, LoadedStudy], tmp_path: Path
) -> None:
    study = studies["default_against_papers"]
    others = {f"zebra{i}": Condition(label=f"other {i}") for i in range(3)}
    other = replace(
        study,
        design=replace(study.design, conditions=others),
        rigs=dict(zip(others, study.rigs.values(), strict=True)),
    )
    traffic, debriefing = whole_session(study, tmp_path / "one")
    assert whole_session(other, tmp_path / "other")[0] == traffic
    # Only then does it explain the study, in the words of the design.
    assert study.design.debriefing[0].encode() in b"".join(debriefing)
    assert study.design.debriefing[0].encode() not in b"".join(traffic)


def test_files_of_the_page_are_those_of_every_study() -> None:
    for path in FOLDER.iterdir():
        text = path.read_text(encoding="utf-8")
        assert not re.search(r"https?://|//\w+\.\w|@import|\bimport\(", text), path.name


def test_a_film_has_no_name_date_or_tag_and_is_there_only_while_it_is_shown(
    pages: Pages, tab: Tab
) -> None:
    page = to(tab, "presentation")
    asked = HTTPConnection(urlsplit(tab.url).netloc)
    asked.request("GET", page["film"], headers=tab.headers)
    answer = asked.getresponse()
    assert answer.status == 200 and len(answer.read()) == 1024
    told = {name.lower() for name, _ in answer.getheaders()}
    always = {"content-type", "content-length", "connection", "date", "server"}
    assert told == {*always, *map(str.lower, HEADERS)}
    asked.close()
    assert tab.get("/study/film/0123456789abcdef0123")[0] == 404
    tab.goes_through(page)
    assert tab.get(page["film"])[0] == 404


def test_the_same_condition_has_another_film_address_each_time(pages: Pages, tab: Tab) -> None:
    page = to(tab, "presentation")
    cut = tab.do(page["page"], do="seen", seconds=0.0)
    assert cut["kind"] == "ready" and cut["again"]
    again = tab.do(cut["page"], do="begin")
    assert again["film"] != page["film"]


# --- who may come in ----------------------------------------


def test_each_token_opens_its_own_page_alone(pages: Pages, tab: Tab) -> None:
    url = tab.url
    assert fetch(f"{url}/")[0] == 403
    assert fetch(f"{url}/study/page?token={EXPERIMENTER}")[0] == 403
    assert fetch(f"{url}/experimenter?token={PARTICIPANT}")[0] == 403
    for path in ("/experimenter", "/rig/line", "/rig/stop.js"):
        assert tab.get(path)[0] == 403
    assert tab.get("/rig/ask", b'{"do": "pause"}')[0] == 403
    assert pages.run.state().paused is False
    experimenter = Tab(pages.server.experimenter_url)
    assert experimenter.get("/experimenter")[0] == 200
    assert experimenter.get("/study/experimenter.js")[0] == 200
    assert experimenter.get("/study/page")[0] == 403


def test_another_origin_may_not_answer(pages: Pages, tab: Tab) -> None:
    tab.headers["Origin"] = "http://elsewhere.example"
    body = json.dumps({"page": pages.run.now()[0], "once": "1", "do": "withdraw"}).encode()
    assert tab.get("/study/done", body)[0] == 403
    assert not pages.session.closed


# --- nothing twice, nothing lost ----------------------------------------


def test_what_is_sent_twice_is_done_once(pages: Pages, tab: Tab) -> None:
    page = to(tab, "questions")
    body = json.dumps(
        {"page": page["page"], "once": "the same", "do": "answer", "answers": answers(page)}
    ).encode()
    first, second = (tab.get("/study/done", body) for _ in range(2))
    assert first == second and first[0] == 200
    kept = [one for one in pages.journal.records if isinstance(one, ItemAnswered)]
    assert len(kept) == len(page["items"])


def test_another_tab_that_is_late_changes_nothing_and_sees_where_it_is(
    pages: Pages, tab: Tab
) -> None:
    other = Tab(pages.server.participant_url)
    page = to(tab, "questions")
    assert other.page() == page
    shown = tab.goes_through(page)
    count = len(pages.journal.records)
    late = other.send(page["page"], do="answer", answers=answers(page, rating=5))
    assert late == (409, shown)
    assert len(pages.journal.records) == count


def test_what_the_disk_does_not_take_is_said_and_taken_when_it_can_be(
    pages: Pages, tab: Tab, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = to(tab, "questions")
    before = pages.journal.records

    def full(records: object) -> None:
        raise WriteFailed("/secret/default/P007: no space left on device")

    with monkeypatch.context() as now:
        now.setattr(pages.journal, "write", full)
        status, words = tab.send(page["page"], do="answer", answers=answers(page))
        assert (status, words) == (507, "not kept\n")
        assert "no space left" in Tab(pages.server.experimenter_url).state()["trouble"]
    assert pages.journal.records == before and tab.page() == page
    assert tab.do(page["page"], do="answer", answers=answers(page))["kind"] != "ready"
    assert Tab(pages.server.experimenter_url).state()["trouble"] == ""


def test_a_session_that_was_cut_off_takes_the_answers_of_the_page_that_stood(
    studies: dict[str, LoadedStudy], tmp_path: Path
) -> None:
    study = studies["nakamoto_1"]
    films = films_of(study, tmp_path)
    with serving(study, tmp_path / CODE, films) as pages:
        page = to(Tab(pages.server.participant_url), "questions")
    with serving(study, tmp_path / CODE, films) as pages:
        tab = Tab(pages.server.participant_url)
        assert tab.page() == page
        tab.do(page["page"], do="answer", answers=answers(page))
        kept = [one.value for one in pages.journal.records if isinstance(one, ItemAnswered)]
        assert kept == [2] * len(page["items"])


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"{}",
        b"[1]",
        b"\xff\xfe",
        b'{"do": "dance", "page": "PAGE", "once": "1"}',
        b'{"do": "answer", "page": "PAGE", "once": "1", "answers": []}',
        b'{"do": "answer", "page": "PAGE", "once": "1", "answers": [{"key": "0", "value": 9, "ms": 1}]}',
        b'{"do": "answer", "page": "PAGE", "once": "1", "answers": [{"key": "x", "value": 1, "ms": 1}]}',
        b'{"do": "answer", "page": "PAGE", "once": "1", "answers": [{"key": "0", "value": true, "ms": 1}]}',
        b'{"do": "answer", "page": "PAGE", "once": "1", "answers": [{"key": "0", "value": 1, "ms": 1}, '
        b'{"key": "0", "value": 2, "ms": 1}]}',
        b'{"do": "seen", "page": "PAGE", "once": "1", "seconds": "long"}',
        b'{"do": "begin", "page": 3, "once": "1"}',
    ],
)  # fmt: skip
def test_what_cannot_be_done_on_the_page_is_refused_and_nothing_is_kept(
    pages: Pages, tab: Tab, body: bytes
) -> None:
    page = to(tab, "questions")
    count = len(pages.journal.records)
    status, words = tab.get("/study/done", body.replace(b"PAGE", page["page"].encode()))
    assert status == 400 and words
    assert len(pages.journal.records) == count and tab.page() == page


def test_more_than_a_page_of_answers_holds_is_not_read(pages: Pages, tab: Tab) -> None:
    assert tab.get("/study/done", b" " * 300_000)[0] == 413


# --- the pages ----------------------------------------


def consented(pages: Pages, asked: list[str], ticked: list[str]) -> tuple[bool, bool, bool]:
    """Whether taking part, pictures, and gaze were consented to."""
    tab = Tab(pages.server.participant_url)
    page = tab.page()
    assert (page["kind"], page["uses"]) == ("consent", asked)
    tab.do(page["page"], do="consent", given=True, uses=ticked)
    said = next(one for one in pages.journal.records if isinstance(one, ConsentGiven))
    return said.given, said.pictures, said.gaze


def test_uses_that_were_not_ticked_are_not_consented_to(
    studies: dict[str, LoadedStudy], tmp_path: Path
) -> None:
    with serving(studies["nakamoto_2"], tmp_path / CODE, {}) as pages:  # no pictures
        assert consented(pages, ["gaze"], ["pictures"]) == (True, False, False)


def test_films_ask_for_no_use_of_a_camera(pages: Pages) -> None:
    assert consented(pages, [], ["gaze", "pictures"]) == (True, False, False)


def test_who_declines_is_thanked_and_has_no_code(pages: Pages, tab: Tab) -> None:
    end = tab.do(tab.page()["page"], do="consent", given=False, uses=[])
    assert (end["kind"], end["outcome"], end["code"], end["text"]) == ("end", "declined", "", [])


def test_who_leaves_is_told_nothing_of_the_conditions_and_keeps_the_code(
    pages: Pages, tab: Tab
) -> None:
    end = tab.do(to(tab, "presentation")["page"], do="withdraw")
    assert (end["outcome"], end["code"], end["text"]) == ("withdrawn", CODE, [])
    ended, closed = pages.journal.records[-2:]
    assert isinstance(ended, TrialEnded) and ended.outcome == "withdrawn"
    assert isinstance(closed, ParticipationClosed) and closed.outcome == "withdrawn"


def test_a_film_that_was_not_seen_to_its_end_counts_as_an_attempt(pages: Pages, tab: Tab) -> None:
    page = to(tab, "presentation")
    ready = tab.do(page["page"], do="seen", seconds=0.5 * page["seconds"])
    assert ready["kind"] == "ready" and ready["again"]
    tab.do(ready["page"], do="begin")
    began, ended, again = pages.journal.records[-3:]
    assert isinstance(began, TrialBegan) and isinstance(again, TrialBegan)
    assert isinstance(ended, TrialEnded) and ended.outcome == "interrupted"
    assert (again.trial, again.attempt) == (began.trial, began.attempt + 1)


def test_a_film_that_was_not_fetched_was_not_seen(pages: Pages, tab: Tab) -> None:
    page = to(tab, "presentation")
    asked = HTTPConnection(urlsplit(tab.url).netloc)
    asked.request("HEAD", page["film"], headers=tab.headers)
    assert asked.getresponse().status == 200
    asked.close()
    ready = tab.do(page["page"], do="seen", seconds=page["seconds"])
    assert ready["kind"] == "ready" and ready["again"]
    ended = pages.journal.records[-1]
    assert isinstance(ended, TrialEnded) and ended.reason == "the film was not fetched"


def test_questions_have_numbers_and_no_names_of_items_or_scales(pages: Pages, tab: Tab) -> None:
    page = to(tab, "questions")
    page = page if len(page["items"]) == 24 else tab.goes_through(page)
    assert [one["key"] for one in page["items"]] == [str(i) for i in range(24)]
    assert set(page["items"][0]) == {"key", "kind", "points", "language", "text", "low", "high"}


def test_a_page_says_that_questions_may_be_skipped_and_takes_none(
    studies: dict[str, LoadedStudy], tmp_path: Path
) -> None:
    study = studies["nakamoto_1"]
    study = replace(study, design=replace(study.design, may_skip=True))
    with serving(study, tmp_path / CODE, films_of(study, tmp_path)) as pages:
        tab = Tab(pages.server.participant_url)
        page = to(tab, "questions")
        assert page["may_skip"]
        left = [{"key": one["key"], "value": None, "ms": 5.0} for one in page["items"]]
        assert tab.do(page["page"], do="answer", answers=left)["page"] != page["page"]
        kept = [one.value for one in pages.journal.records if isinstance(one, ItemAnswered)]
    assert kept == [None, None]


def test_items_that_are_not_translated_are_english_and_say_so(
    studies: dict[str, LoadedStudy], tmp_path: Path
) -> None:
    study = studies["default_against_papers"]
    study = replace(study, design=replace(study.design, language="ja"))
    with serving(study, tmp_path / CODE, films_of(study, tmp_path)) as pages:
        tab = Tab(pages.server.participant_url)
        assert b'<html lang="ja">' in tab.get("/")[1]
        assert "印象" in tab.page()["welcome"][-1]
        papers = to(tab, "questions")
        godspeed = tab.goes_through(papers)
    assert {one["language"] for one in papers["items"]} == {"ja"}
    assert "視線" in papers["instruction"] and papers["instruction_language"] == "ja"
    assert godspeed["instruction"] and godspeed["instruction_language"] == "en"
    assert {one["language"] for one in godspeed["items"]} == {"en"}
    assert all(one["low"] and one["high"] for one in godspeed["items"])


def test_the_name_of_the_present_page_is_pushed(pages: Pages, tab: Tab) -> None:
    line = HTTPConnection(urlsplit(tab.url).netloc, timeout=20.0)
    line.request("GET", "/study/news", headers=tab.headers)
    answer = line.getresponse()
    assert answer.getheader("Content-Type") == "text/event-stream"
    page = tab.page()
    assert answer.readline() == f"data: {page['page']}\n".encode() and answer.readline() == b"\n"
    then = tab.goes_through(page)
    while (said := answer.readline()) in (b"\n", f"data: {page['page']}\n".encode()):
        pass
    assert said == f"data: {then['page']}\n".encode()
    line.close()


def test_what_listens_is_not_cut_off_as_a_slow_request_is(
    studies: dict[str, LoadedStudy], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("BUSY_S", "IDLE_S", "_LOOK_EVERY_S"):
        monkeypatch.setattr(browsers, name, 0.05)
    monkeypatch.setattr(server, "_BEAT_S", 0.1)
    study = studies["nakamoto_1"]
    with serving(study, tmp_path / CODE, {}) as pages:
        tab = Tab(pages.server.participant_url)
        line = HTTPConnection(urlsplit(tab.url).netloc, timeout=20.0)
        line.request("GET", "/study/news", headers=tab.headers)
        answer = line.getresponse()
        said = [answer.readline() for _ in range(10)]  # half a second, ten times what is allowed
        line.close()
    assert all(said)


@pytest.mark.parametrize(
    ("host", "there"),
    [
        ("127.0.0.1", "http://127.0.0.1:8090"),
        ("::1", "http://[::1]:8090"),
        ("0.0.0.0", f"http://{gethostname()}:8090"),
    ],
)
def test_who_is_to_come_in_is_given_an_address_that_leads_here(host: str, there: str) -> None:
    assert page_url(host, 8090) == there


# --- The experimenter's page: who, which condition, how the head is, and the buttons


class Head:
    """A head that obeys and records its commands."""

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
def lossy(study: LoadedStudy, tmp_path: Path, head: Head, shows: LosableHead) -> Iterator[Pages]:
    with serving(study, tmp_path / CODE, {}, shows, head) as lossy:
        yield lossy


@pytest.fixture
def participant(lossy: Pages) -> Tab:
    tab = Tab(lossy.server.participant_url)
    tab.head = lossy.head_has_shown
    return tab


@pytest.fixture
def experimenter(lossy: Pages) -> Tab:
    return Tab(lossy.server.experimenter_url)


def test_it_names_the_condition_and_the_participant_s_page_does_not(
    study: LoadedStudy, lossy: Pages, participant: Tab, experimenter: Tab
) -> None:
    page = to(participant, "presentation")
    state = experimenter.state()
    now = state["session"]
    shown = lossy.session.order[0]
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
    lossy: Pages, participant: Tab, experimenter: Tab, head: Head, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = to(participant, "questions")

    def slow(records: object) -> None:
        # The stop is taken while the disk still has the answers.
        assert experimenter.press("stop", why="slow disk")[0] == 204
        write(records)  # type: ignore[arg-type]

    write = lossy.journal.write
    monkeypatch.setattr(lossy.journal, "write", slow)
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
    lossy: Pages, participant: Tab, experimenter: Tab
) -> None:
    page = to(participant, "ready")
    assert experimenter.press("repeat")[0] == 409
    participant.goes_through(page)
    assert experimenter.press("repeat") == (204, "")
    ended = lossy.journal.records[-1]
    assert isinstance(ended, TrialEnded) and ended.outcome == "interrupted"
    again = participant.page()
    assert again["kind"] == "ready" and again["again"]
    assert experimenter.state()["session"]["attempt"] == 1


def test_who_is_excluded_is_so_for_a_reason(
    lossy: Pages, participant: Tab, experimenter: Tab
) -> None:
    to(participant, "presentation")
    assert experimenter.press("exclude", why="  ")[0] == 503
    assert experimenter.press("exclude", why="the fire alarm went off") == (204, "")
    closed = lossy.journal.records[-1]
    assert isinstance(closed, ParticipationClosed) and closed.outcome == "excluded"
    assert closed.reason == "the fire alarm went off"
    assert participant.page()["outcome"] == "excluded"
    assert experimenter.state()["session"]["outcome"] == "excluded"
    assert b"fire alarm" not in b"".join(participant.traffic)


def test_a_head_that_is_lost_is_said_to_the_experimenter_alone(
    lossy: Pages, participant: Tab, experimenter: Tab, shows: LosableHead
) -> None:
    to(participant, "presentation")
    shows.says = "/dev/ttyUSB0 is gone"
    lossy.run.poll()
    assert participant.page()["kind"] == "paused"
    now = experimenter.state()["session"]
    assert (now["fault"], now["paused"]) == ("/dev/ttyUSB0 is gone", True)
    assert b"ttyUSB0" not in b"".join(participant.traffic)


def test_the_program_ends_when_the_experimenter_says_so(lossy: Pages, experimenter: Tab) -> None:
    assert experimenter.press("end") == (204, "")
    assert lossy.finished == 1


@pytest.mark.parametrize("body", [b"", b"[]", b'{"do": "dance"}', b'{"do": NaN}', b'{"do": []}'])
def test_what_no_button_asks_for_is_refused(lossy: Pages, experimenter: Tab, body: bytes) -> None:
    status, words = experimenter.get("/rig/ask", body)
    assert status in (400, 503) and words
    assert lossy.run.state().paused is False
