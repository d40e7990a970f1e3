"""Slow search for the stop of a joint. Pure.

The goal is ahead of the joint by a few degrees at most, so the servo's position gain limits its
force. If the joint does not move although it is pushed, it is at its stop, and the goal moves back
immediately. A stop and a finger cannot be distinguished: both are pushed gently and for at most
half a second.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Literal, NamedTuple

from gazerig.drivers.bus.servo_models import STEPS_PER_TURN
from gazerig.params import Bounds

STEPS_PER_DEG = STEPS_PER_TURN / 360.0

NEAR_DEG = 1.0
"""Distance of a servo with factory gains and a light load from its goal."""

BACK_OFF_EXCHANGES = 25
"""Half a second at 50 Hz, for the motion back from a stop."""


@dataclass(frozen=True)
class StopSearchParams:
    """Speed and force of a search for a stop; angles are those of the servo."""

    # fmt: off
    speed_deg_s: Annotated[float, Bounds(1, 60), "speed of the search"] = 15.0
    strength: Annotated[float, Bounds(0.05, 1), "the servo's Goal PWM as a share of its limit, so of its stall torque"] = 0.3
    lead_deg: Annotated[float, Bounds(1, 30), "the goal is never farther ahead of the joint"] = 8.0
    progress_deg: Annotated[float, Bounds(0.1, 5), "a smaller advance counts as standing still"] = 0.3
    touch_share: Annotated[float, Bounds(0.01, 1), "share of the stall current that, standing still, is a push"] = 0.15
    touch_ms: Annotated[float, Bounds(20, 500), "standing still under such a current for so long is a stop"] = 200.0
    longest_push_ms: Annotated[float, Bounds(50, 500), "standing still for so long is a stop whatever the current"] = 450.0
    back_off_deg: Annotated[float, Bounds(0.5, 20), "so far the joint goes back from its stop"] = 3.0
    # fmt: on


class EndStop(NamedTuple):
    """Result of a search, in unwrapped steps.

    kind: "stop": pushed and did not move; "limit": end of the range that the servo permits
    pushed_s: time for which it was pushed without motion
    """

    position_steps: int
    kind: Literal["stop", "limit"]
    pushed_s: float


class StopSearch:
    """One search in one direction; call ``step`` for the next goal until ``found`` is not None.

    Args:
        params: speed and force.
        direction: 1 towards more steps, -1 towards fewer.
        low: the smallest goal that the servo permits, in steps.
        high: the largest goal.
    """

    def __init__(self, params: StopSearchParams, direction: int, low: int, high: int) -> None:
        self._params = params
        self._way = direction
        self._end = high if direction > 0 else low
        self._room = (low, high)
        self._goal: float | None = None
        self.found: EndStop | None = None

    def step(self, position_steps: int, load: float, t_s: float) -> int:
        """Add a measurement and return the goal; after the end, a goal away from the stop.

        load: present current as a fraction of the stall current, 0 if unknown
        """
        par, way = self._params, self._way
        if self._goal is None:
            self._goal = self._best = float(position_steps)
            self._moved_s = self._t_s = t_s
        if self.found is None:
            if (position_steps - self._best) * way > par.progress_deg * STEPS_PER_DEG:
                self._best, self._moved_s = float(position_steps), t_s
            still_s = t_s - self._moved_s
            pushed = abs(load) >= par.touch_share and still_s >= par.touch_ms / 1e3
            if (self._end - position_steps) * way <= NEAR_DEG * STEPS_PER_DEG:
                self.found = EndStop(position_steps, "limit", still_s)
            elif pushed or still_s >= par.longest_push_ms / 1e3:
                self.found = EndStop(position_steps, "stop", still_s)
        if self.found is not None:
            back = self.found.position_steps - way * par.back_off_deg * STEPS_PER_DEG
            return self._within(back)
        ahead = self._goal + way * par.speed_deg_s * STEPS_PER_DEG * (t_s - self._t_s)
        most = position_steps + way * par.lead_deg * STEPS_PER_DEG
        nearer = min if way > 0 else max
        self._goal, self._t_s = nearer(ahead, most, self._end), t_s
        return self._within(self._goal)

    def _within(self, goal: float) -> int:
        low, high = self._room
        return round(min(max(goal, low), high))


Exchange = Callable[[int | None], tuple[int, float, float]]
"""Sends a goal (None: no goal) and returns position in steps, load and time in seconds."""


def find_end_stop(
    params: StopSearchParams, direction: int, limits: tuple[int, int], exchange: Exchange
) -> EndStop:
    """Run one search to its end and move back; return the stop."""
    look = StopSearch(params, direction, *limits)
    goal: int | None = None
    while look.found is None:
        goal = look.step(*exchange(goal))
    for _ in range(BACK_OFF_EXCHANGES):
        exchange(goal)
    return look.found


def move_to_goal(goal_steps: int, params: StopSearchParams, exchange: Exchange) -> bool:
    """Move a joint slowly to a position; return whether it arrived unhindered."""
    position, _, _ = exchange(None)
    way = 1 if goal_steps > position else -1
    look = StopSearch(params, way, min(goal_steps, position), max(goal_steps, position))
    goal: int | None = None
    while look.found is None:
        goal = look.step(*exchange(goal))
    free = look.found.kind == "limit"
    exchange(goal_steps if free else goal)
    return free
