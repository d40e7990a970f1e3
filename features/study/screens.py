"""The screens of a participant.

A screen contains only what a browser may know, and nothing about conditions.
"""

from dataclasses import dataclass
from typing import Literal

from gazerig.features.study.questionnaire import Item, Texts

Ending = Literal["finished", "declined", "withdrawn", "excluded"]


@dataclass(frozen=True)
class ConsentScreen:
    """The stored data, and the participant's consent.

    pictures, gaze: consent to this use is requested; never for films, which no camera observes
    """

    pictures: bool
    gaze: bool


@dataclass(frozen=True)
class InstructionsScreen:
    """Description of the session."""

    trials: int
    practice: int
    seconds: float


@dataclass(frozen=True)
class ReadyScreen:
    """Screen before a presentation, which the participant starts.

    number: number of the trial, from 1, among ``trial_count`` trials or practice trials
    side: 0, or 1 for the second presentation of a pair
    again: whether the presentation was cut short before and is repeated
    """

    number: int
    trial_count: int
    practice: bool
    pair: bool
    side: int
    again: bool


@dataclass(frozen=True)
class PresentationScreen:
    """A presentation.

    film: name under which the film is fetched, different each time; "" for the head itself
    """

    number: int
    trial_count: int
    practice: bool
    pair: bool
    side: int
    seconds: float
    film: str


@dataclass(frozen=True)
class Question:
    """One item; number: its name in the answers, from 0 in the order shown."""

    number: int
    item: Item


@dataclass(frozen=True)
class QuestionsScreen:
    """One page of questions.

    instruction: text above them, by language; empty without one
    once: whether they are asked once at the end instead of about a trial; number is then 0
    """

    number: int
    trial_count: int
    practice: bool
    pair: bool
    once: bool
    instruction: Texts
    questions: tuple[Question, ...]


@dataclass(frozen=True)
class RestScreen:
    """A rest with a minimum duration."""

    seconds: float


@dataclass(frozen=True)
class PausedScreen:
    """The experimenter must act first, e.g. because the head is not ready."""


@dataclass(frozen=True)
class EndScreen:
    """The last screen; after ``finished`` it explains the study."""

    outcome: Ending


Screen = (
    ConsentScreen
    | InstructionsScreen
    | ReadyScreen
    | PresentationScreen
    | QuestionsScreen
    | RestScreen
    | PausedScreen
    | EndScreen
)
