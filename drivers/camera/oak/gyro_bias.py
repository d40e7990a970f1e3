"""Bias of a gyro: its reading at rest.

At rest, averages of .3 s hardly differ, even if single readings are noisy. In motion they differ,
even if it is as slow as breathing.
"""

from math import radians

import numpy as np

Rates = tuple[float, float, float]

_BLOCK_S, _BLOCKS = 0.3, 5
_FEWEST = 8  # readings in a block
# Largest deviation of blocks at rest from their mean, and largest bias.
_SPREAD_RAD_S, _MOST_RAD_S = radians(0.06), radians(3.0)
# Largest drift of a bias with temperature from one rest to the next; a larger change is a slow,
# even motion, unless it lasts.
_STEP_RAD_S, _LASTING = radians(0.3), 10
_SHARE = 0.3


class GyroBias:
    """Estimator of the bias, from readings of 1.5 s at rest.

    rad_s: the bias, None before the first rest
    """

    def __init__(self) -> None:
        self.rad_s: Rates | None = None
        self._block: list[Rates] = []
        self._means: list[np.ndarray[tuple[int], np.dtype[np.float64]]] = []
        self._began_s: float | None = None
        self._elsewhere = 0

    def add(self, t_s: float, rates_rad_s: Rates) -> None:
        """Add a reading; times must ascend."""
        if self._began_s is None or t_s - self._began_s > 2.0 * _BLOCK_S:  # first reading, or a gap
            self._block, self._means, self._began_s = [], [], t_s
        self._block.append(rates_rad_s)
        if t_s - self._began_s < _BLOCK_S:
            return
        if len(self._block) >= _FEWEST:
            self._means.append(np.mean(self._block, axis=0))
        self._block, self._began_s = [], t_s
        if len(self._means) == _BLOCKS:
            # The gyro was at rest if these averages agree.
            means = np.array(self._means)
            mean = means.mean(axis=0)
            if np.abs(means - mean).max() > _SPREAD_RAD_S or np.abs(mean).max() > _MOST_RAD_S:
                self._elsewhere = 0
            elif self.rad_s is None:
                self._take(mean)
            else:
                off = mean - self.rad_s
                if np.abs(off).max() <= _STEP_RAD_S:
                    self._elsewhere = 0
                    self._take(np.asarray(self.rad_s) + _SHARE * off)
                else:
                    self._elsewhere += 1
                    if self._elsewhere == _LASTING:
                        self._elsewhere = 0
                        self._take(mean)
            self._means.clear()

    def _take(self, bias: np.ndarray[tuple[int], np.dtype[np.float64]]) -> None:
        x, y, z = bias.tolist()
        self.rad_s = x, y, z
