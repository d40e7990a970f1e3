"""Facial expressions: named pose offsets that are added to gaze and blended over time."""

from collections.abc import Mapping

from gazerig.gaze.minimum_jerk import MinimumJerkBlend
from gazerig.gaze.track.pose_offset import NO_OFFSET, PoseOffset
from gazerig.params import unknown_text

NEUTRAL = "neutral"
"""The initial expression. It always exists; without an entry all its offsets are 0."""


class Expressions:
    """The present expression, and the transition to it.

    name, strength: name and strength of the present one; 1 is the full expression, 0 none
    moves: whether ``step`` may return another offset than last time

    Args:
        offsets: the expressions by name.
        blend_s: time from one expression to another.
        joints: number of joints that gaze does not move.
    """

    def __init__(self, offsets: Mapping[str, PoseOffset], blend_s: float, joints: int) -> None:
        self._rest = NO_OFFSET._replace(joints_rad=(0.0,) * joints)
        self._offsets = {NEUTRAL: self._rest, **offsets}
        self._blend = MinimumJerkBlend(self._rest.to_flat(), blend_s)
        self.reset()

    @property
    def names(self) -> tuple[str, ...]:
        """Return the known expressions, neutral first; empty if the rig has no table."""
        others = [name for name in self._offsets if name != NEUTRAL]
        return (NEUTRAL, *others) if len(self._offsets) > 1 else ()

    def reset(self) -> None:
        """Become neutral immediately."""
        self.name, self.strength = NEUTRAL, 1.0
        self._blend.reset(self._goal())
        self._flat = self._goal()
        self._offset = PoseOffset.from_flat(self._flat)
        self.moves = True

    def express(self, name: str, strength: float = 1.0) -> None:
        """Move to an expression, from the next step on.

        Raises:
            ValueError: the expression is unknown; the message lists the known ones.
        """
        self.require(name)
        self.name, self.strength = name, strength
        self._blend.move_to(self._goal())
        self.moves = True

    def require(self, name: str) -> None:
        """Raise ValueError for an unknown expression; the message lists the known ones."""
        if name not in self._offsets:
            remedy = "none: add a table expressions to the rig"
            raise ValueError(unknown_text("expression", name, self.names, remedy))

    def step(self, t_s: float) -> PoseOffset:
        """Return the offset at a time; at rest it is the same object."""
        flat = self._blend.step(t_s)
        if flat is not self._flat:
            self._flat, self._offset = flat, PoseOffset.from_flat(flat)
        self.moves = not self._blend.is_at_rest
        return self._offset

    def _goal(self) -> tuple[float, ...]:
        rest, full = self._rest.to_flat(), self._offsets[self.name].to_flat()
        return tuple([r + self.strength * (f - r) for r, f in zip(rest, full, strict=True)])
