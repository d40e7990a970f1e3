"""Levels: values 0..1 that a program sets many times per second, such as the opening of a jaw."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, NamedTuple

from gazerig.gaze.minimum_jerk import MinimumJerkBlend
from gazerig.gaze.track.pose_offset import NO_OFFSET, PoseOffset
from gazerig.params import Bounds, unknown_text

HOLD_S = 0.5
"""A level that was not set for this time returns to 0, as its program may have ended."""


@dataclass(frozen=True)
class LevelParams:
    """Motion of one level."""

    # fmt: off
    joint: Annotated[str, "joint that the level moves: any but those of the eyes"]
    low_deg: Annotated[float, Bounds(-180, 180), "angle added to the joint at level 0"]
    high_deg: Annotated[float, Bounds(-180, 180), "angle added to the joint at level 1"]
    smoothing_ms: Annotated[float, Bounds(10, 500), "time within which the joint follows a step of the level"] = 80.0
    # fmt: on


class LevelRange(NamedTuple):
    """Offsets of a level at 0 and at 1; it follows a step within ``smoothing_s``."""

    low: PoseOffset
    high: PoseOffset
    smoothing_s: float

    def offset_at(self, value: float) -> tuple[float, ...]:
        """Return the offset of a value, flat."""
        low, high = self.low.to_flat(), self.high.to_flat()
        return tuple([a + value * (b - a) for a, b in zip(low, high, strict=True)])

    def value_of(self, offset: PoseOffset) -> float:
        """Return the value, 0..1, of an offset, by what the level moves most."""
        rows = zip(self.low.to_flat(), self.high.to_flat(), offset.to_flat(), strict=True)
        low, high, now = max(rows, key=lambda row: abs(row[1] - row[0]))
        return min(max((now - low) / (high - low or 1.0), 0.0), 1.0)


class Levels:
    """All levels of a rig.

    moves: whether ``step`` may return another offset than last time

    Args:
        ranges: offsets of each level.
        joints: number of joints that gaze does not move.
    """

    def __init__(self, ranges: Mapping[str, LevelRange], joints: int) -> None:
        self._rest = NO_OFFSET._replace(joints_rad=(0.0,) * joints)
        self._ranges = ranges
        self.reset()

    def reset(self) -> None:
        """Set all levels to 0 immediately."""
        self._blends = {
            name: MinimumJerkBlend((0.0,), span.smoothing_s) for name, span in self._ranges.items()
        }
        # Time until which each level above 0 stays.
        self._until_s: dict[str, float] = {}
        self._offset = self._rest
        self.moves = True

    def set(self, name: str, value: float, t_s: float) -> None:
        """Set a level to a value 0..1, from the next step on.

        Raises:
            ValueError: the level is unknown; the message lists the known ones.
        """
        self.require(name)
        self._blends[name].move_to((value,))
        self._until_s.pop(name, None)
        if value > 0.0:
            self._until_s[name] = t_s + HOLD_S
        self.moves = True

    def require(self, name: str) -> None:
        """Raise ValueError for an unknown level; the message lists the known ones."""
        if name not in self._ranges:
            remedy = "none: add a table levels to the rig"
            raise ValueError(unknown_text("level", name, self._ranges, remedy))

    def drop_lapsed(self, t_s: float) -> tuple[str, ...]:
        """Drop levels to 0 that were not set for ``HOLD_S``; return their names."""
        fallen = tuple([name for name, until_s in self._until_s.items() if t_s >= until_s])
        for name in fallen:
            self.set(name, 0.0, t_s)
        return fallen

    def step(self, t_s: float) -> PoseOffset:
        """Return the offset of all levels at a time; at rest it is the same object."""
        if self.moves:
            self._offset = self._rest
            for name, blend in self._blends.items():
                offset = self._ranges[name].offset_at(blend.step(t_s)[0])
                self._offset = self._offset.combine(PoseOffset.from_flat(offset))
            self.moves = not all([blend.is_at_rest for blend in self._blends.values()])
        return self._offset
