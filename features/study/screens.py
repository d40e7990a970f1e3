"""What a participant is shown, one screen after the other.

A screen says nothing of conditions: all that a browser may know is in it.
"""

from dataclasses import dataclass
from typing import Literal

from gazerig.features.study.questionnaire import Item, Texts

Ending = Literal["finished", "declined", "withdrawn", "excluded"]


@dataclass(frozen=True)
class ConsentScreen:
    """What is kept, and whether the participant agrees.

    pictures, gaze: the use is asked for; of films never, as no camera sees who looks at them
    """

    pictures: bool
    gaze: bool


@dataclass(frozen=True)
class InstructionsScreen:
    """What will happen."""

    trials: int
    practice: int
    seconds: float


@dataclass(frozen=True)
class ReadyScreen:
    """Before a presentation: it begins when the participant says so.

    number: of the trial, from 1; among ``of`` trials, or practice trials
    side: 0, or 1 for the second presentation of a pair
    again: the presentation was cut short before, and is repeated
    """

    number: int
    of: int
    practice: bool
    pair: bool
    side: int
    again: bool


@dataclass(frozen=True)
class PresentationScreen:
    """A presentation.

    film: name under which the film is fetched, another one each time; "" for the head itself
    """

    number: int
    of: int
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

    instruction: what stands above them, by language; empty for nothing
    once: they are asked once at the end, not of a trial; number is then 0
    """

    number: int
    of: int
    practice: bool
    pair: bool
    once: bool
    instruction: Texts
    questions: tuple[Question, ...]


@dataclass(frozen=True)
class RestScreen:
    """A rest of at least so many seconds."""

    seconds: float


@dataclass(frozen=True)
class PausedScreen:
    """The experimenter has something to do first, e.g. the head is not ready."""


@dataclass(frozen=True)
class EndScreen:
    """The last screen; after ``finished`` it tells what the study was about."""

    how: Ending


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
