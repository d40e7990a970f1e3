"""Canonical text of a study before its first participant, with its hash."""

import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from gazerig.features.study.design import StudyDesign
from gazerig.features.study.questionnaire import Questionnaire

_BY_VALUE = frozenset({"rig", "profile", "character", "scanpath", "params", "recording", "film"})
"""Keys of a condition that name the source of its values; the text has the values instead."""


def canonical(
    design: StudyDesign,
    questionnaires: Mapping[str, Questionnaire],
    shown: Mapping[str, Mapping[str, object]],
) -> bytes:
    """Return a study as JSON that depends only on its content, not on how it was written.

    Defaults are written out, keys are sorted, and files are replaced by their content: comments,
    formatting and paths have no effect; every value has.

    Args:
        design: a checked design.
        questionnaires: by the keys in the design.
        shown: for each condition the values of its gaze by dotted key, and the hashes of its files.
    """
    stated = _plain(design)
    for key, one in stated["conditions"].items():
        stated["conditions"][key] = {k: v for k, v in one.items() if k not in _BY_VALUE}
        stated["conditions"][key]["values"] = _plain(shown[key])
    presentation = stated["presentation"]
    del presentation["rig"]
    if presentation["world"] is not None:
        presentation["world"] = Path(presentation["world"]).name
    asked = {key: _plain(one) for key, one in questionnaires.items()}
    # The order of items is their order of presentation.
    for key, one in questionnaires.items():
        asked[key]["order"] = list(one.items)
    stated["order"] = list(design.conditions)
    text = json.dumps(
        {"design": stated, "questionnaires": asked},
        sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False,
    )  # fmt: skip
    return text.encode()


def design_sha256(canonical: bytes) -> str:
    """Return the hash for a study's data, 64 hexadecimal digits."""
    return sha256(canonical).hexdigest()


def _plain(value: Any) -> Any:
    """Convert frozen values to JSON types."""
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: _plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value
