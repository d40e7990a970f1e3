"""Pictures of emulated scenes."""

from typing import NamedTuple, Protocol

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import ImageArray
from gazerig.gaze.types import Mat3, Vec3


class PinholeView(NamedTuple):
    """A pinhole camera at a time.

    Attributes:
        t_s: Time since the start of the scene in s.
        lens: Intrinsics for pictures of this size; distortion is not drawn.
        size_px: Width and height.
        R: Rotation of the camera in the world, with optical axes.
        p_m: Position of the camera in the world.
    """

    t_s: float
    lens: Intrinsics
    size_px: tuple[int, int]
    R: Mat3
    p_m: Vec3


class SceneView(Protocol):
    """A renderer of a scene through a pinhole camera."""

    def draw(self, seen_by: PinholeView) -> ImageArray:
        """Return the picture of a camera, (h, w, 3) BGR."""

    def close(self) -> None:
        """Free the renderer's resources; safe to call twice."""


class MovableOpponent(Protocol):
    """A boxer in the emulated world; its times are those of the scene."""

    def move(self, p_m: Vec3, t_s: float) -> None:
        """Move the leading fist to a point."""

    def update(self, t_s: float) -> None:
        """Advance the motion to a time."""
