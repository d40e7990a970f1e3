"""Rows from a study's folder: the answers of each participant, with the design's exclusions."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from math import inf, isnan, nan
from pathlib import Path
from typing import Any

import msgspec

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_input import read_limited
from gazerig.features.study import journal
from gazerig.features.study.answers import WrongAnswer, check_answer
from gazerig.features.study.data_folder import StudyData
from gazerig.features.study.design import Condition, StudyDesign
from gazerig.features.study.journal import (
    FILE,
    ConsentGiven,
    ItemAnswered,
    ParticipationClosed,
    ParticipationOpened,
    Record,
    TrialBegan,
    TrialEnded,
    TrialMeasured,
)
from gazerig.features.study.questionnaire import Questionnaire
from gazerig.features.study.trial_order import PAIR

LEAST_SAME = 8
"""Least number of ratings for the rule of equal answers: fewer equal answers may be honest."""


@dataclass(frozen=True)
class AnswerRow(ItemAnswered):
    """An answer of a participant, a row of the tidy table.

    left_out: reason of its exclusion, "" if it counts
    """

    participant: str
    left_out: str = ""


@dataclass(frozen=True)
class TrialRow:
    """One trial in its last attempt: outcome and measures.

    side: 1 for the second presentation of a pair
    from_s, to_s: its start and end in the recording's time, nan without a recording
    """

    trial: int
    side: int
    condition: str
    attempts: int
    outcome: str
    seconds: float
    utc: str
    recording: str
    reason: str
    measured: Mapping[str, float]
    from_s: float = nan
    to_s: float = nan


@dataclass(frozen=True)
class Participation:
    """All data of one participant.

    outcome: "finished", "withdrawn", "excluded", or "unfinished"
    left_out: reason of the participant's exclusion, "" without one
    """

    participant: str
    design_sha256: str
    order: tuple[str, ...]
    program: str
    opened_utc: str
    simulated: bool
    outcome: str
    answers: tuple[AnswerRow, ...]
    trials: tuple[TrialRow, ...]
    left_out: str = ""

    @property
    def counted(self) -> tuple[AnswerRow, ...]:
        """Return the answers that count, none of an excluded participant."""
        return () if self.left_out else tuple(row for row in self.answers if not row.left_out)

    @property
    def counted_trials(self) -> tuple[TrialRow, ...]:
        """Return the complete trials that count, none of an excluded participant."""
        counted = (t for t in self.trials if t.trial >= 0 and t.outcome == "complete")
        return () if self.left_out else tuple(counted)


def participation(
    records: Sequence[Record], design: StudyDesign, questionnaires: Mapping[str, Questionnaire]
) -> Participation:
    """Return one participant's data from the records, with the design's exclusions.

    Raises:
        ValueError: the journal does not begin with Opened.
    """
    if not records or not isinstance(records[0], ParticipationOpened):
        raise ValueError("a journal begins with what opened it")
    opened = records[0]
    found: dict[tuple[int, int], TrialRow] = {}
    answers: dict[tuple[int | None, str, str], AnswerRow] = {}  # the last one to each item
    for one in records:
        if isinstance(one, ItemAnswered):
            row = AnswerRow(**vars(one), participant=opened.participant)
            answers[one.trial, one.questionnaire, one.item] = row
        elif isinstance(one, TrialBegan):
            attempts = found[one.trial, one.side].attempts if (one.trial, one.side) in found else 0
            found[one.trial, one.side] = TrialRow(
                one.trial, one.side, one.condition, attempts + 1, "interrupted", nan,
                one.utc, "", "did not end", {},
            )  # fmt: skip
        elif isinstance(one, TrialEnded) and (one.trial, one.side) in found:
            found[one.trial, one.side] = replace(
                found[one.trial, one.side], outcome=one.outcome, seconds=one.seconds,
                recording=one.recording, reason=one.reason, from_s=one.from_s, to_s=one.to_s,
            )  # fmt: skip
        elif isinstance(one, TrialMeasured) and (one.trial, one.side) in found:
            before = found[one.trial, one.side]
            found[one.trial, one.side] = replace(before, measured=dict(one.values))
    trials = tuple(found.values())
    broken = {t.trial: t.outcome for t in reversed(trials) if t.outcome != "complete"}
    rows = []
    for row in answers.values():
        left_out = "not answered" if row.value is None else ""
        if row.trial is not None and row.trial < 0:
            left_out = "practice"
        elif row.trial in broken:
            left_out = f"presentation {broken[row.trial].replace('_', ' ')}"
        rows.append(replace(row, left_out=left_out))
    slowest: dict[tuple[int | None, str], float] = {}
    for row in rows:
        page = row.trial, row.questionnaire
        # A browser without a measured time was not too fast.
        slowest[page] = max(slowest.get(page, 0.0), inf if isnan(row.ms) else row.ms)
    rows = [
        replace(row, left_out=row.left_out or "answered too fast")
        if slowest[row.trial, row.questionnaire] < design.exclusion.fastest_answer_ms
        else row
        for row in rows
    ]
    closed = [r for r in records if isinstance(r, ParticipationClosed)]
    how = closed[-1].outcome if closed else "unfinished"
    whole = Participation(
        opened.participant, opened.design_sha256, opened.order, opened.program, opened.utc,
        opened.simulated, how, tuple(rows), trials,
    )  # fmt: skip
    why = _exclusion_reason(whole, records, design, questionnaires)
    return replace(whole, left_out=why)


def check_records(
    records: Sequence[Record],
    design: StudyDesign,
    questionnaires: Mapping[str, Questionnaire],
    folder: Path,
) -> None:
    """Refuse records that do not fit a session of this design.

    Raises:
        SetupError: the journal was changed or damaged; it is not modified.
    """
    began: set[tuple[int, int, int]] = set()
    for number, one in enumerate(records, start=1):
        why = _misfit(number, one, design, questionnaires)
        if isinstance(one, TrialBegan):
            began.add((one.trial, one.attempt, one.side))
        if isinstance(one, TrialEnded) and (one.trial, one.attempt, one.side) not in began:
            why = "the presentation did not begin"
        if why:
            raise SetupError(
                f"{folder / FILE}: record {number}, {type(one).__name__}: {why}: the file was "
                "changed or damaged; put a copy of it in its place"
            )


def _misfit(
    number: int, one: Record, design: StudyDesign, questionnaires: Mapping[str, Questionnaire]
) -> str:
    """Return why a record does not fit the design's sessions, "" if it fits."""
    if number == 1 and not isinstance(one, ParticipationOpened):
        return "a journal begins with Opened"
    shown: list[str] = []
    if isinstance(one, TrialBegan):
        shown = [one.condition]
    if isinstance(one, ItemAnswered):
        asked = questionnaires.get(one.questionnaire)
        if asked is None or one.item not in asked.items:
            return f"{one.questionnaire}.{one.item} is not asked"
        item = asked.items[one.item]
        try:
            check_answer(0, item, one.value, may_skip=True)
        except WrongAnswer as error:
            return str(error)
        shown = one.condition.split(PAIR) if one.trial is not None else []
        if len(shown) not in ((2,) if item.kind == "choice" else (0, 1, 2)):
            return f"{one.condition!r} is no pair"
    unknown = [key for key in shown if key not in design.conditions]
    return f"there is no condition {unknown[0]!r}" if unknown else ""


def _exclusion_reason(
    one: Participation,
    records: Iterable[Record],
    design: StudyDesign,
    questionnaires: Mapping[str, Questionnaire],
) -> str:
    """Return the reason of a participant's exclusion, "" without one."""
    consents = [r.given for r in records if isinstance(r, ConsentGiven)]
    if not consents or not consents[-1]:
        return "did not consent"
    if one.outcome in ("withdrawn", "excluded"):
        last = [r.reason for r in records if isinstance(r, ParticipationClosed)][-1]
        words = "withdrew" if one.outcome == "withdrawn" else "excluded by the experimenter"
        return f"{words}: {last}" if last else words
    if one.outcome == "unfinished" and design.exclusion.incomplete == "exclude":
        return "did not finish"
    ratings = [
        row.value
        for row in one.answers
        if row.trial is not None
        and row.trial >= 0
        and row.value is not None
        and questionnaires[row.questionnaire].items[row.item].kind == "rating"
    ]
    if design.exclusion.same_answers and len(ratings) >= LEAST_SAME and len(set(ratings)) == 1:
        return "gave one answer to every item of all trials"
    return ""


_MOST_BYTES = 10_000_000


@dataclass(frozen=True)
class CollectedStudy:
    """A study's data.

    Attributes:
        name: Name of the study's file.
        design: The design at the first participant.
        questionnaires: By the keys in the design.
        design_sha256: Hash of the design, which is in all data.
        people: Participants, with exclusions marked.
        folders: Folders of the participants, in the order of ``people``.
        deleted: Codes of participants whose data were deleted.
    """

    name: str
    design: StudyDesign
    questionnaires: Mapping[str, Questionnaire]
    design_sha256: str
    people: tuple[Participation, ...]
    folders: tuple[Path, ...]
    deleted: tuple[str, ...]


def collect_study(folder: Path) -> CollectedStudy:
    """Return all data of a study.

    Raises:
        SetupError: the folder holds no study or no participant, a file is
            damaged, or data were taken with another design.
    """
    data = StudyData(folder)
    sha256 = data.sha256()
    path = folder / "design.json"
    text = json.loads(read_limited(path, _MOST_BYTES))
    design, questionnaires = design_from_text(text["design"], path)
    people, folders = [], []
    for number in data.numbers():
        each = data.participant(number)
        records = journal.read(each)
        for one in records:
            if isinstance(one, ParticipationOpened) and one.participant != each.name:
                raise SetupError(f"{each} has the journal of {one.participant}: move it back")
            if isinstance(one, ParticipationOpened) and one.design_sha256 != sha256:
                raise SetupError(
                    f"{each} was recorded with another design ({one.design_sha256[:12]}) than "
                    f"{path} ({sha256[:12]}): data of two designs are two studies; move it to the "
                    "folder of its own"
                )
        if records:  # otherwise it has no data
            check_records(records, design, questionnaires, each)
            people.append(participation(records, design, questionnaires))
            folders.append(each)
    if not people:
        raise SetupError(
            f"{folder} has no participant yet: gazerig study run STUDY --participant 1, or "
            "--simulate 24 to try it"
        )
    return CollectedStudy(
        str(text["name"]), design, questionnaires, sha256, tuple(people), tuple(folders),
        data.deleted(),
    )  # fmt: skip


def design_from_text(
    text: Mapping[str, Any], path: Path
) -> tuple[StudyDesign, dict[str, Questionnaire]]:
    """Return design and questionnaires from a study's canonical text.

    Entries that the text replaces by values, such as the names of rigs and films, keep their
    defaults, because the analysis does not need them.

    Raises:
        SetupError: it is not a canonical text.
    """
    try:
        design, asked = dict(text["design"]), text["questionnaires"]
        known = {field.name for field in fields(Condition)}
        design["conditions"] = {
            key: {k: v for k, v in design["conditions"][key].items() if k in known}
            for key in design.pop("order")
        }
        found = {}
        for key in (*design["questionnaires"], *design["after"]):
            one = {**asked[key]}
            one["items"] = {name: one["items"][name] for name in one.pop("order")}
            found[key] = msgspec.convert(one, Questionnaire)
        return msgspec.convert(design, StudyDesign), found
    except (KeyError, TypeError, AttributeError, msgspec.MsgspecError) as error:
        raise SetupError(
            f"{path}: no design of a study ({error}): it was written by another version of gazerig, "
            "or changed; analyse it with the version that ran the study"
        ) from error
