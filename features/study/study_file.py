"""Studies by name or path, checked with their questionnaires, rigs and films."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast

from gazerig.config.load import ConfigError, load, shipped_path
from gazerig.config.parameters import NEXT_START, apply_changes, differences, effect_time
from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.film_writer import film_seconds
from gazerig.features.study.design import (
    Condition,
    Hypothesis,
    Measure,
    Questionnaire,
    StudyDesign,
    balanced_group_size,
    design_measures,
)
from gazerig.robot.app.scene_files import scene_names
from gazerig.robot.model.commands import Value
from gazerig.robot.model.types import JOINT_NAME

HOME = Path(__file__).parent
"""The folder with ``studies`` and ``questionnaires``."""
WHOLE_SHARE = 0.9
"""Share of a film that must be played for a complete presentation."""
Faults = Iterator[tuple[str, str]]
"""(dotted key, broken rule)."""
_NAME = "no name: small letters, digits and _, a letter first, at most 40"


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
        gazerig.config.load.ConfigError: with every fault, each with the study's line.
    """
    path = _find("studies", name_or_path, Path())
    design = load(path, StudyDesign, checks=[lambda raw: _faults(raw, path.parent)])
    asked = (*design.questionnaires, *design.after)
    return Study(
        path,
        _with_keys(design),
        {_key(name): load_questionnaire(name, path.parent) for name in asked},
        load_rig(_locate(path.parent, design.presentation.rig)),
        {key: condition_rig(design, one, path.parent) for key, one in design.conditions.items()},
    )


def load_questionnaire(name_or_path: str, folder: Path) -> Questionnaire:
    """Return a questionnaire by shipped name, or by path relative to a folder.

    Raises:
        gazerig.config.load.ConfigError: with every fault.
    """
    path = _find("questionnaires", name_or_path, folder)
    return load(path, Questionnaire, checks=[_questionnaire_faults])


def condition_rig(design: StudyDesign, condition: Condition, folder: Path) -> Rig:
    """Return the rig of a condition, with all its changes applied.

    Raises:
        gazerig.config.load.ConfigError: with every fault.
    """
    files = (design.presentation.rig, condition.character, condition.profile)
    rig, character, profile = (name and _locate(folder, name) for name in files)
    loaded = load_rig(rig or "", character, profile)
    changes = cast(Mapping[str, Value], condition.params)
    return apply_changes(loaded, changes) if changes else loaded


def _differences(before: Rig, after: Rig) -> dict[str, Value]:
    """Return the changes from one rig to another, without names of files."""
    found = differences(before, after)
    return {key: value for key, value in found.items() if key not in ("name", "profile")}


def _is_path(name: str) -> bool:
    return "/" in name or name.endswith((".yaml", ".webm"))


def _locate(folder: Path, name: str) -> str:
    return str(folder / Path(name).expanduser()) if _is_path(name) else name


def _find(kind: str, name: str, folder: Path) -> Path:
    return Path(_locate(folder, name)) if _is_path(name) else shipped_path(kind, name, HOME)


def _key(name: str) -> str:
    return Path(name).stem


def _with_keys(design: StudyDesign) -> StudyDesign:
    """Return a design with questionnaires by their keys."""
    asked, after = (tuple(map(_key, names)) for names in (design.questionnaires, design.after))
    return replace(design, questionnaires=asked, after=after)


def _faults(design: StudyDesign, folder: Path) -> Faults:
    """Yield every fault of a design and of the files that it names."""
    if not 2 <= len(design.conditions) <= 6:
        yield "conditions", "a study compares two to six; add or remove some"
        return
    shown = design.presentation
    if shown.scene is not None and shown.scene not in scene_names():
        yield "presentation.scene", f"no scene {shown.scene!r}; there is {', '.join(scene_names())}"
    planned, every = design.plan.participants, balanced_group_size(design)
    if planned % every:
        near = f"{planned // every * every or every} or {(planned // every + 1) * every}"
        rule = f"{planned} is no multiple of the {every} orders of Williams' squares: take {near}"
        yield "plan.participants", f"{rule}, or trials.order: random"
    found: dict[str, Questionnaire] = {}
    for list_name in ("questionnaires", "after"):
        for i, name in enumerate(getattr(design, list_name)):
            try:
                found[_key(name)] = load_questionnaire(name, folder)
            except ConfigError as error:
                yield from _at(f"{list_name}.{i}", error)
    if len(found) == len({*design.questionnaires, *design.after}):
        measures = design_measures(_with_keys(design), found)
        kinds = {one.kind for one in measures.values()}
        if ("choice" in kinds) != (design.task == "pairwise"):
            yield (
                "task",
                "pairwise needs a questionnaire with a choice in each trial, and rating none",
            )
        for i, one in enumerate(design.hypotheses):
            yield from _hypothesis_faults(f"hypotheses.{i}", design, one, measures)
    yield from _condition_faults(design, folder)


def _at(key: str, error: ConfigError) -> Faults:
    """Yield the faults of a file at the key that names it."""
    for fault in error.faults:
        yield key, str(fault)


def _hypothesis_faults(
    at: str, design: StudyDesign, one: Hypothesis, measures: Mapping[str, Measure]
) -> Faults:
    """Yield the reasons why a hypothesis cannot be tested."""
    for key, name in (("better", one.better), ("than", one.than)):
        if name not in design.conditions:
            yield f"{at}.{key}", f"no condition {name!r}; there is {', '.join(design.conditions)}"
    if one.better == one.than:
        yield f"{at}.than", "is the condition itself; name another"
    measure = measures.get(one.measure)
    if measure is None:
        yield f"{at}.measure", f"no trial asks {one.measure!r}; there is {', '.join(measures)}"
        return
    fit = ["sign"] if measure.kind == "choice" else ["signed_rank", "rank_sum"]
    if one.test not in fit or (design.task == "pairwise") != (measure.kind == "choice"):
        yield f"{at}.test", f"{one.test} cannot decide on a {measure.kind}; {' or '.join(fit)} can"
    single = len(measure.items) == 1
    for test in one.also:
        if test == "sign" or (test == "chi_square" and not single):
            yield f"{at}.also", f"{test} does not test {one.measure}; remove it"


def _condition_faults(design: StudyDesign, folder: Path) -> Faults:
    """Yield conditions that cannot be shown at all, or on a running head, or are equal."""
    try:
        own = load_rig(_locate(folder, design.presentation.rig))
    except ConfigError as error:
        yield from _at("presentation.rig", error)
        return
    on_head, rigs = design.presentation.on == "head", dict[str, Rig]()
    for key, one in design.conditions.items():
        at = f"conditions.{key}"
        if not JOINT_NAME.fullmatch(key):
            yield at, _NAME
        if one.film is not None:
            try:
                seconds = film_seconds(_locate(folder, one.film))
            except SetupError as error:
                yield f"{at}.film", str(error)
                continue
            if on_head or seconds < WHOLE_SHARE * design.trials.seconds:
                yield f"{at}.film", f"needs presentation.on: film, and lasts {seconds:.1f} s"
            continue
        try:
            rigs[key] = condition_rig(design, one, folder)
        except ConfigError as error:
            for fault in error.faults:
                given = fault.key in one.params
                yield (f"{at}.params.{fault.key}", fault.rule) if given else (at, str(fault))
            continue
        for changed in _differences(own, rigs[key]) if on_head else ():
            if effect_time(changed).startswith(NEXT_START):
                yield at, f"{changed} cannot change while the head runs: presentation.on: film"
        for other in rigs:
            if other != key and not _differences(rigs[other], rigs[key]):
                yield at, f"shows the same as {other!r}; change a value of one, or remove one"


def _questionnaire_faults(asked: Questionnaire) -> Faults:
    """Yield faults within a questionnaire."""
    points: dict[str, int] = {}
    for key, item in asked.items.items():
        at = f"items.{key}"
        if not JOINT_NAME.fullmatch(key):
            yield at, _NAME
        for name in ("low", "high") if item.kind == "rating" else ("text",):
            if not getattr(item, name).get("en"):
                yield f"{at}.{name}", "needs en, which replaces a missing language"
        if item.scale in asked.items or item.points != points.setdefault(
            item.scale or key, item.points
        ):
            yield f"{at}.scale", "is no key of an item, and all its items have as many points"
