"""Slow search for the stop of a joint. Pure.

The goal is ahead of the joint by a few degrees at most, so the servo's position gain limits its
force. If the joint does not move although it is pushed, it is at its stop, and the goal moves back
immediately. A stop and a finger cannot be distinguished: both are pushed gently and for at most
half a second.
"""

from collections.abc import Callable
from typing import Literal, NamedTuple

from gazerig.drivers.bus.servo_models import STEPS_PER_TURN

STEPS_PER_DEG = STEPS_PER_TURN / 360.0

SPEED_DEG_S = 15.0
"""Speed of the search, at the servo."""
STRENGTH = 0.3
"""Drive during the search, as a share of the full one, so of the stall torque."""
BACK_OFF_DEG = 3.0
"""Way back from a stop."""

_LEAD_DEG = 8.0  # the goal is never farther ahead of the joint
_PROGRESS_DEG = 0.3  # a smaller advance is no motion
# Without motion for this time under this share of the stall current, or for the longer time under
# any current, the joint is at a stop.
_TOUCH, _TOUCH_S, _LONGEST_PUSH_S = 0.15, 0.2, 0.45
_NEAR_DEG = 1.0  # distance of a servo with factory gains and a light load from its goal
_BACK_OFF_EXCHANGES = 25  # half a second at 50 Hz


class EndStop(NamedTuple):
    """Result of a search, in unwrapped steps.

    kind: "stop": pushed and did not move; "limit": end of the range that the servo permits
    pushed_s: time for which it was pushed without motion
    """

    position_steps: int
    kind: Literal["stop", "limit"]
    pushed_s: float


Exchange = Callable[[int | None], tuple[int, float, float]]
"""Sends a goal (None: no goal) and returns position in steps, load and time in seconds.

The load is the present current as a fraction of the stall current, 0 if unknown.
"""


def find_end_stop(direction: int, limits: tuple[int, int], exchange: Exchange) -> EndStop:
    """Move to the stop towards more (1) or fewer (-1) steps, and a little back; return the stop.

    limits: smallest and largest goal that the servo permits, in steps
    """
    stop = _search(direction, limits, exchange)
    back = stop.position_steps - direction * BACK_OFF_DEG * STEPS_PER_DEG
    for _ in range(_BACK_OFF_EXCHANGES):
        exchange(_within(back, limits))
    return stop


def move_to_goal(goal_steps: int, exchange: Exchange) -> bool:
    """Move a joint slowly to a position; return whether it arrived unhindered."""
    position, _, _ = exchange(None)
    way = 1 if goal_steps > position else -1
    limits = min(goal_steps, position), max(goal_steps, position)
    stop = _search(way, limits, exchange)
    back = _within(stop.position_steps - way * BACK_OFF_DEG * STEPS_PER_DEG, limits)
    exchange(goal_steps if stop.kind == "limit" else back)
    return stop.kind == "limit"


def _search(way: int, limits: tuple[int, int], exchange: Exchange) -> EndStop:
    """Move until the joint is at a stop or at the end of the limits."""
    end = limits[1] if way > 0 else limits[0]
    nearer = min if way > 0 else max
    position, _, now_s = exchange(None)
    goal = best = float(position)
    moved_s = last_s = now_s
    while True:
        goal += way * SPEED_DEG_S * STEPS_PER_DEG * (now_s - last_s)
        goal = nearer(goal, position + way * _LEAD_DEG * STEPS_PER_DEG, end)
        last_s = now_s
        position, load, now_s = exchange(_within(goal, limits))
        if (position - best) * way > _PROGRESS_DEG * STEPS_PER_DEG:
            best, moved_s = float(position), now_s
        still_s = now_s - moved_s
        if (end - position) * way <= _NEAR_DEG * STEPS_PER_DEG:
            return EndStop(position, "limit", still_s)
        if (abs(load) >= _TOUCH and still_s >= _TOUCH_S) or still_s >= _LONGEST_PUSH_S:
            return EndStop(position, "stop", still_s)


def _within(goal: float, limits: tuple[int, int]) -> int:
    low, high = limits
    return round(min(max(goal, low), high))
