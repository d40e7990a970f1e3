"""Several people: the gaze is on who speaks, over whole turns, stays differ, no one is left out.

The person looked at is the one listened to in 88 % of the time, and the one spoken to in 77 %
(Vertegaal et al. 2001). Listeners turn to the next speaker about when the turn begins (Holler &
Kendrick 2015). All of a turn counts, with its beginning, and with speakers out of view.
"""

from itertools import pairwise

import numpy as np
from human.measured_run import Figures, MeasuredRun, Runs
from human.row_45_talk import faces_deg
from human.spells import apart_deg, spells

from gazerig.robot.run.surroundings import load_scene

SCENES = {
    "three-people": ("left_one", "middle_one", "right_one"),
    "table": ("left_one", "right_one"),
    "interview": ("visitor",),
}
"""Shipped scenes with speech, and their people; those of the first speak to each other and to the
head, which has conversations in the others."""

WANTED = {
    **{f"{scene}: on the speaker, % of whole turns": (75.0, 100.0) for scene in SCENES},
    "own speech at a table: on the addressee, % of the time on faces": (75.0, 100.0),
    "from the beginning of a turn to its speaker, median s": (0.0, 0.4),
    "stays, SD over mean": (0.7, 2.0),
    "stays above 4 s, %": (5.0, 35.0),
    "longest stay, s": (5.0, 20.0),
    "least looked at, % of the time on faces": (5.0, 34.0),
}
_FACE_M, _SHORTEST_S, _NEVER_S = 0.15, 0.1, 9.9


def measure(runs: Runs) -> Figures:
    """Return the figures over all seeds."""
    # Two rounds, as long stays are rare.
    found = {name: runs(name, least_s=128.0) for name in SCENES}
    on, delays = dict[str, float](), list[float]()
    for name, each in found.items():
        speakers = [_speaker(one, name) for one in each]
        seen = [
            looked_at(one)[who >= 0] == who[who >= 0]
            for one, who in zip(each, speakers, strict=True)
        ]
        on[f"{name}: on the speaker, % of whole turns"] = 100.0 * np.concatenate(seen).mean()
        if len(SCENES[name]) > 1:
            delays += [
                d for one, who in zip(each, speakers, strict=True) for d in _delays(one, who)
            ]
    several = [looked_at(one) for one in found["three-people"]]
    stays = np.array(
        [
            s
            for one, who in zip(found["three-people"], several, strict=True)
            for s in _stays(one, who)
        ]
    )
    counts = np.sum([np.bincount(who[who >= 0], minlength=3) for who in several], axis=0)
    return on | {
        "own speech at a table: on the addressee, % of the time on faces": 100.0
        * np.concatenate([_on_addressee(one) for one in found["table"]]).mean(),
        "from the beginning of a turn to its speaker, median s": np.median(delays),
        "the same, of turns with the gaze elsewhere": np.median([d for d in delays if d]),
        "stays, SD over mean": (stays.std() / stays.mean()),
        "stays above 4 s, %": 100.0 * (stays > 4.0).mean(),
        "longest stay, s": stays.max(),
        "least looked at, % of the time on faces": 100.0 * (counts.min() / counts.sum()),
    }


def looked_at(one: MeasuredRun) -> np.ndarray:
    """Return (n,) the number of the person whose face the measured gaze is on, -1 for none."""
    places = np.stack([one.truth[name] for name in sorted(one.truth) if "face" in name])
    far_m, ways = np.linalg.norm(places - one.head_m, axis=2), faces_deg(one)
    off = apart_deg(ways, one.gaze_deg) / np.degrees(np.arctan(_FACE_M / far_m))
    off = np.where(np.isnan(off), np.inf, off)
    who = np.where(off.min(axis=0) < 1.0, off.argmin(axis=0), -1)
    for number in range(len(places)):
        for begin, end in spells(who == number):
            if one.t_s[end - 1] - one.t_s[begin] < _SHORTEST_S:
                who[begin:end] = -1  # passed in a saccade
    return np.asarray(who)


def _speaker(one: MeasuredRun, name: str) -> np.ndarray:
    """Return (n,) who speaks, -1 for nobody."""
    scene = load_scene(name)
    speaker = np.full(len(one.t_s), -1)
    for tick in range(0, len(speaker), 10):
        for number, person in enumerate(scene.people(float(one.clock_s[tick]))):
            if person.speaks:
                speaker[tick : tick + 10] = number
    return speaker


def _on_addressee(one: MeasuredRun) -> np.ndarray:
    """Return whether the gaze is on who is spoken to, while it is on a face at all."""
    scene, who, names = load_scene("table"), looked_at(one), SCENES["table"]
    spoken = [(act.at_s, names.index(act.person)) for act in scene.agent if act.person]
    at = np.searchsorted([s for s, _ in spoken], one.clock_s % scene.round_s, side="right") - 1
    here = (one.turn == "speaking") & (who >= 0)
    return np.asarray((who == np.array([number for _, number in spoken])[at])[here])


def _delays(one: MeasuredRun, speaker: np.ndarray) -> list[float]:
    """Return the times from the beginning of each turn to the gaze on its speaker."""
    who, found = looked_at(one), []
    edges = [0, *(np.flatnonzero(np.diff(speaker)) + 1).tolist(), len(speaker)]
    for begin, end in pairwise(edges):
        if speaker[begin] >= 0:
            there = np.flatnonzero(who[begin:end] == speaker[begin])
            found.append(
                float(one.t_s[begin + there[0]] - one.t_s[begin]) if len(there) else _NEVER_S
            )
    return found


def _stays(one: MeasuredRun, who: np.ndarray) -> list[float]:
    """Return the lengths of complete stays with one person; looks away do not end them."""
    kept = np.flatnonzero(who >= 0)
    edges = np.flatnonzero(np.diff(who[kept])) + 1
    return [float(one.t_s[kept[b]] - one.t_s[kept[a]]) for a, b in pairwise(edges.tolist())]
