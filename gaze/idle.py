"""Where to look when there is nothing: hold the last place for a moment, then rest.

A person who steps out of the picture often comes back at once, and a detector blinks;
so the gaze stays where it was for a while before it returns to straight ahead.
"""

from dataclasses import dataclass, field

from gaze.types import Target, Vec3


@dataclass(frozen=True)
class IdleParams:
    """Times and the resting point."""

    hold_ms: float = field(
        default=1000.0,
        metadata={
            "low": 0.0,
            "high": 60000.0,
            "unit": "ms",
            "says": "time for which the gaze stays where a lost target was",
        },
    )
    rest_distance_m: float = field(
        default=1.5,
        metadata={"low": 0.3, "high": 20.0, "unit": "m", "says": "distance of the resting point"},
    )
    rest_height_m: float = field(
        default=0.2,
        metadata={
            "low": -1.0,
            "high": 3.0,
            "unit": "m",
            "says": "height of the resting point above the neck base",
        },
    )
    rest_pull: float = field(
        default=0.2,
        metadata={"low": 0.0, "high": 10.0, "unit": "", "says": "pull of the resting point"},
    )


class Idle:
    """Chooses the target when attention has none."""

    def __init__(self, params: IdleParams) -> None:
        """Take the times."""
        self._params = params
        self.reset(0.0)

    def reset(self, t_s: float) -> None:
        """Forget what was looked at."""
        self._last: Target | None = None
        self._lost_s = t_s
        self._lost = False

    def remember(self, target: Target) -> None:
        """Note a target that is in sight."""
        self._last, self._lost = target, False

    def step(self, t_s: float) -> Target:
        """Give where to look with nothing in sight: the last place, then the rest."""
        if not self._lost:
            self._lost, self._lost_s = True, t_s
        if self._last is not None:
            if t_s - self._lost_s < self._params.hold_ms / 1e3:
                return self._last._replace(v_world_m_s=(0.0, 0.0, 0.0), why="lost, waiting")
            self._last = None
        par = self._params
        rest: Vec3 = (par.rest_distance_m, 0.0, par.rest_height_m)
        return Target(
            rest, (0.0, 0.0, 0.0), t_s, "rest", -1, par.rest_pull, True, None, 0, "nobody in sight"
        )
