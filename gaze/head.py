"""Head share of a gaze shift: when it starts, how far it goes, how it moves.

Start: the gaze point lies beyond the trigger angle from the face's front, and 20 ms
have passed since the eyes set off or the target is top-down (Mitake et al. 3.3.6).
Goal: between "30 deg short of the target" and "straight at it", smoothly with the
amount of attention (eq 7, whose exponent has the wrong sign in print; the text asks
for the head to turn further the more attention there is). Motion: minimum jerk
(eq 8), from the present position, speed and acceleration so that a new goal in flight
makes no step.
"""

from dataclasses import dataclass, field
from math import degrees, exp, hypot, radians

from gaze.angles import direction, shortened, yaw_pitch
from gaze.types import Angles2, Angles3, Target


@dataclass(frozen=True)
class HeadParams:
    """Constants of eqs 7 and 8 and of the start rule."""

    largest_offset_deg: float = field(
        default=30.0,
        metadata={
            "low": 0.0,
            "high": 90.0,
            "unit": "deg",
            "says": "how far short of the target the least interested head stops; also the "
            "trigger; both are lowered to the eye's limit less eye_margin_deg",
        },
    )
    eye_margin_deg: float = field(
        default=2.0,
        metadata={"low": 0.0, "high": 30.0, "unit": "deg", "says": "kept free at the eye limit"},
    )
    pull_least: float = field(
        default=0.2,
        metadata={
            "low": 0.0,
            "high": 10.0,
            "unit": "",
            "says": "attention A1 at which the head moves least",
        },
    )
    pull_most: float = field(
        default=1.0,
        metadata={
            "low": 0.0,
            "high": 10.0,
            "unit": "",
            "says": "attention A2 at which the head moves most",
        },
    )
    start_delay_ms: float = field(
        default=20.0,
        metadata={
            "low": 0.0,
            "high": 1000.0,
            "unit": "ms",
            "says": "head after eyes for bottom-up targets",
        },
    )
    base_speed_deg_s: float = field(
        default=70.0,
        metadata={
            "low": 5.0,
            "high": 500.0,
            "unit": "deg/s",
            "says": "V0; the peak speed is (4/3 A/50 + 0.4) V0 for A degrees",
        },
    )
    shortest_move_ms: float = field(
        default=300.0,
        metadata={
            "low": 20.0,
            "high": 5000.0,
            "unit": "ms",
            "says": "shortest head movement; small ones would be twitches otherwise",
        },
    )
    replan_deg: float = field(
        default=1.0,
        metadata={
            "low": 0.05,
            "high": 20.0,
            "unit": "deg",
            "says": "change of the goal that makes a moving head plan anew",
        },
    )
    recentre_after_ms: float = field(
        default=800.0,
        metadata={
            "low": 0.0,
            "high": 60000.0,
            "unit": "ms",
            "says": "an eye held aside this long is relieved by the head",
        },
    )
    comfort_deg: float = field(
        default=8.0,
        metadata={
            "low": 0.0,
            "high": 90.0,
            "unit": "deg",
            "says": "eccentricity at which the eye is at ease",
        },
    )
    recentre_speed_deg_s: float = field(
        default=30.0,
        metadata={
            "low": 1.0,
            "high": 200.0,
            "unit": "deg/s",
            "says": "peak speed of that slow relief",
        },
    )

    def __post_init__(self) -> None:
        """Check the order of the two amounts of attention.

        Raises:
            ValueError: pull_most is not above pull_least.
        """
        if self.pull_most <= self.pull_least:
            raise ValueError("pull_most must be above pull_least")


class Quintic:
    """Fifth-order polynomial to a resting goal from any position, speed and acceleration.

    From rest it is eq 8, theta0 + (goal - theta0) (6 s^5 - 15 s^4 + 10 s^3).
    """

    def __init__(self, start: tuple[float, float, float], goal: float, duration_s: float) -> None:
        """Take (position, speed, acceleration) at time 0, and where to be at rest when."""
        p, v, a = start
        T = duration_s
        d = goal - p
        self._goal, self._T = goal, T
        self._c = (
            p,
            v,
            0.5 * a,
            (20.0 * d - 12.0 * v * T - 3.0 * a * T * T) / (2.0 * T**3),
            (-30.0 * d + 16.0 * v * T + 3.0 * a * T * T) / (2.0 * T**4),
            (12.0 * d - 6.0 * v * T - a * T * T) / (2.0 * T**5),
        )

    def at(self, t_s: float) -> tuple[float, float, float]:
        """Give position, speed and acceleration at a time since the start."""
        if t_s >= self._T:
            return (self._goal, 0.0, 0.0)
        c0, c1, c2, c3, c4, c5 = self._c
        t = max(0.0, t_s)
        return (
            c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5)))),
            c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5))),
            2.0 * c2 + t * (6.0 * c3 + t * (12.0 * c4 + t * 20.0 * c5)),
        )


class Head:
    """Decides when, where to and how the head turns."""

    def __init__(
        self, params: HeadParams, eye_limit_rad: float, neck_limit_rad: tuple[Angles2, Angles2]
    ) -> None:
        """Take the smallest eye limit and the neck's ((yaw low, high), (pitch low, high))."""
        self._params = params
        self._neck = neck_limit_rad
        reachable = eye_limit_rad - radians(params.eye_margin_deg)
        # A head that stops short by more than the eye can cover never brings the gaze
        # to the target, and a trigger beyond the eye's limit never fires.
        self.trigger_rad = max(0.0, min(radians(params.largest_offset_deg), reachable))
        self.reset(0.0, (0.0, 0.0, 0.0))

    def reset(self, t_s: float, head_rad: Angles3) -> None:
        """Stand still where the head is."""
        self._plans = tuple(Quintic((angle, 0.0, 0.0), angle, 1.0) for angle in head_rad)
        self._planned_s = t_s
        self._goal: Angles2 = (head_rad[0], head_rad[1])
        self._ends_s = t_s
        self._follows = False
        self._relieves = False
        self._aside_since_s = t_s
        self._level = head_rad[2] == 0.0

    def offset_rad(self, pull: float) -> float:
        """Give how far short of the target the head stops (eq 7, sign corrected)."""
        par = self._params
        z = 2.0 * (pull - par.pull_least) / (par.pull_most - par.pull_least) - 1.0
        full = radians(par.largest_offset_deg) / (1.0 + exp(min(700.0, 7.0 * z)))
        return min(full, self.trigger_rad)

    def goal_rad(self, facing_rad: Angles2, offset_rad: float) -> Angles2:
        """Give the head's yaw and pitch goal: the arc to the target, shortened, in range."""
        yaw, pitch = yaw_pitch(shortened(direction(facing_rad), offset_rad))
        (yaw_low, yaw_high), (pitch_low, pitch_high) = self._neck
        return (min(max(yaw, yaw_low), yaw_high), min(max(pitch, pitch_low), pitch_high))

    def step(
        self,
        target: Target,
        facing_rad: Angles2,
        eccentricity_rad: float,
        since_eye_onset_s: float,
        t_s: float,
    ) -> Angles3:
        """Give the head's yaw, pitch and roll for this instant.

        facing_rad: neck angles that would point the face straight at the gaze target
        eccentricity_rad: angle of the gaze target from the face's front
        since_eye_onset_s: time since the eyes set off for this target
        """
        self._decide(target, facing_rad, eccentricity_rad, since_eye_onset_s, t_s)
        now = [plan.at(t_s - self._planned_s)[0] for plan in self._plans]
        return (now[0], now[1], now[2])

    def _decide(
        self, target: Target, facing: Angles2, eccentricity: float, since_onset: float, t_s: float
    ) -> None:
        """Start, follow, relieve or rest."""
        par = self._params
        if eccentricity <= radians(par.comfort_deg):
            self._aside_since_s = t_s
        moving = t_s < self._ends_s
        late_enough = target.top_down or since_onset >= par.start_delay_ms / 1e3 - 1e-9
        if eccentricity >= self.trigger_rad and late_enough:
            self._follows, self._relieves = True, False
        elif t_s - self._aside_since_s >= par.recentre_after_ms / 1e3 and not moving:
            self._relieves = True
        elif not moving:
            self._follows = self._relieves = False
        if self._follows:
            self._aim(self.goal_rad(facing, self.offset_rad(target.pull)), t_s)
        elif self._relieves:
            comfort = min(radians(par.comfort_deg) / 2.0, self.trigger_rad)
            self._aim(self.goal_rad(facing, comfort), t_s)

    def _aim(self, goal: Angles2, t_s: float) -> None:
        """Plan anew when the goal has moved enough to matter."""
        change = hypot(goal[0] - self._goal[0], goal[1] - self._goal[1])
        if change < radians(self._params.replan_deg) and self._level:
            return
        starts = [plan.at(t_s - self._planned_s) for plan in self._plans]
        duration = self._duration_s(hypot(goal[0] - starts[0][0], goal[1] - starts[1][0]))
        self._plans = tuple(
            Quintic(start, end, duration) for start, end in zip(starts, (*goal, 0.0), strict=True)
        )
        self._goal, self._level = goal, True
        self._planned_s, self._ends_s = t_s, t_s + duration

    def _duration_s(self, amplitude_rad: float) -> float:
        """Give the time of a head movement: peak speed grows with its size."""
        par = self._params
        amplitude = degrees(amplitude_rad)
        peak = (4.0 / 3.0 * amplitude / 50.0 + 0.4) * par.base_speed_deg_s
        if self._relieves:
            peak = min(peak, par.recentre_speed_deg_s)
        return max(1.875 * amplitude / peak, par.shortest_move_ms / 1e3)
