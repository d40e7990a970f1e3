"""When a control loop counts as hung: numbers in, a verdict out."""

HANG_S = 0.4
"""Silence of a loop after which its servos are released.

A loop on a busy machine has been seen up to 0.3 s late. Letting go may take 0.1 s more, so
that the torque of the servos is off half a second after the last sign of life."""

MAX_COUNTED_S = 0.1
"""Silence between two looks counts as no more than this.

Where the whole machine stood still, the guardian slept as well and cannot say what the loop
would have done meanwhile: it sees at least four times in a row that nothing came."""


class HangDetector:
    """Adds up the time without a heartbeat.

    silent_s: seconds of silence that count
    """

    def __init__(self, beats: int, now_s: float) -> None:
        self._beats, self._now_s = beats, now_s
        self.silent_s = 0.0

    def step(self, beats: int, now_s: float) -> bool:
        """Return whether the loop counts as hung.

        Args:
            beats: its counter now.
            now_s: the time of this look, monotonic seconds.
        """
        elapsed_s, self._now_s = now_s - self._now_s, now_s
        if beats != self._beats:
            self._beats = beats
            self.silent_s = 0.0
        else:
            self.silent_s += min(max(elapsed_s, 0.0), MAX_COUNTED_S)
        return self.silent_s >= HANG_S

    def reset(self) -> None:
        """Reset, as where nothing is armed."""
        self.silent_s = 0.0
