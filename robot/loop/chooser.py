"""Choice of the gaze target by the rig's own attention or by a rule of another package.

The rig's own attention is always updated, so that it can choose whenever the rule does not.
"""

from math import dist
from typing import Any, Protocol

from msgspec.structs import replace

from gazerig.drivers.errors import PluginError
from gazerig.gaze.attention.top_down import TopDown
from gazerig.gaze.types import GazeState, Percept, Target, Vec3

FARTHEST_M = 1e6
"""Largest coordinate [m] of a target."""

_JUMP_M = 0.1
"""A bare point that moves farther between two answers counts as a new target."""


class TargetChooser(Protocol):
    """A source of gaze targets, such as gaze.attention.Attention.

    Attributes:
        top_down: The available behaviours.
    """

    top_down: TopDown

    @property
    def reacts(self) -> bool:
        """Return whether another target waits for its reaction time."""

    def reset(self, t_s: float) -> None:
        """Forget all observations."""

    def choose(self, percept: Percept | None, state: GazeState, t_s: float) -> Target:
        """Return the target at ``t_s``."""


class Chooser(Protocol):
    """A rule for the gaze target from a package or a program."""

    def choose(self, percept: Percept | None, state: GazeState, t_s: float) -> Target | Vec3 | None:
        """Choose a target; None leaves the choice to the rig's own attention.

        Args:
            percept: Faces and things of the newest frame in the world, None before the first.
            state: Poses of head and eyes.
            t_s: Time of the tick in s.

        Returns:
            A target, or a point x, y, z in the world in m.
        """


class RuleChooser:
    """A rule, and the rig's own attention if it does not choose; implements ``TargetChooser``.

    Args:
        rule: The rule.
        own: The rig's attention.
        label: Name of the rule in messages.
    """

    def __init__(self, rule: Chooser, own: TargetChooser, label: str) -> None:
        self._rule, self._own, self._label = rule, own, label
        self.top_down = own.top_down
        self._chosen: Target | None = None
        self._identity: tuple[str, int, int] | None = None
        self._shift = 0

    @property
    def reacts(self) -> bool:
        """Return whether another target of the rig's attention waits for its reaction time."""
        return self._own.reacts

    def reset(self, t_s: float) -> None:
        """Forget all observations."""
        self._own.reset(t_s)
        self._chosen, self._identity = None, None
        forget = getattr(self._rule, "reset", None)
        if callable(forget):
            forget(t_s)

    def choose(self, percept: Percept | None, state: GazeState, t_s: float) -> Target:
        """Return the target of the rule, otherwise that of the rig's own attention.

        Raises:
            PluginError: The rule returned something else.
        """
        own, before = self._own.choose(percept, state, t_s), self._chosen
        chosen = self._chosen = self._to_target(self._rule.choose(percept, state, t_s), t_s)
        target = chosen or own
        identity = (target.kind, target.id, own.shift if chosen is None else 0)
        jumped = False
        if chosen is not None and before is not None and chosen.id < 0:
            jumped = dist(chosen.p_world_m, before.p_world_m) > _JUMP_M
        self._shift += jumped or identity != self._identity
        self._identity = identity
        return replace(target, shift=self._shift)

    def _to_target(self, answer: Any, t_s: float) -> Target | None:
        """Return the target that a rule has chosen.

        Raises:
            PluginError: It is neither a target nor a point nor None, or not finite.
        """
        if answer is None:
            return None
        point = answer.p_world_m if isinstance(answer, Target) else answer
        try:
            x, y, z = map(float, () if isinstance(point, str) else point)
            valid = all(abs(v) <= FARTHEST_M for v in (x, y, z))  # also rejects NaN
        except (TypeError, ValueError):
            valid = False
        if not valid:
            raise PluginError(
                f"{self._label} returned {type(answer).__name__} {str(answer)[:60]!r}, wanted a "
                f"target, a point x, y, z within {FARTHEST_M:g} m, or None"
            )
        if isinstance(answer, Target):
            return replace(answer, p_world_m=(x, y, z), saliences=())
        return Target(
            (x, y, z), (0.0, 0.0, 0.0), t_s, "point", -1, 1.0, True, None, 0, "a rule's point"
        )
