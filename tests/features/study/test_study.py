"""Designs, sessions, data and reports; short studies have films that are made in an instant."""

import itertools
import json
import signal
import time
from collections import Counter
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from browser import browsing
from command_line import invoked
from shown_page import free_port
from slow_rigs import at_rate
from study_program import Program

from gazerig.config.load import ConfigError
from gazerig.config.shipped_files import shipped_names
from gazerig.drivers.errors import SetupError
from gazerig.errors import HeadEnded
from gazerig.features.lab.film_writer import film_writer
from gazerig.features.study import film, session
from gazerig.features.study.analyse import analyse_study
from gazerig.features.study.design import HOME, Study, load_study, participant_order, williams
from gazerig.features.study.journal import Journal, StudyFolder
from gazerig.features.study.session import PageEvent, StudySession
from gazerig.features.study.simulate import condition_levels, simulate_study

STUDY = """\
title: Short
conditions:
  alpha: { profile: mitake }
  beta: {}
trials: { seconds: 2, practice: 0 }
questionnaires: [nakamoto_tsuruno]
after: [free_text]
debriefing: [It was the difference.]
hypotheses: [{ measure: nakamoto_tsuruno.naturalness, better: alpha, than: beta }]
participants: 2
"""


@pytest.fixture
def study(tmp_path, monkeypatch) -> Path:
    """A study of two films of two seconds, of which a quarter is shown and is enough."""

    def draw(study: Study, key: str, path: Path, progress: object) -> None:
        with film_writer(path, (64, 64), 10.0) as write:
            for _ in range(5):
                write(np.full((64, 64, 3), 100 * (key == "beta"), np.uint8))

    monkeypatch.setattr(film, "_render", draw)
    monkeypatch.setattr(session, "WHOLE_SHARE", 0.2)
    path = tmp_path / "short.yaml"
    path.write_text(STUDY)
    film.films(load_study(str(path)), tmp_path / "data" / "films", lambda what, share: None)
    return path


@pytest.fixture
def program(tmp_path) -> Any:
    """Starts ``gazerig study run`` at one address; kills it at the end."""
    started: list[Program] = []
    address = f"127.0.0.1:{free_port()}"

    def start(*words: str) -> Program:
        data = ("--data", str(tmp_path / "data"), "--page", address, "--no-browser")
        started.append(Program(*words, "--participant", "1", *data))
        return started[-1]

    yield start
    for one in started:
        one.process.kill()
        one.process.wait()


def session_of(study: Path, journal: Journal) -> StudySession:
    """A session whose clock advances by a minute whenever it is read."""
    now_s = itertools.count(0.0, 60.0).__next__
    return StudySession(load_study(str(study)), 1, journal, now_s, lambda: "now")


def events(session: StudySession) -> list[str]:
    """Do what each page asks for to the end; return the steps."""
    steps: list[str] = []
    do = {"consent": "consent", "ready": "begin", "presentation": "seen", "questions": "answer"}
    while (step := session.place.step) != "end":
        steps.append(step)
        session.film_fetched()
        kinds = {"rating": 3, "choice": "first", "text": "well"}
        values: list[Any] = [kinds[item.kind] for _, item in session.items()]
        assert session.handle(PageEvent(session.page, do[step], values, [900.0] * len(values)))
    return steps


Start = Callable[..., Program]


@pytest.mark.parametrize("n", range(2, 7))
def test_orders_balance_positions_and_successors(n):
    rows = williams(n)
    each = len(rows) // n
    assert all(set(Counter(column).values()) == {each} for column in zip(*rows, strict=True))
    successors = Counter(pair for row in rows for pair in pairwise(row))
    assert len(successors) == n * (n - 1) and set(successors.values()) == {each}


def test_pairs_are_seen_in_both_orders(tmp_path):
    path = tmp_path / "pairs.yaml"
    path.write_text(
        "title: Pairs\ntask: pairwise\nquestionnaires: [choice]\nparticipants: 12\n"
        "conditions: {a: {profile: robot}, b: {profile: mitake}, c: {profile: nakamoto}}\n"
        "hypotheses: [{measure: choice.alive, better: a, than: b, test: sign}]\n"
    )
    study = load_study(str(path))
    seen = Counter(pair for n in range(1, 13) for pair in participant_order(study.design, n))
    assert len(seen) == 6 and set(seen.values()) == {6}


def faults(path: Path, text: str) -> list[str]:
    path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        load_study(str(path))
    return [f"{fault.line} {fault.key}" for fault in caught.value.faults]


def test_faults_name_line_and_key(study):
    text = study.read_text()
    both = text.replace("title: Short", "titel: Short").replace("seconds: 2", "seconds: 1")
    assert {"1 titel", "5 trials.seconds"} <= set(faults(study, both))
    assert faults(study, text.replace(".naturalness", ".beauty")) == ["9 hypotheses.0.measure"]
    assert faults(study, text.replace("than: beta", "than: gamma")) == ["9 hypotheses.0"]
    assert faults(study, text.replace("{ profile: mitake }", "{}")) == [
        "3 conditions.alpha", "4 conditions.beta"
    ]  # fmt: skip
    study.write_text(text.replace("mitake", "none"))
    with pytest.raises(SetupError, match=r"conditions\.alpha: .*none"):
        load_study(str(study))


def test_conditions_rank_by_their_chain_of_hypotheses():
    chain = [SimpleNamespace(better=better, than=than) for better, than in ("cb", "ba")]
    design: Any = SimpleNamespace(conditions="abcd", hypotheses=chain)
    assert condition_levels(design) == {"a": 0, "b": 1, "c": 2, "d": 0}


@pytest.mark.parametrize("name", shipped_names("studies", HOME))
def test_shipped_studies_find_their_effects_in_simulated_answers(name, tmp_path):
    study = load_study(name)
    folder = StudyFolder(tmp_path / "data")
    simulate_study(study, folder, 24, 1, effect=1.5)
    found = analyse_study(folder.path)
    assert [one.verdict for one in found.decisions] == ["supported"] * len(study.design.hypotheses)
    if name == "example":
        from gazerig.features.study.report import write_report

        page = write_report(found, tmp_path / "report").read_text()
        assert "simulated participants" in page and page.count("<svg") == len(found.scores)
        with pytest.raises(SetupError, match="--data"):
            simulate_study(study, folder, 1, 1)


def test_answers_that_do_not_count(study, tmp_path):
    from gazerig.features.study.report import answers_csv  # loads matplotlib

    loaded, folder = load_study(str(study)), StudyFolder(tmp_path / "data")
    folder.claim(loaded)
    for number in (1, 2):
        journal = Journal(folder.participant(number))
        session = session_of(study, journal)
        session.handle(PageEvent(session.page, "consent"))
        while session.place.step != "questions":
            session.film_fetched()
            session.handle(
                PageEvent(session.page, "begin" if session.place.step == "ready" else "seen")
            )
        session.handle(PageEvent(session.page, "answer", [4, 5], [900.0, 900.0]))
        if number == 1:
            session.handle(PageEvent(session.page, "leave"))
        else:
            events(session)
        journal.close()
    found = analyse_study(folder.path)
    assert found.reasons == {"P001": "withdrew", "P002": ""}
    reasons = [one.left_out for one in found.answers]
    assert reasons == ["withdrew"] * 2 + [""] * 5
    assert answers_csv(found).count("\n") == 8
    assert found.decisions[0].verdict == "too few"


@pytest.fixture
def journal(tmp_path) -> Iterator[Journal]:
    journal = Journal(tmp_path / "data")
    yield journal
    journal.close()


def test_a_head_that_is_held_for_more_than_a_second_ends_the_session(study, journal):
    state = SimpleNamespace(stopped="", level="hold", reasons=("a program jogs",))
    clock = iter((0.0, 0.9, 1.1))
    head: Any = SimpleNamespace(state=state)
    one = StudySession(load_study(str(study)), 1, journal, lambda: next(clock), str, head)
    one.poll()
    with pytest.raises(HeadEnded, match="the joints are held: a program jogs"):
        one.poll()


def test_pages_do_not_distinguish_conditions(study, journal):
    session = session_of(study, journal)
    assert "difference" not in json.dumps(session.page_json())
    events_of = events(session)
    assert events_of == ["consent", *2 * ["ready", "presentation", "questions"], "questions"]
    assert session.page_json()["debriefing"] == ("It was the difference.",)


def test_an_incomplete_last_line_is_dropped(tmp_path, study):
    journal = Journal(tmp_path / "data")
    session_of(study, journal)
    with pytest.raises(SetupError, match="another program"):
        Journal(tmp_path / "data")
    journal.close()
    path = tmp_path / "data" / "journal.jsonl"
    whole = path.read_bytes()
    path.write_bytes(whole + b'[{"kind":"Cons')
    Journal(tmp_path / "data").close()
    assert path.read_bytes() == whole
    path.write_bytes(b"nonsense\n" + whole)
    with pytest.raises(SetupError, match="jsonl:1"):
        Journal(tmp_path / "data")


def test_a_design_does_not_change_after_the_first_participant(study, tmp_path):
    folder = StudyFolder(tmp_path / "data")
    folder.claim(load_study(str(study)))
    journal = Journal(folder.participant(1))
    session_of(study, journal)
    journal.close()
    folder.claim(load_study(str(study)))
    study.write_text(study.read_text().replace("seconds: 2", "seconds: 2.1"))
    with pytest.raises(SetupError, match="another design"):
        folder.claim(load_study(str(study)))


@pytest.mark.pty
def test_a_killed_session_resumes_with_every_answer(study, program):
    first = program(str(study))
    assert first.do(first.page(), "consent") == 200
    assert first.fetch("/film/x")[0] == 404
    _see_film(first)
    page = first.page()
    assert page["step"] == "questions"
    assert first.do(page, "answer", values=[9, 1], ms=[1.0, 1.0]) == 400
    assert first.do(page, "answer", values=[2, 5], ms=[1000.0, 1000.0]) == 200
    first.process.kill()
    again = program(str(study))
    assert again.token == first.token
    assert again.do(page, "answer", values=[1, 1], ms=[1000.0, 1000.0]) == 409
    _see_film(again)
    assert again.do(again.page(), "answer", values=[4, 4], ms=[1000.0, 1000.0]) == 200
    assert again.do(again.page(), "answer", values=["remark"], ms=[1000.0]) == 200
    assert again.page()["step"] == "end"
    again.process.send_signal(signal.SIGINT)
    assert again.process.wait() == 0
    found = analyse_study(study.parent / "data")
    assert [one.record.value for one in found.answers] == [2, 5, 4, 4, "remark"]


def _see_film(one: Program) -> None:
    assert one.do(one.page(), "begin") == 200
    page = one.page()
    status, film = one.fetch(f"/film/{page['page']}")
    assert status == 200 and film[:4] == b"\x1aE\xdf\xa3"
    time.sleep(0.5)
    assert one.do(page, "seen") == 200


@pytest.mark.pty
def test_a_session_with_a_live_head(tmp_path, program):
    path = tmp_path / "head.yaml"
    shipped = (HOME / "studies" / "nakamoto_2.yaml").read_text()
    shipped = shipped.replace("rig: expressive", f"rig: {at_rate(tmp_path, 'expressive', 50.0)}")
    path.write_text(shipped.replace("seconds: 30", "seconds: 2"))
    one = program(str(path), "--mock")
    assert one.do(one.page(), "consent") == 200
    for _ in range(2):
        assert one.do(one.page(), "begin") == 200
        assert one.page()["step"] == "presentation"
        assert one.do(one.page(), "seen") == 400  # the clock decides
        while one.page()["step"] == "presentation":
            time.sleep(0.1)
        assert one.do(one.page(), "answer", values=[4, 4], ms=[1000.0, 1000.0]) == 200
    assert invoked("stop").code == 0
    assert one.process.wait(30) == 2
    assert one.process.stderr is not None and "stopped" in one.process.stderr.read()
    again = program(str(path), "--mock")
    assert again.do(again.page(), "answer", values=[""], ms=[1000.0]) == 200
    assert again.page()["step"] == "end"
    again.process.send_signal(signal.SIGINT)
    assert again.process.wait(30) == 0


def test_a_session_in_chromium_with_the_keyboard(study, program):
    one = program(str(study))
    with browsing() as tab:

        def press(key: str) -> None:
            text = {"text": "\r"} if key == "Enter" else {"text": key} if len(key) == 1 else {}
            for kind in ("keyDown", "keyUp"):
                more = text if kind == "keyDown" else {}
                tab.ask("Input.dispatchKeyEvent", type=kind, key=key, **more)

        def wait_for(words: str) -> None:
            until = time.monotonic() + 60.0
            while words not in tab.words():
                assert time.monotonic() < until, tab.words()
                time.sleep(0.05)

        tab.go(f"{one.url}/?token={one.token}")
        wait_for("Before you begin")
        tab.run("document.getElementById('agree').click()")
        press("Enter")
        for _ in range(2):
            wait_for("Are you ready?")
            press("Enter")
            wait_for("Your impression")
            press("4")
            tab.ask("Page.reload")  # the draft stays
            wait_for("Your impression")
            press("2")
            press("Enter")
        wait_for("What struck you")
        source = tab.ask("Runtime.evaluate", expression="document.documentElement.outerHTML")
        shown = source["result"]["value"] + "".join(tab.asked_for)
        assert "alpha" not in shown and "beta" not in shown
        tab.run("document.querySelector('button.main').click()")
        wait_for("It was the difference.")
    found = analyse_study(study.parent / "data")
    assert [one.record.value for one in found.answers] == [4, 2, 4, 2, ""]


def test_films_are_rendered_once(tmp_path, monkeypatch):
    pytest.importorskip("mujoco")
    from gazerig.drivers.camera.film import Film

    monkeypatch.setattr(film, "SIZE_PX", 96)
    monkeypatch.setattr(film, "RATE_HZ", 5.0)
    path = tmp_path / "film.yaml"
    shipped = (HOME / "studies" / "nakamoto_1.yaml").read_text()
    shipped = shipped.replace("gaze.scanpath.model:", "loop.rate_hz: 50.0, gaze.scanpath.model:")
    path.write_text(shipped.replace("seconds: 30", "seconds: 2"))
    study = load_study(str(path))
    try:
        made = film.films(study, tmp_path, lambda what, share: None)
    except SetupError as error:
        pytest.skip(str(error))
    ends = []
    for one in made.values():
        *_, last = Film(one).play_once()
        assert last.start_s + 0.2 == pytest.approx(2.0, 0.05)
        ends.append(last.read().image)
    assert not any(key in one.name for key, one in made.items())
    assert len(ends) == 2 and np.ptp(ends[0]) > 50 and (ends[0] != ends[1]).mean() > 0.02
    before = [one.stat().st_mtime_ns for one in made.values()]
    assert film.films(study, tmp_path, lambda what, share: None) == made
    assert [one.stat().st_mtime_ns for one in made.values()] == before
