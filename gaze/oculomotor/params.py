"""Parameters of eye and head movements, with the sources of their values.

Amplitude of the head: 0.77 of the excess over the eye-only range, 35.8 deg wide (Stahl 1999;
between people the range varies by 31.9 deg, the slope by 0.16), or eq 7 of Mitake et al., or a
fixed share. People roll their heads by a few degrees when they turn to a person next to them; the
direction of the roll and its dependence on interest are choices made here.
"""

from dataclasses import dataclass
from typing import Annotated, Literal

from gazerig.params import Bounds

PredictionModel = Literal["none", "velocity", "periodic"]


@dataclass(frozen=True)
class OculomotorParams:
    """Re-fixations, endpoints and trigger of saccades, and the prediction of target and head."""

    # fmt: off
    refixation_deg: Annotated[float, Bounds(0, 5),
        "largest re-fixation, a small saccade within the target; 0: none"] = 1.7
    refixation_least_deg: Annotated[float, Bounds(0.1, 5), "smallest re-fixation; smaller ones are hidden by servo steps and play"] = 1.15
    refixation_after_ms: Annotated[float, Bounds(50, 60_000), "shortest rest of the gaze before a re-fixation"] = 350.0
    refixation_spread_ms: Annotated[float, Bounds(0, 60_000), "that rest is extended by a random time of up to this"] = 1100.0
    undershoot: Annotated[float, Bounds(0, 0.3),
        "share of its amplitude by which a saccade of 10 deg or more falls short, none up to 5 deg; people: .05-.10"] = 0.08
    endpoint_scatter_along: Annotated[float, Bounds(0, 0.2),
        "scatter of saccade endpoints along the path, standard deviation as a share of the amplitude; people: .03-.05"] = 0.04
    endpoint_scatter_across: Annotated[float, Bounds(0, 0.2),
        "scatter of saccade endpoints across the path, standard deviation as a share of the amplitude; people: .02"] = 0.02
    saccade_deg: Annotated[float, Bounds(0.1, 30), "position error above which a saccade is made instead of smooth pursuit"] = 2.0
    smallest_shift_deg: Annotated[float, Bounds(0, 10), "a new target closer to the gaze than this gets no saccade"] = 0.3
    refractory_ms: Annotated[float, Bounds(0, 2000),
        "shortest time after a saccade before a position error alone triggers the next"] = 150.0
    latency_ms: Annotated[float, Bounds(0, 1000), "latency from a new target to the saccade; people: 200"] = 0.0
    crossing_least_ms: Annotated[float, Bounds(0, 1000),
        "no catch-up saccade if pursuit will bring the eye onto the target between this time ..."] = 40.0
    crossing_most_ms: Annotated[float, Bounds(0, 1000), "... and this time from now"] = 180.0
    correct_deg: Annotated[float, Bounds(0.1, 30), "landing error above which a corrective saccade follows, if saccades have errors"] = 1.2
    correct_after_ms: Annotated[float, Bounds(0, 1000), "mean delay from landing to the corrective saccade; people: 100 to 200"] = 155.0
    correct_spread_ms: Annotated[float, Bounds(0, 500), "largest random deviation of that delay, up or down"] = 45.0
    min_interval_ms: Annotated[float, Bounds(0, 1000), "shortest time from the landing of a saccade to the next one"] = 100.0
    redirect_before_ms: Annotated[float, Bounds(0, 1000),
        "a new target bends the saccade in flight if it appears at least this long before its end; 1000: never"] = 70.0
    nearest_m: Annotated[float, Bounds(0.05, 2), "nearest distance on which the eyes converge (0.2 m is 17.6 deg of vergence)"] = 0.2
    prediction_horizon_ms: Annotated[float, Bounds(0, 2000),
        "longest time over which a target's position is extrapolated with its velocity"] = 120.0
    fade_ms: Annotated[float, Bounds(1, 5000), "time constant with which that velocity decays after that time"] = 300.0
    target_prediction: Annotated[PredictionModel,
        "predicted position of a target: that in its frame, extrapolated with its velocity, or along its curve and its swing, "
        "which is recognised after one to two cycles"] = "periodic"
    eye_lag_ms: Annotated[float, Bounds(0, 200), "delay from command to motion of an eye; the head's motion during it is predicted"] = 15.0
    # fmt: on

    @property
    def has_errors(self) -> bool:
        """Return whether saccades miss their targets."""
        return self.undershoot > 0.0 or self.has_scatter

    @property
    def has_scatter(self) -> bool:
        """Return whether endpoints are random."""
        return self.endpoint_scatter_along > 0.0 or self.endpoint_scatter_across > 0.0


@dataclass(frozen=True)
class PursuitParams:
    """Model, gains, delays and limits of pursuit.

    Gains and limits apply to both models; delays, reflex and fading apply only to the binocular
    controller: in gaze space no visual delay remains, and the reflex is exact.
    """

    # fmt: off
    model: Annotated[Literal["gaze_space", "binocular", "opposite_angles"],
        "the gaze point follows the predicted target; or the binocular controller of Zhang & Wakamatsu moves the eyes; or they turn "
        "between shifts by the opposite of the head's angles (Nakamoto & Tsuruno 3.4)"] = "gaze_space"
    gain_1_s: Annotated[float, Bounds(0, 50), "rate Kc at which the position error is closed"] = 8.0
    velocity_gain: Annotated[float, Bounds(0, 1), "gain Gp: share of the target's velocity that the eye adopts; people: .95"] = 0.95
    vergence_gain_1_s: Annotated[float, Bounds(0, 50), "rate Kd at which the error in depth is closed"] = 4.0
    divergence_gain_1_s: Annotated[float, Bounds(0, 50), "rate Kdiv instead of Kd if the target is farther away than the gaze point"] = 3.0
    max_speed_deg_s: Annotated[float, Bounds(1, 200), "fastest smooth pursuit, including the closing of the error; people: 63 deg/s"] = 58.0
    reject_deg_s: Annotated[float, Bounds(1, 1000), "a target reported as faster than this is taken as a jump and not pursued"] = 100.0
    max_error_deg: Annotated[float, Bounds(0.1, 90),
        "the rate of closing applies to at most this error; larger errors are closed no faster"] = 5.0
    delay_ms: Annotated[float, Bounds(0, 500), "binocular: visual delay tau_c, including the age of a frame"] = 100.0
    smooth_ms: Annotated[float, Bounds(0.1, 500), "binocular: smoothing time Tf of the observed direction"] = 40.0
    vergence_delay_ms: Annotated[float, Bounds(0, 500), "binocular: additional delay of vergence; 60 gives a total of 160 ms"] = 60.0
    max_vergence_deg: Annotated[float, Bounds(1, 60), "binocular: largest vergence"] = 20.0
    reflex_gain: Annotated[float, Bounds(0, 1.5), "binocular: gain of the vestibulo-ocular reflex; people: .95"] = 1.0
    reflex_delay_ms: Annotated[float, Bounds(0, 100), "binocular: delay of the reflex; people: 7-10"] = 10.0
    lost_fade_ms: Annotated[float, Bounds(1, 5000), "binocular: decay time of the eyes' speed after the loss of the target"] = 300.0
    # fmt: on


@dataclass(frozen=True)
class HeadParams:
    """Start, share, duration and roll of head movements."""

    # fmt: off
    goal_model: Annotated[Literal["attention", "align", "stahl"],
        "share of the head in a gaze shift: head_slope of the excess over the eye-only range (stahl), by salience (attention, eq 7), or "
        "fixed (align)"] = "stahl"
    eye_only_range_deg: Annotated[float, Bounds(0, 180),
        "with goal_model stahl: full width of the range of targets, about the head's direction that the eyes reach alone; "
        "people: 4 to 68"] = 35.8
    head_slope: Annotated[float, Bounds(0, 1),
        "with goal_model stahl: degrees of head for each degree beyond that range; people: .61 to .93"] = 0.77
    max_offset_deg: Annotated[float, Bounds(0, 90),
        "with the other two: angle by which the head stops short of the target at min_salience, and eccentricity beyond which it starts to "
        "move; both at most the eye's limit minus eye_margin_deg"] = 30.0
    eye_margin_deg: Annotated[float, Bounds(0, 30),
        "distance that the eyes keep from their limit, and more for a near target on which both converge; 0: none"] = 2.0
    min_salience: Annotated[float, Bounds(0, 10), "salience A1 of the least interest: the head turns and rolls least"] = 0.2
    max_salience: Annotated[float, Bounds(0, 10), "salience A2 of the highest interest: the head turns and rolls most"] = 1.0
    align: Annotated[float, Bounds(0, 1),
        "with goal_model align: 0: the head stops max_offset_deg short of the target, 1: it faces the target"] = 0.5
    literal_reach: Annotated[bool, "use max_offset_deg even if it exceeds the eyes' limit, as printed in the paper"] = False
    roll_deg: Annotated[float, Bounds(0, 20),
        "roll of the head, to the side to which it turns, at the highest interest for a target at least 30 deg aside; 0: none"] = 4.0
    slope_spread: Annotated[float, Bounds(0, 0.4),
        "standard deviation of head_slope from one shift to the next, limited to twice that; between people: .16"] = 0.1
    lead_ms: Annotated[float, Bounds(0, 100), "lead of the head before the eyes, for top-down targets to which it turns"] = 0.0
    lead_spread_ms: Annotated[float, Bounds(0, 200),
        "standard deviation of both onsets; in self-initiated looks (glance, search, rest) the eyes wait for a head that is first, "
        "as in half of people's shifts; in other shifts it is never first"] = 30.0
    start_delay_ms: Annotated[float, Bounds(0, 1000), "delay of the head after the eyes, for bottom-up targets"] = 20.0
    base_speed_deg_s: Annotated[float, Bounds(5, 500), "V0: the peak speed of a head movement of A degrees is (4/3 A/50 + 0.4) V0"] = 70.0
    duration_spread: Annotated[float, Bounds(0, 0.4),
        "standard deviation over mean of the duration of equal head movements, limited to 1.5 times that"] = 0.15
    min_move_ms: Annotated[float, Bounds(20, 5000), "shortest duration of a head movement; shorter ones would look like twitches"] = 300.0
    replan_deg: Annotated[float, Bounds(0.05, 20), "a moving head plans its movement again when the goal changes by this much"] = 1.0
    recentre_after_ms: Annotated[float, Bounds(0, 60000),
        "after an eye has been eccentric for this long at least, the head turns slowly to recentre it"] = 3000.0
    recentre_spread_ms: Annotated[float, Bounds(0, 60000), "mean of an additional random time (exponential)"] = 7000.0
    recentre_now_above: Annotated[float, Bounds(0, 10),
        "the head recentres a rule's target, other than a face, at once if its salience is above this; 10: never at once"] = 0.85
    comfort_deg: Annotated[float, Bounds(0, 90), "eccentricity up to which an eye is not recentred"] = 10.0
    recentre_speed_deg_s: Annotated[float, Bounds(1, 200), "peak speed of the head while it recentres the eyes"] = 12.0
    search_deg: Annotated[float, Bounds(0, 90),
        "eccentricity at which the head follows the eyes in the search for a lost person; 90: as in any shift"] = 6.0
    pursue_above_deg_s: Annotated[float, Bounds(0, 100),
        "the head pursues a target whose mean velocity over the last second is above this; 0: never"] = 3.0
    # fmt: on

    def __post_init__(self) -> None:
        """Check the order of the two amounts of attention.

        Raises:
            ValueError: max_salience is not above min_salience.
        """
        if self.max_salience <= self.min_salience:
            raise ValueError("max_salience must be above min_salience")
