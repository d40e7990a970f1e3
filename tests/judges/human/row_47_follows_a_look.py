"""A look is followed: when a person turns the face aside, the gaze goes there, and comes back.

People follow 60 to 90 % of such turns, to what they find there, or into the direction. A person
turns the face by 40 deg every 7 s, to each side: to a thing that is there, or where nothing is.
"""

from collections.abc import Iterator, Sequence
from math import atan2, hypot, radians

import numpy as np
from fakes.scenes import EmptyScene
from human.measured_run import Figures, MeasuredRun, Runs
from human.spells import apart_deg
from human.swinging_face import HEAD_M

from gazerig.gaze.types import Vec3
from gazerig.sim_mock.scenes.scene import ScenePerson, Thing, there_and_back

WANTED = {
    "a thing is there: followed in 1 s, %": (60.0, 90.0),
    "nothing is there: followed in 1 s, %": (60.0, 90.0),
    "back on the face in 3 s, %": (90.0, 100.0),
}

_FACE_M: Vec3 = (1.35, 0.0, 0.22)
_FIRST_S, _EVERY_S, _LEAST_LOOKS = 8.0, 7.0, 12
_TURN_S, _HOLD_S, _TURN_DEG = 0.4, 2.2, 40.0
_THINGS_M: tuple[Vec3, ...] = ((0.93, -0.353, 0.18), (0.93, 0.353, 0.18))
"""On the way of the face when it is turned to its left, and to its right; 22 deg from it."""
_ON_DEG, _ON_FACE_DEG, _SOON_S, _BACK_S = 8.0, 6.0, 1.0, 3.0


class Turning(EmptyScene):
    """A person who looks at the head, and aside now and then, with things there or without."""

    round_s = 3600.0

    def __init__(self, furnished: bool) -> None:
        self.name, self._furnished = f"a face turns, {furnished}", furnished

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return the person."""
        number, since_s = divmod(t_s - _FIRST_S, _EVERY_S)
        turned = there_and_back(since_s, _TURN_S, _HOLD_S, _TURN_S) if number >= 0 else 0.0
        x, y, z = (a - b for a, b in zip(HEAD_M, _FACE_M, strict=True))
        yaw = atan2(y, x) + side(int(number)) * radians(_TURN_DEG) * turned
        return (ScenePerson(_FACE_M, (yaw, atan2(z, hypot(x, y))), None),)

    def things(self, t_s: float) -> tuple[Thing, ...]:
        """Return the things."""
        return tuple(
            Thing(n, "thing", place, 0.05) for n, place in enumerate(_THINGS_M) if self._furnished
        )


def side(number: int) -> int:
    """Return 1 for a turn to the person's left, which is the head's right, and -1 else."""
    return -1 if number % 2 else 1


def measure(runs: Runs) -> Figures:
    """Return the shares over all turns and seeds."""
    least_s = _FIRST_S + _EVERY_S * _LEAST_LOOKS + 1.0
    looks = {
        furnished: [
            look for one in runs(Turning(furnished), least_s) for look in followed(one, furnished)
        ]
        for furnished in (True, False)
    }
    back = [back for each in looks.values() for went, back in each if went]
    return {
        "a thing is there: followed in 1 s, %": 100.0 * share(looks[True]),
        "nothing is there: followed in 1 s, %": 100.0 * share(looks[False]),
        "back on the face in 3 s, %": 100.0 * np.mean(back) if back else np.nan,
        "looks": sum(len(each) for each in looks.values()),
    }


def share(looks: Sequence[tuple[bool, bool]]) -> float:
    """Return the share of looks that are followed."""
    return float(np.mean([went for went, _ in looks]))


def followed(one: MeasuredRun, furnished: bool) -> Iterator[tuple[bool, bool]]:
    """Yield for each look of the person whether the gaze follows, and is then back in time."""
    face = one.truth_deg("face 0")
    for number in range(int((one.t_s[-1] - _FIRST_S) / _EVERY_S)):
        start_s = _FIRST_S + _EVERY_S * number
        first, last = np.searchsorted(one.t_s, (start_s, start_s + _SOON_S))
        if furnished:
            place = one.truth_deg(f"thing {0 if side(number) > 0 else 1}")
            went = apart_deg(one.gaze_deg, place)[first:last] < _ON_DEG
        else:
            went = side(number) * (face - one.gaze_deg)[first:last, 0] > _ON_DEG
        there = np.flatnonzero(went)
        if not len(there):
            yield False, False
            continue
        then = slice(
            first + there[0], np.searchsorted(one.t_s, one.t_s[first + there[0]] + _BACK_S)
        )
        yield True, bool((apart_deg(one.gaze_deg, face)[then] < _ON_FACE_DEG).any())
