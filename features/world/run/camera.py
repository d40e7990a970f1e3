"""A camera in a world of another process; without a renderer it computes detections."""

from collections.abc import Callable

from gazerig.drivers.camera.process import CameraProcess
from gazerig.drivers.types import Detections
from gazerig.features.world.gl_context import NoRenderer
from gazerig.features.world.run.poses import WorldPoses
from gazerig.sim_mock.cameras.detections import SceneCamera


class WorldCamera:
    """A camera in a world in real time.

    Args:
        process: renders and detects; None: nothing is rendered.
        ideal: returns a camera that computes detections of a scene that began at a time.
        poses: the pose of the head, and the start time of the people's script.

    Attributes:
        seeing: the process, or the camera that computes detections; None until one is chosen.
    """

    def __init__(
        self,
        process: CameraProcess | None,
        ideal: Callable[[float], SceneCamera],
        poses: WorldPoses,
    ) -> None:
        self._process, self._ideal, self._poses = process, ideal, poses
        self.seeing: CameraProcess | SceneCamera | None = process
        self._events: list[str] = []

    @property
    def start_s(self) -> float | None:
        """Return when the script of the people began, None before that."""
        return self._poses.begin_s

    def open(self) -> None:
        """Start the process; without a renderer continue without pictures.

        Raises:
            SetupError: as the process does.
        """
        self.seeing = self._process
        if self._process is not None:
            try:
                self._process.open()
            except NoRenderer as error:
                self.seeing = None
                self._events.append(no_pictures_message(error))

    def latest(self, now_s: float) -> Detections | None:
        """Return the detections in the newest frame, None before the first."""
        if self.seeing is None:
            begin_s = self.start_s
            if begin_s is None:
                return None
            self.seeing = self._ideal(begin_s)
            self.seeing.open()
        return self.seeing.latest(now_s)

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call, one line each."""
        events, self._events = (*self._events, *(self.seeing.events() if self.seeing else ())), []
        return events

    def close(self) -> None:
        """End the process; safe to call twice."""
        if self._process is not None:
            self._process.close()


def no_pictures_message(error: NoRenderer) -> str:
    """Return a message to the user if nothing can render."""
    return f"{error}; detections are computed instead, without pictures"
