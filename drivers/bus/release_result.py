"""Result of switching torque off; imports no more than the guardian needs."""

from typing import NamedTuple


class ReleaseResult(NamedTuple):
    """Ids of servos that still report torque or pulses, and of those that did not answer."""

    holding_ids: tuple[int, ...]
    unconfirmed_ids: tuple[int, ...]
