"""Single saccades of one eye joint by a rig's own law, through guard and bus, on the true shaft."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import degrees, radians

import numpy as np
from true_shafts import Bench

from gazerig.config.schema import load_rig
from gazerig.gaze.oculomotor.saccade import SaccadeModel

EYES = {
    "desk": "left_eye_pan", "feetech": "left_eye_pan", "expressive": "eyes_pan", "maker": "eyes_pan",
}  # fmt: skip
"""The shipped rigs that differ in the servos of their eyes."""
SETTLES_S = 0.25
_REST_TICKS, _WAY_TICKS = 90, 60


@dataclass(frozen=True)
class Step:
    """One saccade from rest, in ms from its command and in deg from its start, onward positive.

    size_deg: as commanded; most_deg_s: the rig's cap
    asked_deg, done_deg: (n,) commanded by the law and done by the true shaft, one a millisecond
    """

    size_deg: float
    most_deg_s: float
    asked_deg: np.ndarray
    done_deg: np.ndarray

    @property
    def speed_deg_s(self) -> np.ndarray:
        """Return the speed over 5 ms, (n,)."""
        padded = np.pad(self.done_deg, (3, 2), mode="edge")
        return (padded[5:] - padded[:-5]) / 0.005

    def rise_ms(self, angles: np.ndarray) -> float:
        """Return the time from 10 to 90 % of the size."""
        low, high = (int(np.argmax(angles >= share * self.size_deg)) for share in (0.1, 0.9))
        return float(high - low)

    def timing(self) -> tuple[float, float, float]:
        """Return duration in ms, peak in deg/s and the time of the peak as a share.

        It lasts as long as the speed is above a tenth of the peak and 10 deg/s; the peak is the
        middle of what is above nine tenths.
        """
        speed = self.speed_deg_s
        peak = float(speed.max())
        fast = np.flatnonzero(speed > max(0.1 * peak, 10.0))
        top = np.flatnonzero(speed >= 0.9 * peak)
        lasts = float(fast[-1] - fast[0])
        return lasts, peak, float((0.5 * (top[0] + top[-1]) - fast[0]) / lasts)


def steps(rig_name: str, sizes_deg: Sequence[float]) -> Iterator[Step]:
    """Yield saccades of some sizes in both directions, each about the middle of the range."""
    rig = load_rig(rig_name)
    bench, law = Bench(rig), SaccadeModel(rig.gaze.saccade).profile
    bench.shafts.looking = False
    bench.start()
    i = bench.names.index(EYES[rig_name])
    desired = [0.0] * len(bench.names)
    while any(bench.guard._gentle):
        bench.tick(tuple(desired))
    for size in sizes_deg:
        for side in (1.0, -1.0):
            before, begin = degrees(desired[i]), -0.5 * side * size
            for k in range(_WAY_TICKS + _REST_TICKS):
                share = min(1.0, (k + 1) / _WAY_TICKS)
                desired[i] = radians(before + (begin - before) * share)
                bench.tick(tuple(desired))
            seconds = law.duration_s(radians(size))
            bench.shafts.angles_rad.clear()
            bench.shafts.looking = True
            for k in range(1, round((seconds + SETTLES_S) / bench.period_s)):
                gone = law.displacement_rad(radians(size), k * bench.period_s)
                desired[i] = radians(begin) + side * gone
                bench.tick(tuple(desired))
            bench.shafts.looking = False
            done = side * (np.degrees([row[i] for row in bench.shafts.angles_rad]) - begin)
            times = np.arange(1, len(done) + 1) / 1e3
            asked = np.degrees([law.displacement_rad(radians(size), t) for t in times])
            yield Step(size, rig.gaze.saccade.max_speed_deg_s, asked, done)
