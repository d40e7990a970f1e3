"""The design of a study: conditions, participants, order, questions, hypotheses and plan.

Read from YAML by the configuration's loader (features/study/studies/*.yaml are shipped).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from gazerig.params import Bounds, Choices

Language = Literal["en", "ja", "de"]
Task = Literal["rating", "pairwise"]
"""rating: each presentation is rated; pairwise: one of two presentations is chosen."""
Test = Literal["signed_rank", "rank_sum", "sign", "chi_square", "friedman"]
"""Tests of one hypothesis (gazerig.features.study.statistics)."""
DECIDING: tuple[Test, ...] = ("signed_rank", "rank_sum", "sign")
"""Tests with a measured rate of false positives (docs/study/study-analysis.md); others explore."""


# fmt: off
@dataclass(frozen=True)
class Condition:
    """One gaze of the study; missing entries are those of the rig."""

    label: Annotated[str, "what the experimenter calls it; participants never see it"] = ""
    rig: Annotated[str | None, "shipped name or path; null: the study's"] = None
    profile: Annotated[str | None, "style of gaze by name or path"] = None
    character: Annotated[str | None, "character by name or path"] = None
    scanpath: Annotated[Literal["markov", "simple", "face_tracking", "random"] | None, "face scanpath"] = None
    behaviour: Annotated[str | None, "behaviour chosen from the rules' menu"] = None
    params: Annotated[Mapping[str, object], "dotted keys of the rig's YAML and their values"] = field(default_factory=dict)
    recording: Annotated[str | None, "recorded run (.mcap) that a film is made of"] = None
    film: Annotated[str | None, "film to show (.webm); null: rendered from the condition"] = None
    factors: Annotated[Mapping[str, str], "level of each factor, for designs with several"] = field(default_factory=dict)


@dataclass(frozen=True)
class StudyTexts:
    """The study's own texts for participants, in one language."""

    welcome: Annotated[tuple[str, ...], "paragraphs before they consent; they must not name the difference"] = ()
    debriefing: Annotated[tuple[str, ...], "paragraphs at the end"] = ()


@dataclass(frozen=True)
class Presentation:
    """Presentation of the conditions."""

    on: Annotated[Literal["head", "film"], "the head in the room, or a film of it in the browser"] = "film"
    rig: Annotated[str, "shipped name or path"] = "expressive"
    scene: Annotated[str | None, "what an emulated head looks at; null with world or a real camera"] = None
    world: Annotated[str | None, "the world with physics that it is in"] = None
    seed: Annotated[int, Bounds(0, 2**31 - 1), "seed of the conditions' random generators; the same for all"] = 0


@dataclass(frozen=True)
class Trials:
    """Trials of one participant, and their times."""

    seconds: Annotated[float, Bounds(2, 900), "length of one presentation"] = 30.0
    repetitions: Annotated[int, Bounds(1, 20), "how often each condition (pair) is shown"] = 1
    practice: Annotated[int, Bounds(0, 5), "trials before the first that counts"] = 1
    rest_every: Annotated[int, Bounds(0, 50), "trials between two rests; 0: no rests"] = 4
    rest_s: Annotated[float, Bounds(0, 600), "least length of a rest"] = 20.0
    order: Annotated[Literal["williams", "random"], "Williams' squares, or shuffled by the seed"] = "williams"
    seed: Annotated[int, Bounds(0, 2**31 - 1), "seed of all orders"] = 0


@dataclass(frozen=True)
class Hypothesis:
    """Expectation, and the test that decides on it."""

    measure: Annotated[str, "questionnaire.item, questionnaire.scale or an objective measure"]
    better: Annotated[str, "condition, or level of a factor (gaze=moving), for which more is expected"]
    than: Annotated[str, "condition, or level of the same factor, that it is compared with"]
    test: Annotated[Test, "what decides: signed_rank, rank_sum; sign for choices"] = "signed_rank"
    also: Annotated[tuple[Test, ...], "exploratory tests, printed beside it; they decide nothing"] = ()
    two_sided: Annotated[bool, "differences of either sign count"] = True


@dataclass(frozen=True)
class StatisticalPlan:
    """The numbers of a pre-registration."""

    participants: Annotated[int, Bounds(2, 1000), "how many are invited"] = 24
    alpha: Annotated[float, Bounds(0.0001, 0.2), "probability of a false alarm, over all hypotheses"] = 0.05
    power: Annotated[float, Bounds(0.5, 0.999), "wanted probability to find the effect"] = 0.8
    effect: Annotated[float, Bounds(0.05, 3), "standardised effect to be found (Cohen's d_z of a participant's differences)"] = 0.6
    correction: Annotated[Literal["holm", "bonferroni", "none"], "multiplicity over the hypotheses"] = "holm"


@dataclass(frozen=True)
class Exclusion:
    """Exclusion of trials and participants, decided before the first participant."""

    lost_head: Annotated[Literal["repeat", "exclude"], "a trial in which the head was lost"] = "repeat"
    repeats: Annotated[int, Bounds(0, 10), "times that a trial is repeated at most"] = 2
    fastest_answer_ms: Annotated[float, Bounds(0, 10000), "a page of answers given faster is left out"] = 300.0
    same_answers: Annotated[bool, "leave out who gives one answer to every item of all trials"] = True
    incomplete: Annotated[Literal["exclude", "keep"], "participants who did not finish"] = "exclude"


@dataclass(frozen=True)
class Privacy:
    """Further data of a participant besides the answers; the consent page names them."""

    pictures: Annotated[bool, "keep camera pictures of the participant"] = False
    gaze: Annotated[bool, "keep where the participant looked (angles, no pictures)"] = True
    contact: Annotated[str, "whom participants write to, e.g. to have their data deleted"] = ""
    deleted_after_days: Annotated[int, Bounds(1, 36500), "when the data are deleted or made anonymous"] = 3650


@dataclass(frozen=True)
class StudyDesign:
    """A study as in its YAML file."""

    title: Annotated[str, "title of the pre-registration and the report"]
    conditions: Annotated[Mapping[str, Condition], "two to six gazes"]
    questionnaires: Annotated[tuple[str, ...], "shipped names or paths, asked after each trial in this order"]
    after: Annotated[tuple[str, ...], "questionnaires asked once at the end"] = ()
    description: Annotated[tuple[str, ...], "what is studied, in paragraphs, for the pre-registration"] = ()
    welcome: Annotated[tuple[str, ...], "paragraphs that participants read before they consent; they must not name the difference"] = ()
    debriefing: Annotated[tuple[str, ...], "paragraphs that participants read at the end"] = ()
    translations: Annotated[Mapping[str, StudyTexts], "welcome and debriefing by other languages"] = field(default_factory=dict)
    language: Annotated[Language, Choices("en", "ja", "de"), "of questions and pages"] = "en"
    task: Annotated[Task, "what participants do"] = "rating"
    may_skip: Annotated[bool, "participants may leave questions unanswered"] = False
    presentation: Presentation = field(default_factory=Presentation)
    trials: Trials = field(default_factory=Trials)
    hypotheses: tuple[Hypothesis, ...] = ()
    objective: Annotated[tuple[str, ...], "measures beside the questions: mutual_gaze_share, first_look_s, keys of the report"] = ()
    plan: StatisticalPlan = field(default_factory=StatisticalPlan)
    exclusion: Exclusion = field(default_factory=Exclusion)
    privacy: Privacy = field(default_factory=Privacy)

    @property
    def texts(self) -> StudyTexts:
        """Return the texts for participants, in the study's language if there is a translation."""
        return self.translations.get(self.language, StudyTexts(self.welcome, self.debriefing))

    def side(self, name: str) -> tuple[str, ...]:
        """Return the conditions of one side of a hypothesis, none for an unknown name.

        name: a condition, which is then the only one, or a level of a factor: "gaze=moving".
        """
        if name in self.conditions:
            return (name,)
        factor, _, level = name.partition("=")
        return tuple([key for key, one in self.conditions.items() if one.factors.get(factor) == level])

    def condition_pairs(self, one: Hypothesis) -> tuple[tuple[str, str], ...]:
        """Return the pairs (better, than) of conditions that a hypothesis compares.

        Pairs of two levels of a factor agree in all other factors.
        """
        better, than = self.side(one.better), self.side(one.than)
        if one.better in self.conditions:
            return tuple([(one.better, other) for other in than])
        factor = one.better.partition("=")[0]
        cells = {self._other_levels(factor, key): key for key in than}
        beside = [(key, cells.get(self._other_levels(factor, key))) for key in better]
        return tuple([(key, other) for key, other in beside if other is not None])

    def _other_levels(self, factor: str, key: str) -> tuple[tuple[str, str], ...]:
        """Return a condition's levels of all factors but one."""
        levels = self.conditions[key].factors.items()
        return tuple(sorted([pair for pair in levels if pair[0] != factor]))
# fmt: on
