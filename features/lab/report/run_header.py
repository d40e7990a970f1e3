"""Description of the run in a report: its origin and its style of gaze."""

from dataclasses import dataclass, field

from gazerig.features.lab.report.reference_walk import ReferenceWalk


@dataclass(frozen=True)
class RunHeader:
    """A run's name and circumstances.

    name: short, for figures; facts: (what, value) rows of the page's head
    styles: e.g. "saccade min_jerk", "scanpath markov": which notes of the bands apply
    model: the configured walk over faces, None for another scanpath model
    warnings: e.g. that the recording is incomplete
    duration_s: length of the run, None if unknown before it is read
    """

    name: str
    facts: tuple[tuple[str, str], ...] = ()
    styles: frozenset[str] = field(default_factory=frozenset)
    model: ReferenceWalk | None = None
    warnings: tuple[str, ...] = ()
    duration_s: float | None = None
