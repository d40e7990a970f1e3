"""Gaze points of the last seconds."""

from collections import deque

import numpy as np

from gazerig.gaze.types import Floats, Vec3

KEPT_S, EVERY_S = 12.0, 0.05
"""Duration of the trail and time between its points, s."""


class GazeTrail:
    """Gaze points of the last seconds in the world frame, m."""

    def __init__(self) -> None:
        self._points: deque[tuple[float, Vec3]] = deque(maxlen=int(KEPT_S / EVERY_S))

    def add(self, t_s: float, p_world_m: Vec3) -> None:
        """Add a point; one with an earlier time than the last clears the trail."""
        if self._points and t_s < self._points[-1][0]:
            self._points.clear()
        if not self._points or t_s - self._points[-1][0] >= EVERY_S:
            self._points.append((t_s, p_world_m))

    def points(self) -> Floats:
        """Return the points (n, 3), oldest first."""
        return np.array([p for _, p in self._points], dtype=np.float64).reshape(-1, 3)
