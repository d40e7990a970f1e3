"""Rules of a study that need no rig: errors of a design or a questionnaire, with remedies.

Each rule yields (dotted key, broken rule), like the rules between the sections of a rig.
"""

from collections.abc import Collection, Iterator, Mapping

from gazerig.features.study.design import DECIDING, Hypothesis, StudyDesign, Test
from gazerig.features.study.questionnaire import Item, Questionnaire
from gazerig.features.study.scores import GAZE_MEASURES, Measure, design_measures
from gazerig.features.study.trial_order import balanced_group_size
from gazerig.robot.model.types import JOINT_NAME

Found = Iterator[tuple[str, str]]
LANGUAGES = ("en", "ja", "de")
_MOST, _LEAST = 6, 2
_NAME = "small letters, digits and _, a letter first, at most 40"


def design_rules(design: StudyDesign) -> Found:
    """Yield errors within a design."""
    count = len(design.conditions)
    if not _LEAST <= count <= _MOST:
        words = "a study compares two to six; " + (
            "add one" if count < _LEAST else "leave some out, or make two studies"
        )
        yield "conditions", f"{count} of them: {words}"
    for key in design.conditions:
        if not JOINT_NAME.fullmatch(key):
            yield f"conditions.{key}", f"no name of a condition: {_NAME}"
    for language, texts in design.translations.items():
        at = f"translations.{language}"
        if language not in LANGUAGES:
            yield at, f"no language of the pages: {', '.join(LANGUAGES)}"
        for name in ("welcome", "debriefing"):
            if getattr(design, name) and not getattr(texts, name):
                yield f"{at}.{name}", "is missing, and the study has one; translate it as well"
    yield from _shown_rules(design)
    yield from _factor_rules(design)
    if _LEAST <= count <= _MOST:
        wanted, every = design.plan.participants, balanced_group_size(design)
        if wanted % every:
            below, above = wanted // every * every, (wanted // every + 1) * every
            near = f"{below} or {above}" if below else f"{above} or {above + every}"
            few = "too few for" if not below else "no multiple of"
            yield (
                "plan.participants",
                f"{wanted} is {few} the {every} orders of Williams' squares: take {near}, "
                "or trials.order: random",
            )
    for i, name in enumerate(design.objective):
        if name in design.objective[:i]:
            yield f"objective.{i}", "stands twice"
        if design.presentation.on == "film":
            yield f"objective.{i}", "is measured by the head in the room: presentation.on: head"
        elif name in GAZE_MEASURES and not design.privacy.gaze:
            yield f"objective.{i}", "needs privacy.gaze: true"


def _shown_rules(design: StudyDesign) -> Found:
    """Yield conditions that cannot be shown, and settings without effect."""
    if design.presentation.scene is not None and design.presentation.world is not None:
        yield "presentation.world", "there is a scene as well; give one of them"
    for key, one in design.conditions.items():
        at = f"conditions.{key}"
        if design.presentation.on == "head":
            for name in ("film", "recording"):
                if getattr(one, name) is not None:
                    rule = "the head itself is shown; write presentation.on: film, or leave it"
                    yield f"{at}.{name}", rule
        given = ("film", "recording")
        shown = [name for name in given if getattr(one, name) is not None]
        if len(shown) == len(given):
            yield f"{at}.recording", "there is a film of it already; give one of them"
        said = ("profile", "character", "scanpath", "behaviour", "params")
        for name in said if shown else ():
            if getattr(one, name):
                yield f"{at}.{name}", f"has no effect beside {shown[0]}; take one of them out"


def _factor_rules(design: StudyDesign) -> Found:
    """Yield factors that do not define the level of every condition."""
    names = dict.fromkeys(name for one in design.conditions.values() for name in one.factors)
    cells: dict[tuple[str | None, ...], str] = {}
    for key, one in design.conditions.items():
        for name in names:
            if name not in one.factors:
                yield f"conditions.{key}.factors", f"has no level of {name!r}, as others have"
        cell = tuple(one.factors.get(name) for name in names)
        if names and cell in cells:
            yield f"conditions.{key}.factors", f"are those of {cells[cell]!r}; each cell is once"
        cells.setdefault(cell, key)
    for name in names:
        levels = {one.factors.get(name) for one in design.conditions.values()}
        if len(levels) == 1:
            yield f"conditions.{next(iter(design.conditions))}.factors.{name}", "has one level only"


def objective_rules(design: StudyDesign, known: Collection[str]) -> Found:
    """Yield unknown objective measures; known: the measures of the report."""
    for i, name in enumerate(design.objective):
        if name not in GAZE_MEASURES and name not in known:
            there = ", ".join((*GAZE_MEASURES, *known))
            yield f"objective.{i}", f"no measure {name!r}; there is {there}"


def questionnaire_rules(asked: Questionnaire) -> Found:
    """Yield errors within a questionnaire."""
    if not asked.items:
        yield "items", "there are none; write at least one"
    for language in asked.instruction:
        if language not in LANGUAGES:
            yield f"instruction.{language}", f"no language of the pages: {', '.join(LANGUAGES)}"
    if asked.instruction and "en" not in asked.instruction:
        yield "instruction", "has no en, which stands where another language is missing"
    points: dict[str, tuple[str, int]] = {}
    for key, item in asked.items.items():
        yield from _item_rules(key, item)
        if item.scale:
            first, steps = points.setdefault(item.scale, (key, item.points))
            if item.points != steps:
                yield f"items.{key}.points", f"{first!r} of the same scale has {steps}"
            if item.scale in asked.items:
                yield f"items.{key}.scale", "is an item's key as well; name the scale otherwise"


def _item_rules(key: str, item: Item) -> Found:
    """Yield errors of one item."""
    at = f"items.{key}"
    if not JOINT_NAME.fullmatch(key):
        yield at, f"no key of an item: {_NAME}"
    for name in ("text", "low", "high"):
        texts: Mapping[str, str] = getattr(item, name)
        for language in texts:
            if language not in LANGUAGES:
                yield f"{at}.{name}.{language}", f"no language of the pages: {', '.join(LANGUAGES)}"
        if texts and not texts.get("en"):
            yield f"{at}.{name}", "has no en, which stands where another language is missing"
    if item.kind == "rating":
        for name in ("low", "high"):
            if not getattr(item, name):
                yield f"{at}.{name}", "a rating needs the words at both ends"
    else:
        if not item.text:
            yield f"{at}.text", "is missing: nothing else says what is asked"
        for name in ("low", "high", "scale", "reverse"):
            if getattr(item, name):
                yield f"{at}.{name}", f"belongs to ratings, and this is {item.kind}"


def consistency_rules(design: StudyDesign, questionnaires: Mapping[str, Questionnaire]) -> Found:
    """Yield contradictions between the task, the questions and the hypotheses.

    questionnaires: by the keys in the design, without invalid ones
    """
    every = (*design.questionnaires, *design.after)
    for i, key in enumerate(every):
        n = len(design.questionnaires)  # those after each trial are counted first
        place = f"questionnaires.{i}" if i < n else f"after.{i - n}"
        if key in every[:i]:
            yield place, f"{key!r} is asked already; once is enough"
        kinds = (
            {one.kind for one in questionnaires[key].items.values()}
            if key in questionnaires
            else set()
        )
        if "choice" in kinds and design.task == "rating":
            yield place, f"{key!r} asks for a choice between two: task: pairwise"
        if "choice" in kinds and i >= len(design.questionnaires):
            yield place, f"{key!r} asks which of two was chosen, and at the end there are none"
    if not design.questionnaires:
        yield "questionnaires", "none is asked after a trial; name one"
    known = design_measures(design, questionnaires)
    complete = all(key in questionnaires for key in every)
    chosen = [one for one in known.values() if one.kind == "choice"]
    if design.task == "pairwise" and complete and not chosen:
        yield "questionnaires", "task pairwise needs one with a choice, such as choice"
    for i, one in enumerate(design.hypotheses):
        for key, rule in _hypothesis_rules(design, one, known, complete):
            yield f"hypotheses.{i}.{key}", rule


def _hypothesis_rules(
    design: StudyDesign, one: Hypothesis, known: Mapping[str, Measure], complete: bool
) -> Found:
    """Yield the reasons why a hypothesis cannot be tested."""
    yield from _side_rules(design, one)
    measure = known.get(one.measure)
    if measure is None:
        if complete:
            names, more = list(known)[:12], len(known) - 12
            there = ", ".join(names) + f" and {more} more" * (more > 0)
            yield "measure", f"nothing asks or measures {one.measure!r}; there is {there}"
    elif measure.once:
        yield "measure", "is asked once at the end, of no condition; ask it after each trial"
    for i, test in enumerate((one.test, *one.also)):
        key = "test" if i == 0 else f"also.{i - 1}"
        if test in (one.test, *one.also)[:i]:
            yield key, f"{test} stands already; once is enough"
        if i == 0 and test not in DECIDING:
            right = "sign" if measure is not None and measure.kind == "choice" else "signed_rank"
            yield key, f"{test} {_EXPLORATORY[test]}: write test: {right}, and also: [{test}]"
        elif measure is not None and (rule := _test_misfit(test, measure, len(design.conditions))):
            yield key, rule
        elif len(design.side(one.better)) > 1 and test not in LEVEL_TESTS:
            instead = "name two" if test == "sign" else f"take {' or '.join(LEVEL_TESTS)}"
            yield key, f"{test} compares single conditions, not levels of a factor; {instead}"


def _side_rules(design: StudyDesign, one: Hypothesis) -> Found:
    """Yield the reasons why both sides of a hypothesis cannot be compared."""
    sides = {key: design.side(getattr(one, key)) for key in ("better", "than")}
    for key, side in sides.items():
        if not side:
            pairs = [pair for c in design.conditions.values() for pair in c.factors.items()]
            levels = [f"{factor}={level}" for factor, level in dict.fromkeys(pairs)]
            there = ", ".join((*design.conditions, *levels))
            yield key, f"no condition {getattr(one, key)!r}, and no level; there is {there}"
    if one.better == one.than:
        yield "than", "is the condition itself; name another"
    elif all(sides.values()):
        factors = [
            name.partition("=")[0] if name not in design.conditions else ""
            for name in (one.better, one.than)
        ]
        if factors[0] != factors[1]:
            yield "than", "is to be a level of the same factor, or both are to be conditions"
        elif len(design.condition_pairs(one)) != max(len(side) for side in sides.values()):
            yield (
                "than",
                f"{one.better!r} and {one.than!r} do not stand beside the same levels of the other "
                "factors, so the difference would be theirs as well; compare single conditions",
            )


_EXPLORATORY: Mapping[Test, str] = {
    "friedman": "tests whether any of all conditions differ, so it cannot decide on these two",
    "chi_square": "has no sign and treats each answer as another person's, so it cannot decide",
}
LEVEL_TESTS = ("signed_rank", "rank_sum")
"""Tests of a participant's means, which may include several conditions."""


def _test_misfit(test: str, measure: Measure, conditions: int) -> str:
    """Return why a test cannot decide on a measure, "" if it can."""
    if (test == "sign") != (measure.kind == "choice"):
        fit = "sign" if measure.kind == "choice" else "signed_rank"
        return f"{test} cannot decide on {_KINDS[measure.kind]}; for example {fit} can"
    if test == "chi_square" and measure.kind != "item":
        return f"{test} counts the answers to one item; for {_KINDS[measure.kind]} take signed_rank"
    if test == "friedman" and conditions < 3:
        return "friedman compares three conditions or more; for two take signed_rank"
    return ""


_KINDS = {
    "item": "a rating",
    "scale": "the mean of a scale",
    "choice": "a choice between two",
    "objective": "an objective measure",
}
