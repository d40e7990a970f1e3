"""The head in a gaze shift: start, goal and motion.

The head starts if the gaze point is beyond the trigger angle from the face's front, and 20 ms have
passed since the eyes started or the target is top-down (Mitake et al. 3.3.6). ``HeadShare`` gives
its goal, short of the target, and its roll. It moves with minimum jerk (eq 8), from the present
position, speed and acceleration so that a new goal during the movement causes no step.

All angles of a shift are measured along the great circle from the head's direction at the start:
the head stops short of the target as seen from there and never passes it. The paper's text
describes eq 7 in this form ("30 deg short of the gaze direction"); with an offset measured from
straight ahead, a head that comes from 60 deg would turn past a target at 25 deg.

Amplitude of the head: 0.77 of the excess over the eye-only range, 35.8 deg wide (Stahl 1999;
between people the range varies by 31.9 deg, the slope by 0.16), or eq 7 of Mitake et al., or all of
it (Nakamoto & Tsuruno 3.5). What follows belongs to the first of these laws alone.

People roll their heads by a few degrees when they turn to a person next to them; the direction of
the roll and its dependence on interest are choices made here.

Equal shifts differ: slope, onset and duration scatter within bounds. The head stays at the position
that its law determines. When an eye has been eccentric for a random time of some seconds, the head
turns slowly to recentre it. It comes closer to a face, as people face each other; looks away from
the face, and short ones elsewhere, do not restart that time. A target in sustained motion is
pursued by the head too: each tick plans a minimum-jerk movement of .6 s to where the target will be
soon. On a ramp this lags by .6 of that time, .36 s, less the .2 s of foresight; people's heads lag
by .1 to .2 s. When the motion ends, the last plan brings the head to rest.
During a look away the eyes rest on a place of the room, and the head goes on with the person.
"""

from dataclasses import dataclass
from math import degrees, exp, hypot, inf, radians
from typing import Annotated, Literal, NamedTuple

import numpy as np

from gazerig.gaze.angles import (
    add,
    angle_between,
    direction,
    norm,
    scale,
    shorten_arc,
    sub,
    yaw_pitch,
)
from gazerig.gaze.minimum_jerk import Quintic
from gazerig.gaze.types import AWAY, ORDERED, SEARCH, Angles2, Angles3, Target, Vec3
from gazerig.params import Bounds

OWN_LOOKS = ("glance", SEARCH, "rest")
"""Kinds of targets that are not caused by anything visible (gazerig.gaze.attention.idle)."""
_FACES = ("face", AWAY)

_MOST_SALIENCE = 1.0
"""Salience A2 of the highest interest: the head turns and rolls most."""
_SLOPE, _SLOPE_SD = 0.77, 0.1
"""Degrees of head for each degree beyond the eye-only range, people's is .61 to .93, and its
standard deviation from one shift to the next; between people it is .16."""
_MARGIN_RAD = radians(2.0)
"""Distance that the eyes keep from their limit."""
_ROLL_RAD, _LATERAL_RAD = radians(4.0), radians(30.0)
"""Roll at the highest interest for a target at least so far aside."""
_LEAST_ROLL = 0.4
"""Share of the roll at the least interest."""


@dataclass(frozen=True)
class HeadParams:
    """Share and speed of head movements."""

    # fmt: off
    goal_model: Annotated[Literal["attention", "align", "stahl"],
        "share of the head in a gaze shift: as people's beyond the eye-only range, with a roll, a scatter and slow recentring (stahl), "
        "by salience alone (attention, eq 7), or all of it (align)"] = "stahl"
    eye_only_range_deg: Annotated[float, Bounds(0, 180),
        "with goal_model stahl: full width of the range of targets, about the head's direction that the eyes reach alone; "
        "people: 4 to 68"] = 35.8
    max_offset_deg: Annotated[float, Bounds(0, 90),
        "with goal_model attention: angle by which the head stops short of the target at min_salience; with this and align: "
        "eccentricity beyond which it starts to move"] = 30.0
    min_salience: Annotated[float, Bounds(0, 0.9), "salience A1 of the least interest: the head turns and rolls least"] = 0.2
    base_speed_deg_s: Annotated[float, Bounds(5, 500), "V0: the peak speed of a head movement of A degrees is (4/3 A/50 + 0.4) V0"] = 70.0
    # fmt: on


def interest(params: HeadParams, salience: float) -> float:
    """Return 0 at the least interest and 1 at the highest: eq 7's logistic, sign corrected."""
    z = 2.0 * (salience - params.min_salience) / (_MOST_SALIENCE - params.min_salience) - 1.0
    return 1.0 - 1.0 / (1.0 + exp(min(700.0, 7.0 * z)))


class HeadShare:
    """Share of the head in gaze shifts, from the present parameters and the limit of the eyes.

    trigger_rad: eccentricity from which the head takes part
    reach_rad: largest eccentricity of the eyes
    """

    def __init__(self, params: HeadParams, eye_limit_rad: float) -> None:
        self._params = params
        self._half_range_rad = radians(params.eye_only_range_deg) / 2.0
        printed = radians(params.max_offset_deg)
        self._margin_rad = _MARGIN_RAD if params.goal_model == "stahl" else 0.0
        self._reachable_rad = reachable = max(0.0, eye_limit_rad - self._margin_rad)
        # If the head stopped short by more than the eye can cover, the gaze would never reach the
        # target; and a trigger beyond the eye's limit never fires. Eq 7 is taken as printed.
        if params.goal_model == "stahl":
            self.trigger_rad, self.reach_rad = min(self._half_range_rad, reachable), reachable
        elif params.goal_model == "align":
            self.trigger_rad = self.reach_rad = min(printed, reachable)
        else:
            self.trigger_rad = self.reach_rad = printed

    def for_near_target(self, limit_rad: float) -> "HeadShare":
        """Return the share for a target on which both eyes converge up to an eccentricity."""
        if limit_rad >= self._reachable_rad:
            return self
        return HeadShare(self._params, limit_rad + self._margin_rad)

    def offset_rad(self, salience: float) -> float:
        """Return the angle by which the head stops short of the target (eq 7, sign corrected)."""
        return self.trigger_rad * (1.0 - interest(self._params, salience))

    def undershoot_rad(self, salience: float, arc_rad: float, steeper: float = 0.0) -> float:
        """Return the angle by which the head stops short of a target.

        Args:
            salience: salience of the target.
            arc_rad: angle of the target from the head's direction at the start.
            steeper: deviation of the slope in this shift.
        """
        if self._params.goal_model == "attention":
            return self.offset_rad(salience)
        if self._params.goal_model == "align":
            return 0.0
        slope = min(1.0, max(0.0, _SLOPE + steeper))
        short = arc_rad - slope * max(0.0, arc_rad - self._half_range_rad)
        return min(short, self.reach_rad)

    def roll_rad(self, salience: float, yaw_rad: float) -> float:
        """Return the roll for a target at a yaw of ``yaw_rad``."""
        if self._params.goal_model != "stahl":
            return 0.0
        lateral = min(1.0, max(-1.0, yaw_rad / _LATERAL_RAD))
        share = _LEAST_ROLL + (1.0 - _LEAST_ROLL) * interest(self._params, salience)
        return -_ROLL_RAD * share * lateral


_NO_ROLL: Angles2 = (0.0, 0.0)
_AHEAD: Vec3 = (1.0, 0.0, 0.0)
_BRAKES_S = 0.12
"""Time constant of the braking distance of a moving head."""

_ROUNDING_RAD = 1e-6
_ROLLS_S = 0.5
_FIRST_S = 0.0065
"""Mean lead of the head in self-initiated looks: by more than 8 ms in 48 % of them."""
_LATER_S, _LEAD_SD_S = 0.02, 0.03
"""Delay of the head after the eyes for bottom-up targets, and standard deviation of both onsets."""
_DURATION_SD = 0.15
"""Standard deviation over mean of the duration of equal head movements."""
_MOST_SD, _MOST_DURATION_SD = 2.0, 1.5
"""Bounds of the scatter, in standard deviations."""
_SHORTEST_S = 0.3
"""Shortest duration of a head movement; shorter ones would look like twitches."""
_REPLAN_RAD = radians(1.0)
"""A moving head plans its movement again when the goal changes by this much."""
_PURSUES_RAD_S = radians(3.0)
"""The head pursues a target whose mean velocity is above this."""
_PURSUES_S, _FORESEES_S = 0.6, 0.2
"""Duration of a planned movement of pursuit, and how far ahead of now its goal is."""
_NO_DRIFT: Vec3 = (0.0, 0.0, 0.0)
_MEAN_S = 0.8
"""Time constant of the mean velocity, which is 0 for a waving hand but not for a walk."""
_FASTEST = 3.0
"""Factor on the threshold to which speeds are clipped, so that it is not reached within .32 s."""
_GOES_ON = 0.3
"""Share of the threshold at which a pursuit ends."""
_COMFORT_RAD = radians(10.0)
"""Eccentricity up to which an eye is not recentred."""
_RECENTRE_S, _RECENTRE_SPREAD_S = 3.0, 7.0
"""Least time after which an eccentric eye is recentred, and the mean of an added random time."""
_RECENTRE_DEG_S = 12.0
_AT_ONCE_ABOVE = 0.85
"""Salience of a rule's target, other than a face, above which the head recentres it at once."""
_SEARCH_RAD = radians(6.0)
"""Eccentricity at which the head follows the eyes in the search for a lost person."""
_RELIEF = (0.4, 0.9)
"""Eccentricity to which the head recentres an eye, as a share of the one that is comfortable."""
_BEFORE_FACE = 0.5
"""Comfortable eccentricity of a face, as a share of ``_COMFORT_RAD``."""
_SHORT_LOOK_S = 6.0
"""Duration of looks elsewhere up to which the time to recentre a face continues.

Looks at each of several people last 2 to 5 s. The head comes between them, so that the camera sees
those beside them.
"""
_FARTHEST_AWAY_RAD = radians(22.0)
"""Eccentricity of a look away from a walker up to which the head goes on with the walker."""
_SWINGS = 2.5
"""A movement lasting longer than this multiple of distance over speed swings past its goal."""


def _draw_bounded(rng: np.random.Generator, most: float) -> float:
    """Draw a standard normal deviate within bounds."""
    return min(most, max(-most, float(rng.standard_normal())))


class _Facing(NamedTuple):
    """The last look at a face.

    until_s: its end
    since_s: time from which the face has been aside
    later, relief: random deviates of the time until the head recentres, and of how far
    """

    until_s: float
    since_s: float
    later: float
    relief: float


class HeadModel:
    """Start, goal and trajectory of the head's part of a gaze shift.

    share: the share of the head for distant targets
    foresees_s: time ahead for which pursuit needs the target's direction; 0: not needed
    range_rad: the neck's ((yaw low, high), (pitch low, high))

    Args:
        params: constants of start, goal and motion.
        eye_limit_rad: the smallest limit of the eyes.
        neck_limit_rad: ((yaw low, high), (pitch low, high)) of the neck.
        roll_limit_rad: (low, high) of its roll; None without such a joint.
        rng: random generator of the scatter and of recentring; None: neither is random.
    """

    def __init__(
        self,
        params: HeadParams,
        eye_limit_rad: float,
        neck_limit_rad: tuple[Angles2, Angles2],
        roll_limit_rad: Angles2 = _NO_ROLL,
        rng: np.random.Generator | None = None,
    ) -> None:
        self._rng = rng
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
        self.range_rad, self._roll = neck_limit_rad, roll_limit_rad
        self.share = self._share = HeadShare(params, eye_limit_rad)
        self._people = params.goal_model == "stahl"
        # The papers' heads leave an eye aside; only an urgent target is recentred, to the trigger.
        self._comfort_rad = _COMFORT_RAD if self._people else inf
        self.foresees_s = _FORESEES_S if self._people else 0.0

    def reset(self, t_s: float, head_rad: Angles3) -> None:
        """Start at rest at the present head angles."""
        self._plans = tuple(Quintic((angle, 0.0, 0.0), angle, 1.0) for angle in head_rad)
        self._planned_s, self._lasts_s = t_s, 1.0
        self._set_goal(head_rad)
        self._ends_s = t_s
        self._follows = False
        self._relieves = False
        self._aside_since_s = self._stepped_s = t_s
        self._facings: dict[int, _Facing] = {}
        self._lead_s = 0.0
        self._drift, self._pursues = _NO_DRIFT, False
        self._steeper: float
        self._later: float
        self._relief: float
        self._draw_variation()
        self._level = head_rad[2] == 0.0
        self._start = self._goal_direction
        self._target: tuple[str, int] | None = None

    def goal_rad(self, facing_rad: Angles2, offset_rad: float, start: Vec3 = _AHEAD) -> Angles2:
        """Return the head's yaw and pitch goal: the arc to the target, shortened, in range.

        An arc through the back ends at the limit nearest to the target, as no neck turns that far.

        Args:
            facing_rad: neck angles that would point the face straight at the target.
            offset_rad: angle by which the head stops short of it.
            start: direction at the head's start; it is the goal if it is nearer to the target.
        """
        yaw, pitch = yaw_pitch(shorten_arc(direction(facing_rad), offset_rad, start))
        start_yaw = yaw_pitch(start)[0]
        if (yaw - start_yaw) * (facing_rad[0] - start_yaw) < 0.0:
            yaw, pitch = facing_rad
        return self.clip_to_range((yaw, pitch, 0.0))[:2]

    def clip_to_range(self, head_rad: Angles3) -> Angles3:
        """Return head angles with yaw and pitch clipped to the neck's range."""
        (yaw_low, yaw_high), (pitch_low, pitch_high) = self.range_rad
        yaw, pitch, roll = head_rad
        if yaw_low <= yaw <= yaw_high and pitch_low <= pitch <= pitch_high:
            return head_rad
        return (min(max(yaw, yaw_low), yaw_high), min(max(pitch, pitch_low), pitch_high), roll)

    def _share_for(self, target: Target, both_eyes_rad: float) -> HeadShare:
        """Return the share for a target on which both eyes converge up to an eccentricity.

        With ``align`` only an ordered point takes that room: for others the eyes' limit is the
        paper's trigger (Nakamoto & Tsuruno 3.5).
        """
        if target.kind != ORDERED and self._params.goal_model == "align":
            return self.share
        return self.share.for_near_target(both_eyes_rad)

    def destination_rad(
        self, target: Target, facing_rad: Angles2, both_eyes_rad: float = inf
    ) -> Angles3:
        """Return the yaw, pitch and roll of the head at rest for a target, by its centre.

        facing_rad: neck angles that would point the face straight at it
        both_eyes_rad: eccentricity up to which both eyes converge on it
        """
        share, start = self._share_for(target, both_eyes_rad), self._goal_direction
        arc_rad = angle_between(start, direction(facing_rad))
        short_rad = share.undershoot_rad(target.salience, arc_rad)
        if min(short_rad, arc_rad) > self._comfort_rad:
            short_rad = min(self._comfort_rad / 2.0, self.share.trigger_rad)
        return self._reachable_goal(target, facing_rad, facing_rad, short_rad, start, share)

    def draw_lead_s(
        self, target: Target, eccentricity_rad: float, both_eyes_rad: float = inf
    ) -> float:
        """Return the time for which the eyes wait because the head moves first.

        Called once for each new target: the onset of the head is drawn here.

        both_eyes_rad: eccentricity up to which both eyes converge on the target
        """
        self._share = self._share_for(target, both_eyes_rad)
        self._lead_s = 0.0 if target.top_down else -_LATER_S
        if self._people and self._rng is not None:
            self._lead_s += _LEAD_SD_S * _draw_bounded(self._rng, _MOST_SD)
            if target.kind in OWN_LOOKS:
                self._lead_s += _FIRST_S
            else:  # a reaction to something visible, whose time is drawn with it
                self._lead_s = min(self._lead_s, 0.0)
        first = target.top_down and eccentricity_rad >= self._trigger_rad(target)
        return max(0.0, self._lead_s) if first else 0.0

    def step(
        self,
        target: Target,
        facing_rad: Angles2,
        gaze_rad: Angles2,
        eccentricity_rad: float,
        since_eye_onset_s: float,
        t_s: float,
        soon_rad: Angles2 | None = None,
        both_eyes_rad: float = inf,
    ) -> Angles3:
        """Return the head's yaw, pitch and roll for this instant.

        facing_rad: neck angles that would point the face straight at the target's centre
        gaze_rad: neck angles for the target point itself
        eccentricity_rad: angle of that point from the face's front
        since_eye_onset_s: time since the eyes started towards it, negative before
        soon_rad: neck angles that will point the face at the centre ``foresees_s`` later; None: it
            does not move
        both_eyes_rad: eccentricity up to which both eyes converge on the target point
        """
        self._share = self._share_for(target, both_eyes_rad)
        there = direction(facing_rad)
        self._decide(target, facing_rad, there, gaze_rad, eccentricity_rad, since_eye_onset_s, t_s)
        if self._pursues and target.kind == AWAY and eccentricity_rad < _FARTHEST_AWAY_RAD:
            soon_rad = yaw_pitch(add(there, scale(self._drift, self.foresees_s)))
        if self._is_in_sustained_motion(there, soon_rad, since_eye_onset_s, t_s):
            self._pursue(target, facing_rad, facing_rad if soon_rad is None else soon_rad, t_s)
        since_s = t_s - self._planned_s
        if since_s >= self._lasts_s:
            return self.clip_to_range(self._goal)
        yaw, pitch, roll = self._plans
        # A new plan at full speed may pass its goal, but not the neck's range.
        return self.clip_to_range(
            (yaw.position(since_s), pitch.position(since_s), roll.position(since_s))
        )

    def _decide(
        self,
        target: Target,
        facing: Angles2,
        there: Vec3,
        gaze: Angles2,
        eccentricity: float,
        since_onset: float,
        t_s: float,
    ) -> None:
        """Choose between turning to the target, recentring an eccentric eye, and rest.

        there: direction of ``facing``
        """
        share, trigger_rad = self._share, self._trigger_rad(target)
        moving, is_face = t_s < self._ends_s, target.kind in _FACES
        if (target.kind, target.id) != self._target:
            if self._target is None or target.id != self._target[1]:  # not a look past a face
                self._drift, self._pursues = _NO_DRIFT, False
            if self._target is not None and self._target[0] in _FACES:
                now = _Facing(t_s, self._aside_since_s, self._later, self._relief)
                self._facings[self._target[1]] = now
            recent = self._facings.items()
            self._facings = {i: one for i, one in recent if t_s - one.until_s <= _SHORT_LOOK_S}
            self._target = target.kind, target.id
            self._aside_since_s = t_s
            self._draw_variation()
            if is_face and (last := self._facings.get(target.id)):
                self._aside_since_s, self._later, self._relief = last[1:]
            self._start = self._extrapolated_direction(t_s) if moving else self._goal_direction
            # The reason for the last movement ends when the eyes return from the target.
            self._follows, self._relieves = moving, False
        elif (
            not moving
            and self._start is not self._goal_direction
            and angle_between(self._goal_direction, there) < trigger_rad
        ):
            self._start = self._goal_direction
        comfort_rad, aside_rad = self._comfort_rad, eccentricity
        if is_face:
            comfort_rad *= _BEFORE_FACE
            aside_rad = angle_between(self._goal_direction, there)
        if aside_rad <= comfort_rad:
            self._aside_since_s = t_s
        wait_s = _RECENTRE_S + self._later * _RECENTRE_SPREAD_S
        if self._is_urgent(target):
            wait_s = 0.0
        if t_s - self._aside_since_s >= wait_s and not moving:
            self._follows, self._relieves = False, True
        elif eccentricity >= trigger_rad and since_onset >= -self._lead_s - 1e-9:
            self._follows, self._relieves = True, False
        elif not moving:
            self._follows = self._relieves = False
        if self._relieves:
            relief_rad = min(self._relief * comfort_rad, share.trigger_rad)
            self._follow(target, facing, there, gaze, relief_rad, t_s)
        elif self._follows:
            arc_rad = angle_between(self._start, there)
            steeper = self._steeper * _SLOPE_SD
            short_rad = share.undershoot_rad(target.salience, arc_rad, steeper)
            if target.kind == SEARCH:
                short_rad = min(short_rad, _SEARCH_RAD)
            self._follow(target, facing, there, gaze, short_rad, t_s)

    def _is_urgent(self, target: Target) -> bool:
        """Return whether a rule's target matters so much that the head does not wait."""
        is_rule = target.top_down and target.kind != ORDERED and target.kind not in _FACES
        return is_rule and target.salience > _AT_ONCE_ABOVE

    def _trigger_rad(self, target: Target) -> float:
        """Return the eccentricity of a target from which the head takes part."""
        if target.kind == SEARCH:
            return min(_SEARCH_RAD, self._share.trigger_rad)
        return self._share.trigger_rad

    def _draw_variation(self) -> None:
        """Draw the deviations of this shift from others, and the time and amount of recentring.

        Deviates in standard deviations.
        """
        self._steeper = self._longer = self._later = 0.0
        self._relief = 0.5
        if self._people and (rng := self._rng) is not None:
            self._steeper, self._longer = (
                _draw_bounded(rng, _MOST_SD),
                _draw_bounded(rng, _MOST_DURATION_SD),
            )
            self._later, self._relief = (
                float(rng.standard_exponential()),
                float(rng.uniform(*_RELIEF)),
            )

    def _is_in_sustained_motion(
        self, there: Vec3, soon: Angles2 | None, since_onset: float, t_s: float
    ) -> bool:
        """Return whether the target is in sustained motion, which the head pursues."""
        dt_s, self._stepped_s = t_s - self._stepped_s, t_s
        if not self._people:
            return False
        least, v = _PURSUES_RAD_S, _NO_DRIFT
        if soon is not None:
            v = scale(sub(direction(soon), there), 1.0 / _FORESEES_S)
            v = scale(v, min(1.0, _FASTEST * least / max(norm(v), 1e-9)))
        new = 1.0 - exp(-max(0.0, dt_s) / _MEAN_S)
        self._drift = add(self._drift, scale(sub(v, self._drift), new))
        if since_onset < 0.0 and not self._pursues:
            return False
        self._pursues = norm(self._drift) > (_GOES_ON * least if self._pursues else least)
        return self._pursues

    def _pursue(self, target: Target, facing: Angles2, soon: Angles2, t_s: float) -> None:
        """Plan a movement to where the target will be soon, from the present one."""
        low, high = self._roll
        roll = min(max(self.share.roll_rad(target.salience, facing[0]), low), high)
        yaw, pitch, _ = self.clip_to_range((*soon, 0.0))
        starts = [plan.state_at(t_s - self._planned_s) for plan in self._plans]
        goal = yaw, pitch, roll
        self._plans = tuple(
            Quintic(start, end, _PURSUES_S) for start, end in zip(starts, goal, strict=True)
        )
        self._set_goal(goal)
        self._start, self._level = self._goal_direction, True
        self._follows = self._relieves = False
        self._aside_since_s = t_s
        self._planned_s, self._lasts_s, self._ends_s = t_s, _PURSUES_S, t_s + _PURSUES_S

    def _follow(
        self,
        target: Target,
        facing: Angles2,
        there: Vec3,
        gaze: Angles2,
        short_rad: float,
        t_s: float,
    ) -> None:
        """Turn towards the target, but never away from it only because its salience has decreased.

        A person who steps aside is most salient while moving; with the larger offset of a still
        person the head would swing back from its new direction.
        """
        way = self._goal_direction
        to_gaze = there if gaze is facing else direction(gaze)
        moving, start = t_s < self._ends_s, self._start
        # A movement under way is not planned again for noise: that would end it where it can stop.
        near_rad = short_rad + (_REPLAN_RAD if moving else _ROUNDING_RAD)
        near_enough = angle_between(way, there) <= near_rad
        in_reach = angle_between(way, to_gaze) <= self._share.reach_rad + _ROUNDING_RAD
        arc_rad = angle_between(start, there)
        if near_enough and in_reach and not (moving and angle_between(start, way) > arc_rad):
            return
        if moving:
            # From the point where it can stop, unless that is past the target.
            stop = self._extrapolated_direction(t_s, _BRAKES_S)
            start = stop if angle_between(start, stop) <= arc_rad else there
        goal = self._reachable_goal(target, facing, gaze, short_rad, start, self._share)
        self._plan_to(goal, t_s)

    def _reachable_goal(
        self,
        target: Target,
        facing: Angles2,
        gaze: Angles2,
        offset_rad: float,
        start: Vec3,
        share: HeadShare,
    ) -> Angles3:
        """Return the goal for the centre; for the point itself if the eyes could not reach it."""
        reach_rad = share.reach_rad
        goal = self.goal_rad(facing, offset_rad, start)
        if facing != gaze and self._params.goal_model != "attention":
            rest = angle_between(direction(goal), direction(gaze))
            goal = goal if rest <= reach_rad else self.goal_rad(gaze, reach_rad, start)
        low, high = self._roll
        roll = share.roll_rad(target.salience, facing[0])
        return (*goal, min(max(roll, low), high))

    def _extrapolated_direction(self, t_s: float, ahead_s: float = 0.0) -> Vec3:
        """Return the direction of the head, extrapolated with its present speed over a time."""
        since_s = t_s - self._planned_s
        (yaw, yaw_rate, _), (pitch, pitch_rate, _) = (p.state_at(since_s) for p in self._plans[:2])
        return direction((yaw + ahead_s * yaw_rate, pitch + ahead_s * pitch_rate))

    def _plan_to(self, goal: Angles3, t_s: float) -> None:
        """Plan a new trajectory when the goal has moved by more than ``_REPLAN_RAD``."""
        change = hypot(goal[0] - self._goal[0], goal[1] - self._goal[1])
        if change < _REPLAN_RAD and self._level:
            return
        starts = [plan.state_at(t_s - self._planned_s) for plan in self._plans]
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
            yaw: horizontal distance to the goal, rad.
            pitch: vertical distance to the goal, rad.
            yaw_rate: the present speed, rad/s; with a longer duration, a head that moves fast
                towards the goal would pass it.
            pitch_rate: present vertical speed, rad/s.
        """
        way = hypot(yaw, pitch)
        amplitude = degrees(way)
        peak = (4.0 / 3.0 * amplitude / 50.0 + 0.4) * self._params.base_speed_deg_s
        longer = 1.0 + _DURATION_SD * self._longer
        if self._relieves:
            peak, longer = min(peak, _RECENTRE_DEG_S), 1.0
        duration = max(longer * 1.875 * amplitude / peak, _SHORTEST_S)
        closing = yaw * yaw_rate + pitch * pitch_rate
        if closing > 0.0:
            duration = min(duration, max(_SWINGS * way * way / closing, _BRAKES_S))
        return duration
