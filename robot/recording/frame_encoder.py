"""Camera frames to JPEG beside the control loop: now and then one, in a thread of its own.

The encoder lets go of the interpreter while it works, so the loop does not wait for it.
"""

import threading
from collections import deque
from collections.abc import Iterator
from math import inf

from gazerig.drivers.types import ImageArray
from gazerig.robot.control.tick import Tick
from gazerig.robot.dashboard.camera_overlay import encode


class FrameEncoder:
    """Encodes the frames of ticks as JPEG, at a given rate.

    Args:
        rate_hz: 0 for none.
        at_once: encode in ``look`` itself, as a run in simulated time needs it.
    """

    def __init__(self, rate_hz: float, at_once: bool = False) -> None:
        self._every_s = 1.0 / rate_hz if rate_hz > 0.0 else inf
        self._at_once = at_once
        self._due_s = -inf
        self._number = 0
        self._slot: tuple[float, ImageArray] | None = None
        self._made: deque[tuple[float, bytes]] = deque()
        self._come = threading.Event()
        self._over = False
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Begin to encode."""
        if self._every_s < inf and not self._at_once:
            self._thread = threading.Thread(target=self._work, name="frame encoder", daemon=True)
            self._thread.start()

    def look(self, tick: Tick) -> None:
        """Encode the tick's frame if it is a new one and due."""
        found = tick.detections
        if found is None or found.image is None or found.number == self._number:
            return
        self._number = found.number
        if found.captured_s < self._due_s or self._every_s == inf:
            return
        # A frame that came late does not put off those that follow.
        late_s = found.captured_s - self._due_s
        began_s = self._due_s if late_s < self._every_s else found.captured_s
        self._due_s = began_s + self._every_s - 1e-3
        if self._at_once:
            self._made.append((found.captured_s, encode(found.image)))
        else:
            self._slot = (found.captured_s, found.image)
            self._come.set()

    def taken(self) -> Iterator[tuple[float, bytes]]:
        """Return what has been encoded: time of the exposure and JPEG, each once."""
        while self._made:
            yield self._made.popleft()

    def stop(self) -> None:
        """Finish what was begun, and end."""
        self._over = True
        self._come.set()
        if self._thread is not None:
            self._thread.join(timeout=2.0)
            self._thread = None

    def _work(self) -> None:
        while not self._over:
            self._come.wait()
            self._come.clear()
            slot, self._slot = self._slot, None
            if slot is not None:
                self._made.append((slot[0], encode(slot[1])))
