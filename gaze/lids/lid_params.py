"""Parameters of the lids, with the sources of their values.

Rates are those of Bentivoglio 1997: 17 a minute at rest, 26 in conversation, with log-normal
intervals. Closing is about twice as fast as opening (VanderWerf 2003; Kwon 2013). Half of all
blinks are incomplete. Large gaze shifts evoke a blink (Evinger 1994: 97 % of those beyond 33 deg),
once for each shift, about when eyes and head start; the published rates include these. Upper lids
follow the gaze with a gain of about 1 (Becker & Fuchs 1988), lower lids in the same direction by a
quarter of that (Leite 2006: 2.2 mm and 9.1 mm in the same saccades of people of 20 to 30; a third
at 60 and more), equally up and down.

People's lower lids hardly rise in a blink: they move towards the nose (Doane 1980), and the upper
lid moves down to them. A mechanism cannot do this: the shut points of its lids are calibrated to
meet, perhaps in the middle, so a lower lid at rest would leave a gap. Therefore
``lower_close_share`` is 1. If the upper lid's shut point is calibrated at the edge of a resting
lower lid, a rig can blink as people do: share 0 to 0.2.

No two blinks of a person are equal: durations differ by tens of ms, half of the blinks stop between
a quarter and nearly all of the path (Ousler 2014), and the lids of both eyes differ a little. The
eyes turn 1 to 5 deg down and towards the nose in a blink (Collewijn 1985; 1 to 2 deg, Riggs 1987),
faster than the lids: they turn back before these are shut.

No measurement of the lower lid in sleepiness is known; the muscle that lifts it
tires with the others, so it rises by little.
"""

from dataclasses import dataclass
from typing import Annotated, Literal

from gazerig.params import Bounds


@dataclass(frozen=True)
class LidParams:
    """Rates, shapes and rest positions of the lids; an unnamed lid is an upper one."""

    # fmt: off
    blinks_per_min: Annotated[float, Bounds(0, 60), "spontaneous blinks at rest; 0: never"] = 17.0
    conversation_per_min: Annotated[float, Bounds(0, 60), "spontaneous blinks in conversation; 0: never"] = 26.0
    interval_distribution: Annotated[Literal["lognormal", "exponential", "fixed"],
        "distribution of the intervals between blinks; all three have the same mean, fixed has no spread"] = "lognormal"
    interval_cv: Annotated[float, Bounds(0.05, 3), "coefficient of variation (standard deviation over mean) of log-normal intervals"] = 0.8
    min_interval_ms: Annotated[float, Bounds(400, 10000), "shortest pause between a blink and the next spontaneous one"] = 1000.0
    double_share: Annotated[float, Bounds(0, 1), "share of blinks that are followed by a second one immediately"] = 0.0
    double_gap_ms: Annotated[float, Bounds(0, 500), "pause between the two blinks of a double blink"] = 100.0
    incomplete_share: Annotated[float, Bounds(0, 1), "share of blinks that do not shut the lid; people: half"] = 0.5
    incomplete_least: Annotated[float, Bounds(0.3, 0.95),
        "smallest closure of such a blink; the largest is 0.95, and most are nearly that deep"] = 0.6
    close_ms: Annotated[float, Bounds(30, 500), "duration of closing in a blink"] = 75.0
    hold_ms: Annotated[float, Bounds(0, 1000), "time that the lid stays shut in a blink"] = 35.0
    open_ms: Annotated[float, Bounds(50, 1500), "duration of opening in a blink"] = 175.0
    duration_spread: Annotated[float, Bounds(0, 1),
        "standard deviation of the logarithm of a blink's closing, shut and opening time, each drawn separately; 0: all equal"] = 0.2
    asymmetry: Annotated[float, Bounds(0, 0.5),
        "standard deviation of the relative difference between both eyes' lids in a blink: of the opening time, and of the depth of an "
        "incomplete one; 0: both equal"] = 0.06
    eye_down_deg: Annotated[float, Bounds(0, 10), "turn of the eyes downwards and back in a complete blink; people: 1 to 5; 0: none"] = 1.3
    eye_nasal_deg: Annotated[float, Bounds(0, 10), "turn of the eyes towards the nose in a complete blink"] = 0.7
    wink_hold_ms: Annotated[float, Bounds(0, 3000), "time that the lid stays shut in a wink"] = 200.0
    rest_opening: Annotated[float, Bounds(0.1, 1), "opening of the upper lids with level gaze, 0 shut to 1 open"] = 0.75
    follow_per_deg: Annotated[float, Bounds(0, 0.1),
        "decrease of the opening per degree that the gaze goes down; the inverse of the lid's travel in degrees makes it follow the eye "
        "exactly"] = 0.0222
    follow_up_share: Annotated[float, Bounds(0, 1.5), "factor on follow_per_deg above level gaze"] = 0.85
    lower_rest_opening: Annotated[float, Bounds(0.1, 1), "opening of the lower lids with level gaze, 0 shut to 1 open"] = 0.8
    lower_follow_per_deg: Annotated[float, Bounds(0, 0.1),
        "decrease of the lower lids' opening per degree that the gaze goes up; they open as it goes down"] = 0.008
    lower_close_share: Annotated[float, Bounds(0, 1),
        "share of its travel that a lower lid closes in a blink; 1: it meets the upper lid"] = 1.0
    gaze_evoked_blink_middle_deg: Annotated[float, Bounds(1, 180),
        "size of a gaze shift that evokes a blink in half of the cases"] = 17.0
    gaze_evoked_blink_steepness_1_deg: Annotated[float, Bounds(0, 5),
        "steepness of that probability; larger: closer to a fixed threshold"] = 0.217
    gaze_evoked_blink_least_deg: Annotated[float, Bounds(0, 180), "size of a gaze shift up to which it evokes no blink"] = 6.0
    gaze_evoked_blink_jitter_ms: Annotated[float, Bounds(0, 500),
        "standard deviation of the time from the onset of the gaze shift to that of its blink, which may precede it; at most twice "
        "that; 0: both begin together"] = 30.0
    gaze_evoked_blink_replaces: Annotated[bool,
        "a gaze-evoked blink replaces the next spontaneous one, so that the rate is unchanged"] = True
    gaze_evoked_blink_pause_ms: Annotated[float, Bounds(0, 10000),
        "shortest time from the onset of a blink to one evoked by a gaze shift"] = 600.0
    gaze_evoked_blink_literal: Annotated[bool, "blink with every shift beyond gaze_evoked_blink_literal_deg instead of at random"] = False
    gaze_evoked_blink_literal_deg: Annotated[float, Bounds(0, 180), "size of a large saccade, as in Nakamoto & Tsuruno 3.6"] = 20.0
    sleepy_level: Annotated[float, Bounds(0, 1), "sleepiness at the start, 0 awake to 1"] = 0.0
    sleepy_droop: Annotated[float, Bounds(0, 1), "share by which full sleepiness reduces the upper lids' opening"] = 0.65
    lower_sleepy_rise: Annotated[float, Bounds(0, 1), "share by which full sleepiness reduces the lower lids' opening"] = 0.1
    sleepy_slowness: Annotated[float, Bounds(0, 5), "relative increase of a blink's duration at full sleepiness"] = 2.0
    # fmt: on
