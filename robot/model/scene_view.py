"""What a camera without faults sees of something simulated, and who draws that."""

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import ImageArray
from gazerig.gaze.types import Mat3, Vec3


class PinholeView(NamedTuple):
    """What a pinhole camera is at an instant.

    Attributes:
        t_s: time since the scene began, seconds.
        lens: of the camera, for pictures of this size; its distortion is not drawn.
        size_px: width and height.
        R: rotation of the camera in the world, its axes optical.
        p_m: position of the camera in the world.
    """

    t_s: float
    lens: Intrinsics
    size_px: tuple[int, int]
    R: Mat3
    p_m: Vec3


class Rendered(NamedTuple):
    """A picture: image (h, w, 3) BGR; depth_m (h, w) along the axis, inf where nothing is."""

    image: ImageArray
    depth_m: NDArray[np.float32] | None


class SceneView(Protocol):
    """Draws what a pinhole camera sees at an instant."""

    def draw(
        self, seen_by: PinholeView, *, depth: bool = False, rows: tuple[int, int] | None = None
    ) -> Rendered:
        """Return a picture.

        Args:
            seen_by: the camera.
            depth: with distances, where what draws knows them.
            rows: the first row and the one after the last, where only these are wanted.
        """
        ...

    def close(self) -> None:
        """Free what drawing needs; safe to call twice."""
        ...
