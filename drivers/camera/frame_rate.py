"""Comparison of a camera's measured frame rate with the stated one."""

from collections import deque
from math import isfinite
from statistics import median

_WINDOW = 45
_LEAST = 15  # intervals before anything is reported
_TOLERANCE = 0.2
# A reader that was away for less than this part of a frame period cannot have lost a frame.
_PROMPT = 0.5


class FrameRateMonitor:
    """Monitor that measures the frame rate and reports once if it differs from the stated one.

    Only intervals in which the reader was prompt count: a slow reader misses frames, which is no
    fault of the camera.
    """

    def __init__(self, name: str, stated_hz: float) -> None:
        self._name = name
        self._stated_hz = stated_hz if isfinite(stated_hz) and stated_hz > 0.0 else 0.0
        self._intervals_s: deque[float] = deque(maxlen=_WINDOW)
        self._before_s: float | None = None
        self._reported = False

    @property
    def measured_hz(self) -> float | None:
        """Return the measured rate, None before there are enough frames."""
        if len(self._intervals_s) < _LEAST:
            return None
        return 1.0 / median(self._intervals_s)

    def update(self, captured_s: float, away_s: float) -> str:
        """Add a frame; return a line when the rate becomes wrong or right again, otherwise "".

        Args:
            captured_s: Time of its capture, seconds.
            away_s: Time for which the reader was busy before it, seconds.
        """
        before_s, self._before_s = self._before_s, captured_s
        if before_s is None or captured_s <= before_s:
            return ""
        if away_s <= _PROMPT * (captured_s - before_s) and self._prompt(away_s):
            self._intervals_s.append(captured_s - before_s)
        rate_hz = self.measured_hz
        if rate_hz is None or self._stated_hz == 0.0:
            return ""
        lies = abs(rate_hz / self._stated_hz - 1.0) > _TOLERANCE
        if lies == self._reported:
            return ""
        self._reported = lies
        if not lies:
            return f"{self._name} delivers {rate_hz:.1f} frames a second again, as stated"
        return (
            f"{self._name} states {self._stated_hz:g} frames a second and delivers {rate_hz:.1f}: "
            "the times of its frames are measured; more light makes many cameras faster"
        )

    def _prompt(self, away_s: float) -> bool:
        """Return whether the reader was back before a frame could be missed."""
        return self._stated_hz == 0.0 or away_s <= _PROMPT / self._stated_hz
