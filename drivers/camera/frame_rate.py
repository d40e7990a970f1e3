"""The measured frame rate of a camera against the stated one."""

from collections import deque
from math import isfinite
from statistics import median

_WINDOW = 45
_LEAST = 15  # intervals before anything is said
_TOLERANCE = 0.2
# Absence of the reader for less than this part of a frame cannot have cost a frame.
_PROMPT = 0.5


class FrameRateMonitor:
    """Measures the frame rate and reports once when it differs from the stated one.

    Only intervals in which the reader was back in time count: a slow reader misses
    frames, and that is no fault of the camera.
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
        """Add a frame; return a line when the rate is newly wrong or right again, else "".

        Args:
            captured_s: when it was captured.
            away_s: how long the reader was busy elsewhere before it.
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
            return f"{self._name} gives {rate_hz:.1f} frames a second again, as it states"
        return (
            f"{self._name} states {self._stated_hz:g} frames a second and gives {rate_hz:.1f}: "
            "the times of its frames are measured; more light makes many cameras faster"
        )

    def _prompt(self, away_s: float) -> bool:
        """Return whether the reader was back before a frame could be missed."""
        return self._stated_hz == 0.0 or away_s <= _PROMPT / self._stated_hz
