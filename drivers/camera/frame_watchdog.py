"""When a camera whose process is alive counts as lost, or as hung: pure."""

from typing import Literal

from gazerig.drivers.camera.params import CameraRecoveryParams

FIRST_FRAME_S = 15.0
"""A camera may take so long for its first frame: exposure settles, networks are loaded."""

LOST_PERIODS, HUNG_PERIODS = 5.0, 15.0
"""So many of its usual periods may go by at least: films and weak computers are slow."""

_SHARE = 0.2

Silence = Literal["", "lost", "hung"]


class FrameWatchdog:
    """Compares the time since the last frame with what is usual.

    Args:
        recovery: how long is too long.
        now_s: when the waiting for the first frame begins, monotonic seconds.
    """

    def __init__(self, recovery: CameraRecoveryParams, now_s: float) -> None:
        self._recovery = recovery
        self._last_s = now_s
        self._period_s: float | None = None
        self._first = True

    def record_frame(self, now_s: float) -> None:
        """Record that a frame came."""
        period_s = now_s - self._last_s
        if self._first:
            self._first = False
        elif self._period_s is None:
            self._period_s = period_s
        elif period_s < self._lost_after_s():
            self._period_s += _SHARE * (period_s - self._period_s)
        self._last_s = now_s

    def record_activity(self, now_s: float) -> None:
        """Record that the process is busy with something else than frames."""
        self._last_s = now_s

    def verdict(self, now_s: float) -> Silence:
        """Return "lost" where no frame came for too long, "hung" where none will come."""
        silent_s = now_s - self._last_s
        if self._first:
            return "hung" if silent_s >= FIRST_FRAME_S else ""
        lost_s = self._lost_after_s()
        hung_s = max(lost_s, self._recovery.restart_s, HUNG_PERIODS * (self._period_s or 0.0))
        return "hung" if silent_s >= hung_s else "lost" if silent_s >= lost_s else ""

    def _lost_after_s(self) -> float:
        return max(self._recovery.silent_s, LOST_PERIODS * (self._period_s or 0.0))
