"""In turns of 3 to 9 s the gaze leaves the face as people's does, and the head takes part.

Rates, shares and spread of 19 people in remote talk (Dembinsky et al. 2024, quartiles; averted is
more than 6 deg from the face). A thinker looks up in 70 %, with .4 of it by the head (Andrist et
al. 2014); more than 70 % of long utterances begin averted (Kendon 1967). Measured gaze, all of the
time of each reported state; with two people, now and then another is answered than has spoken.
"""

from collections.abc import Iterator
from math import atan2, hypot, pi, sin

import numpy as np
from fakes.scenes import EmptyScene
from human.measured_run import Figures, MeasuredRun, Runs
from human.spells import apart_deg, spells
from human.swinging_face import HEAD_M
from scipy.signal import find_peaks

from gazerig.gaze.types import Vec3
from gazerig.sim_mock.scenes.scene import ScenePerson
from gazerig.sim_mock.scenes.script import AgentAct

_FIRST_S, _THINKS_S, _CYCLES = 2.0, 0.8, 60
_LEAST_S, _MOST_S, _CHARACTERS_PER_S = 3.0, 9.0, 15
_PLACES: dict[int, tuple[Vec3, ...]] = {
    1: ((1.15, 0.02, 0.24),),
    2: ((1.2, 0.30, 0.22), (1.25, -0.34, 0.26)),
}


class Talk(EmptyScene):
    """The head listens, thinks and speaks; people look at it, and speak while it listens.

    Two answers of three go to the person who has not spoken, if there are two, one of them without
    a thought. Half of the speeches have a text, half a planned length.
    """

    round_s = 3600.0

    def __init__(self, people: int, number: int) -> None:
        self.name, self._places = f"talk of {people}, {number}", _PLACES[people]
        rng, t_s, partner, acts = np.random.default_rng(number), _FIRST_S, 0, list[AgentAct]()
        for cycle in range(_CYCLES):
            hears_s, speaks_s = rng.uniform(_LEAST_S, _MOST_S, 2).tolist()
            answered = (partner + (cycle % 3 > 0)) % people
            acts.append(AgentAct(t_s, "listening", str(partner)))
            t_s += hears_s
            if people == 1 or cycle % 3 < 2:
                acts.append(AgentAct(t_s, "thinking", str(answered)))
                t_s += _THINKS_S
            text = "x" * round(_CHARACTERS_PER_S * speaks_s) if cycle % 2 else ""
            acts.append(AgentAct(t_s, "speaking", str(answered), None if text else speaks_s, text))
            t_s, partner = t_s + speaks_s, answered
        self.agent = tuple(acts)

    def face(self, name: str, t_s: float) -> Vec3:
        """Return a person's face."""
        x, y, z = self._places[int(name)]
        return x, y + 0.008 * sin(2.0 * pi * 0.17 * t_s + int(name)), z

    def partner(self, t_s: float, state: str = "") -> int:
        """Return the partner at a time, in a state or in any; -1 for none."""
        acts = [act for act in self.agent if act.at_s <= t_s]
        return int(acts[-1].person) if acts and state in ("", acts[-1].state) else -1

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return the people."""
        heard, found = self.partner(t_s, "listening"), []
        for number in range(len(self._places)):
            face = self.face(str(number), t_s)
            x, y, z = (a - b for a, b in zip(HEAD_M, face, strict=True))
            way = atan2(y, x), atan2(z, hypot(x, y))
            found.append(ScenePerson(face, way, None, number == heard))
        return tuple(found)


_ROLES = {"speaking": ((8.6, 17.7), (0.21, 0.52)), "listening": ((1.0, 5.4), (0.01, 0.08))}
_PEOPLE = {1: "one person", 2: "two people"}
WANTED = {
    **{
        f"{who}, {role}: {figure}": band
        for who in _PEOPLE.values()
        for role, bands in _ROLES.items()
        for figure, band in zip(("looks away a minute", "share averted"), bands, strict=True)
    },
    "speaking: SD of the gaze aside, deg": (6.5, 12.0),
    "speaking: SD of the gaze up and down, deg": (3.5, 7.5),
    "saccades a second in looks away above .8 s": (1.5, 5.0),
    "thinking looks that go up, share": (0.55, 0.85),
    "head's share of speakers' and thinkers' looks away": (0.25, 0.55),
    "thoughts of an answer to another: looks away lost": (0.0, 0.0),
    "speech to another that begins averted, share": (0.7, 1.0),
    "speed of the head, speaking over listening": (2.0, 10.0),
    "listening: nods a minute": (0.5, 20.0),
}

_AVERTED_DEG, _SHORTEST_S, _LONG_S = 6.0, 0.15, 0.8
_BEFORE_S, _SOON_S, _THOUGHT_S, _SPEED_OVER_S = 0.15, 1.0, 1.2, 0.1
_KEPT_S = 0.3
"""The gaze is between two faces for less on its way."""
_NOD_DEG, _NOD_S, _TOGETHER_S = 0.7, 0.4, 1.0


def measure(runs: Runs) -> Figures:
    """Return the figures over all seeds."""
    figures: Figures = {}
    talks = {n: [Talk(n, seed) for seed in runs.seeds] for n in _PEOPLE}
    seen = {n: [runs.one(scene, k) for k, scene in enumerate(talks[n])] for n in _PEOPLE}
    for people, who in _PEOPLE.items():
        for role in _ROLES:
            counts, away_s, all_s = np.sum([_looks(one, role) for one in seen[people]], axis=0)
            figures[f"{who}, {role}: looks away a minute"] = 60.0 * counts / all_s
            figures[f"{who}, {role}: share averted"] = away_s / all_s
    every = [one for each in seen.values() for one in each]
    off = [(one.gaze_deg - one.truth_deg("face 0"))[one.turn == "speaking"] for one in seen[1]]
    aside, up = np.mean([each.std(axis=0) for each in off], axis=0)
    inside = np.sum([_saccades_inside(one) for one in every], axis=0)
    ways = np.array([way for one in every for way in _thoughts(one)])
    # Of two people the head also turns to the other one meanwhile.
    gaze, head = np.concatenate([_shifts(one) for one in seen[1]]).transpose(1, 0, 2)
    others = [
        found
        for scene, one in zip(talks[2], seen[2], strict=True)
        for found in _answers_to_another(scene, one)
    ]
    speeds = {role: np.concatenate([_head_speed(one, role) for one in every]) for role in _ROLES}
    return figures | {
        "speaking: SD of the gaze aside, deg": aside,
        "speaking: SD of the gaze up and down, deg": up,
        "saccades a second in looks away above .8 s": inside[0] / inside[1],
        "thinking looks that go up, share": (ways[:, 1] > np.abs(ways[:, 0])).mean(),
        "head's share of speakers' and thinkers' looks away": (gaze * head).sum()
        / (gaze * gaze).sum(),
        "thoughts of an answer to another: looks away lost": sum(
            not averted for state, averted in others if state == "thinking"
        ),
        "answers to another": len(others),
        "speech to another that begins averted, share": np.mean(
            [averted for state, averted in others if state == "speaking"]
        ),
        "speed of the head, speaking over listening": speeds["speaking"].mean()
        / speeds["listening"].mean(),
        "speed of the head, listening, deg/s": speeds["listening"].mean(),
        "listening: nods a minute": sum(_nods(one) for one in every)
        / sum(_seconds(one, one.turn == "listening") / 60.0 for one in every),
    }


def averted(one: MeasuredRun) -> np.ndarray:
    """Return (n,) whether the gaze is off all faces."""
    off = [apart_deg(one.gaze_deg, each) for each in faces_deg(one)]
    return np.asarray(np.min(off, axis=0) > _AVERTED_DEG)


def faces_deg(one: MeasuredRun) -> np.ndarray:
    """Return (people, n, 2) the directions of the faces in the order of their numbers."""
    return np.stack([one.truth_deg(name) for name in sorted(one.truth) if "face" in name])


def _seconds(one: MeasuredRun, state: np.ndarray) -> float:
    return float(state.sum() * np.median(np.diff(one.t_s)))


def lasting(one: MeasuredRun, state: np.ndarray, least_s: float) -> list[tuple[int, int]]:
    """Return the spells of a state that last so long."""
    ends = np.append(one.t_s, one.t_s[-1])
    return [(a, b) for a, b in spells(state) if ends[b] - ends[a] >= least_s]


def _looks(one: MeasuredRun, role: str) -> tuple[float, float, float]:
    """Return the number of looks away in a role, their time and the role's, s."""
    away, here = averted(one), one.turn == role
    looks = lasting(one, away & here, _SHORTEST_S)
    return len(looks), _seconds(one, away & here), _seconds(one, here)


def _saccades_inside(one: MeasuredRun) -> tuple[int, float]:
    """Return the number of saccades within long looks away, and the time of these, s."""
    looks = lasting(one, averted(one) & (one.turn != "idle"), _LONG_S)
    spans = [(one.clock_s[a], one.clock_s[b - 1]) for a, b in looks]
    count = sum(a < s.onset_s and s.end_s < b for s in one.trace.saccades for a, b in spans)
    return count, sum(b - a for a, b in spans)


def _thoughts(one: MeasuredRun) -> Iterator[np.ndarray]:
    """Yield the way of each look away that belongs to a thought, from the nearest face."""
    away = averted(one)
    for begin, _ in spells(one.turn == "thinking"):
        end = int(np.searchsorted(one.t_s, one.t_s[begin] + _THOUGHT_S))
        faces = faces_deg(one)[:, begin]
        looks = lasting(one, away[begin:end], _SHORTEST_S)
        if looks:
            place = np.median(one.gaze_deg[begin:end][slice(*looks[-1])], axis=0)
            yield place - faces[apart_deg(faces, place).argmin()]


def _shifts(one: MeasuredRun) -> np.ndarray:
    """Return (n, 2, 2) the gaze's and the head's way in the long looks of the head's own turns."""
    away = averted(one) & np.isin(one.turn, ("speaking", "thinking"))
    rows = []
    for begin, end in lasting(one, away, _LONG_S):
        before = int(np.searchsorted(one.t_s, one.t_s[begin] - _BEFORE_S))
        gaze = np.median(one.gaze_deg[begin:end], axis=0) - one.gaze_deg[before]
        rows.append((gaze, one.head_deg[end - 1, :2] - one.head_deg[before, :2]))
    return np.array(rows).reshape(-1, 2, 2)


def _answers_to_another(scene: Talk, one: MeasuredRun) -> Iterator[tuple[str, bool]]:
    """Yield state and success of what begins, with a look away, towards another than looked at."""
    away, states = averted(one), np.isin(one.turn, ("thinking", "speaking"))
    looked_at = apart_deg(faces_deg(one), one.gaze_deg).argmin(axis=0)
    for begin, _ in spells(states):
        end = int(np.searchsorted(one.t_s, one.t_s[begin] + _SOON_S))
        if scene.partner(float(one.clock_s[begin])) != looked_at[begin]:
            yield str(one.turn[begin]), bool(lasting(one, away[begin:end], _KEPT_S))


def _head_speed(one: MeasuredRun, role: str) -> np.ndarray:
    """Return the head's speed in a role over a tenth of a second, all axes, deg/s."""
    ticks = round(_SPEED_OVER_S / one.period_s)
    moved = np.linalg.norm(one.head_deg[ticks:] - one.head_deg[:-ticks], axis=1)
    return np.asarray(moved[one.turn[ticks:] == role] / _SPEED_OVER_S)


def _nods(one: MeasuredRun) -> int:
    """Return the number of short dips of the head while it listens; those of a second are one."""
    rate_hz = 1.0 / one.period_s
    dips, _ = find_peaks(-one.head_deg[:, 1], prominence=_NOD_DEG, width=(None, _NOD_S * rate_hz))
    heard = dips[one.turn[dips] == "listening"]
    return int((np.diff(heard, prepend=-rate_hz * 9.0) > _TOGETHER_S * rate_hz).sum())
