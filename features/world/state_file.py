"""File with the newest state of a world, from the process that computes it to its readers.

Both sides map a small file into memory. The writer fills the older of two entries and then
increments a count; a reader reads the count before and after. Processes find the file by its path,
so a restarted process finds it as well, and a killed process cannot leave a lock behind.
"""

import mmap
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gazerig.gaze.types import Floats

_HEADER = 3  # count of states, numbers in a state, host's time at the start of the world


class WorldState(NamedTuple):
    """State of a world; a picture needs only this and the script of the people.

    Attributes:
        host_s: time of the clock on which the world is simulated.
        t_s: time since the start of the script of its people, 0 before.
        qpos: all coordinates of its joints, in MuJoCo's order.
    """

    host_s: float
    t_s: float
    qpos: Floats


class StateWriter:
    """Writer of states; only one process may use it."""

    def __init__(self, path: Path, size: int) -> None:
        with path.open("xb+") as file:
            file.truncate(8 * (_HEADER + 2 * (size + 2)))
            whole = mmap.mmap(file.fileno(), 0)
        self._numbers: Floats = np.frombuffer(whole, np.float64)
        self._numbers[1] = size
        self._rows = self._numbers[_HEADER:].reshape(2, size + 2)
        self._count = 0

    def write(self, state: WorldState) -> None:
        """Write the newest state."""
        row = self._rows[self._count % 2]
        row[0], row[1], row[2:] = state
        self._count += 1
        self._numbers[2] = state.host_s - state.t_s
        self._numbers[0] = self._count


class StateReader:
    """Reads the newest state; the file must exist.

    Raises:
        OSError: the file does not exist.
    """

    def __init__(self, path: Path) -> None:
        with path.open("rb") as file:
            whole = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        self._numbers = np.frombuffer(whole, np.float64)
        self._rows = self._numbers[_HEADER:].reshape(2, int(self._numbers[1]) + 2)

    @property
    def count(self) -> int:
        """Return the number of written states."""
        return int(self._numbers[0])

    @property
    def begin_s(self) -> float | None:
        """Return the host's time at the start of the world, None before the first state."""
        return float(self._numbers[2]) if self.count else None

    def newest(self) -> WorldState | None:
        """Return the newest state, None before the first."""
        while count := self.count:
            row = self._rows[(count - 1) % 2].copy()
            # If two states were written in the meantime, the copy may mix both.
            if self.count <= count:
                return WorldState(float(row[0]), float(row[1]), row[2:])
        return None
