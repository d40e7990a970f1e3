"""Head share of a gaze shift: when it starts, how far it goes, how it moves.

Start: the gaze point lies beyond the trigger angle from the face's front, and 20 ms
have passed since the eyes set off or the target is top-down (Mitake et al. 3.3.6).
Goal: between "30 deg short of the target" and "straight at it", smoothly with the
amount of attention (eq 7, whose exponent has the wrong sign in print; the text asks
for the head to turn further the more attention there is). Motion: minimum jerk
(eq 8), from the present position, speed and acceleration so that a new goal in flight
makes no step.
"""

from dataclasses import dataclass
from math import degrees, exp, hypot, radians
from typing import Annotated, Literal

from gazerig.gaze.angles import angle_between, direction, shortened, yaw_pitch
from gazerig.gaze.quintic import Quintic
from gazerig.gaze.types import Angles2, Angles3, Target
from gazerig.params import Bounds


@dataclass(frozen=True)
class HeadParams:
    """Constants of eqs 7 and 8 and of the start rule."""

    # fmt: off
    max_offset_deg: Annotated[float, Bounds(0, 90),
        "how far short of the target the head stops at min_salience, and the eccentricity beyond which it starts to move; both at "
        "most the eye's limit less eye_margin_deg"] = 30.0
    eye_margin_deg: Annotated[float, Bounds(0, 30), "distance that the eyes keep from their limit"] = 2.0
    min_salience: Annotated[float, Bounds(0, 10), "salience A1 at which the head turns least"] = 0.2
    max_salience: Annotated[float, Bounds(0, 10), "salience A2 at which the head turns most"] = 1.0
    goal_model: Annotated[Literal["attention", "align", "stahl"],
        "share of the head in a gaze shift: by salience (eq 7), fixed (align), or 0.77 of what exceeds 17.9 deg (Stahl "
        "1999)"] = "attention"
    align: Annotated[float, Bounds(0, 1),
        "with goal_model align: 0: the head stops max_offset_deg short of the target, 1: it faces the target"] = 0.5
    literal_reach: Annotated[bool, "use max_offset_deg even if it exceeds the eyes' limit, as printed in the paper"] = False
    lead_ms: Annotated[float, Bounds(0, 100), "how long the head starts before the eyes, for top-down targets to which it turns"] = 0.0
    start_delay_ms: Annotated[float, Bounds(0, 1000), "how long the head starts after the eyes, for bottom-up targets"] = 20.0
    base_speed_deg_s: Annotated[float, Bounds(5, 500), "V0: the peak speed of a head movement of A degrees is (4/3 A/50 + 0.4) V0"] = 70.0
    min_move_ms: Annotated[float, Bounds(20, 5000), "shortest duration of a head movement; otherwise small ones would be twitches"] = 300.0
    replan_deg: Annotated[float, Bounds(0.05, 20), "a moving head plans its movement again when the goal changes by this much"] = 1.0
    recentre_after_ms: Annotated[float, Bounds(0, 60000),
        "after an eye has been eccentric for this long, the head turns slowly to bring it back"] = 800.0
    comfort_deg: Annotated[float, Bounds(0, 90), "eccentricity up to which an eye is not brought back"] = 8.0
    recentre_speed_deg_s: Annotated[float, Bounds(1, 200), "peak speed of the head while it brings the eyes back"] = 30.0
    # fmt: on

    def __post_init__(self) -> None:
        """Check the order of the two amounts of attention.

        Raises:
            ValueError: max_salience is not above min_salience.
        """
        if self.max_salience <= self.min_salience:
            raise ValueError("max_salience must be above min_salience")


class HeadModel:
    """Start, goal and trajectory of the head's part of a gaze shift."""

    def __init__(
        self, params: HeadParams, eye_limit_rad: float, neck_limit_rad: tuple[Angles2, Angles2]
    ) -> None:
        self.retune(params, eye_limit_rad, neck_limit_rad)
        self.reset(0.0, (0.0, 0.0, 0.0))

    def retune(
        self, params: HeadParams, eye_limit_rad: float, neck_limit_rad: tuple[Angles2, Angles2]
    ) -> None:
        """Change constants and ranges; a movement under way goes on as planned."""
        self._params = params
        self._neck = neck_limit_rad
        reachable = eye_limit_rad - radians(params.eye_margin_deg)
        # A head that stops short by more than the eye can cover never brings the gaze
        # to the target, and a trigger beyond the eye's limit never fires.
        printed = radians(params.max_offset_deg)
        self._comfort_rad = radians(params.comfort_deg)
        self.trigger_rad = printed if params.literal_reach else max(0.0, min(printed, reachable))

    def reset(self, t_s: float, head_rad: Angles3) -> None:
        """Start at rest at the present head angles."""
        self._plans = tuple(Quintic((angle, 0.0, 0.0), angle, 1.0) for angle in head_rad)
        self._planned_s, self._lasts_s = t_s, 1.0
        self._rest_rad = head_rad
        self._set_goal((head_rad[0], head_rad[1]))
        self._ends_s = t_s
        self._follows = False
        self._relieves = False
        self._aside_since_s = t_s
        self._level = head_rad[2] == 0.0

    def offset_rad(self, salience: float) -> float:
        """Return how far short of the target the head stops (eq 7, sign corrected)."""
        par = self._params
        z = 2.0 * (salience - par.min_salience) / (par.max_salience - par.min_salience) - 1.0
        full = radians(par.max_offset_deg) / (1.0 + exp(min(700.0, 7.0 * z)))
        return full if par.literal_reach else min(full, self.trigger_rad)

    def goal_rad(self, facing_rad: Angles2, offset_rad: float) -> Angles2:
        """Return the head's yaw and pitch goal: the arc to the target, shortened, in range."""
        yaw, pitch = yaw_pitch(shortened(direction(facing_rad), offset_rad))
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

    def destination_rad(self, target: Target, facing_rad: Angles2) -> Angles2:
        """Return the yaw and pitch to which the head turns for a point, its own centre.

        facing_rad: neck angles that would point the face straight at it
        """
        return self._reaching(facing_rad, facing_rad, self._stops_short(target, facing_rad))

    def leads_s(self, target: Target, eccentricity_rad: float) -> float:
        """Return how long the eyes wait because the head goes first."""
        first = target.top_down and eccentricity_rad >= self.trigger_rad
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
        gaze_rad: the same for the point itself that is looked at
        eccentricity_rad: angle of that point from the face's front
        since_eye_onset_s: time since the eyes set off for it, negative before they do
        """
        self._decide(target, facing_rad, gaze_rad, eccentricity_rad, since_eye_onset_s, t_s)
        since_s = t_s - self._planned_s
        if since_s >= self._lasts_s:
            return self.in_range(self._rest_rad)
        yaw, pitch, roll = self._plans
        # A plan made again in full flight may swing past its goal, but not past the neck's range.
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
        par = self._params
        if eccentricity <= self._comfort_rad:
            self._aside_since_s = t_s
        moving = t_s < self._ends_s
        delay_ms = -par.lead_ms if target.top_down else par.start_delay_ms
        if eccentricity >= self.trigger_rad and since_onset >= delay_ms / 1e3 - 1e-9:
            self._follows, self._relieves = True, False
        elif t_s - self._aside_since_s >= par.recentre_after_ms / 1e3 and not moving:
            self._follows, self._relieves = False, True
        elif not moving:
            self._follows = self._relieves = False
        if self._follows:
            self._follow(facing, gaze, self._stops_short(target, facing), t_s)
        elif self._relieves:
            comfort = min(self._comfort_rad / 2.0, self.trigger_rad)
            self._follow(facing, gaze, comfort, t_s)

    def _follow(self, facing: Angles2, gaze: Angles2, short_rad: float, t_s: float) -> None:
        """Turn towards the target, but never away from it because its salience has fallen.

        A person who steps aside is most salient while moving; a head that then took the larger
        offset of one who stands would swing back from where it has just turned to.
        """
        way, to_centre = self._goal_direction, direction(facing)
        to_gaze = to_centre if gaze is facing else direction(gaze)
        near_enough = angle_between(way, to_centre) <= short_rad
        in_reach = angle_between(way, to_gaze) <= self.trigger_rad
        if not (near_enough and in_reach):
            self._aim(self._reaching(facing, gaze, short_rad), t_s)

    def _stops_short(self, target: Target, facing: Angles2) -> float:
        """Return the angle by which the head stops short of the target."""
        par = self._params
        if par.goal_model == "attention":
            return self.offset_rad(target.salience)
        if par.goal_model == "align":
            return (1.0 - par.align) * self.trigger_rad
        arc = angle_between((1.0, 0.0, 0.0), direction(facing))
        short = arc - 0.77 * max(0.0, arc - radians(17.9))
        return min(short, self.trigger_rad)

    def _reaching(self, facing: Angles2, gaze: Angles2, offset_rad: float) -> Angles2:
        """Return the goal for the centre; for the point itself if its eye could not get there."""
        goal = self.goal_rad(facing, offset_rad)
        if facing == gaze or self._params.literal_reach:
            return goal
        rest = angle_between(direction(goal), direction(gaze))
        return goal if rest <= self.trigger_rad else self.goal_rad(gaze, self.trigger_rad)

    def _aim(self, goal: Angles2, t_s: float) -> None:
        """Plan a new trajectory when the goal has moved by more than ``replan_deg``."""
        change = hypot(goal[0] - self._goal[0], goal[1] - self._goal[1])
        if change < radians(self._params.replan_deg) and self._level:
            return
        starts = [plan.at(t_s - self._planned_s) for plan in self._plans]
        duration = self._duration_s(hypot(goal[0] - starts[0][0], goal[1] - starts[1][0]))
        self._plans = tuple(
            Quintic(start, end, duration) for start, end in zip(starts, (*goal, 0.0), strict=True)
        )
        self._set_goal(goal)
        self._rest_rad, self._level = (*goal, 0.0), True
        self._planned_s, self._lasts_s, self._ends_s = t_s, duration, t_s + duration

    def _set_goal(self, goal: Angles2) -> None:
        self._goal, self._goal_direction = goal, direction(goal)

    def _duration_s(self, amplitude_rad: float) -> float:
        """Return the time of a head movement: peak speed grows with its size."""
        par = self._params
        amplitude = degrees(amplitude_rad)
        peak = (4.0 / 3.0 * amplitude / 50.0 + 0.4) * par.base_speed_deg_s
        if self._relieves:
            peak = min(peak, par.recentre_speed_deg_s)
        return max(1.875 * amplitude / peak, par.min_move_ms / 1e3)
