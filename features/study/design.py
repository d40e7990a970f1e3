"""The design of a study: the types of its YAML file, its measures, and the order of trials.

The order of conditions is balanced over the participants by Williams' squares (E. J. Williams,
"Experimental designs balanced for the estimation of residual effects of treatments", Australian
Journal of Scientific Research A 2, 1949, 149-168).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import combinations
from typing import Annotated, Literal, NamedTuple

import numpy as np

from gazerig.params import Bounds

Test = Literal["signed_rank", "rank_sum", "sign", "chi_square"]
Texts = Mapping[str, str]
"""Language -> text; "en" is required, and replaces a missing language."""
PAIR = "|"
"""Separator of the first and the second presentation of a pair."""
_ORDERS, _PRACTICE = 0, 1
"""Random streams of one seed."""


# fmt: off
@dataclass(frozen=True)
class Item:
    """One question: a rating from ``low`` to ``high``, a choice of a presentation, or free text."""

    text: Annotated[Texts, "the question; empty where the anchors say it all"] = field(default_factory=dict)
    kind: Annotated[Literal["rating", "choice", "text"], "how it is answered"] = "rating"
    points: Annotated[int, Bounds(2, 11), "steps of a rating"] = 5
    low: Annotated[Texts, "anchor of the least"] = field(default_factory=dict)
    high: Annotated[Texts, "anchor of the most"] = field(default_factory=dict)
    scale: Annotated[str, "scale that the item belongs to"] = ""
    reverse: Annotated[bool, "more means less of the scale"] = False


@dataclass(frozen=True)
class Questionnaire:
    """Items on one page."""

    title: Annotated[str, "name in the report"]
    source: Annotated[str, "reference in full"]
    licence: Annotated[str, "under which terms the items may be used"]
    items: Annotated[Mapping[str, Item], "key -> item, in order"]
    shuffled: Annotated[bool, "items in an order of their own for each participant and trial"] = False
    instruction: Annotated[Texts, "text above the items"] = field(default_factory=dict)


@dataclass(frozen=True)
class Condition:
    """One gaze of the study; missing entries are those of the rig."""

    label: Annotated[str, "name in the report; participants never see it"] = ""
    profile: Annotated[str | None, "style of gaze by name or path"] = None
    character: Annotated[str | None, "character by name or path"] = None
    params: Annotated[Mapping[str, object], "dotted keys of the rig's YAML and their values"] = field(default_factory=dict)
    film: Annotated[str | None, "film to show (.webm); null: rendered from the condition"] = None


@dataclass(frozen=True)
class Presentation:
    """Presentation of the conditions."""

    on: Annotated[Literal["head", "film"], "the head in the room, or a film of it in the browser"] = "film"
    rig: Annotated[str, "shipped name or path"] = "expressive"
    scene: Annotated[str | None, "what an emulated head looks at; unused with a camera"] = None
    seed: Annotated[int, Bounds(0, 2**31 - 1), "seed of the conditions' random generators; the same for all"] = 0


@dataclass(frozen=True)
class Trials:
    """Trials of one participant, and their times."""

    seconds: Annotated[float, Bounds(2, 900), "length of one presentation"] = 30.0
    repetitions: Annotated[int, Bounds(1, 20), "how often each condition (pair) is shown"] = 1
    practice: Annotated[int, Bounds(0, 5), "trials before the first that counts"] = 1
    order: Annotated[Literal["williams", "random"], "Williams' squares, or shuffled by the seed"] = "williams"
    seed: Annotated[int, Bounds(0, 2**31 - 1), "seed of all orders"] = 0


@dataclass(frozen=True)
class Hypothesis:
    """Expectation, and the test that decides on it."""

    measure: Annotated[str, "questionnaire.item or questionnaire.scale"]
    better: Annotated[str, "condition for which more is expected"]
    than: Annotated[str, "condition that it is compared with"]
    test: Annotated[Test, "what decides: signed_rank, rank_sum; sign for choices"] = "signed_rank"
    also: Annotated[tuple[Test, ...], "exploratory tests, printed next to it; they decide nothing"] = ()


@dataclass(frozen=True)
class StatisticalPlan:
    """Sample size and level of all tests together (Holm's correction)."""

    participants: Annotated[int, Bounds(2, 1000), "how many are invited"] = 24
    alpha: Annotated[float, Bounds(0.0001, 0.2), "probability of a false alarm, over all hypotheses"] = 0.05


@dataclass(frozen=True)
class StudyDesign:
    """A study as in its YAML file."""

    title: Annotated[str, "title of the report"]
    conditions: Annotated[Mapping[str, Condition], "two to six gazes"]
    questionnaires: Annotated[tuple[str, ...], "shipped names or paths, asked after each trial in this order"]
    after: Annotated[tuple[str, ...], "questionnaires asked once at the end"] = ()
    description: Annotated[tuple[str, ...], "what is studied, in paragraphs, for the report"] = ()
    welcome: Annotated[tuple[str, ...], "paragraphs that participants read before they consent; they must not name the difference"] = ()
    debriefing: Annotated[tuple[str, ...], "paragraphs that participants read at the end"] = ()
    language: Annotated[str, "of the questions, where they have it"] = "en"
    task: Annotated[Literal["rating", "pairwise"], "each presentation is rated, or one of two is chosen"] = "rating"
    may_skip: Annotated[bool, "participants may leave questions unanswered"] = False
    presentation: Presentation = field(default_factory=Presentation)
    trials: Trials = field(default_factory=Trials)
    hypotheses: tuple[Hypothesis, ...] = ()
    plan: StatisticalPlan = field(default_factory=StatisticalPlan)
    contact: Annotated[str, "whom participants write to, e.g. to have their data deleted"] = ""
# fmt: on


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


def balanced_group_size(design: StudyDesign) -> int:
    """Return the number of participants that use every order once; 1 for random orders."""
    if design.trials.order == "random":
        return 1
    orders = len(williams(len(_block(design))))
    return orders if design.task == "rating" else 2 * orders


def participant_order(design: StudyDesign, participant: int) -> list[str]:
    """Return the trials of a participant in order, each a condition key or a pair "a|b".

    Each repetition is a block with the next order. The seed assigns conditions to the squares.
    Pairs are turned for the second half of the balanced group.

    Args:
        design: a checked design.
        participant: from 1; it selects the row of the table, or the random order.
    """
    trials, seed = _block(design), design.trials.seed
    table = np.array(williams(len(trials)))
    letters = np.random.default_rng((seed, 0, _ORDERS)).permutation(len(trials))
    rng = np.random.default_rng((seed, participant, _ORDERS))
    order: list[str] = []
    for block in range(design.trials.repetitions):
        turn, row = divmod(participant - 1 + block, len(table))
        random = design.trials.order == "random"
        for one in rng.permutation(len(trials)) if random else letters[table[row]]:
            turned = (turn + one) % 2
            order.append(PAIR.join(trials[one].split(PAIR)[:: -1 if turned else 1]))
    return order


def practice_trials(design: StudyDesign, participant: int) -> list[str]:
    """Return the practice trials of a participant, drawn at random; they do not count."""
    trials = _block(design)
    rng = np.random.default_rng((design.trials.seed, participant, _PRACTICE))
    drawn = rng.permutation(len(trials))
    return [trials[drawn[i % len(drawn)]] for i in range(design.trials.practice)]


def _block(design: StudyDesign) -> list[str]:
    """Return the trials of one block: the conditions, or their pairs as "a|b"."""
    if design.task == "rating":
        return list(design.conditions)
    return [f"{a}{PAIR}{b}" for a, b in combinations(design.conditions, 2)]
