"""When a simulated camera exposes its frames, and when their detections arrive."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from math import inf, radians

from gazerig.drivers.camera.pinhole import Intrinsics, intrinsics_of_view
from gazerig.drivers.types import Detections


@dataclass(frozen=True)
class FrameParams:
    """Size, field and times of a simulated camera's frames."""

    width_px: int = 640
    height_px: int = 400
    horizontal_field_deg: float = 69.0
    rate_hz: float = 30.0
    latency_ms: float = 60.0

    @property
    def lens(self) -> Intrinsics:
        """Return the ideal lens of this field."""
        return intrinsics_of_view(radians(self.horizontal_field_deg), self.width_px, self.height_px)


Begin = Callable[[], float | None]
"""Returns the start of a scene, None before it."""


class FrameTimes:
    """Frames at a constant rate that arrive after a constant latency.

    Args:
        params: rate and latency.
        begin: returns the start of the scene, None before it; None: at the first frame.

    Attributes:
        start_s: start of the scene, None before it.
        number: number of the newest frame, from 1.
    """

    def __init__(self, params: FrameParams, begin: Begin | None) -> None:
        self._rate_hz, self._latency_s = params.rate_hz, params.latency_ms / 1e3
        self._begin = begin
        self.start_s: float | None = None
        self.restart()

    def restart(self) -> None:
        """Begin again with the first frame."""
        self._on_the_way: deque[Detections] = deque()
        self._arrived: Detections | None = None
        self.start_s, self.number = None, 0
        self._due_s = -inf

    def next_frame_s(self, now_s: float) -> float | None:
        """Return the time of the scene at which a frame is exposed now, None if none is due."""
        if now_s < self._due_s:
            return None
        if self.start_s is None:
            self.start_s = now_s if self._begin is None else self._begin()
            if self.start_s is None:
                return None
        # A late call skips the frames that it missed, as a real camera's buffer does.
        due = int((now_s - self.start_s) * self._rate_hz + 1e-6)
        self.number = max(self.number, due) + 1
        self._due_s = self.start_s + self.number / self._rate_hz - 1e-9
        return now_s - self.start_s

    def send(self, found: Detections) -> None:
        """Send detections on their way."""
        self._on_the_way.append(found)

    def arrived(self, now_s: float) -> Detections | None:
        """Return the newest detections that have arrived."""
        sent_s = now_s - self._latency_s + 1e-9
        while self._on_the_way and self._on_the_way[0].captured_s <= sent_s:
            self._arrived = self._on_the_way.popleft()
        return self._arrived
