"""Stands in for an action planner: asks for the behaviour that a scene's plan has in force.

Mitake et al. 3.2 take the behaviour (attack, guard, wait) from the planner of a boxing
game; a scene carries such a plan as a function of time.
"""

from collections.abc import Callable


class ScriptedBehaviour:
    """Asks once for each change of the plan, so that people may overrule it in between."""

    def __init__(
        self, plan: Callable[[float], str | None], ask: Callable[[str, str], None]
    ) -> None:
        self._plan = plan
        self._ask = ask
        self._first_s: float | None = None
        self._asked: str | None = None

    def update(self, t_s: float) -> None:
        """Apply what the script plans for this tick."""
        if self._first_s is None:
            self._first_s = t_s
        wanted = self._plan(t_s - self._first_s)
        if wanted is not None and wanted != self._asked:
            self._ask("behaviour", wanted)
            self._asked = wanted
