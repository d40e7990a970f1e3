"""Memory that a program and its guardian share: two counters and one record for each port.

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

    def look(self) -> None:
        """Count one check of the heartbeat; only the guardian may call it."""
        self._looks[0] += 1

    @property
    def looks(self) -> int:
        """Return how often a guardian has checked the heartbeat."""
        return self._looks[0]

    def arm(self, plan: int, armed: bool) -> None:
        """Record whether a plan's servos may be under torque."""
        self._flags[2 * plan] = armed

    def armed(self, plan: int) -> bool:
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
