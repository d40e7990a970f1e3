"""Published curves and tables of people, and measures with the range of people.

The ranges are published means with their spread, not targets. If a model of this robot differs on
purpose, a note explains it; the verdict stays the same.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gazerig.gaze.types import Floats

BAHILL_DEG_S, BALOH_DEG_S, ROUND_DEG = 551.0, 420.0, 14.0
"""Peak speed V (1 - exp(-A / 14 deg)): Bahill et al. 1975 and Baloh et al. 1975."""

COLLEWIJN_DEG_S, COLLEWIJN_ROUND_DEG = 502.0, 11.0
"""Saturation beyond 40 deg (Collewijn et al. 1988: 502 +- 32), and its amplitude scale."""

STAHL_FREE_DEG, STAHL_FREE_SD_DEG = 17.9, 16.0
"""Half of the range of 35.8 +- 31.9 deg that people cover with the eyes alone (Stahl 1999)."""

STAHL_SLOPE, STAHL_SLOPE_SD = 0.77, 0.16
"""Head movement per degree beyond that range (Stahl 1999)."""

CONE_DEG = 5.2
"""Diameter of the cone in which a gaze appears direct (Horstmann & Linke 2021)."""

# Nakamoto & Tsuruno, eq 1 as printed: rows from, columns to, in the order of PARTS.
_PRINTED = (
    (0.2, 0.2, 0.0, 0.4, 0.0, 0.1, 0.0, 0.0),
    (0.1, 0.4, 0.0, 0.2, 0.0, 0.0, 0.1, 0.0),
    (0.0, 0.1, 0.4, 0.0, 0.3, 0.1, 0.2, 0.0),
    (0.3, 0.0, 0.1, 0.3, 0.3, 0.0, 0.1, 0.0),
    (0.0, 0.0, 0.1, 0.1, 0.4, 0.0, 0.3, 0.0),
    (0.1, 0.0, 0.0, 0.0, 0.1, 0.3, 0.4, 0.1),
    (0.0, 0.0, 0.1, 0.0, 0.2, 0.2, 0.3, 0.2),
    (0.0, 0.2, 0.0, 0.0, 0.1, 0.0, 0.3, 0.3),
)
DWELL_MEAN_S = (0.19, 0.24, 0.11, 0.19, 0.16, 0.20, 0.20, 0.11)
"""Nakamoto & Tsuruno, table 1, in the order of PARTS."""
DWELL_SD_S = (0.35, 0.25, 0.14, 0.22, 0.30, 0.30, 0.38, 0.15)


def transition_matrix() -> Floats:
    """Return Nakamoto & Tsuruno's eq 1 with every row summing to 1, (8, 8), rows from."""
    printed = np.array(_PRINTED)
    out: Floats = printed / printed.sum(axis=1, keepdims=True)
    return out


def visit_matrix(steps: Floats) -> Floats:
    """Return the Markov chain of visits for a chain of steps, without self-transitions, (n, n)."""
    away = steps * (1.0 - np.eye(len(steps)))
    total = away.sum(axis=1, keepdims=True)
    out: Floats = np.divide(away, total, out=np.zeros_like(away), where=total > 0.0)
    return out


def stationary_shares(steps: Floats) -> Floats:
    """Return the share of steps that a chain spends in each of its states, (n,)."""
    values, vectors = np.linalg.eig(steps.T)
    share = np.real(vectors[:, np.argmin(np.abs(values - 1.0))])
    out: Floats = share / share.sum()
    return out


def time_share(steps: Floats, dwell_s: ArrayLike) -> Floats:
    """Return the share of time in each state if a step in it lasts ``dwell_s``, (n,)."""
    time = stationary_shares(steps) * np.asarray(dwell_s)
    out: Floats = time / time.sum()
    return out


def mean_visit_s(steps: Floats, dwell_s: ArrayLike) -> Floats:
    """Return the mean duration of a visit, with its refixations merged, (n,)."""
    out: Floats = np.asarray(dwell_s) / (1.0 - np.diag(steps))
    return out


def lowest_peak_deg_s(amplitude_deg: ArrayLike) -> Floats:
    """Return the lower limit of human peak speeds: Baloh's curve minus 15 % for people's spread."""
    a = np.asarray(amplitude_deg, dtype=float)
    out: Floats = 0.85 * BALOH_DEG_S * (1.0 - np.exp(-a / ROUND_DEG))
    return out


def highest_peak_deg_s(amplitude_deg: ArrayLike) -> Floats:
    """Return the upper limit: the higher of Bahill's and Collewijn's curves plus 15 %."""
    a = np.asarray(amplitude_deg, dtype=float)
    bahill = BAHILL_DEG_S * (1.0 - np.exp(-a / ROUND_DEG))
    collewijn = COLLEWIJN_DEG_S * (1.0 - np.exp(-a / COLLEWIJN_ROUND_DEG))
    out: Floats = 1.15 * np.maximum(bahill, collewijn)
    return out


def shortest_duration_ms(amplitude_deg: ArrayLike) -> Floats:
    """Return the lower limit of human durations, 21 ms + 2.2 ms per degree, minus a quarter."""
    out: Floats = 0.75 * (21.0 + 2.2 * np.asarray(amplitude_deg, dtype=float))
    return out


def longest_duration_ms(amplitude_deg: ArrayLike) -> Floats:
    """Return the upper limit of human durations.

    This is the higher of 25 ms + 2.4 ms per degree (Lee, Badler & Badler 2002) plus a quarter, and
    the mean of Baloh et al. 1975, 37 ms + 2.7 ms per degree.
    """
    a = np.asarray(amplitude_deg, dtype=float)
    out: Floats = np.maximum(1.25 * (25.0 + 2.4 * a), 37.0 + 2.7 * a)
    return out


def acceleration_share(amplitude_deg: ArrayLike) -> Floats:
    """Return the share of acceleration: .45 up to 10 deg, .20 from 50 (Collewijn et al. 1988)."""
    over = (np.asarray(amplitude_deg, dtype=float) - 10.0) / 40.0
    out: Floats = 0.45 - 0.25 * np.clip(over, 0.0, 1.0)
    return out


def mean_head_deg(eccentricity_deg: ArrayLike) -> Floats:
    """Return the mean head movement for a gaze shift (Stahl 1999)."""
    beyond = np.abs(np.asarray(eccentricity_deg, dtype=float)) - STAHL_FREE_DEG
    out: Floats = STAHL_SLOPE * np.maximum(0.0, beyond)
    return out


def evoked_blink_probability(amplitude_deg: ArrayLike) -> Floats:
    """Return a blink's probability with a gaze shift: .5 at 17, .97 at 33 deg (Evinger 1994)."""
    a = np.asarray(amplitude_deg, dtype=float)
    out: Floats = 1.0 / (1.0 + np.exp(-0.217 * (a - 17.0)))
    return out


class NormBand(NamedTuple):
    """One measure and its range of people.

    key, group: name in code, and section
    low, high: the range; least: fewest events that allow a verdict
    source: publication of the measurement
    mode: only mode of conversation in which it applies, "" for all
    notes: (style, text) pairs shown if the run has that style, e.g. "saccade min_jerk"
    """

    key: str
    group: str
    title: str
    unit: str
    low: float
    high: float
    min_events: int
    source: str
    mode: str = ""
    notes: tuple[tuple[str, str], ...] = ()


SACCADES, FACE, HEAD, FOLLOWING, LIDS, SOCIAL = (
    "Saccades", "On the face", "Eyes and head", "Following", "Lids", "Social gaze",
)  # fmt: skip
GROUPS = (SACCADES, FACE, HEAD, FOLLOWING, LIDS, SOCIAL)

_MIN_JERK = (
    "saccade min_jerk",
    "by design: Mitake et al. eq 5 gives every saccade below 13.3 deg the same 50 ms, longer than "
    "people's below 12 deg and with up to half more speed between 8 and 20 deg",
)
_SYMMETRIC = (
    "saccade min_jerk",
    "by design: minimum jerk (Mitake et al. eqs 5 and 6) is symmetric, people's saccades are not",
)
_LITERAL = (
    "saccade literal_frame",
    "by design: 0.8 of the way in each frame (Nakamoto & Tsuruno 3.3) is over in two frames",
)
_FLOOR = (
    "scanpath markov",
    "the model holds no look shorter than its floor of .14 s, which "
    "lengthens the shortest ones of table 1",
)
_NO_WALK = (
    "scanpath random",
    "by design: random angles are the baseline that Nakamoto & Tsuruno 4.4.4 compare with",
)
_ONE_POINT = (
    "scanpath face_tracking",
    "by design: the face is looked at as one point (Nakamoto & Tsuruno 4.4.3)",
)
PARALLEL = "eyes parallel"
"""Style of a run in which one linkage turns both eyes sideways."""

_PARALLEL = (
    PARALLEL,
    "by build: one linkage turns both eyes sideways, so that each passes the point that they are "
    "on by half their distance from each other",
)
_STARES = (
    "conversation none",
    "no conversation was on: with gaze.looks_away none the gaze then leaves a face only "
    "for something that pulls more; set it to people, or choose talk or listen for looks away",
)

BANDS: tuple[NormBand, ...] = (
    NormBand("peak_small", SACCADES, "peak speed inside the human band, 1 to 8 deg", "share",
         0.75, 1.0, 30, "Bahill et al. 1975; Baloh et al. 1975: curves 420 and 551 deg/s "
         "(1 - exp(-A/14)), 15 % between people", "", (_MIN_JERK, _LITERAL)),
    NormBand("peak_large", SACCADES, "peak speed inside the human band, 8 deg and more", "share",
         0.75, 1.0, 15, "the same; Collewijn et al. 1988: saturates at 502 +- 32 deg/s", "",
         (_MIN_JERK, _LITERAL)),
    NormBand("duration_small", SACCADES, "duration inside the human band, 1 to 12 deg", "share",
         0.75, 1.0, 30, "21 ms + 2.2 ms/deg to 25 ms + 2.4 ms/deg (Lee, Badler & Badler 2002) "
         "+- 25 %, or up to 37 ms + 2.7 ms/deg (Baloh et al. 1975)", "", (_MIN_JERK, _LITERAL)),
    NormBand("duration_large", SACCADES, "duration inside the human band, 12 deg and more", "share",
         0.75, 1.0, 15, "the same; Baloh et al. 1975: 2 to 2.7 ms a degree", "", (_LITERAL,)),
    NormBand("skew", SACCADES, "time of the peak against people's, median difference", "",
         -0.08, 0.08, 30, "Collewijn et al. 1988: acceleration takes .45 of a small saccade, .20 "
         "beyond 50 deg", "", (_SYMMETRIC, _LITERAL)),
    NormBand("below_15", SACCADES, "saccades smaller than 15 deg", "share", 0.75, 1.0, 30,
         "Malinov et al. 2000: 83 %; 90 % in conversation", "", (_NO_WALK,)),
    NormBand("rate", SACCADES, "saccades a second", "1/s", 1.5, 4.0, 30,
         "2 to 3 fixations a second, up to 4 (Ruhland et al. 2015)", "", (_NO_WALK, _ONE_POINT)),
    NormBand("too_soon", SACCADES, "saccades less than 100 ms after another", "share", 0.0, 0.1, 30,
         "150 ms between saccades, 50 to 100 at the least (Lee, Badler & Badler 2002)"),
    NormBand("unasked", SACCADES, "saccades that no model asked for: servos that swing", "share",
         0.0, 0.1, 30, "people land within half a degree, whatever the size (Collewijn et al. "
         "1988)"),
    NormBand("rest_error", SACCADES, "gaze off its target between saccades, median", "deg", 0.0, 1.0,
         30, "people notice 1 to 2 deg in which object is looked at; a direct gaze "
         "may be off by 2.6 deg (Horstmann & Linke 2021)", "", (_PARALLEL,)),
    NormBand("overshoot", SACCADES, "eyes beyond where they come to rest, 5 to 20 deg, median", "share",
         0.0, 0.05, 15, "Kapoula & Robinson 1986; Collewijn et al. 1988: short of the target rather "
         "than beyond it"),
    NormBand("landing", SACCADES, "share of the way that a saccade of 10 deg and more goes", "",
         0.88, 0.99, 12, "Becker 1989: 5 to 10 % short, whatever the direction"),
    NormBand("corrected", SACCADES, "of these, followed by another to the same target", "share",
         0.15, 0.6, 12, "Becker 1989: after 100 to 200 ms, a third and more"),
    NormBand("short_rests", SACCADES, "rests on a face below 150 ms", "share", 0.0, 0.08, 100,
         "Lee, Badler & Badler 2002: 150 ms between saccades; 2 to 3 fixations a second"),
    NormBand("rest_spike", SACCADES, "rests of one length beyond a smooth law, in 10 ms", "share",
         0.0, 0.03, 400, "lengths of fixations have a smooth distribution"),
    NormBand("refixations", SACCADES, "shifts of .4 to 1.5 deg on a face", "1/s", 0.1, 2.0, 30,
         "Otero-Millan et al. 2013: small saccades go on in looking about; 1 to 2 a second at rest, "
         "most of them below what servos can do"),
    NormBand("idle_rate", SACCADES, "saccades a second with no one there", "1/s", 1.0, 3.0, 15,
         "2 to 3 fixations a second in looking about, 1 to 2 at rest"),
    NormBand("on_parts", FACE, "share of the time meant for a face that is on a part of it", "share",
         0.8, 1.0, 30, "Nakamoto & Tsuruno 3.2.2 and figs 8 and 9: looks go to the parts", "",
         (_NO_WALK,)),
    NormBand("part_share", FACE, "time on each part: total difference from people's", "share",
         0.0, 0.15, 150, "Nakamoto & Tsuruno, eq 1 with table 1", "",
         (_FLOOR, _NO_WALK, _ONE_POINT)),
    NormBand("eyes_share", FACE, "share of the time on the two eyes", "share", 0.28, 0.6, 100,
         "Nakamoto & Tsuruno, eq 1 with table 1: .35; about .40 on photographs of faces",
         "", (_NO_WALK, _ONE_POINT)),
    NormBand("visit", FACE, "mean length of a visit to a part", "s", 0.20, 0.48, 60,
         "Nakamoto & Tsuruno, table 1: .17 to .48 s a part, .27 s together", "",
         (_FLOOR, _ONE_POINT)),
    NormBand("never_taken", FACE, "shifts that people were never seen to take", "share", 0.0, 0.05,
         60, "Nakamoto & Tsuruno, eq 1: 28 of its 64 cells are 0", "", (_NO_WALK,)),
    NormBand("transitions", FACE, "shifts between parts: mean difference of the rows", "share",
         0.0, 0.25, 150, "Nakamoto & Tsuruno, eq 1, normalised, without staying", "",
         (_NO_WALK, _ONE_POINT)),
    NormBand("heat", FACE, "heat map against the one expected of people, correlation", "",
         0.7, 1.0, 30, "Nakamoto & Tsuruno 4.3, figs 8 and 9", "", (_NO_WALK, _ONE_POINT)),
    NormBand("left_mm", FACE, "left pupil axis past the point looked at, median", "mm", 0.0, 18.0, 30,
         "1 deg at 1 m, the least that people notice; 2.6 deg pass for a direct gaze "
         "(Horstmann & Linke 2021)", "", (_PARALLEL,)),
    NormBand("right_mm", FACE, "right pupil axis past the point looked at, median", "mm", 0.0, 18.0,
         30, "the same", "", (_PARALLEL,)),
    NormBand("in_cone", FACE, "both axes inside the cone of direct gaze about that point", "share",
         0.9, 1.0, 30, "Horstmann & Linke 2021: 5.2 deg across, the same from 1.6 to 7.9 m", "",
         (_PARALLEL,)),
    NormBand("vergence", FACE, "vergence off what the face's distance asks for, median", "deg",
         -1.0, 1.0, 30, "half of what passes for a direct gaze (Linke & Horstmann 2022)"),
    NormBand("vergence_ok", FACE, "vergence that passes for a direct gaze", "share", 0.9, 1.0, 30,
         "Linke & Horstmann 2022: -2.5 to +4.5 deg"),
    NormBand("head_slope", HEAD, "head movement for each degree beyond the eyes' own range", "",
         0.61, 0.93, 12, "Stahl 1999: .77 +- .16"),
    NormBand("head_share", HEAD, "head movement less people's mean, shifts of 20 deg and more", "deg",
         -12.3, 12.3, 12, "Stahl 1999: eyes alone cover 35.8 +- 31.9 deg; very individual"),
    NormBand("head_after", HEAD, "head's start after the eyes', median", "ms", -100.0, 140.0, 8,
         "20 to 50 ms after unforeseen targets (Mitake et al. 3.3.6: 20 ms), up to "
         "100 ms before foreseen ones, 139 ms after with small ones"),
    NormBand("head_peak", HEAD, "head's peak speed over (4/3 A/50 + .4) 60 deg/s, median", "",
         0.6, 1.6, 8, "everyday movements (Andrist et al. 2012; Pejsa et al. 2013)"),
    NormBand("head_roll", HEAD, "roll of the head while it looks aside, median", "deg", 0.5, 4.0, 12,
         "some degrees (Glenn & Vilis 1992: Donders' law of the head)"),
    NormBand("vor", HEAD, "gain of the reflex that holds the gaze while the head turns", "",
         0.85, 1.2, 8, "healthy people .85 to 1.2 in the head impulse test, mean .97"),
    NormBand("pursuit_gain", FOLLOWING, "gain of smooth following, 5 to 40 deg/s", "", 0.85, 1.05, 8,
         "Robinson et al. 1986: .95 from 5 to 30 deg/s"),
    NormBand("pursuit_lag", FOLLOWING, "gaze behind what it follows", "ms", -50.0, 160.0, 8,
         "Tavassoli & Ringach 2009; Robinson et al. 1986: 67 to 150 ms, none once learned "
         "(Bahill & McDonald 1983)"),
    NormBand("pursuit_most", FOLLOWING, "highest gain at any frequency, .08 to 1 Hz", "", 0.85, 1.05, 3,
         "gain does not exceed 1 (Robinson et al. 1986)"),
    NormBand("smooth_peak", FOLLOWING, "fastest smooth motion of the gaze", "deg/s", 0.0, 75.0, 8,
         "dots are followed at up to some 63 deg/s (Lee, Badler & Badler 2002 and others)"),
    NormBand("blink_rate", LIDS, "blinks a minute", "1/min", 8.0, 21.0, 8,
         "Doughty 2001, looking ahead; Bentivoglio et al. 1997: 17 at rest", "none"),
    NormBand("blink_rate_talk", LIDS, "blinks a minute in conversation", "1/min", 10.5, 32.5, 8,
         "Doughty 2001; Bentivoglio et al. 1997: 26", "talk listen think turns"),
    NormBand("blink_cv", LIDS, "intervals between blinks: deviation over mean", "", 0.5, 1.2, 20,
         "log-normal intervals (Bentivoglio et al. 1997)"),
    NormBand("blink_close", LIDS, "time of closing, median", "ms", 60.0, 100.0, 10,
         "VanderWerf et al. 2003: spontaneous 66 ms; Kwon et al. 2013: 76 ms"),
    NormBand("blink_hold", LIDS, "time shut, median", "ms", 20.0, 60.0, 10,
         "Kwon et al. 2013: 58 ms"),
    NormBand("blink_open", LIDS, "time of opening, median", "ms", 130.0, 250.0, 10,
         "VanderWerf et al. 2003; Trutoiu et al. 2011: 233 to 300 ms for the whole"),
    NormBand("blink_ratio", LIDS, "fastest closing over fastest opening, median", "", 1.5, 3.0, 10,
         "VanderWerf et al. 2003: closing about twice as fast"),
    NormBand("evoked", LIDS, "shifts of 33 deg and more that bring a blink", "share", 0.85, 1.0, 8,
         "Evinger et al. 1994: 97 %"),
    NormBand("blink_partial", LIDS, "blinks that do not shut the eye", "share", 0.3, 0.7, 15,
         "half of natural blinks (Trutoiu et al. 2011 and others)"),
    NormBand("blink_tied", LIDS, "blinks that begin in the very moment of a saccade", "share",
         0.0, 0.15, 15, "Evinger et al. 1994: with gaze shifts, some 40 ms before or after; 4 % by chance"),
    NormBand("bout_none", SOCIAL, "median look at a face without a conversation", "s", 1.5, 6.0, 10,
         "Binetti et al. 2016: 3.3 s is what people like; Rogers et al. 2018: 2.2 s", "none"),
    *(
        NormBand(f"{key}_{role}", SOCIAL, f"{title} in {text}", unit, low, high, least,
             f"Dembinsky et al. 2024, 19 people in remote talk: {people}")
        for role, text, values in (
            ("speaking", "long turns of speech", ((0.21, 0.52, ".45 [.21-.52]"),
             (8.6, 17.7, "13.5 [8.6-17.7]"), (0.6, 0.95, ".77, quartiles not known"))),
            ("listening", "long turns of the partner", ((0.01, 0.08, ".04 [.01-.08]"),
             (1.0, 5.4, "3.2 [1.0-5.4]"), (0.6, 0.95, ".75, quartiles not known"))),
            ("dialogue", "turns below 10 s", ((0.07, 0.28, ".14 [.07-.28]"),
             (4.4, 9.9, "6.6 [4.4-9.9]"), (0.6, 0.95, ".87, quartiles not known"))),
        )
        for (key, title, unit, least), (low, high, people) in zip((
            ("averted", "share of the time averted", "share", 6),
            ("aversions", "looks away a minute", "1/min", 6),
            ("aside", "looks away that go aside", "share", 12),
        ), values, strict=True)
    ),
    NormBand("turn_begins", SOCIAL, "long turns of speech that begin averted", "share", 0.7, 1.0, 8,
         "Kendon 1967: more than 70 %"),
    NormBand("turn_ends", SOCIAL, "long turns of speech that end on the face", "share", 0.7, 1.0, 8,
         "Kendon 1967: more than 70 %"),
    NormBand("turn_motion", SOCIAL, "from a reported state to the gaze's motion, 95 % below", "ms",
         0.0, 150.0, 5, "Saslow 1967: 200 ms after an event; a report is the head's own decision"),
    NormBand("turn_thinks", SOCIAL, "from thinking to a look away, 95 % below", "ms", 0.0, 500.0, 5,
         "Shiwa et al. 2008: an answer is preferred within 1 s, and a filler helps"),
    NormBand("turn_yields", SOCIAL, "from an interruption to the face, 95 % below", "ms", 0.0, 200.0,
         3, "Holler & Kendrick 2015: gaps between turns are some 200 ms"),
    NormBand("reaction", SOCIAL, "from coming into view to the gaze's start, median", "ms",
         150.0, 250.0, 8, "Saslow 1967: 200 ms, 150 with a gap, 250 with an overlap"),
    NormBand("express", SOCIAL, "such reactions in less than 120 ms", "share", 0.0, 0.05, 8,
         "Fischer & Ramsperger 1984: express saccades; rare without training"),
    NormBand("longest_look", SOCIAL, "longest look at a face", "s", 0.0, 15.0, 1,
         "longer is a stare: people do not (Lee, Badler & Badler 2002)", "", (_STARES,)),
    NormBand("mutual", SOCIAL, "mean time in which both faces are turned to each other", "s",
         1.0, 10.0, 5, "Rogers et al. 2018: 2.2 s; Binetti et al. 2016: 3.3 s is what people like; "
         "the person's own eyes are not seen, only the turn of the face", "", (_STARES,)),
)  # fmt: skip


BY_KEY = {band.key: band for band in BANDS}


def band_applies(band: NormBand, mode: str) -> bool:
    """Return whether a band applies in a mode of conversation."""
    return not band.mode or mode in band.mode.split()
