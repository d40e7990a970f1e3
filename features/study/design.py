"""The design of a study: the types of its YAML file, checks, measures, and the order of trials.

The order of conditions is balanced over the participants by Williams' squares (E. J. Williams,
"Experimental designs balanced for the estimation of residual effects of treatments", Australian
Journal of Scientific Research A 2, 1949, 149-168).
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations
from pathlib import Path
from typing import Annotated, Literal, NamedTuple, cast

import numpy as np

from gazerig.config.load import ConfigError, load, shipped_path
from gazerig.config.parameters import NEXT_START, apply_changes, differences, effect_time
from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.config.shipped_files import is_path
from gazerig.drivers.errors import SetupError
from gazerig.params import Bounds
from gazerig.robot.model.commands import Value

HOME = Path(__file__).parent
"""The folder with ``studies`` and ``questionnaires``."""
PAIR = "|"
"""Separator of the first and the second presentation of a pair."""
SEED = 0
"""Seed of all orders, and of the conditions' random generators: the same in every study."""
_ORDERS, _PRACTICE = 0, 1  # random streams of one seed


@dataclass(frozen=True)
class Item:
    """One question: a rating from ``low`` to ``high``, a choice of a presentation, or free text.

    Attributes:
        text: The question; empty where the anchors say it all.
        points: Steps of a rating.
        low: Anchor of the least.
        high: Anchor of the most.
        reverse: Whether more means less of the scale.
    """

    text: str = ""
    kind: Literal["rating", "choice", "text"] = "rating"
    points: Annotated[int, Bounds(2, 11)] = 5
    low: str = ""
    high: str = ""
    scale: str = ""
    reverse: bool = False


@dataclass(frozen=True)
class Questionnaire:
    """Items on one page.

    Attributes:
        source: Reference in full.
        items: Key -> item, in order.
        shuffled: Whether the items have an order of their own for each participant and trial.
    """

    title: str
    source: str
    items: Mapping[str, Item]
    shuffled: bool = False
    instruction: str = ""


@dataclass(frozen=True)
class Condition:
    """One gaze of the study; missing entries are those of the rig.

    Attributes:
        label: Name in the report; participants never see it.
        profile: Style of gaze by name or path.
        character: Character by name or path.
        params: Dotted keys of the rig's YAML and their values.
    """

    label: str = ""
    profile: str | None = None
    character: str | None = None
    params: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True)
class Presentation:
    """Presentation of the conditions.

    Attributes:
        on: The head in the room, or a film of it in the browser.
        rig: Shipped name or path.
        scene: What an emulated head looks at; unused with a camera.
    """

    on: Literal["head", "film"] = "film"
    rig: str = "expressive"
    scene: str | None = None


@dataclass(frozen=True)
class Trials:
    """Trials of one participant, and their times.

    Attributes:
        seconds: Length of one presentation.
        practice: Trials before the first that counts.
    """

    seconds: Annotated[float, Bounds(2, 900)] = 30.0
    practice: Annotated[int, Bounds(0, 5)] = 1
    order: Literal["williams", "random"] = "williams"


@dataclass(frozen=True)
class Hypothesis:
    """Expectation, and the test that decides on it.

    Attributes:
        measure: "questionnaire.item" or "questionnaire.scale".
        better: Condition for which more is expected.
        test: What decides: signed_rank or rank_sum for ratings, sign for choices.
        also: Exploratory tests of ratings, printed next to it; they decide nothing.
    """

    measure: str
    better: str
    than: str
    test: Literal["signed_rank", "rank_sum", "sign"] = "signed_rank"
    also: tuple[Literal["signed_rank", "rank_sum", "chi_square"], ...] = ()


@dataclass(frozen=True)
class StudyDesign:
    """A study as in its YAML file.

    Attributes:
        conditions: Two to six gazes.
        questionnaires: Shipped names or paths, asked after each trial in this order.
        after: Questionnaires asked once at the end.
        welcome: Paragraphs that participants read before they consent; they must not name the
            difference.
        debriefing: Paragraphs that participants read at the end.
        task: Each presentation is rated, or one of two is chosen.
        participants: How many are invited.
        contact: Whom participants write to, e.g. to have their data deleted.
    """

    title: str
    conditions: Mapping[str, Condition]
    questionnaires: tuple[str, ...]
    after: tuple[str, ...] = ()
    description: tuple[str, ...] = ()
    welcome: tuple[str, ...] = ()
    debriefing: tuple[str, ...] = ()
    task: Literal["rating", "pairwise"] = "rating"
    presentation: Presentation = field(default_factory=Presentation)
    trials: Trials = field(default_factory=Trials)
    hypotheses: tuple[Hypothesis, ...] = ()
    participants: Annotated[int, Bounds(2, 1000)] = 24
    contact: str = ""


class Measure(NamedTuple):
    """One dependent variable: an item, the mean of a scale's items, or a choice."""

    name: str
    questionnaire: str
    items: tuple[str, ...]
    kind: str
    points: int


def design_measures(
    design: StudyDesign, questionnaires: Mapping[str, Questionnaire]
) -> dict[str, Measure]:
    """Return the measures of each trial by name, "questionnaire.item" or "questionnaire.scale"."""
    found: dict[str, Measure] = {}
    for key in design.questionnaires:
        items = questionnaires[key].items
        groups: dict[str, list[str]] = {}
        for name, item in items.items():
            for group in dict.fromkeys((name, item.scale or name)):
                groups.setdefault(group, []).append(name)
        for group, names in groups.items():
            at, first = f"{key}.{group}", items[names[0]]
            if first.kind != "text":
                found[at] = Measure(at, key, tuple(names), first.kind, first.points)
    return found


def williams(n: int) -> list[tuple[int, ...]]:
    """Return Williams' orders of ``n`` conditions 0..n-1: n of them if n is even, else 2n."""
    # 0, 1, n-1, 2, n-2, ...: neighbours differ by every number except 0, each once if n is even.
    first = [0] + [(i + 1) // 2 if i % 2 else n - i // 2 for i in range(1, n)]
    square = [tuple((one + row) % n for one in first) for row in range(n)]
    return square + ([row[::-1] for row in square] if n % 2 and n > 1 else [])


def participant_order(design: StudyDesign, participant: int) -> list[str]:
    """Return the trials of a participant in order, each a condition key or a pair "a|b".

    The number of a participant, from 1, selects the row of the table, or the random order.
    Conditions are assigned to the squares at random, for all studies alike. Pairs are turned for
    the second half of a balanced group.
    """
    trials = _block(design)
    table = np.array(williams(len(trials)))
    letters = np.random.default_rng((SEED, 0, _ORDERS)).permutation(len(trials))
    rng = np.random.default_rng((SEED, participant, _ORDERS))
    order: list[str] = []
    turn, row = divmod(participant - 1, len(table))
    random = design.trials.order == "random"
    for one in rng.permutation(len(trials)) if random else letters[table[row]]:
        turned = (turn + one) % 2
        order.append(PAIR.join(trials[one].split(PAIR)[:: -1 if turned else 1]))
    return order


def practice_trials(design: StudyDesign, participant: int) -> list[str]:
    """Return the practice trials of a participant, drawn at random; they do not count."""
    trials = _block(design)
    rng = np.random.default_rng((SEED, participant, _PRACTICE))
    drawn = rng.permutation(len(trials))
    return [trials[drawn[i % len(drawn)]] for i in range(design.trials.practice)]


def _block(design: StudyDesign) -> list[str]:
    """Return the trials of one block: the conditions, or their pairs as "a|b"."""
    if design.task == "rating":
        return list(design.conditions)
    return [f"{a}{PAIR}{b}" for a, b in combinations(design.conditions, 2)]


@dataclass(frozen=True)
class Study:
    """A checked study.

    Attributes:
        design: The content of the file, with questionnaires by their keys.
        questionnaires: By the keys in the design.
        rig_name: Name of the rig, or its path from the working folder.
        rig: The study's own rig, without any condition.
        rigs: The rig of each condition, with profile, character and parameters applied.
    """

    design: StudyDesign
    questionnaires: Mapping[str, Questionnaire]
    rig_name: str
    rig: Rig
    rigs: Mapping[str, Rig]


def load_study(name_or_path: str) -> Study:
    """Return a study by shipped name or path.

    Raises:
        SetupError: with every fault of the study's file, each with its line, or with those of a
            file that it names.
    """
    path = _find("studies", name_or_path, Path())
    design, folder = load(path, StudyDesign), path.parent
    files = {
        name: _find("questionnaires", name, folder)
        for name in (*design.questionnaires, *design.after)
    }
    rig_name = _locate(folder, design.presentation.rig)
    study = Study(
        replace(
            design,
            questionnaires=tuple(files[name].stem for name in design.questionnaires),
            after=tuple(files[name].stem for name in design.after),
        ),
        {file.stem: load(file, Questionnaire) for file in files.values()},
        rig_name,
        load_rig(rig_name),
        {key: _condition_rig(design, key, path) for key in design.conditions},
    )
    load(path, StudyDesign, checks=[lambda _: _faults(study)])
    return study


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


def rig_changes(before: Rig, after: Rig) -> dict[str, Value]:
    """Return the changes from one rig to another, without names of files."""
    found = differences(before, after)
    return {key: value for key, value in found.items() if key not in ("name", "profile")}


def _locate(folder: Path, name: str) -> str:
    return str(folder / Path(name).expanduser()) if is_path(name) else name


def _find(kind: str, name: str, folder: Path) -> Path:
    return Path(_locate(folder, name)) if is_path(name) else shipped_path(kind, name, HOME)


def _faults(study: Study) -> Iterator[tuple[str, str]]:
    """Yield dotted key and broken rule of the faults of a design whose files are good."""
    design = study.design
    if not 2 <= len(design.conditions) <= 6:
        yield "conditions", "a study compares two to six; add or remove some"
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
        for changed in rig_changes(study.rig, rig) if design.presentation.on == "head" else ():
            if effect_time(changed).startswith(NEXT_START):
                rule = f"{changed} cannot change while the head runs: presentation.on: film"
                yield f"conditions.{key}", rule
