"""A participant's session: its screens, and its continuation after an interruption."""

import errno
import json
import os
from dataclasses import replace
from itertools import pairwise
from math import isnan, nan
from pathlib import Path

import pytest
from study_runs import UTC, run_of, screens, step

from gazerig.config.shipped_files import shipped_names
from gazerig.drivers.errors import SetupError
from gazerig.features.study.answers import LONGEST_TEXT, WrongAnswer
from gazerig.features.study.data_folder import StudyData, participant_code
from gazerig.features.study.journal import (
    FILE,
    ConsentGiven,
    ItemAnswered,
    Journal,
    ParticipationClosed,
    ParticipationOpened,
    Record,
    TrialBegan,
    TrialEnded,
    TrialMeasured,
    WriteFailed,
    encode_records,
    read,
)
from gazerig.features.study.run.participant import open_journal
from gazerig.features.study.run.simulated_session import simulate_study
from gazerig.features.study.run.study_file import LoadedStudy, load_questionnaire, load_study
from gazerig.features.study.screens import (
    ConsentScreen,
    EndScreen,
    InstructionsScreen,
    PausedScreen,
    PresentationScreen,
    QuestionsScreen,
    ReadyScreen,
    RestScreen,
)
from gazerig.features.study.shipped import HOME
from gazerig.features.study.simulation import Population
from gazerig.features.study.study_run import HeadLost, PresentationData
from gazerig.features.study.study_session import INTERRUPTED, ShownTrial
from gazerig.features.study.trial_order import PAIR


def rating(**trials: float) -> LoadedStudy:
    return _with(load_study("default_against_papers"), **trials)


def pairs(**trials: float) -> LoadedStudy:
    study = _with(load_study("default_against_papers"), **trials)
    design = replace(study.design, task="pairwise", questionnaires=("choice",))
    asked = {**study.questionnaires, "choice": load_questionnaire("choice")}
    return replace(study, design=replace(design, hypotheses=()), questionnaires=asked)


def _with(study: LoadedStudy, **trials: float) -> LoadedStudy:
    design = replace(study.design, trials=replace(study.design.trials, **trials))  # type: ignore[arg-type]
    return replace(study, design=design)


@pytest.mark.parametrize("name", shipped_names("studies", HOME))
def test_all_of_a_study_is_shown_and_asked_in_its_order(name: str, tmp_path: Path) -> None:
    study = load_study(name)
    study = replace(
        study,
        design=replace(study.design, presentation=replace(study.design.presentation, on="film")),
    )
    run, journal = run_of(study, tmp_path, 3)
    seen = screens(run)
    assert isinstance(seen[0], ConsentScreen) and seen[-1] == EndScreen("finished")
    shown = [one for one in journal.records if isinstance(one, TrialBegan) and one.trial >= 0]
    expected = [key for trial in run._session.order for key in trial.split(PAIR)]
    assert [one.condition for one in shown] == expected
    answers = [one for one in journal.records if isinstance(one, ItemAnswered)]
    per_trial = sum(len(study.questionnaires[q].items) for q in study.design.questionnaires)
    at_end = sum(len(study.questionnaires[q].items) for q in study.design.after)
    trials = len(run._session.order) + study.design.trials.practice
    assert len(answers) == trials * per_trial + at_end
    assert [type(one) for one in journal.records].count(ParticipationClosed) == 1
    journal.close()


def test_rests_come_after_every_so_many_trials_and_never_before_the_first(tmp_path: Path) -> None:
    run, journal = run_of(rating(rest_every=2, repetitions=2, practice=1), tmp_path)
    seen = [one for one in screens(run) if isinstance(one, RestScreen | ReadyScreen)]
    rests = [after.number for one, after in pairwise(seen) if isinstance(one, RestScreen)]  # type: ignore[union-attr]
    assert rests == [3, 5]
    journal.close()


def test_a_session_that_is_cut_off_anywhere_goes_on_at_that_screen(tmp_path: Path) -> None:
    """Each step is done by another program; only an interrupted presentation begins again."""
    study = pairs(rest_every=2, practice=1)
    whole, journal = run_of(study, tmp_path / "whole")
    expected = [(type(one), one) for one in screens(whole)]
    journal.close()
    seen = []
    for _ in range(200):
        run, journal = run_of(study, tmp_path / "cut")
        page, screen = run.now()
        journal.close()
        run, journal = run_of(study, tmp_path / "cut")
        if not isinstance(screen, RestScreen):
            assert run.now() == (page, screen), "the same page after one more crash"
        seen.append(step(run))
        while isinstance(seen[-1], InstructionsScreen | RestScreen | ReadyScreen):
            seen.append(step(run))  # what leaves nothing on disk, and a presentation
        journal.close()
        if isinstance(seen[-1], EndScreen):
            break
    kinds = [type(one) for one in seen]
    assert [kind for kind in kinds if kind is not PresentationScreen] == [
        kind for kind, _ in expected if kind is not PresentationScreen
    ]
    answers = [one for one in read(tmp_path / "cut") if isinstance(one, ItemAnswered)]
    keys = [(one.trial, one.questionnaire, one.item) for one in answers]
    assert len(keys) == len(set(keys)), "nothing is asked twice"


def test_a_presentation_under_way_at_a_crash_is_marked_and_begins_again(tmp_path: Path) -> None:
    study = rating(practice=0)
    run, journal = run_of(study, tmp_path)
    while not isinstance(run.now()[1], PresentationScreen):
        step(run)
    token = run.now()[1].film  # type: ignore[union-attr]
    condition = run.film_of(token)
    assert condition in study.design.conditions and run.film_of("guessed") is None
    journal.close()
    run, journal = run_of(study, tmp_path)
    ended = [one for one in journal.records if isinstance(one, TrialEnded)]
    assert [(one.outcome, one.reason) for one in ended] == [("interrupted", INTERRUPTED)]
    screen = run.now()[1]
    assert isinstance(screen, ReadyScreen) and screen.again and screen.number == 1
    assert run.film_of(token) is None, "the name of a film is good for one attempt"
    step(run)
    assert run.film_of(run.now()[1].film) == condition  # type: ignore[union-attr]
    journal.close()


def test_what_comes_twice_or_late_changes_nothing(tmp_path: Path) -> None:
    run, journal = run_of(rating(), tmp_path)
    first = run.now()[0]
    run.consent(first, True, False, True)
    run.consent(first, False, False, False)
    assert not run.state().closed
    while not isinstance(run.now()[1], QuestionsScreen):
        step(run)
    page, screen = run.now()
    values = {one.number: 1 for one in screen.questions}  # type: ignore[union-attr]
    for _ in range(3):
        run.answer(page, values, {})
    assert run.state().answers == len(values)
    journal.close()


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({}, "question 0 is not answered"),
        ({0: 0, 1: 1}, "question 0: a whole number from 1 to 5"),
        ({0: 6, 1: 1}, "question 0: a whole number from 1 to 5"),
        ({0: True, 1: 1}, "question 0: a whole number from 1 to 5"),
        ({0: "3", 1: 1}, "question 0: a whole number from 1 to 5"),
        ({0: 1, 1: 1, 9: 1}, "there is no question 9"),
    ],
)
def test_answers_that_cannot_be_are_refused_and_the_page_stays(
    values: dict[int, int | str], said: str, tmp_path: Path
) -> None:
    run, journal = run_of(rating(practice=0), tmp_path)
    while not isinstance(run.now()[1], QuestionsScreen):
        step(run)
    page = run.now()[0]
    with pytest.raises(WrongAnswer, match=said):
        run.answer(page, values, {})
    assert run.now()[0] == page and run.state().answers == 0
    journal.close()


def test_questions_may_be_left_unanswered_where_the_study_permits_it(tmp_path: Path) -> None:
    study = rating(practice=0)
    study = replace(study, design=replace(study.design, may_skip=True))
    run, journal = run_of(study, tmp_path)
    while not isinstance(run.now()[1], QuestionsScreen):
        step(run)
    page = run.now()[0]
    with pytest.raises(WrongAnswer, match="a whole number from 1 to 5"):
        run.answer(page, {0: 9}, {})
    run.answer(page, {0: None, 1: 3}, {0: 900.0, 1: 700.0})
    assert run.now()[0] != page
    answered = [one.value for one in read(tmp_path) if isinstance(one, ItemAnswered)]
    assert answered == [None, 3]
    journal.close()


def test_a_text_has_a_longest_length(tmp_path: Path) -> None:
    run, journal = run_of(rating(practice=0), tmp_path)
    while not (
        isinstance(screen := run.now()[1], QuestionsScreen)
        and screen.questions[0].item.kind == "text"
    ):
        step(run)
    with pytest.raises(WrongAnswer, match=str(LONGEST_TEXT)):
        run.answer(run.now()[0], {0: "a" * (LONGEST_TEXT + 1)}, {})
    run.answer(run.now()[0], {0: "a" * LONGEST_TEXT}, {})
    assert run.state().closed
    journal.close()


def test_who_declines_or_leaves_is_asked_nothing_more(tmp_path: Path) -> None:
    run, journal = run_of(rating(), tmp_path / "declines")
    run.consent(run.now()[0], False, True, True)
    assert run.now()[1] == EndScreen("declined")
    journal.close()
    run, journal = run_of(rating(), tmp_path / "leaves")
    for _ in range(3):
        step(run)
    run.withdraw()
    run.withdraw()
    assert run.now()[1] == EndScreen("withdrawn")
    ends = [one for one in journal.records if isinstance(one, TrialEnded | ParticipationClosed)]
    assert [type(one) for one in ends] == [TrialEnded, ParticipationClosed]
    journal.close()


class LosesHead:
    """A head that is lost in the given presentations, counted from 0."""

    def __init__(self, *lost: int) -> None:
        self._lost, self._count, self._why = lost, -1, ""

    def begin(self, shown: ShownTrial) -> None:
        self._count += 1
        self._why = "servo 3 does not answer" if self._count in self._lost else ""

    def end(self) -> PresentationData:
        return PresentationData("run-01.mcap", (1.0, 2.0))

    def fault(self) -> str:
        return self._why

    def restart(self) -> None:
        self._why = ""


def on_head(study: LoadedStudy, **rules: object) -> LoadedStudy:
    design = study.design
    shown = replace(design.presentation, on="head")
    exclusion = replace(design.exclusion, **rules)  # type: ignore[arg-type]
    return replace(study, design=replace(design, presentation=shown, exclusion=exclusion))


@pytest.mark.parametrize(
    ("rule", "repeats", "lost", "attempts"),
    [
        ("repeat", 2, (0,), [0, 1, 0, 0]),
        ("repeat", 1, (0, 1), [0, 1, 0, 0]),  # twice is too often: the trial is left out
        ("exclude", 2, (1,), [0, 0, 0]),
    ],
)
def test_a_lost_head_pauses_and_the_trial_goes_by_the_rule(
    rule: str, repeats: int, lost: tuple[int, ...], attempts: list[int], tmp_path: Path
) -> None:
    now = [0.0]
    study = on_head(rating(practice=0, seconds=10.0), lost_head=rule, repeats=repeats)
    run, journal = run_of(study, tmp_path, presenter=LosesHead(*lost), now_s=lambda: now[0])
    for _ in range(60):
        screen = step(run)
        if isinstance(screen, EndScreen):
            break
        if isinstance(run.now()[1], PresentationScreen):
            run.poll()
            now[0] += 10.0
            run.poll()
            if run.state().fault:
                assert run.now()[1] == PausedScreen()
    began = [one for one in journal.records if isinstance(one, TrialBegan)]
    ended = [one for one in journal.records if isinstance(one, TrialEnded)]
    assert [one.attempt for one in began] == attempts
    assert [i for i, one in enumerate(ended) if one.outcome == "head_lost"] == list(lost)
    assert {one.reason for one in ended if one.outcome == "head_lost"} == {
        "servo 3 does not answer"
    }
    asked = {one.trial for one in journal.records if isinstance(one, ItemAnswered)}
    complete = {one.trial for one in ended if one.outcome == "complete"}
    assert asked - {None} == complete
    journal.close()


def test_a_head_that_cannot_begin_pauses_until_it_can(tmp_path: Path) -> None:
    class Refuses(LosesHead):
        def begin(self, shown: ShownTrial) -> None:
            super().begin(shown)
            if self._why:
                raise HeadLost(self._why)

    run, journal = run_of(on_head(rating(practice=0)), tmp_path, presenter=Refuses(0))
    while not isinstance(run.now()[1], ReadyScreen):
        step(run)
    step(run)
    assert run.now()[1] == PausedScreen() and run.state().fault == "servo 3 does not answer"
    run.begin(run.now()[0])
    assert run.now()[1] == PausedScreen()
    run.pause(False)
    assert isinstance(run.now()[1], ReadyScreen) and not run.state().fault
    step(run)
    assert isinstance(run.now()[1], PresentationScreen)
    journal.close()


def test_the_experimenter_may_repeat_and_exclude(tmp_path: Path) -> None:
    run, journal = run_of(rating(practice=0), tmp_path)
    with pytest.raises(WrongAnswer):
        run.repeat()
    while not isinstance(run.now()[1], PresentationScreen):
        step(run)
    run.repeat()
    screen = run.now()[1]
    assert isinstance(screen, ReadyScreen) and screen.again
    run.exclude("asked what the difference is")
    assert run.now()[1] == EndScreen("excluded")
    assert journal.records[-1] == ParticipationClosed(
        "excluded", "asked what the difference is", UTC
    )
    journal.close()


def test_no_screen_says_which_condition_it_is_of(tmp_path: Path) -> None:
    study = pairs()
    names = set(study.design.conditions) | {one.label for one in study.design.conditions.values()}
    run, journal = run_of(study, tmp_path)
    for _ in range(100):
        page, screen = run.now()
        words = f"{page} {screen!r}"
        assert not [name for name in names - {"default"} if name in words]
        if isinstance(step(run), EndScreen):
            break
    journal.close()


def test_a_film_that_was_not_shown_whole_is_shown_again(tmp_path: Path) -> None:
    run, journal = run_of(rating(practice=0, seconds=20.0), tmp_path)
    while not isinstance(run.now()[1], PresentationScreen):
        step(run)
    for seconds in (3.0, float("nan"), float("inf"), -20.0):
        run.film_fetched(run.now()[1].film)  # type: ignore[union-attr]
        run.film_ended(run.now()[0], seconds)
        screen = run.now()[1]
        assert isinstance(screen, ReadyScreen) and screen.again
        step(run)
    run.film_fetched(run.now()[1].film)  # type: ignore[union-attr]
    run.film_ended(run.now()[0], 19.9)
    assert isinstance(run.now()[1], QuestionsScreen)
    journal.close()


@pytest.mark.parametrize(
    ("fetched", "waited_s", "claimed_s", "outcome", "shown_s"),
    [
        (True, 0.0, 1e300, "interrupted", 0.0),
        (True, 17.0, 20.0, "interrupted", 17.0),
        (False, 60.0, 20.0, "interrupted", 0.0),
        (True, 21.0, 1e300, "complete", 21.0),
        (True, 21.0, 20.0, "complete", 20.0),
    ],
)
def test_a_film_is_seen_by_the_hosts_clock_and_only_if_it_was_fetched(
    fetched: bool, waited_s: float, claimed_s: float, outcome: str, shown_s: float, tmp_path: Path
) -> None:
    now = [0.0]
    study = rating(practice=0, seconds=20.0)
    run, journal = run_of(study, tmp_path, now_s=lambda: now[0])
    while not isinstance(run.now()[1], PresentationScreen):
        step(run)
    now[0] += 100.0  # the film takes long to come
    if fetched:
        run.film_fetched(run.now()[1].film)  # type: ignore[union-attr]
    run.film_fetched("guessed")
    now[0] += waited_s
    run.film_ended(run.now()[0], claimed_s)
    ended = journal.records[-1]
    assert isinstance(ended, TrialEnded)
    assert (ended.outcome, ended.seconds) == (outcome, shown_s)
    journal.close()


@pytest.mark.parametrize(
    ("claimed_ms", "kept_ms"),
    [(900.0, 900.0), (1e300, 4000.0), (-1.0, nan), (float("inf"), nan), (nan, nan)],
)
def test_a_response_time_is_never_longer_than_the_page_was_shown(
    claimed_ms: float, kept_ms: float, tmp_path: Path
) -> None:
    now = [0.0]
    run, journal = run_of(rating(practice=0, seconds=20.0), tmp_path, now_s=lambda: now[0])
    while not isinstance(run.now()[1], QuestionsScreen):
        if isinstance(screen := run.now()[1], PresentationScreen):
            run.film_fetched(screen.film)
            now[0] += 25.0
        step(run)
    now[0] += 4.0
    run.answer(run.now()[0], {0: 1, 1: 1}, {0: claimed_ms, 1: 100.0})
    answered = [one.ms for one in journal.records if isinstance(one, ItemAnswered)]
    assert answered == pytest.approx([kept_ms, 100.0], nan_ok=True)
    journal.close()


def test_a_response_time_on_a_page_of_an_earlier_program_is_not_known(tmp_path: Path) -> None:
    run, journal = run_of(rating(practice=0), tmp_path)
    while not isinstance(run.now()[1], QuestionsScreen):
        step(run)
    journal.close()
    run, journal = run_of(rating(practice=0), tmp_path)
    run.answer(run.now()[0], {0: 1, 1: 1}, {0: 700.0, 1: 900.0})
    answered = [one.ms for one in journal.records if isinstance(one, ItemAnswered)]
    assert answered == pytest.approx([nan, nan], nan_ok=True)
    journal.close()


# --- The journal of a participant: on disk before the next screen, whole or not at all


ALL: tuple[Record, ...] = (
    ParticipationOpened("P001", "ab" * 32, ("a", "b|c"), "0.1", UTC),
    ConsentGiven(True, False, True, UTC),
    TrialBegan(-1, 0, "a", UTC),
    TrialEnded(-1, 0, "head_lost", 3.5, UTC, 1, "run-01.mcap", "servo 3", 1.0, 4.5),
    ItemAnswered(0, "b|c", "choice", "alive", "first", 812.5, UTC),
    ItemAnswered(None, "", "free_text", "what", 'schön\n"ja" 目', 1.0, UTC),
    TrialMeasured(0, "b", {"first_look_s": 1.5}, 1, 2),
    ParticipationClosed("finished", "", UTC),
)


def test_all_kinds_of_records_come_back(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        for one in ALL:
            journal.write((one,))
        assert journal.records == ALL
    assert read(tmp_path) == ALL
    with Journal(tmp_path) as journal:
        assert journal.records == ALL and journal.torn is None


def test_what_is_not_a_number_comes_back_as_that(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        journal.write(
            (TrialMeasured(0, "a", {"x": nan}), TrialEnded(0, 0, "interrupted", nan, UTC))
        )
    measured, ended = read(tmp_path)
    assert isinstance(measured, TrialMeasured) and isnan(measured.values["x"])
    assert isinstance(ended, TrialEnded) and isnan(ended.seconds) and isnan(ended.from_s)


def test_a_step_is_there_whole_or_not_at_all_wherever_it_was_cut(tmp_path: Path) -> None:
    """As after a crash or a lost power: the file ends at any byte of the last line."""
    whole, step = encode_records(ALL[:3]), encode_records(ALL[3:5])
    for cut in range(len(step)):
        folder = tmp_path / str(cut)
        folder.mkdir()
        (folder / FILE).write_bytes(whole + step[:cut])
        assert read(folder) == ALL[:3]
        with Journal(folder) as journal:
            assert journal.records == ALL[:3]
            assert (journal.torn is None) == (cut == 0)
            if journal.torn is not None:
                assert journal.torn.read_bytes() == step[:cut]
            journal.write(ALL[3:5])
        assert read(folder) == ALL[:5]


def test_a_damaged_line_is_named(tmp_path: Path) -> None:
    (tmp_path / FILE).write_bytes(
        encode_records(ALL[:1]) + b'[{"kind": "Rumour"}]\n' + encode_records(ALL[1:2])
    )
    with pytest.raises(SetupError, match=rf"{FILE}:2: no records of a session"):
        Journal(tmp_path)
    with pytest.raises(SetupError, match=rf"{FILE}:2:"):
        read(tmp_path)


def test_two_sessions_of_one_participant_are_refused(tmp_path: Path) -> None:
    folder = tmp_path / "P007"
    with Journal(folder), pytest.raises(SetupError, match="P007 has a session already"):
        Journal(folder)
    with Journal(folder) as journal:
        journal.write(ALL[:1])


def test_a_full_disk_keeps_nothing_by_halves_and_may_be_tried_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Journal(tmp_path) as journal:
        journal.write(ALL[:2])
        there, room = os.write, [60]

        def full(fd: int, data: bytes) -> int:
            if not room[0]:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            part = data[: room[0]]
            room[0] -= len(part)
            return there(fd, part)

        monkeypatch.setattr(os, "write", full)
        with pytest.raises(WriteFailed, match="not kept: No space left on device"):
            journal.write(ALL[2:5])
        assert journal.records == ALL[:2] == read(tmp_path)
        monkeypatch.setattr(os, "write", there)
        journal.write(ALL[2:5])
    assert read(tmp_path) == ALL[:5]


def test_no_journal_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(SetupError, match="No such file"):
        read(tmp_path / "P009")


def test_only_the_owner_may_read_it(tmp_path: Path) -> None:
    with Journal(tmp_path):
        assert (tmp_path / FILE).stat().st_mode & 0o077 == 0


# --- The data of a study: one design, participants without names, one command that deletes one


@pytest.fixture(scope="module")
def study() -> LoadedStudy:
    return load_study("nakamoto_1")


def edited(study: LoadedStudy) -> LoadedStudy:
    trials = replace(study.design.trials, seconds=31.0)
    return replace(study, design=replace(study.design, trials=trials))


def simulated(study: LoadedStudy, folder: Path, count: int = 3, seed: int = 0) -> StudyData:
    data = StudyData(folder)
    simulate_study(study, data, count, Population(seed=seed))
    return data


def test_simulated_participants_finish_and_the_same_seed_gives_the_same_journals(
    study: LoadedStudy, tmp_path: Path
) -> None:
    one = simulated(study, tmp_path / "a")
    again, other = simulated(study, tmp_path / "b"), simulated(study, tmp_path / "c", seed=1)
    assert one.numbers() == (1, 2, 3)
    texts = [
        [(data.participant(n) / FILE).read_bytes() for n in (1, 2, 3)]
        for data in (one, again, other)
    ]
    assert texts[0] == texts[1] != texts[2]
    for number in one.numbers():
        records = read(one.participant(number))
        assert isinstance(records[0], ParticipationOpened) and records[0].simulated
        assert isinstance(records[-1], ParticipationClosed) and records[-1].outcome == "finished"
        assert sum(isinstance(record, ItemAnswered) for record in records) == 2 * 2 + 1


def test_simulated_ones_are_not_put_beside_others(study: LoadedStudy, tmp_path: Path) -> None:
    data = simulated(study, tmp_path)
    with pytest.raises(SetupError, match="has data of participants: .* --data NEW_FOLDER"):
        simulate_study(study, data, 1, Population())


def test_a_design_edited_after_the_first_participant_is_refused(
    study: LoadedStudy, tmp_path: Path
) -> None:
    data = simulated(study, tmp_path)
    assert data.claim(study.name, study.canonical) == study.sha256
    changed = edited(study)
    with pytest.raises(SetupError, match=f"{study.sha256[:12]}; this one is {changed.sha256[:12]}"):
        data.claim(changed.name, changed.canonical)
    StudyData(tmp_path / "new").claim(changed.name, changed.canonical)
    with pytest.raises(SetupError, match="was begun with another design"):
        open_journal(changed, data, 1, changed.sha256)


def test_what_is_said_of_the_design_cannot_be_changed_unseen(
    study: LoadedStudy, tmp_path: Path
) -> None:
    data = StudyData(tmp_path)
    data.claim(study.name, study.canonical)
    path = tmp_path / "design.json"
    stated = json.loads(path.read_text(encoding="utf-8"))
    stated["design"]["design"]["trials"]["seconds"] = 5.0
    path.write_text(json.dumps(stated), encoding="utf-8")
    with pytest.raises(SetupError, match="was changed: its design does not have the hash"):
        data.sha256()
    path.write_text("{", encoding="utf-8")
    with pytest.raises(SetupError, match="cannot be read"):
        data.sha256()
    with pytest.raises(SetupError, match="has no data of a study"):
        StudyData(tmp_path / "nowhere").sha256()


def test_deleting_a_participant_leaves_nothing_but_the_code(
    study: LoadedStudy, tmp_path: Path
) -> None:
    data = simulated(study, tmp_path)
    folder = data.participant(2)
    (folder / "run-01.mcap").write_bytes(b"joints")
    for made in ("report/index.html", "bids/sub-P002/beh/a.tsv"):
        (tmp_path / made).parent.mkdir(parents=True)
        (tmp_path / made).write_text("P002")
    with Journal(folder), pytest.raises(SetupError, match="P002 has a session already"):
        data.delete(2)
    assert data.delete(2) == 5
    assert not folder.exists() and not (tmp_path / "report").exists()
    left = [one for one in tmp_path.rglob("*") if one.is_file()]
    assert [one.name for one in left if b"P002" in one.read_bytes()] == ["deleted.txt"]
    assert data.deleted() == ("P002",) and data.numbers() == (1, 3)
    with pytest.raises(SetupError, match="has nothing of P002; there is P001, P003"):
        data.delete(2)
    with pytest.raises(SetupError, match="the data of P002 were deleted on request"):
        open_journal(study, data, 2, study.sha256)


def test_a_participant_with_a_damaged_journal_can_be_deleted(
    study: LoadedStudy, tmp_path: Path
) -> None:
    data = simulated(study, tmp_path)
    (data.participant(2) / FILE).write_bytes(b"nonsense\n")
    with pytest.raises(SetupError, match="damaged"):
        open_journal(study, data, 2, study.sha256)
    assert data.delete(2) and data.numbers() == (1, 3)


def test_participants_have_numbers_and_no_names() -> None:
    assert [participant_code(7), participant_code(1234)] == ["P007", "P1234"]
    for number in (0, -1, 1_000_000):
        with pytest.raises(SetupError, match="a whole number from 1 to 999999; no names"):
            participant_code(number)


def test_the_secret_stays_and_is_the_owners_alone(tmp_path: Path) -> None:
    data = StudyData(tmp_path)
    assert data.secret() == data.secret() and len(data.secret()) == 32
    assert (tmp_path / "secret").stat().st_mode & 0o077 == 0
    (tmp_path / "secret").write_text("what")
    with pytest.raises(SetupError, match="secret cannot be read"):
        data.secret()
