"""Which of the camera's frames a recording holds: now and then one, encoded by its writer."""

from math import inf

from gazerig.drivers.types import Detections

_EARLY_S = 1e-3  # by so much a frame may be early, as times are rounded


class FramePicker:
    """Picks the frames of ticks at a given rate.

    Args:
        rate_hz: 0 for none.
    """

    def __init__(self, rate_hz: float) -> None:
        self._every_s = 1.0 / rate_hz if rate_hz > 0.0 else inf
        self._due_s = -inf
        self._number = 0

    def picks(self, found: Detections | None) -> bool:
        """Return whether the frame is a new one and due."""
        if found is None or found.number == self._number:
            return False
        self._number = found.number
        if found.captured_s < self._due_s - _EARLY_S or self._every_s == inf:
            return False
        if found.image is None:  # asked last, as an image may have to be copied then
            return False
        # A frame that came late does not put off those that follow.
        late_s = found.captured_s - self._due_s
        began_s = self._due_s if late_s < self._every_s else found.captured_s
        self._due_s = began_s + self._every_s
        return True
