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

Equal shifts differ: slope, onset and duration scatter within bounds. The head comes closer to a
face than to a thing, as people face each other, and at once to an urgent target: a speaker, an
addressed partner, a person who has just come. Eyes in their corners strain: the strain grows faster
the more eccentric they are, whatever they look at, while the head rests, and when it is large the
head turns slowly to recentre them. So a glance elsewhere does not end it. A target in sustained
motion is pursued by the head too: each tick plans a minimum-jerk movement of .6 s to where the
target will be soon. On a ramp this lags by .6 of that time, .36 s, less the .2 s of foresight;
people's heads lag by .1 to .2 s. When the motion ends, the last plan brings the head to rest.
During a look away the head goes on with the person, and takes the share in it that the centre of
its target has in the way from the face; it returns to where it was.
"""

from dataclasses import dataclass
from math import degrees, exp, hypot, inf, radians
from typing import Annotated, Literal

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
_USUAL_RAD = radians(17.9)
"""Half of people's mean eye-only range."""
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
    base_speed_deg_s: Annotated[float, Bounds(5, 500), "V0: the peak speed of a head movement of A degrees is (4/3 A/50 + 0.4) V0"] = 80.0
    # fmt: on


def interest(params: HeadParams, salience: float) -> float:
    """Return 0 at the least interest and 1 at the highest: eq 7's logistic, sign corrected."""
    z = 2.0 * (salience - params.min_salience) / (_MOST_SALIENCE - params.min_salience) - 1.0
    return 1.0 - 1.0 / (1.0 + exp(min(700.0, 7.0 * z)))


class HeadShare:
    """Share of the head in gaze shifts, from the present parameters and the limit of the eyes.

    half_range_rad: largest eccentricity of a thing that the eyes reach alone
    trigger_rad: eccentricity from which the head takes part
    reach_rad: largest eccentricity of the eyes
    """

    def __init__(self, params: HeadParams, eye_limit_rad: float) -> None:
        self._params = params
        self.half_range_rad = radians(params.eye_only_range_deg) / 2.0
        printed = radians(params.max_offset_deg)
        self._margin_rad = _MARGIN_RAD if params.goal_model == "stahl" else 0.0
        self._reachable_rad = reachable = max(0.0, eye_limit_rad - self._margin_rad)
        # If the head stopped short by more than the eye can cover, the gaze would never reach the
        # target; and a trigger beyond the eye's limit never fires. Eq 7 is taken as printed.
        if params.goal_model == "stahl":
            self.trigger_rad, self.reach_rad = min(self.half_range_rad, reachable), reachable
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

    def undershoot_rad(
        self, salience: float, arc_rad: float, steeper: float = 0.0, range_share: float = 1.0
    ) -> float:
        """Return the angle by which the head stops short of a target.

        Args:
            salience: salience of the target.
            arc_rad: angle of the target from the head's direction at the start.
            steeper: deviation of the slope in this shift.
            range_share: eye-only range for this kind of target, as a share of that for things; the
                slope approaches 1 as it approaches 0.
        """
        if self._params.goal_model == "attention":
            return self.offset_rad(salience)
        if self._params.goal_model == "align":
            return 0.0
        slope = min(1.0, max(0.0, 1.0 - (1.0 - _SLOPE - steeper) * range_share))
        short = arc_rad - slope * max(0.0, arc_rad - range_share * self.half_range_rad)
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
_STRAIN_S, _STRAIN_RAD, _STRAIN_SCALE_RAD = 6.0, radians(10.0), radians(4.0)
"""Mean time after which an eye is recentred at an eccentricity, and the change of that by which it
is e times shorter: 1.7 s at 15 deg, .5 s at 20 and beyond."""
_MOST_STRAIN_RAD = radians(20.0)
_STRAIN_SPREAD = 0.4
"""Largest relative deviation of the strain at which the head relieves the eyes."""
_RELAXED_RAD, _RELAXES_S = radians(5.0), 1.0
"""Eccentricity up to which strain decays, and the time constant of that."""
_RELIEF_RAD = radians(2.0), radians(4.5)
"""Eccentricity to which the head recentres an eye, at random."""
_RECENTRE_DEG_S = 20.0
_SETTLES_S = 0.7
"""Shortest time from the start of a gaze shift to a turn of the head that recentres the eyes."""
_FACE, _LOOKED_FOR, _URGENT = 0.4, 0.33, 0.15
"""Eye-only range for faces, for looks in search of people, and for urgent targets, as shares of
that for things: 7, 6 and 3 deg to a side; a rest straight ahead is the head's as well.
"""
_COMFORTABLE_RAD = radians(13.0)
"""Eccentricity of the eyes in looks away beyond which the head goes farther with them; people's are
seldom beyond 15 deg (Stahl 1999).
"""
_FARTHEST_AWAY_RAD = radians(22.0)
"""Eccentricity of a look away from a walker up to which the head goes on with the walker."""
_SWINGS = 2.5
"""A movement lasting longer than this multiple of distance over speed swings past its goal."""


def _draw_bounded(rng: np.random.Generator, most: float) -> float:
    """Draw a standard normal deviate within bounds."""
    return min(most, max(-most, float(rng.standard_normal())))


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
        self.foresees_s = _FORESEES_S if self._people else 0.0

    def reset(self, t_s: float, head_rad: Angles3) -> None:
        """Start at rest at the present head angles."""
        self._plans = tuple(Quintic((angle, 0.0, 0.0), angle, 1.0) for angle in head_rad)
        self._planned_s, self._lasts_s = t_s, 1.0
        self._set_goal(head_rad)
        self._ends_s = t_s
        self._follows = False
        self._relieves = False
        self._stepped_s = t_s
        self._strain, self._bearable = 0.0, 1.0
        self._facing: Angles2 = head_rad[:2]
        self._met: tuple[Angles3, Angles2] | None = None
        self._lead_s = 0.0
        self._drift, self._pursues = _NO_DRIFT, False
        self._steeper: float
        self._relief_rad: float
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
        short_rad = share.undershoot_rad(
            target.salience, arc_rad, range_share=self._range_share(target)
        )
        if self._people and min(short_rad, arc_rad) > _RELAXED_RAD:
            short_rad = _RELAXED_RAD
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
        dt_s, self._stepped_s = max(0.0, t_s - self._stepped_s), t_s
        self._decide(
            target, facing_rad, there, gaze_rad, eccentricity_rad, since_eye_onset_s, dt_s, t_s
        )
        if self._pursues and target.kind == AWAY and eccentricity_rad < _FARTHEST_AWAY_RAD:
            soon_rad = yaw_pitch(add(there, scale(self._drift, self.foresees_s)))
        if self._is_in_sustained_motion(there, soon_rad, since_eye_onset_s, dt_s):
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
        dt_s: float,
        t_s: float,
    ) -> None:
        """Choose between turning to the target, recentring an eccentric eye, and rest.

        there: direction of ``facing``
        """
        share, trigger_rad = self._share, self._trigger_rad(target)
        moving = t_s < self._ends_s
        if (target.kind, target.id) != self._target:
            if self._target is None or target.id != self._target[1]:  # not a look past a face
                self._drift, self._pursues, self._met = _NO_DRIFT, False, None
            self._target = target.kind, target.id
            self._draw_variation()
            self._start = self._extrapolated_direction(t_s) if moving else self._goal_direction
            # The reason for the last movement ends when the eyes return from the target.
            self._follows, self._relieves = moving, False
        elif (
            not moving
            and self._start is not self._goal_direction
            and angle_between(self._goal_direction, there) < trigger_rad
        ):
            self._start = self._goal_direction
        if self._people and not moving:
            self._update_strain(eccentricity, dt_s)
        if target.kind == AWAY and self._people:
            self._accompany(facing, gaze, t_s)
            return
        if self._met is not None:  # back on the face
            self._accompany(facing, gaze, t_s)
            self._met, self._follows = None, False
        self._facing, aside_rad = facing, eccentricity
        if target.kind in _FACES and self._people:
            aside_rad = angle_between(self._goal_direction, there)
        arc_rad, steeper = angle_between(self._start, there), self._steeper * _SLOPE_SD
        short_rad = share.undershoot_rad(
            target.salience, arc_rad, steeper, self._range_share(target)
        )
        turns = aside_rad >= trigger_rad
        due = turns and angle_between(self._goal_direction, there) > short_rad + _REPLAN_RAD
        strains = self._strain > self._bearable and aside_rad > _RELAXED_RAD
        if strains and not (moving or due) and since_onset > _SETTLES_S:
            self._follows, self._relieves, self._strain = False, True, 0.0
        elif turns and since_onset >= -self._lead_s - 1e-9:
            self._follows, self._relieves = True, False
        elif not moving:
            self._follows = self._relieves = False
        if self._relieves:
            self._follow(target, facing, there, gaze, self._relief_rad, t_s)
        elif self._follows:
            self._follow(target, facing, there, gaze, short_rad, t_s)

    def _update_strain(self, eccentricity: float, dt_s: float) -> None:
        """Add the strain of an eccentric eye, 1 when it is time to recentre it."""
        usual = eccentricity * _USUAL_RAD / max(self.share.half_range_rad, _RELAXED_RAD)
        if usual < _RELAXED_RAD:
            self._strain *= exp(-dt_s / _RELAXES_S)
        else:
            farther = (min(usual, _MOST_STRAIN_RAD) - _STRAIN_RAD) / _STRAIN_SCALE_RAD
            self._strain += dt_s / _STRAIN_S * exp(farther)

    def _accompany(self, facing: Angles2, gaze: Angles2, t_s: float) -> None:
        """Turn as far as the centre has moved from where it was with the gaze on the face."""
        if self._met is None:
            self._met = self._goal, self._facing
        self._facing = facing
        (yaw, pitch, roll), before = self._met
        goal = yaw + facing[0] - before[0], pitch + facing[1] - before[1]
        start, reach_rad = direction(goal), min(self._share.reach_rad, _COMFORTABLE_RAD)
        if angle_between(start, direction(gaze)) > reach_rad:
            goal = self.goal_rad(gaze, reach_rad, start)
        self._plan_to(self.clip_to_range((*goal, roll)), t_s)

    def _range_share(self, target: Target) -> float:
        """Return the eye-only range for a target, as a share of that for things."""
        if target.kind == "rest":
            return 0.0
        if target.urgent:
            return _URGENT
        return _FACE if target.kind in _FACES else _LOOKED_FOR if target.kind == SEARCH else 1.0

    def _trigger_rad(self, target: Target) -> float:
        """Return the eccentricity of a target from which the head takes part."""
        if not self._people:
            return self._share.trigger_rad
        range_rad = self._range_share(target) * self.share.half_range_rad
        return min(max(range_rad, _RELAXED_RAD), self._share.trigger_rad)

    def _draw_variation(self) -> None:
        """Draw the deviations of this shift from others, and the start and amount of recentring.

        Deviates in standard deviations.
        """
        self._steeper = self._longer = 0.0
        self._bearable, self._relief_rad = 1.0, sum(_RELIEF_RAD) / 2.0
        if self._people and (rng := self._rng) is not None:
            self._steeper, self._longer = (
                _draw_bounded(rng, _MOST_SD),
                _draw_bounded(rng, _MOST_DURATION_SD),
            )
            self._bearable = 1.0 + _STRAIN_SPREAD * float(rng.uniform(-1.0, 1.0))
            self._relief_rad = float(rng.uniform(*_RELIEF_RAD))

    def _is_in_sustained_motion(
        self, there: Vec3, soon: Angles2 | None, since_onset: float, dt_s: float
    ) -> bool:
        """Return whether the target is in sustained motion, which the head pursues."""
        if not self._people:
            return False
        least, v = _PURSUES_RAD_S, _NO_DRIFT
        if soon is not None:
            v = scale(sub(direction(soon), there), 1.0 / _FORESEES_S)
            v = scale(v, min(1.0, _FASTEST * least / max(norm(v), 1e-9)))
        new = 1.0 - exp(-dt_s / _MEAN_S)
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
        self._start, self._level, self._met = self._goal_direction, True, None
        self._follows = self._relieves = False
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
