"""Nobody there: the gaze explores what is in view, and the lids blink as at rest.

People who look about make one to two shifts of gaze a second; 8 to 21 blinks a minute at rest
(Doughty 2001). What is in view: three things that lie about, else the middle of the room.
"""

from collections.abc import Sequence

import numpy as np
from fakes.scenes import EmptyScene
from human.measured_run import BEGIN_S, MeasuredRun, Runner

from gazerig.gaze.types import Vec3
from gazerig.sim_mock.scenes.scene import Thing

WANTED = {
    "empty room, saccades/s": (1.0, 2.0),
    "empty room, blinks/min": (8.0, 22.0),
    "empty room, saccades below 15 deg, %": (65.0, 97.0),  # corrections are among them
    "empty room, gaze within 35 x 20 deg of the middle, %": (98.0, 100.0),
    "room with things, saccades/s": (1.0, 2.0),
    "room with things, gaze on them, %": (20.0, 75.0),
    "room with things, least looked at of them, %": (4.0, 30.0),
}

_ON_DEG = 3.0
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


def measure(run: Runner, seconds: float, seeds: Sequence[int]) -> dict[str, float]:
    """Return the figures of a room with nothing in it and of one with three things."""
    empty = [run(EMPTY, seed=seed, seconds=seconds) for seed in seeds]
    full = [run(FURNISHED, seed=seed, seconds=seconds) for seed in seeds]
    sizes = np.array([s.amplitude_deg for one in empty for s in _later(one)])
    gaze = np.concatenate([one.gaze_deg for one in empty])
    inside = (np.abs(gaze[:, 0]) <= 35.0) & (np.abs(gaze[:, 1]) <= 20.0)
    on = np.array([_on(full, f"thing {n}") for n in range(1, len(_PLACES) + 1)])
    return {
        "empty room, saccades/s": _rate(empty),
        "empty room, blinks/min": 60.0
        * sum(len(one.trace.blinks) for one in empty)
        / sum(one.trace.seconds for one in empty),
        "empty room, saccades below 15 deg, %": 100.0 * float((sizes < 15.0).mean()),
        "empty room, gaze within 35 x 20 deg of the middle, %": 100.0 * float(inside.mean()),
        "room with things, saccades/s": _rate(full),
        "room with things, gaze on them, %": float(on.sum()),
        "room with things, least looked at of them, %": float(on.min()),
    }


def _later(one: MeasuredRun) -> list:
    first = one.trace.column("t")[0]
    return [s for s in one.trace.saccades if s.onset_s - first >= BEGIN_S]


def _rate(runs: Sequence[MeasuredRun]) -> float:
    return sum(len(_later(one)) for one in runs) / sum(float(np.ptp(one.t_s)) for one in runs)


def _on(runs: Sequence[MeasuredRun], name: str) -> float:
    """Return the share of time on a thing in percent."""
    off = np.concatenate([one.gaze_deg - one.truth_deg(name) for one in runs])
    return 100.0 * float((np.hypot(*off.T) <= _ON_DEG).mean())
