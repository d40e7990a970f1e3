"""A boxer in the emulated world that a person moves by commands."""

from collections.abc import Callable, Sequence
from typing import Protocol, runtime_checkable

from gazerig.gaze.types import Vec3


class MovableOpponent(Protocol):
    """A boxer; its times are those of the scene."""

    @property
    def spans_s(self) -> Sequence[tuple[float, float]]:
        """Return the times in which a person moved it, (start, end)."""

    def move(self, p_m: Vec3, t_s: float) -> None:
        """Move the leading fist to a point."""

    def update(self, t_s: float) -> None:
        """Advance the motion to a time."""


@runtime_checkable
class BoxingScene(Protocol):
    """A scene that may have such a boxer."""

    @property
    def opponent(self) -> MovableOpponent | None:
        """Return the boxer, None without one."""


def has_opponent(scene: object) -> bool:
    """Return whether a scene, or its shapes, has a boxer that a person can move."""
    return isinstance(scene, BoxingScene) and scene.opponent is not None


class TickClockOpponent:
    """A boxer, on the clock of the ticks.

    Args:
        opponent: the boxer.
        start_s: returns the start of its scene, None before.
    """

    def __init__(self, opponent: MovableOpponent, start_s: Callable[[], float | None]) -> None:
        self._opponent, self._start_s = opponent, start_s

    def move(self, p_m: Vec3, t_s: float) -> None:
        """Move the leading fist to a point; no effect before the start of the scene."""
        if (start_s := self._start_s()) is not None:
            self._opponent.move(p_m, t_s - start_s)

    def update(self, t_s: float) -> None:
        """Advance the motion to a time."""
        if (start_s := self._start_s()) is not None:
            self._opponent.update(t_s - start_s)
