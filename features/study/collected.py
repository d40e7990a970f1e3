"""The data in a study's folder: the design, and every participant's journal."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import msgspec

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_input import read_limited
from gazerig.features.study import journal
from gazerig.features.study.data_folder import StudyData
from gazerig.features.study.design import Condition, StudyDesign
from gazerig.features.study.participation import Participation, check_records, participation
from gazerig.features.study.questionnaire import Questionnaire
from gazerig.features.study.records import Opened

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
            if isinstance(one, Opened) and one.participant != each.name:
                raise SetupError(f"{each} has the journal of {one.participant}: move it back")
            if isinstance(one, Opened) and one.design_sha256 != sha256:
                raise SetupError(
                    f"{each} was recorded with another design ({one.design_sha256[:12]}) than "
                    f"{path} ({sha256[:12]}): data of two designs are two studies; move it to the "
                    "folder of its own"
                )
        if records:  # else it has no data
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

    Args:
        text: of gazerig.features.study.preregistration.canonical, decoded; it is not changed.
        path: path of its file, for messages.

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
        found = {
            key: msgspec.convert(_in_order(asked[key]), Questionnaire)
            for key in (*design["questionnaires"], *design["after"])
        }
        return msgspec.convert(design, StudyDesign), found
    except (KeyError, TypeError, AttributeError, msgspec.MsgspecError) as error:
        raise SetupError(
            f"{path}: no design of a study ({error}): it was written by another version of gazerig, "
            "or changed; analyse it with the version that ran the study"
        ) from error


def _in_order(asked: Mapping[str, Any]) -> dict[str, Any]:
    """Return a questionnaire with its items in the order of presentation."""
    rest = {key: value for key, value in asked.items() if key != "order"}
    return {**rest, "items": {key: asked["items"][key] for key in asked["order"]}}
