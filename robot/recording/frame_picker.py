"""Selection of the camera frames that a recording contains, at a given rate."""

from math import inf

from gazerig.drivers.types import Detections

_EARLY_S = 1e-3  # a frame may be this early, as times are rounded


class FramePicker:
    """A selector of frames at a given rate.

    Args:
        rate_hz: Rate of the selected frames, 0 for none.
    """

    def __init__(self, rate_hz: float) -> None:
        self._every_s = 1.0 / rate_hz if rate_hz > 0.0 else inf
        self._due_s = -inf
        self._number = 0

    def picks(self, found: Detections | None) -> bool:
        """Return whether the frame is new and due."""
        if found is None or found.number == self._number:
            return False
        self._number = found.number
        if found.captured_s < self._due_s - _EARLY_S or self._every_s == inf:
            return False
        if found.image is None:  # checked last, as reading the image may copy it
            return False
        # A late frame does not delay those that follow.
        late_s = found.captured_s - self._due_s
        began_s = self._due_s if late_s < self._every_s else found.captured_s
        self._due_s = began_s + self._every_s
        return True
