"""The records of one participant: one line per record, in order of time.

A participant's journal (gazerig.features.study.journal) holds these as JSON, each on disk before
the next page is shown. Conditions are named by their keys in the design; browsers never receive
these records.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import nan
from typing import Literal

STEP_DEG = "largest_step_deg"
"""Largest step of any joint's goal between two ticks, in the switch to the condition."""
Outcome = Literal["complete", "head_lost", "interrupted", "withdrawn"]
AnswerValue = int | str | None
"""A rating 1..points, "first"/"second", free text, or None: not answered."""


@dataclass(frozen=True)
class Opened:
    """A session began or was resumed.

    design_sha256: of the design's canonical text (gazerig.features.study.preregistration)
    order: condition keys of all trials in order, for pairs "a|b" as first and second
    program: version; simulated: whether the participant is simulated
    """

    participant: str
    design_sha256: str
    order: tuple[str, ...]
    program: str
    utc: str
    simulated: bool = False


@dataclass(frozen=True)
class Consented:
    """Consent to each use, as requested on the consent page."""

    given: bool
    pictures: bool
    gaze: bool
    utc: str


@dataclass(frozen=True)
class TrialBegan:
    """A presentation began.

    trial: 0-based row of the order, practice trials below 0; attempt: from 0
    side: 0, or 1 for the second presentation of a pair
    """

    trial: int
    attempt: int
    condition: str
    utc: str
    side: int = 0


@dataclass(frozen=True)
class TrialEnded:
    """A presentation ended.

    recording: file next to the journal, "" without; reason: why it was not completed
    from_s, to_s: its start and end in the recording's time, nan without a recording
    """

    trial: int
    attempt: int
    outcome: Outcome
    seconds: float
    utc: str
    side: int = 0
    recording: str = ""
    reason: str = ""
    from_s: float = nan
    to_s: float = nan


@dataclass(frozen=True)
class ItemAnswered:
    """One item was answered.

    trial: None for questions at the end; condition: "a|b" for a pair
    ms: from the page's appearance to the answer, as measured by the browser
    """

    trial: int | None
    condition: str
    questionnaire: str
    item: str
    value: AnswerValue
    ms: float
    utc: str


@dataclass(frozen=True)
class Measured:
    """Measures of one presentation: name -> value, nan if unknown.

    values: the design's objective measures, and STEP_DEG
    """

    trial: int
    condition: str
    values: Mapping[str, float]
    side: int = 0
    attempt: int = 0


@dataclass(frozen=True)
class Closed:
    """The session ended: finished, withdrawn, or the experimenter excluded the participant."""

    how: Literal["finished", "withdrawn", "excluded"]
    reason: str
    utc: str


Record = Opened | Consented | TrialBegan | TrialEnded | ItemAnswered | Measured | Closed
"""``kind`` in JSON is the class's name."""
