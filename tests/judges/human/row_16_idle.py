"""Nobody there: eyes and head explore the room, and the lids blink as at rest.

People who look about make one to two shifts of gaze a second; 8 to 21 blinks a minute at rest
(Doughty 2001). What is in view: three things that lie about, or nothing. Every few seconds a look
with the head goes to one side, so that the camera sees half of the room in 20 s.
"""

from collections.abc import Sequence

import numpy as np
from fakes.scenes import EmptyScene
from human.measured_run import BEGIN_S, Figures, MeasuredRun, Runs
from human.spells import spells

from gazerig.gaze.types import Vec3
from gazerig.sim_mock.scenes.scene import Thing

WANTED = {
    "empty room, saccades/s": (1.0, 2.0),
    "empty room, blinks/min": (8.0, 22.0),
    "empty room, saccades below 15 deg, %": (65.0, 97.0),  # corrections are among them
    "empty room, gaze within 25 deg of the horizon, %": (98.0, 100.0),
    "empty room, turns of the head above 10 deg, 1/min": (10.0, 40.0),
    "empty room, seen in 20 s, least, deg": (180.0, 360.0),
    "room with things, saccades/s": (1.0, 2.0),
    "room with things, gaze on them, %": (20.0, 75.0),
    "room with things, least looked at of them, %": (4.0, 30.0),
}

_ON_DEG = 3.0
_STILL_DEG_S, _OVER_S, _TURNS_DEG = 5.0, 0.1, 10.0
_FIELD_DEG, _SEEN_S = 69.0, 20.0
"""Field of the desk rig's camera."""
_PLACES: tuple[Vec3, ...] = ((1.4, 0.55, 0.20), (1.6, -0.75, 0.10), (1.3, 0.05, 0.45))


class Room(EmptyScene):
    """A room without any person, with still things."""

    round_s = 60.0

    def __init__(self, name: str, places: Sequence[Vec3]) -> None:
        self.name = name
        self._things = tuple(
            Thing(n, "thing", place, 0.05) for n, place in enumerate(places, start=1)
        )

    def things(self, t_s: float) -> tuple[Thing, ...]:
        """Return the things of the room."""
        return self._things


EMPTY, FURNISHED = Room("empty-room", ()), Room("room-with-things", _PLACES)


def measure(runs: Runs) -> Figures:
    """Return the figures of a room with nothing in it and of one with three things."""
    empty, full = runs(EMPTY, _SEEN_S), runs(FURNISHED)
    sizes = np.array([s.amplitude_deg for one in empty for s in _later(one)])
    level = np.abs(np.concatenate([one.gaze_deg[:, 1] for one in empty])) <= 25.0
    turns = [_turns_s(one) for one in empty]
    on = np.array([_on(full, f"thing {n}") for n in range(1, len(_PLACES) + 1)])
    return {
        "empty room, saccades/s": _rate(empty),
        "empty room, blinks/min": 60.0
        * sum(len(one.trace.blinks) for one in empty)
        / sum(one.trace.seconds for one in empty),
        "empty room, saccades below 15 deg, %": 100.0 * (sizes < 15.0).mean(),
        "empty room, gaze within 25 deg of the horizon, %": 100.0 * level.mean(),
        "empty room, turns of the head above 10 deg, 1/min": 60.0
        * sum(map(len, turns))
        / sum(np.ptp(one.t_s) for one in empty),
        "empty room, longest time without, s": max(
            np.diff([0.0, *each, one.t_s[-1]]).max() for each, one in zip(turns, empty, strict=True)
        ),
        "empty room, seen in 20 s, least, deg": min(map(_seen_deg, empty)),
        "room with things, saccades/s": _rate(full),
        "room with things, gaze on them, %": on.sum(),
        "room with things, least looked at of them, %": on.min(),
    }


def _turns_s(one: MeasuredRun) -> list[float]:
    """Return the times of the head's turns from rest to rest above 10 deg."""
    ticks = round(_OVER_S / one.period_s)
    moved = np.linalg.norm(one.head_deg[ticks:, :2] - one.head_deg[:-ticks, :2], axis=1)
    return [
        float(one.t_s[begin])
        for begin, end in spells(moved > _STILL_DEG_S * _OVER_S)
        if np.linalg.norm(one.head_deg[end, :2] - one.head_deg[begin, :2]) > _TURNS_DEG
    ]


def _seen_deg(one: MeasuredRun) -> float:
    """Return the least angle that the camera sees in any 20 s, from one end to the other."""
    ticks = int(np.searchsorted(one.t_s, _SEEN_S))
    yaw = one.head_deg[:, 0]
    starts = range(0, len(yaw) - ticks + 1, ticks // 10)
    return float(min(np.ptp(yaw[k : k + ticks]) for k in starts) + _FIELD_DEG)


def _later(one: MeasuredRun) -> list:
    first = one.trace.column("t")[0]
    return [s for s in one.trace.saccades if s.onset_s - first >= BEGIN_S]


def _rate(runs: Sequence[MeasuredRun]) -> float:
    return sum(len(_later(one)) for one in runs) / sum(float(np.ptp(one.t_s)) for one in runs)


def _on(runs: Sequence[MeasuredRun], name: str) -> float:
    off = np.concatenate([one.gaze_deg - one.truth_deg(name) for one in runs])
    return 100.0 * (np.hypot(*off.T) <= _ON_DEG).mean()
