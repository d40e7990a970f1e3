"""What became of servos whose torque was taken off; no more than an emergency needs."""

from typing import NamedTuple


class ReleaseResult(NamedTuple):
    """Ids that still report torque or pulses, and those of which nothing was heard."""

    holding: tuple[int, ...]
    mute: tuple[int, ...]
