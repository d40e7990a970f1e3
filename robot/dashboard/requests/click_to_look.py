"""Conversion of a click in the camera image to a point in the world."""

from gazerig.gaze.types import Vec3
from gazerig.robot.control.tick import Tick
from gazerig.robot.perception.pixel_to_world import PixelToWorld


class ClickToLook:
    """Stores the newest frame and the pose of the camera at its capture.

    Args:
        pixels: places pixels in the world.

    newest: the newest tick, left here by the loop
    """

    def __init__(self, pixels: PixelToWorld) -> None:
        self._pixels = pixels
        self.newest: Tick | None = None

    def point(self, x: float, y: float) -> Vec3 | None:
        """Return the world point at a position in the newest frame, None without one.

        x, y: 0..1 from the left and from the top
        """
        tick = self.newest
        if tick is None or tick.detections is None:
            return None
        found = tick.detections
        pixel = (
            min(max(x, 0.0), 1.0) * (found.width_px - 1),
            min(max(y, 0.0), 1.0) * (found.height_px - 1),
        )
        return self._pixels.point(pixel, found, tick.percept)
