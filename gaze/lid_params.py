"""Parameters of the lids, with the sources of their values.

Rates are those of Bentivoglio 1997: 17 a minute at rest, 26 in conversation, with
log-normal intervals. Closing is about twice as fast as opening (VanderWerf 2003; Kwon
2013). Large gaze shifts bring a blink with them (Evinger 1994: 97 % of those beyond
33 deg), once for each shift. Upper lids follow the gaze with a gain of about 1 (Becker &
Fuchs 1988), lower lids the same way by a quarter of that (Leite 2006: 2.2 mm and 9.1 mm in
the same saccades of people of 20 to 30; a third at 60 and more), up and down alike.

People's lower lids hardly rise in a blink, they move towards the nose (Doane 1980), and the
upper lid comes down to them. A mechanism cannot do as they do: the shut points of its lids
are calibrated where upper and lower meet, half way perhaps, so a lower lid that stays leaves
a gap. Therefore ``lower_close_share`` is 1. Calibrated the other way, with the upper lid's
shut point at the edge of a resting lower lid, a rig may blink as people do: share 0 to 0.2.

What sleepiness does to the lower lid nobody seems to have measured; the muscle that lifts it
tires with the others, so it rises by little.
"""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class LidParams:
    """Rates, shapes and what the lids do at rest; lids without a name are the upper ones."""

    blinks_per_min: float = field(
        default=17.0,
        metadata={
            "low": 0.0,
            "high": 60.0,
            "unit": "1/min",
            "says": "spontaneous blinks at rest; 0 is never",
        },
    )
    conversation_per_min: float = field(
        default=26.0,
        metadata={
            "low": 0.0,
            "high": 60.0,
            "unit": "1/min",
            "says": "spontaneous blinks in conversation; 0 is never",
        },
    )
    interval_law: str = field(
        default="lognormal",
        metadata={
            "choices": ("lognormal", "exponential", "fixed"),
            "unit": "",
            "says": "law of the intervals; all three keep the mean, fixed has no spread",
        },
    )
    interval_cv: float = field(
        default=0.8,
        metadata={
            "low": 0.05,
            "high": 3.0,
            "unit": "",
            "says": "spread of log-normal intervals: standard deviation over mean",
        },
    )
    shortest_interval_ms: float = field(
        default=1000.0,
        metadata={
            "low": 400.0,
            "high": 10000.0,
            "unit": "ms",
            "says": "pause after a blink before a spontaneous one",
        },
    )
    double_share: float = field(
        default=0.0,
        metadata={
            "low": 0.0,
            "high": 1.0,
            "unit": "",
            "says": "share of blinks with a second one right after them",
        },
    )
    double_gap_ms: float = field(
        default=100.0,
        metadata={"low": 0.0, "high": 500.0, "unit": "ms", "says": "pause between those two"},
    )
    incomplete_share: float = field(
        default=0.12,
        metadata={
            "low": 0.0,
            "high": 1.0,
            "unit": "",
            "says": "share of blinks that shut the lid by 0.70 to 0.85 only",
        },
    )
    close_ms: float = field(
        default=75.0,
        metadata={"low": 30.0, "high": 500.0, "unit": "ms", "says": "time of closing"},
    )
    hold_ms: float = field(
        default=35.0,
        metadata={"low": 0.0, "high": 1000.0, "unit": "ms", "says": "time shut"},
    )
    open_ms: float = field(
        default=175.0,
        metadata={"low": 50.0, "high": 1500.0, "unit": "ms", "says": "time of opening"},
    )
    wink_hold_ms: float = field(
        default=200.0,
        metadata={"low": 0.0, "high": 3000.0, "unit": "ms", "says": "time shut in a wink"},
    )
    rest_opening: float = field(
        default=0.75,
        metadata={"low": 0.1, "high": 1.0, "unit": "", "says": "opening with level gaze"},
    )
    follow_per_deg: float = field(
        default=0.0222,
        metadata={
            "low": 0.0,
            "high": 0.1,
            "unit": "1/deg",
            "says": "change of the opening as the gaze sinks; gain 1 is one over the lid's travel",
        },
    )
    follow_up_share: float = field(
        default=0.85,
        metadata={
            "low": 0.0,
            "high": 1.5,
            "unit": "",
            "says": "the same above level gaze, in parts of the change below it",
        },
    )
    lower_rest_opening: float = field(
        default=0.8,
        metadata={
            "low": 0.1,
            "high": 1.0,
            "unit": "",
            "says": "opening of the lower lids with level gaze",
        },
    )
    lower_follow_per_deg: float = field(
        default=0.008,
        metadata={
            "low": 0.0,
            "high": 0.1,
            "unit": "1/deg",
            "says": "shutting of the lower lids as the gaze rises, opening as it sinks",
        },
    )
    lower_close_share: float = field(
        default=1.0,
        metadata={
            "low": 0.0,
            "high": 1.0,
            "unit": "",
            "says": "part of its way that a lower lid goes in a blink; 1 meets the upper lid",
        },
    )
    evoked_middle_deg: float = field(
        default=17.0,
        metadata={
            "low": 1.0,
            "high": 180.0,
            "unit": "deg",
            "says": "gaze shift that brings a blink every second time",
        },
    )
    evoked_steepness_1_deg: float = field(
        default=0.217,
        metadata={"low": 0.0, "high": 5.0, "unit": "1/deg", "says": "slope of that probability"},
    )
    evoked_pause_ms: float = field(
        default=600.0,
        metadata={
            "low": 0.0,
            "high": 10000.0,
            "unit": "ms",
            "says": "from the onset of a blink to the next that a gaze shift may bring",
        },
    )
    evoked_literal: bool = field(
        default=False,
        metadata={
            "unit": "",
            "says": "a blink with every shift beyond evoked_literal_deg instead of the dice",
        },
    )
    evoked_literal_deg: float = field(
        default=20.0,
        metadata={
            "low": 0.0,
            "high": 180.0,
            "unit": "deg",
            "says": "a large saccade of Nakamoto & Tsuruno 3.6",
        },
    )
    sleepy_level: float = field(
        default=0.0,
        metadata={"low": 0.0, "high": 1.0, "unit": "", "says": "sleepiness at the start"},
    )
    sleepy_droop: float = field(
        default=0.65,
        metadata={
            "low": 0.0,
            "high": 1.0,
            "unit": "",
            "says": "part of the opening that full sleepiness takes away",
        },
    )
    lower_sleepy_rise: float = field(
        default=0.1,
        metadata={
            "low": 0.0,
            "high": 1.0,
            "unit": "",
            "says": "part of a lower lid's opening that full sleepiness takes away",
        },
    )
    sleepy_slowness: float = field(
        default=2.0,
        metadata={
            "low": 0.0,
            "high": 5.0,
            "unit": "",
            "says": "full sleepiness makes a blink this many times its length longer",
        },
    )
