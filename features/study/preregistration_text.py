"""A study's pre-registration as Markdown, from hypotheses to exclusions."""

from collections.abc import Iterator, Mapping
from math import ceil
from pathlib import Path

import jinja2

from gazerig.features.study.design import Hypothesis, StudyDesign, Test
from gazerig.features.study.participation import LEAST_SAME
from gazerig.features.study.power import MOST, PowerClaim, power_claim, power_of
from gazerig.features.study.questionnaire import Item, Questionnaire, Texts
from gazerig.features.study.scores import GAZE_MEASURES, design_measures
from gazerig.features.study.trial_order import (
    PAIR,
    balanced_group_size,
    block_trials,
    participant_order,
)

TESTS: Mapping[Test, str] = {
    "signed_rank": "Wilcoxon's signed-rank test of participants' differences, zeros left out",
    "rank_sum": "Wilcoxon's rank-sum statistic, by all swaps of participants' two answers",
    "sign": "the exact sign test of participants, by which of both each chose more often",
    "chi_square": "Pearson's chi-square test of the counts of each point",
    "friedman": "Friedman's test over all conditions",
}
"""Description of each test."""
_QUESTION_S, _SHOWN_ROWS = 6.0, 12
_FILES = ("rig", "profile", "character", "scanpath", "behaviour", "recording", "film")


def preregistration_text(
    design: StudyDesign,
    questionnaires: Mapping[str, Questionnaire],
    changes: Mapping[str, Mapping[str, object]],
    sha256: str,
    program: str,
) -> str:
    """Return the pre-registration of a study."""
    claims = claims_of(design, questionnaires)
    hypotheses = [
        {
            "sentence": hypothesis_sentence(one, design),
            "analysis": (
                f"`{one.measure}`, `{one.better}` against `{one.than}`: {TESTS[one.test]}."
                + f" Exploratory, deciding nothing: {'; '.join(TESTS[test] for test in one.also)}."
                * bool(one.also)
            ),
            "size": size_words(design, found),
        }
        for one, found in zip(design.hypotheses, claims, strict=True)
    ]
    trials, pairs = design.trials, len(block_trials(design))
    shown = f"each of the {pairs} pairs of conditions, one after the other"
    if design.task == "rating":
        shown = f"each of the {len(design.conditions)} conditions"
    elif pairs == 1:
        shown = "the pair of conditions, one after the other"
    practice = rests = ""
    if trials.practice:
        many = f"{trials.practice} practice trial{'s' if trials.practice > 1 else ''}"
        practice = f"Before it, {many}."
    if trials.rest_every and len(participant_order(design, 1)) > trials.rest_every:
        rests = f"After every {trials.rest_every} trials a rest of at least {trials.rest_s:g} s."
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent), undefined=jinja2.StrictUndefined,
        trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True, autoescape=False,
    )  # fmt: skip
    made = environment.get_template("preregistration.md.jinja").render(
        design=design, program=program, sha256=sha256, hypotheses=hypotheses,
        conditions=list(_conditions(design, changes)), shown=_presentation(design),
        trials=shown,
        repeated=f", {trials.repetitions} times" if trials.repetitions > 1 else "",
        course=" ".join(filter(None, (_order(design), practice, rests))),
        minutes=minutes(design, questionnaires),
        rows=list(_rows(design)), questionnaires=list(_questionnaire_rows(design, questionnaires)),
        objective=[(n, GAZE_MEASURES.get(n, "as in gazerig report")) for n in design.objective],
        correction=_correction(design), curve=_curve(design, claims),
        exclusions=list(_exclusions(design)), privacy=list(_privacy(design)),
        debriefing="At the end:\n" if design.texts.debriefing else "",
    )  # fmt: skip
    return made.rstrip("\n") + "\n"


def claims_of(
    design: StudyDesign, questionnaires: Mapping[str, Questionnaire]
) -> tuple[PowerClaim, ...]:
    """Return the power of each hypothesis."""
    known = design_measures(design, questionnaires)
    return tuple(power_claim(design, one, known[one.measure]) for one in design.hypotheses)


def hypothesis_sentence(one: Hypothesis, design: StudyDesign) -> str:
    """Return a hypothesis in words."""
    sides = "either sign counts" if one.two_sided else "the other sign does not count"
    better, than = design.side(one.better), design.side(one.than)
    if len(better) > 1:
        means = (", ".join(f"`{key}`" for key in side) for side in (better, than))
        sides = f"each participant's mean of {' against that of '.join(means)}; {sides}"
    return f"`{one.measure}` is higher for `{one.better}` than for `{one.than}` ({sides})."


def size_words(design: StudyDesign, found: PowerClaim) -> str:
    """Return the participants that a hypothesis needs, and the power of the planned ones."""
    asked, wanted = found.question, design.plan.power
    needed = f"{found.needed}" if found.needed is not None else f"more than {MOST}"
    few = found.needed is None or found.participants < found.needed
    ties = (
        f"by the formula without ties {found.formula}" if asked.test != "sign"
        else f"by the normal approximation {found.formula}"
    )  # fmt: skip
    return (
        f"{TESTS[asked.test]}, alpha {asked.alpha:.4g}: power {wanted:g} takes {needed} participants "
        f"({ties}); the {found.participants} planned have power {found.power:.2f}"
        + (": too few." if few else ".")
    )


def minutes(design: StudyDesign, questionnaires: Mapping[str, Questionnaire]) -> int:
    """Return the approximate duration of a session, minutes."""
    trials = len(block_trials(design)) * design.trials.repetitions + design.trials.practice
    sides = 2 if design.task == "pairwise" else 1
    items = sum(len(questionnaires[key].items) for key in design.questionnaires)
    once = sum(len(questionnaires[key].items) for key in design.after)
    rests = (trials - 1) // design.trials.rest_every if design.trials.rest_every else 0
    seconds = trials * (sides * design.trials.seconds + items * _QUESTION_S)
    return ceil((seconds + once * _QUESTION_S + rests * design.trials.rest_s + 120.0) / 60.0)


def _conditions(
    design: StudyDesign, changes: Mapping[str, Mapping[str, object]]
) -> Iterator[dict[str, str]]:
    for key, one in design.conditions.items():
        said = [
            f"{name} {Path(getattr(one, name)).name}"
            for name in _FILES
            if getattr(one, name) is not None
        ]
        said += [f"{name} = {value}" for name, value in one.params.items()]
        said += [f"{name}: {level}" for name, level in one.factors.items()]
        many = len(changes.get(key, ()))
        values = f"{many} value{'s' if many != 1 else ''} in all" if many else "nothing"
        yield {"key": key, "label": _cell(one.label), "differs": _cell("; ".join([*said, values]))}


def _presentation(design: StudyDesign) -> str:
    shown_by = design.presentation
    before = shown_by.world or shown_by.scene
    who = (
        f"an emulated head before {Path(before).name!r}" if before else "the head before its camera"
    )
    if shown_by.on == "head":
        return f"They sit before the head itself; seed {shown_by.seed} for all conditions."
    return (
        f"They see films in a browser, of {who}; seed {shown_by.seed} for all conditions, whose "
        "people and things therefore do the same."
    )


def _order(design: StudyDesign) -> str:
    if design.trials.order == "random":
        return f"The order is random for each participant (seed {design.trials.seed})."
    return (
        f"Orders are Williams' squares (seed {design.trials.seed}): after every {balanced_group_size(design)} "
        "participants each has stood in each place, and after each other one, equally often."
    )


def _rows(design: StudyDesign) -> Iterator[tuple[str, str]]:
    """Yield the orders of the first participants until they repeat."""
    every = (
        balanced_group_size(design)
        if design.trials.order == "williams"
        else design.plan.participants
    )
    for number in range(1, min(every, _SHOWN_ROWS) + 1):
        yield (
            str(number),
            ", ".join(one.replace(PAIR, " then ") for one in participant_order(design, number)),
        )
    if every > _SHOWN_ROWS:
        yield "...", f"{every - _SHOWN_ROWS} more, from the seed"
    if design.trials.order == "williams" and every < design.plan.participants:
        yield "...", f"participant {every + 1} as participant 1, and so on"


def _questionnaire_rows(
    design: StudyDesign, questionnaires: Mapping[str, Questionnaire]
) -> Iterator[dict[str, object]]:
    said = design.language
    for key in (*design.questionnaires, *design.after):
        one = questionnaires[key]
        items = [
            {"key": name, "text": _cell(_text_in_language(item.text, said)), "answers": _cell(_answers(item, said)),
             "scale": item.scale + (" (reversed)" if item.reverse else "")}
            for name, item in one.items.items()
        ]  # fmt: skip
        asked = "after each trial" if key in design.questionnaires else "once at the end"
        shuffled = " Items are shuffled for each participant and trial." if one.shuffled else ""
        licence = one.licence.rstrip(".") + "."
        yield {
            "key": key, "title": one.title, "asked": asked, "source": one.source.rstrip(".") + ".",
            "licence": licence, "shuffled": shuffled, "asked_items": items,
            "instruction": _text_in_language(one.instruction, said),
        }  # fmt: skip


def _text_in_language(texts: Texts, language: str) -> str:
    return texts.get(language) or texts.get("en", "")


def _answers(item: Item, language: str) -> str:
    if item.kind == "text":
        return "free text, may be left empty"
    if item.kind == "choice":
        return "the first or the second"
    low, high = _text_in_language(item.low, language), _text_in_language(item.high, language)
    return f"1 ({low}) to {item.points} ({high})"


def _cell(words: str) -> str:
    """Return text in a form for a table's cell."""
    return words.replace("|", "\\|")


def _correction(design: StudyDesign) -> str:
    many, by = len(design.hypotheses), design.plan.correction
    if many < 2:
        return ""
    return {
        "holm": f", over the {many} hypotheses by Holm's procedure",
        "bonferroni": f", divided by the {many} hypotheses (Bonferroni)",
        "none": f" for each of the {many} hypotheses, not corrected for being many",
    }[by]


def _curve(design: StudyDesign, claims: tuple[PowerClaim, ...]) -> list[tuple[int, list[str]]]:
    """Return the power of all hypotheses for some numbers of participants."""
    every = balanced_group_size(design)
    found = [one.needed for one in claims if one.needed is not None]
    around = max(found, default=design.plan.participants)
    wanted = {design.plan.participants, *found}
    wanted |= {max(1, round(share * around / every)) * every for share in (0.5, 0.75, 1.25)}
    return [(n, [f"{power_of(one.question, n):.2f}" for one in claims]) for n in sorted(wanted)]


def _exclusions(design: StudyDesign) -> Iterator[str]:
    rule = design.exclusion
    if rule.lost_head == "repeat":
        yield f"A trial in which the head was lost is repeated, at most {rule.repeats} times, then left out."
    else:
        yield "A trial in which the head was lost is left out."
    if rule.fastest_answer_ms:
        yield f"A page of answers given in less than {rule.fastest_answer_ms:g} ms is left out."
    if rule.same_answers:
        yield (
            f"Who gives one answer to every item of all trials, at least {LEAST_SAME} ratings, is left "
            "out."
        )
    if rule.incomplete == "exclude":
        yield "Who did not finish is left out."
    else:
        yield "Who did not finish is kept, with the trials that were answered."
    if design.may_skip:
        yield (
            "Questions may be left unanswered. A scale counts if at least half of its items are "
            "answered; a participant counts in a comparison with answers on both sides."
        )


def _privacy(design: StudyDesign) -> Iterator[str]:
    rule = design.privacy
    yield "No name is asked; participants have codes."
    yield (
        "Pictures of participants are kept, and the consent page says so." if rule.pictures
        else "No picture of a participant is kept."
    )  # fmt: skip
    if rule.gaze and design.presentation.on == "head":
        yield "Where participants looked is kept, as angles."
    yield f"Data are deleted or made anonymous after {rule.deleted_after_days} days."
    yield f"Participants write to: {rule.contact or '(nobody is named: privacy.contact is empty)'}"
