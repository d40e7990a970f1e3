"""Temporary use of a browser's own camera instead of an emulated rig's.

Its images arrive through the page's process and are analysed in a camera process of their own, like
a webcam's. While they arrive, the head looks at the person in front of the browser; when they end,
the simulated scene returns.
"""

import threading
from collections.abc import Callable
from functools import partial

from gazerig.drivers.camera.browser_source import FIELD_DEG, BrowserSource
from gazerig.drivers.camera.shared_slots import JpegSlot
from gazerig.drivers.camera.source import FrameSource
from gazerig.drivers.camera.worker import CameraWorker
from gazerig.drivers.errors import SetupError

SILENT_S = 1.5
"""Silence after which a browser counts as gone."""

_BEGINS = (
    f"using a browser's camera; its unknown field of view is assumed to be {FIELD_DEG:g} deg; "
    "the scene pauses"
)
_ENDS = "the browser's camera has ended: the scene continues"

Make = Callable[[Callable[[], FrameSource], int], CameraWorker]
"""Function that returns a camera process of a source; the number counts the former ones."""


class BrowserCamera:
    """A browser's camera, used instead of the rig's while its images arrive.

    Args:
        make: Returns the process that analyses the images.
        now_s: The host's clock.
        use: Called in the loop's thread with the camera to use, None for the rig's own.
        report: Called with each event as one line.

    in_use: whether the browser's camera is in use
    """

    def __init__(
        self,
        make: Make,
        now_s: Callable[[], float],
        use: Callable[[CameraWorker | None], None],
        report: Callable[[str], None],
    ) -> None:
        self.in_use = False
        self._make, self._now_s, self._use, self._report = make, now_s, use, report
        self._pictures = JpegSlot()
        self._worker: CameraWorker | None = None
        self._starting: threading.Thread | None = None
        self._begun = 1
        self._closed = False
        self._fault = ""

    def take(self, jpeg: bytes) -> None:
        """Store an image of a browser; called from one thread other than the loop's."""
        if self._closed or not self._pictures.put(jpeg, self._now_s()):
            return
        if self._worker is None and (self._starting is None or not self._starting.is_alive()):
            self._starting = threading.Thread(
                target=self._start, name="browser camera", daemon=True
            )
            self._starting.start()

    def _start(self) -> None:
        """Start the process, which takes a second; the scene continues meanwhile."""
        worker = self._make(partial(BrowserSource, self._pictures), self._begun)
        self._begun += 1
        try:
            worker.open()
        except SetupError as error:
            self._fault = f"a browser's camera cannot be used: {error}"
            return
        if self._closed:
            worker.close()
        else:
            self._worker = worker

    def update(self) -> None:
        """Begin or end the use of the camera; called by the loop in each tick."""
        worker, now_s = self._worker, self._now_s()
        fault, self._fault = self._fault, ""
        if fault:
            self._report(fault)
        if worker is None:
            return
        if now_s - self._pictures.came_s > SILENT_S:
            self._worker = None
            if self.in_use:
                self._switch(None, _ENDS)
            threading.Thread(target=worker.close, name="browser camera", daemon=True).start()
        elif not self.in_use and worker.latest(now_s) is not None:
            self._switch(worker, _BEGINS)

    def _switch(self, camera: CameraWorker | None, line: str) -> None:
        self.in_use = camera is not None
        self._use(camera)
        self._report(line)

    def close(self) -> None:
        """End the process; safe to call twice."""
        self._closed = True
        worker, self._worker = self._worker, None
        if worker is not None:
            worker.close()
