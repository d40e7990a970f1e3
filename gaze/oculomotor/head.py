"""The head in a gaze shift: start, goal and motion.

The head starts if the gaze point is beyond the trigger angle from the face's front, and 20 ms have
passed since the eyes started or the target is top-down (Mitake et al. 3.3.6). ``HeadShare`` gives
its goal, short of the target, and its roll. It moves with minimum jerk (eq 8), from the present
position, speed and acceleration so that a new goal in flight makes no step.

All angles of a shift are measured along the great circle from the head's direction at the start:
the head stops short of the target as seen from there and never passes it. The paper describes eq 7
so in words ("30 deg short of the gaze direction"); an offset measured from straight ahead would
turn a head that comes from 60 deg past a target at 25 deg.
"""

from math import degrees, exp, hypot, radians

from gazerig.gaze.angles import angle_between, direction, shortened, yaw_pitch
from gazerig.gaze.minimum_jerk import Quintic
from gazerig.gaze.oculomotor.params import HeadParams as HeadParams
from gazerig.gaze.types import Angles2, Angles3, Target, Vec3

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


_NO_ROLL: Angles2 = (0.0, 0.0)
_AHEAD: Vec3 = (1.0, 0.0, 0.0)
_BRAKES_S = 0.12
"""Time constant of the braking distance of a head in flight."""

_ROUNDING_RAD = 1e-6
_ROLLS_S = 0.5
_SWINGS = 2.5
"""A movement lasting longer than this multiple of distance over speed swings past its goal."""


class HeadModel:
    """Start, goal and trajectory of the head's part of a gaze shift.

    share: the present share of the head

    Args:
        params: constants of start, goal and motion.
        eye_limit_rad: the smallest limit of the eyes.
        neck_limit_rad: ((yaw low, high), (pitch low, high)) of the neck.
        roll_limit_rad: (low, high) of its roll; None without such a joint.
    """

    def __init__(
        self,
        params: HeadParams,
        eye_limit_rad: float,
        neck_limit_rad: tuple[Angles2, Angles2],
        roll_limit_rad: Angles2 = _NO_ROLL,
    ) -> None:
        self.retune(params, eye_limit_rad, neck_limit_rad, roll_limit_rad)
        self.reset(0.0, (0.0, 0.0, 0.0))

    def retune(
        self,
        params: HeadParams,
        eye_limit_rad: float,
        neck_limit_rad: tuple[Angles2, Angles2],
        roll_limit_rad: Angles2 = _NO_ROLL,
    ) -> None:
        """Change constants and ranges; a movement in progress continues as planned."""
        self._params = params
        self._neck, self._roll = neck_limit_rad, roll_limit_rad
        self.share = HeadShare(params, eye_limit_rad)
        self._comfort_rad = radians(params.comfort_deg)
        self._relief_rad = min(self._comfort_rad / 2.0, self.share.trigger_rad)

    def reset(self, t_s: float, head_rad: Angles3) -> None:
        """Start at rest at the present head angles."""
        self._plans = tuple(Quintic((angle, 0.0, 0.0), angle, 1.0) for angle in head_rad)
        self._planned_s, self._lasts_s = t_s, 1.0
        self._set_goal(head_rad)
        self._ends_s = t_s
        self._follows = False
        self._relieves = False
        self._aside_since_s = t_s
        self._level = head_rad[2] == 0.0
        self._start = self._goal_direction
        self._target: tuple[str, int] | None = None

    def goal_rad(self, facing_rad: Angles2, offset_rad: float, start: Vec3 = _AHEAD) -> Angles2:
        """Return the head's yaw and pitch goal: the arc to the target, shortened, in range.

        Args:
            facing_rad: neck angles that would point the face straight at the target.
            offset_rad: angle by which the head stops short of it.
            start: direction at the head's start; it is the goal if it is nearer to the target.
        """
        yaw, pitch = yaw_pitch(shortened(direction(facing_rad), offset_rad, start))
        return self.in_range((yaw, pitch, 0.0))[:2]

    def in_range(self, head_rad: Angles3) -> Angles3:
        """Return head angles with yaw and pitch clipped to the neck's range."""
        (yaw_low, yaw_high), (pitch_low, pitch_high) = self._neck
        yaw, pitch, roll = head_rad
        if yaw_low <= yaw <= yaw_high and pitch_low <= pitch <= pitch_high:
            return head_rad
        return (min(max(yaw, yaw_low), yaw_high), min(max(pitch, pitch_low), pitch_high), roll)

    @property
    def range_rad(self) -> tuple[Angles2, Angles2]:
        """Return the neck's ((yaw low, high), (pitch low, high))."""
        return self._neck

    def destination_rad(self, target: Target, facing_rad: Angles2) -> Angles3:
        """Return the yaw, pitch and roll of the head at rest for a target, by its centre.

        facing_rad: neck angles that would point the face straight at it
        """
        start = self._goal_direction
        arc_rad = angle_between(start, direction(facing_rad))
        short_rad = self.share.short_rad(target.salience, arc_rad)
        if min(short_rad, arc_rad) > self._comfort_rad:
            short_rad = self._relief_rad
        return self._reaching(target, facing_rad, facing_rad, short_rad, start)

    def leads_s(self, target: Target, eccentricity_rad: float) -> float:
        """Return the time for which the eyes wait because the head goes first."""
        first = target.top_down and eccentricity_rad >= self.share.trigger_rad
        return self._params.lead_ms / 1e3 if first else 0.0

    def step(
        self,
        target: Target,
        facing_rad: Angles2,
        gaze_rad: Angles2,
        eccentricity_rad: float,
        since_eye_onset_s: float,
        t_s: float,
    ) -> Angles3:
        """Return the head's yaw, pitch and roll for this instant.

        facing_rad: neck angles that would point the face straight at the target's centre
        gaze_rad: the same for the target point itself
        eccentricity_rad: angle of that point from the face's front
        since_eye_onset_s: time since the eyes started towards it, negative before
        """
        self._decide(target, facing_rad, gaze_rad, eccentricity_rad, since_eye_onset_s, t_s)
        since_s = t_s - self._planned_s
        if since_s >= self._lasts_s:
            return self.in_range(self._goal)
        yaw, pitch, roll = self._plans
        # A new plan in full flight may swing past its goal, but not past the neck's range.
        return self.in_range(
            (yaw.position(since_s), pitch.position(since_s), roll.position(since_s))
        )

    def _decide(
        self,
        target: Target,
        facing: Angles2,
        gaze: Angles2,
        eccentricity: float,
        since_onset: float,
        t_s: float,
    ) -> None:
        """Choose between turning to the target, recentring an eccentric eye, and rest."""
        par, share = self._params, self.share
        moving = t_s < self._ends_s
        if (target.kind, target.id) != self._target:
            self._target = target.kind, target.id
            self._aside_since_s = t_s
            self._start = self._facing(t_s) if moving else self._goal_direction
            # A reason that moved the eyes back from the target before it ends.
            self._follows, self._relieves = moving, False
        elif (
            not moving
            and self._start is not self._goal_direction
            and angle_between(self._goal_direction, direction(facing)) < share.trigger_rad
        ):
            self._start = self._goal_direction
        if eccentricity <= self._comfort_rad:
            self._aside_since_s = t_s
        delay_ms = -par.lead_ms if target.top_down else par.start_delay_ms
        if t_s - self._aside_since_s >= par.recentre_after_ms / 1e3 and not moving:
            self._follows, self._relieves = False, True
        elif eccentricity >= share.trigger_rad and since_onset >= delay_ms / 1e3 - 1e-9:
            self._follows, self._relieves = True, False
        elif not moving:
            self._follows = self._relieves = False
        if self._relieves:
            self._follow(target, facing, gaze, self._relief_rad, t_s)
        elif self._follows:
            arc_rad = angle_between(self._start, direction(facing))
            short_rad = share.short_rad(target.salience, arc_rad)
            self._follow(target, facing, gaze, short_rad, t_s)

    def _follow(
        self, target: Target, facing: Angles2, gaze: Angles2, short_rad: float, t_s: float
    ) -> None:
        """Turn towards the target, but never away from it because its salience has fallen.

        A person who steps aside is most salient while moving; with the larger offset of a still
        person the head would swing back from its new direction.
        """
        way, to_centre = self._goal_direction, direction(facing)
        to_gaze = to_centre if gaze is facing else direction(gaze)
        near_enough = angle_between(way, to_centre) <= short_rad + _ROUNDING_RAD
        in_reach = angle_between(way, to_gaze) <= self.share.reach_rad + _ROUNDING_RAD
        moving, start = t_s < self._ends_s, self._start
        arc_rad = angle_between(start, to_centre)
        if near_enough and in_reach and not (moving and angle_between(start, way) > arc_rad):
            return
        if moving:
            # From the point where it can stop, unless that is past the target.
            stop = self._facing(t_s, _BRAKES_S)
            start = stop if angle_between(start, stop) <= arc_rad else to_centre
        self._aim(self._reaching(target, facing, gaze, short_rad, start), t_s)

    def _reaching(
        self, target: Target, facing: Angles2, gaze: Angles2, offset_rad: float, start: Vec3
    ) -> Angles3:
        """Return the goal for the centre; for the point itself if the eyes could not reach it."""
        reach_rad = self.share.reach_rad
        goal = self.goal_rad(facing, offset_rad, start)
        if facing != gaze and not self._params.literal_reach:
            rest = angle_between(direction(goal), direction(gaze))
            goal = goal if rest <= reach_rad else self.goal_rad(gaze, reach_rad, start)
        low, high = self._roll
        roll = self.share.roll_rad(target.salience, facing[0])
        return (*goal, min(max(roll, low), high))

    def _facing(self, t_s: float, ahead_s: float = 0.0) -> Vec3:
        """Return the direction of the head, extrapolated at its present speed by a time."""
        since_s = t_s - self._planned_s
        (yaw, yaw_rate, _), (pitch, pitch_rate, _) = (p.at(since_s) for p in self._plans[:2])
        return direction((yaw + ahead_s * yaw_rate, pitch + ahead_s * pitch_rate))

    def _aim(self, goal: Angles3, t_s: float) -> None:
        """Plan a new trajectory when the goal has moved by more than ``replan_deg``."""
        change = hypot(goal[0] - self._goal[0], goal[1] - self._goal[1])
        if change < radians(self._params.replan_deg) and self._level:
            return
        starts = [plan.at(t_s - self._planned_s) for plan in self._plans]
        (yaw, yaw_rate, _), (pitch, pitch_rate, _), _ = starts
        duration = self._duration_s(goal[0] - yaw, goal[1] - pitch, yaw_rate, pitch_rate)
        # A roll in motion would swing far in a long turn.
        lasts = (duration, duration, min(duration, _ROLLS_S))
        self._plans = tuple(
            Quintic(start, end, each) for start, end, each in zip(starts, goal, lasts, strict=True)
        )
        self._set_goal(goal)
        self._level = True
        self._planned_s, self._lasts_s, self._ends_s = t_s, duration, t_s + duration

    def _set_goal(self, goal: Angles3) -> None:
        self._goal, self._goal_direction = goal, direction(goal[:2])

    def _duration_s(self, yaw: float, pitch: float, yaw_rate: float, pitch_rate: float) -> float:
        """Return the time of a head movement: peak speed grows with its size.

        Args:
            yaw: the distance to the goal sideways, rad.
            pitch: the same upwards.
            yaw_rate: the present speed, rad/s; a head that is fast towards the goal would swing
                past it with a longer duration.
            pitch_rate: the same upwards.
        """
        par = self._params
        way = hypot(yaw, pitch)
        amplitude = degrees(way)
        peak = (4.0 / 3.0 * amplitude / 50.0 + 0.4) * par.base_speed_deg_s
        if self._relieves:
            peak = min(peak, par.recentre_speed_deg_s)
        duration = max(1.875 * amplitude / peak, par.min_move_ms / 1e3)
        closing = yaw * yaw_rate + pitch * pitch_rate
        if closing > 0.0:
            duration = min(duration, max(_SWINGS * way * way / closing, _BRAKES_S))
        return duration
