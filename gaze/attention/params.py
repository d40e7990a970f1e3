"""Parameters of the choice between targets: hysteresis, habituation and reaction time."""

from dataclasses import dataclass, field
from typing import Annotated

from gazerig.params import Bounds


@dataclass(frozen=True)
class HabituationParams:
    """Rates of habituation and recovery, and extent of the inhibition of return."""

    # fmt: off
    decay_rate_1_s: Annotated[float, Bounds(0, 10),
        "rate at which the salience factor of the present target decreases from 1; 0: never"] = 0.2
    recovery_rate_1_s: Annotated[float, Bounds(0.01, 10), "rate at which the salience factors of all other bodies recover to 1"] = 1.0
    rule_floor: Annotated[float, Bounds(0, 1),
        "lowest salience factor of one of several targets of a rule; lower: the gaze changes sooner between people"] = 0.0
    stay_s: Annotated[float, Bounds(0, 60),
        "mean of the random additional time of each look at one of two or three people, beyond a balance of their shares; 0: none"] = 2.0
    stay_spread: Annotated[float, Bounds(0, 3), "its standard deviation / mean; larger: more long looks among short ones"] = 1.2
    rhythm_ratio: Annotated[float, Bounds(0, 1),
        "factor on the salience of a hand at each reversal of its motion near the face, outside a boxing match; "
        "1: none"] = 0.5
    rhythm_recovery_s: Annotated[float, Bounds(0.1, 600), "time constant with which that salience recovers"] = 2.0
    inhibition_of_return_strength: Annotated[float, Bounds(0, 1),
        "how strongly the point that the gaze has just left is avoided; 0: not at all"] = 0.5
    inhibition_of_return_sigma_deg: Annotated[float, Bounds(0.1, 45), "standard deviation of that inhibition around the point"] = 4.0
    inhibition_of_return_s: Annotated[float, Bounds(0.05, 60), "time constant with which that inhibition decays"] = 1.5
    # fmt: on


@dataclass(frozen=True)
class ReactionParams:
    """Distribution of reaction times, and their reductions."""

    # fmt: off
    median_ms: Annotated[float, Bounds(0, 1000),
        "median time from the frame in which another target wins attention to the change; 0: immediately; people: 150 to 250"] = 150.0
    spread: Annotated[float, Bounds(0, 1), "standard deviation of the logarithm of that time"] = 0.15
    looming_ratio: Annotated[float, Bounds(0, 1), "share of that time for a fast approach"] = 0.65
    return_ratio: Annotated[float, Bounds(0, 1), "share of that time for a face that was looked at within return_s"] = 0.8
    return_s: Annotated[float, Bounds(0, 600), "time for which a face counts as just looked at"] = 5.0
    # fmt: on


@dataclass(frozen=True)
class AttentionParams:
    """Hysteresis of the choice, reaction time, and the greatest age of a frame."""

    # fmt: off
    hysteresis_ratio: Annotated[float, Bounds(1, 10),
        "another body becomes the target if its salience exceeds the present target's by this factor"] = 1.2
    least_salience: Annotated[float, Bounds(0, 10),
        "a thing less salient than this is not a target; it gets only glances, like anything in view"] = 0.05
    min_dwell_ms: Annotated[float, Bounds(0, 10000), "shortest time on one target"] = 300.0
    stale_ms: Annotated[float, Bounds(20, 10000), "a frame older than this is not used"] = 400.0
    looks_elsewhere_ratio: Annotated[float, Bounds(0, 1),
        "share of its salience that a face keeps while the person neither looks at the head nor speaks; 1: all"] = 0.6
    speaker_share: Annotated[float, Bounds(0, 0.99),
        "share of the looks at several people that speaking people get; 0: speech has no effect"] = 0.88
    sinking_ratio: Annotated[float, Bounds(0, 1),
        "share of its salience that a person's hand keeps while it moves down, outside a boxing match; 1: all"] = 0.0
    own_motion_ratio: Annotated[float, Bounds(0, 1),
        "share of their motion that a person's own hands and clothes keep, unless they are raised to the face or "
        "reach out; the rest is added to the face; 1: all"] = 0.3
    face_memory_s: Annotated[float, Bounds(0, 600),
        "a face that leaves the view while the gaze is elsewhere is remembered at its last position for this time; 0: not at all"] = 15.0
    habituation: Annotated[HabituationParams, "habituation and inhibition of return"] = field(default_factory=HabituationParams)
    reaction: Annotated[ReactionParams, "reaction time"] = field(default_factory=ReactionParams)
    # fmt: on
