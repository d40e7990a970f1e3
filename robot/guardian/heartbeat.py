"""Heartbeat of a control loop, and when it counts as hung.

A program and its guardian share memory with two counters and one record for each port:

    offset 0     uint64   beats: counted up by the control loop's thread
    offset 8+2i  uint8    armed: the servos of plan i may be under torque   (the loop writes)
    offset 9+2i  uint8    state of plan i: IDLE, RELEASING or RELEASED      (both write)
    offset 136   uint64   looks: checks of the heartbeat, counted by the guardian

Nothing is locked: every field has one writer at a time. The guardian sets ``RELEASING``
before its first byte and ``RELEASED`` after the last; the loop alone sets ``IDLE`` again.
"""

import mmap
import os

IDLE, RELEASING, RELEASED = 0, 1, 2

SIZE = 4096
MAX_PLANS = 64

HANG_S = 0.4
"""Time without a heartbeat after which the servos are released, s.

Loops on a busy machine were up to 0.3 s late. The release may take 0.1 s more, so that the
torque is off half a second after the last heartbeat."""

MAX_COUNTED_S = 0.1
"""Longest time that one interval between two checks counts, s.

If the whole machine was suspended, the guardian was suspended as well. At least four checks in
a row must find no heartbeat."""


class Heartbeat:
    """View of the shared memory, in the program or in the guardian.

    Args:
        fd: Descriptor of a file of ``SIZE`` bytes; it may be closed afterwards.
    """

    def __init__(self, fd: int) -> None:
        self._map = mmap.mmap(fd, SIZE)
        view = memoryview(self._map)
        self._beats = view[:8].cast("Q")
        self._flags = view[8 : 8 + 2 * MAX_PLANS]
        self._looks = view[8 + 2 * MAX_PLANS : 16 + 2 * MAX_PLANS].cast("Q")
        self._count = self._beats[0]

    def beat(self) -> None:
        """Count one heartbeat; only the loop's thread may call it."""
        self._count += 1
        self._beats[0] = self._count

    @property
    def beats(self) -> int:
        """Return the counter."""
        return self._beats[0]

    def count_check(self) -> None:
        """Count one check of the heartbeat; only the guardian may call it."""
        self._looks[0] += 1

    @property
    def checks(self) -> int:
        """Return how often a guardian has checked the heartbeat."""
        return self._looks[0]

    def arm(self, plan: int, armed: bool) -> None:
        """Record whether a plan's servos may be under torque."""
        self._flags[2 * plan] = armed

    def is_armed(self, plan: int) -> bool:
        """Return whether a plan's servos may be under torque."""
        return self._flags[2 * plan] != 0

    def state(self, plan: int) -> int:
        """Return IDLE, RELEASING or RELEASED."""
        return self._flags[2 * plan + 1]

    def set_state(self, plan: int, state: int) -> None:
        """Set IDLE, RELEASING or RELEASED."""
        self._flags[2 * plan + 1] = state


def shared_file() -> int:
    """Return the descriptor of a new file in memory, to be passed to another process."""
    fd = os.memfd_create("gazerig-heartbeat", os.MFD_CLOEXEC)
    os.ftruncate(fd, SIZE)
    return fd


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
