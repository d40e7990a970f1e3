"""What a report says of the run itself: whose it was, and in what style."""

from dataclasses import dataclass, field

from gazerig.features.lab.report.reference_walk import ReferenceWalk


@dataclass(frozen=True)
class RunHeader:
    """A run's name and circumstances.

    name: short, for figures; facts: (what, value) rows of the page's head
    styles: e.g. "saccade min_jerk", "scanpath markov": which notes of the bands apply
    model: the walk over faces that was configured, None where it was another model
    warnings: what a reader must know, e.g. that the recording is not whole
    duration_s: how long the run lasts, None if unknown before it is read
    """

    name: str
    facts: tuple[tuple[str, str], ...] = ()
    styles: frozenset[str] = field(default_factory=frozenset)
    model: ReferenceWalk | None = None
    warnings: tuple[str, ...] = ()
    duration_s: float | None = None
