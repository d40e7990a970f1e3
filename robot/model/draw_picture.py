"""What draws a simulated scene as a camera in it sees it."""

from typing import Protocol

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import ImageArray
from gazerig.gaze.types import Mat3, Vec3


class DrawPicture(Protocol):
    """Draws what a camera in a simulated scene sees; can be sent to another process."""

    def draw(
        self, scene_s: float, lens: Intrinsics, size_px: tuple[int, int], R: Mat3, p_m: Vec3
    ) -> ImageArray:
        """Return a BGR image.

        Args:
            scene_s: time since the scene began, seconds.
            lens: of the camera, for images of this size.
            size_px: width and height.
            R: rotation of the camera in the world, its axes optical.
            p_m: position of the camera in the world.
        """
        ...
