"""Decision whether a camera with a running process is lost or hung; pure."""

from typing import Literal

from gazerig.drivers.camera.params import CameraRecoveryParams

FIRST_FRAME_S = 15.0
"""Longest time to the first frame: exposure settles, networks are loaded."""

LOST_PERIODS, HUNG_PERIODS = 5.0, 15.0
"""Smallest number of usual frame periods before either: films and weak computers are slow."""

_SHARE = 0.2

Silence = Literal["", "lost", "hung"]


class FrameWatchdog:
    """Watchdog that compares the time since the last frame with the usual period.

    Args:
        recovery: Time limits.
        now_s: Start of the wait for the first frame, monotonic seconds.
    """

    def __init__(self, recovery: CameraRecoveryParams, now_s: float) -> None:
        self._recovery = recovery
        self._last_s = now_s
        self._period_s: float | None = None
        self._first = True

    def record_frame(self, now_s: float) -> None:
        """Record a frame."""
        period_s = now_s - self._last_s
        if self._first:
            self._first = False
        elif self._period_s is None:
            self._period_s = period_s
        elif period_s < self._lost_after_s():
            self._period_s += _SHARE * (period_s - self._period_s)
        self._last_s = now_s

    def record_activity(self, now_s: float) -> None:
        """Record that the process is busy with other tasks than frames."""
        self._last_s = now_s

    def verdict(self, now_s: float) -> Silence:
        """Return "lost" if no frame came for too long, "hung" if none will come."""
        silent_s = now_s - self._last_s
        if self._first:
            return "hung" if silent_s >= FIRST_FRAME_S else ""
        lost_s = self._lost_after_s()
        hung_s = max(lost_s, self._recovery.restart_s, HUNG_PERIODS * (self._period_s or 0.0))
        return "hung" if silent_s >= hung_s else "lost" if silent_s >= lost_s else ""

    def _lost_after_s(self) -> float:
        return max(self._recovery.silent_s, LOST_PERIODS * (self._period_s or 0.0))
