"""Past gaze points, for frames that arrive late."""

from collections import deque

from gazerig.gaze.types import Vec3

GAZE_KEPT_S = 2.0
"""Age of the oldest frame that is shown with the gaze of its capture, s."""


class GazeHistory:
    """Gaze points of the last seconds, for frames that arrive after their capture."""

    def __init__(self) -> None:
        self._points: deque[tuple[float, Vec3]] = deque()

    def add(self, t_s: float, point_m: Vec3) -> None:
        """Add a gaze point; an earlier time than the last one's resets the history."""
        if self._points and t_s < self._points[-1][0]:
            self._points.clear()
        self._points.append((t_s, point_m))
        while t_s - self._points[0][0] > GAZE_KEPT_S:
            self._points.popleft()

    def at(self, t_s: float) -> Vec3:
        """Return the gaze point nearest to a time; there must be one."""
        return min(self._points, key=lambda one: abs(one[0] - t_s))[1]
