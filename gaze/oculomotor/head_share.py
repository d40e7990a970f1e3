"""Share of the head in a gaze shift, and its roll.

All angles of a shift are measured along the great circle from the head's direction at the start:
the head stops short of the target as seen from there and never passes it. The paper describes eq 7
so in words ("30 deg short of the gaze direction"); an offset measured from straight ahead would
turn a head that comes from 60 deg past a target at 25 deg.
"""

from math import exp, radians

from gazerig.gaze.oculomotor.params import HeadParams

_LATERAL_RAD = radians(30.0)
_LEAST_ROLL = 0.4
"""Share of the roll at the least interest."""


def interest(params: HeadParams, salience: float) -> float:
    """Return 0 at the least interest and 1 at the highest: eq 7's logistic, sign corrected."""
    z = 2.0 * (salience - params.min_salience) / (params.max_salience - params.min_salience) - 1.0
    return 1.0 - 1.0 / (1.0 + exp(min(700.0, 7.0 * z)))


class HeadShare:
    """Share of the head in gaze shifts, by the present parameters and limit of the eyes.

    trigger_rad: eccentricity from which the head joins in
    reach_rad: largest eccentricity of the eyes
    """

    def __init__(self, params: HeadParams, eye_limit_rad: float) -> None:
        self._params = params
        printed = radians(params.max_offset_deg)
        reachable = max(0.0, eye_limit_rad - radians(params.eye_margin_deg))
        self._half_range_rad = radians(params.eye_only_range_deg) / 2.0
        # If the head stopped short by more than the eye can cover, the gaze would never reach the
        # target; and a trigger beyond the eye's limit never fires.
        if params.goal_model == "stahl":
            self.trigger_rad = min(self._half_range_rad, reachable)
            self.reach_rad = reachable
        else:
            self.trigger_rad = printed if params.literal_reach else min(printed, reachable)
            self.reach_rad = self.trigger_rad

    def offset_rad(self, salience: float) -> float:
        """Return how far short of the target the head stops (eq 7, sign corrected)."""
        par = self._params
        full = radians(par.max_offset_deg) * (1.0 - interest(par, salience))
        return full if par.literal_reach else min(full, self.reach_rad)

    def short_rad(self, salience: float, arc_rad: float) -> float:
        """Return the angle by which the head stops short of a target.

        Args:
            salience: of the target.
            arc_rad: angle of the target from the head's direction at the start.
        """
        par = self._params
        if par.goal_model == "attention":
            return self.offset_rad(salience)
        if par.goal_model == "align":
            return (1.0 - par.align) * self.trigger_rad
        short = arc_rad - par.head_slope * max(0.0, arc_rad - self._half_range_rad)
        return min(short, self.reach_rad)

    def roll_rad(self, salience: float, yaw_rad: float) -> float:
        """Return the roll for a target at a yaw of ``yaw_rad``."""
        par = self._params
        lateral = min(1.0, max(-1.0, yaw_rad / _LATERAL_RAD))
        share = _LEAST_ROLL + (1.0 - _LEAST_ROLL) * interest(par, salience)
        return -radians(par.roll_deg) * share * lateral
