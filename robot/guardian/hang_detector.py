"""Detection of a control loop that hangs, from its heartbeat counter and the time."""

HANG_S = 0.4
"""Time without a heartbeat after which the servos are released, s.

Loops on a busy machine were up to 0.3 s late. The release may take 0.1 s more, so that the
torque is off half a second after the last heartbeat."""

MAX_COUNTED_S = 0.1
"""Longest time that one interval between two checks counts, s.

If the whole machine was suspended, the guardian was suspended as well. At least four checks in
a row must find no heartbeat."""


class HangDetector:
    """Accumulates the time without a heartbeat.

    Attributes:
        silent_s: Accumulated time without a heartbeat, s.
    """

    def __init__(self, beats: int, now_s: float) -> None:
        self._beats, self._now_s = beats, now_s
        self.silent_s = 0.0

    def step(self, beats: int, now_s: float) -> bool:
        """Return whether the loop counts as hung.

        Args:
            beats: Present value of the loop's counter.
            now_s: Present time, monotonic seconds.
        """
        elapsed_s, self._now_s = now_s - self._now_s, now_s
        if beats != self._beats:
            self._beats = beats
            self.silent_s = 0.0
        else:
            self.silent_s += min(max(elapsed_s, 0.0), MAX_COUNTED_S)
        return self.silent_s >= HANG_S

    def reset(self) -> None:
        """Reset the accumulated time to 0."""
        self.silent_s = 0.0
