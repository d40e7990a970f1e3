"""What chooses where to look, for the control loop."""

from typing import Protocol

from gazerig.gaze.top_down import TopDown
from gazerig.gaze.types import GazeState, Percept, Target


class TargetChooser(Protocol):
    """Chooses what to look at, as gaze.attention.Attention does.

    top_down: the behaviours there are to choose from
    """

    top_down: TopDown

    def reset(self, t_s: float) -> None:
        """Forget everything seen."""
        ...

    def choose(self, percept: Percept | None, state: GazeState, t_s: float) -> Target:
        """Return the target in force at ``t_s``."""
        ...
