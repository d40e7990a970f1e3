"""Studies by name or path, checked with their questionnaires and rigs."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast

from gazerig.config.load import ConfigError, load, shipped_path
from gazerig.config.parameters import NEXT_START, apply_changes, differences, effect_time
from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.drivers.errors import SetupError
from gazerig.features.study.design import (
    Questionnaire,
    StudyDesign,
    balanced_group_size,
    design_measures,
)
from gazerig.robot.model.commands import Value

HOME = Path(__file__).parent
"""The folder with ``studies`` and ``questionnaires``."""
Faults = Iterator[tuple[str, str]]
"""(dotted key, broken rule)."""


@dataclass(frozen=True)
class Study:
    """A checked study.

    Attributes:
        path: The file.
        design: The content of the file, with questionnaires by their keys.
        questionnaires: By the keys in the design.
        rig: The study's own rig, without any condition.
        rigs: The rig of each condition, with profile, character and parameters applied.
    """

    path: Path
    design: StudyDesign
    questionnaires: Mapping[str, Questionnaire]
    rig: Rig
    rigs: Mapping[str, Rig]

    def changes(self, before: str | None, after: str) -> dict[str, Value]:
        """Return a running head's changes between conditions; None: from the study's rig."""
        return _differences(self.rig if before is None else self.rigs[before], self.rigs[after])

    def locate(self, name: str) -> str:
        """Return a path relative to the working folder instead of the study's; names unchanged."""
        return _locate(self.path.parent, name)


def load_study(name_or_path: str) -> Study:
    """Return a study by shipped name or path.

    Raises:
        SetupError: with every fault of the study's file, each with its line, or with those of a
            file that it names.
    """
    path = _find("studies", name_or_path, Path())
    design, folder = load(path, StudyDesign), path.parent
    names = (*design.questionnaires, *design.after)
    questionnaires, after = (
        tuple(map(_key, names)) for names in (design.questionnaires, design.after)
    )
    study = Study(
        path,
        replace(design, questionnaires=questionnaires, after=after),
        {_key(name): load_questionnaire(name, folder) for name in names},
        load_rig(_locate(folder, design.presentation.rig)),
        {key: _condition_rig(design, key, path) for key in design.conditions},
    )
    load(path, StudyDesign, checks=[lambda _: _faults(study)])
    return study


def load_questionnaire(name_or_path: str, folder: Path) -> Questionnaire:
    """Return a questionnaire by shipped name, or by path relative to a folder.

    Raises:
        gazerig.config.load.ConfigError: with every fault.
    """
    path = _find("questionnaires", name_or_path, folder)
    return load(path, Questionnaire, checks=[_questionnaire_faults])


def _condition_rig(design: StudyDesign, key: str, path: Path) -> Rig:
    """Return the rig of a condition, with all its changes applied."""
    condition = design.conditions[key]
    files = (design.presentation.rig, condition.character, condition.profile)
    rig, character, profile = (name and _locate(path.parent, name) for name in files)
    try:
        loaded = load_rig(rig or "", character, profile)
        return apply_changes(loaded, cast(Mapping[str, Value], condition.params))
    except ConfigError as error:
        raise SetupError(f"{path}: conditions.{key}: {error}") from error


def _differences(before: Rig, after: Rig) -> dict[str, Value]:
    """Return the changes from one rig to another, without names of files."""
    found = differences(before, after)
    return {key: value for key, value in found.items() if key not in ("name", "profile")}


def _is_path(name: str) -> bool:
    return "/" in name or name.endswith(".yaml")


def _locate(folder: Path, name: str) -> str:
    return str(folder / Path(name).expanduser()) if _is_path(name) else name


def _find(kind: str, name: str, folder: Path) -> Path:
    return Path(_locate(folder, name)) if _is_path(name) else shipped_path(kind, name, HOME)


def _key(name: str) -> str:
    return Path(name).stem


def _faults(study: Study) -> Faults:
    """Yield the faults of a design whose files are good."""
    design = study.design
    if not 2 <= len(design.conditions) <= 6:
        yield "conditions", "a study compares two to six; add or remove some"
        return
    every = balanced_group_size(design)
    if design.plan.participants % every:
        rule = f"no multiple of the {every} orders of Williams' squares"
        yield "plan.participants", f"{rule}; take one, or trials.order: random"
    measures = design_measures(design, study.questionnaires)
    choices = [name for name, one in measures.items() if one.kind == "choice"]
    if bool(choices) != (design.task == "pairwise"):
        yield "task", "pairwise needs a questionnaire with a choice in each trial, and rating none"
    for i, one in enumerate(design.hypotheses):
        at = f"hypotheses.{i}"
        for name in (one.better, one.than):
            if name not in design.conditions:
                yield at, f"no condition {name!r}; there is {', '.join(design.conditions)}"
        if one.measure not in measures or (choices and one.measure not in choices):
            tested = ", ".join(choices or measures)
            yield f"{at}.measure", f"no trial asks {one.measure!r}; there is {tested}"
        elif (one.test == "sign") != bool(choices):
            yield f"{at}.test", "sign decides on choices, signed_rank and rank_sum on ratings"
    for key, rig in study.rigs.items():
        if [*study.rigs.values()].count(rig) > 1:
            yield f"conditions.{key}", "shows the same as another; change a value, or remove it"
        for changed in _differences(study.rig, rig) if design.presentation.on == "head" else ():
            if effect_time(changed).startswith(NEXT_START):
                rule = f"{changed} cannot change while the head runs: presentation.on: film"
                yield f"conditions.{key}", rule


def _questionnaire_faults(asked: Questionnaire) -> Faults:
    """Yield faults within a questionnaire."""
    points: dict[str, int] = {}
    for key, item in asked.items.items():
        same = points.setdefault(item.scale or key, item.points)
        if item.scale in asked.items or item.points != same:
            yield f"items.{key}.scale", "is no key of an item; all its items have as many points"
