"""Rendering of flat pieces of the world in a camera's view.

Later drawing covers earlier drawing, so the farthest piece is drawn first. The lens does not
distort. World frame, metres; camera frame optical, x right, y down, z forward.
"""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from gazerig.gaze.types import Vec3
from gazerig.robot.model.scene_view import PinholeView

Floats = NDArray[np.float64]
Bytes = NDArray[np.uint8]
Colour = tuple[int, int, int]
"""Blue, green, red."""

# Nothing nearer is drawn: a lens does not see its own cap.
_NEAREST_M = 0.03
# OpenCV draws polygons with a resolution of 1/16 pixel.
_SHIFT = 4


class TexturedQuad(NamedTuple):
    """A flat textured rectangle: a corner and two edges; texture rows go along ``down_m``."""

    corner_m: Vec3
    right_m: Vec3
    down_m: Vec3
    texture: Bytes


class Canvas:
    """Image of one camera at one position: colours, and distances along its axis.

    Args:
        seen_by: the camera.
        depth: whether to compute distances, which take as long as the colours.

    image: (h, w, 3) BGR
    depth_m: (h, w) float32, infinite where nothing was drawn, and everywhere without ``depth``
    """

    def __init__(self, seen_by: PinholeView, depth: bool = True) -> None:
        self._depth = depth
        _, lens, (width_px, height_px), R, p_m = seen_by
        self.image: Bytes = np.zeros((height_px, width_px, 3), np.uint8)
        self.depth_m = np.full((height_px, width_px), np.inf, np.float32)
        self.lens = lens
        self.R_world_camera = np.array(R)
        self.p_m = np.array(p_m)

    def to_camera(self, points_world_m: ArrayLike) -> Floats:
        """Transform points (n, 3) into the camera frame."""
        points = np.asarray(points_world_m, dtype=np.float64).reshape(-1, 3)
        seen: Floats = (points - self.p_m) @ self.R_world_camera
        return seen

    def polygon(self, points_world_m: ArrayLike, colour: Colour) -> None:
        """Fill a polygon (n, 3) with a colour; the distances do not change."""
        points = self.to_camera(points_world_m)
        if points[:, 2].min() > _NEAREST_M:
            fixed = np.rint((self._pixels(points)) * (1 << _SHIFT)).astype(np.int32)
            cv2.fillPoly(self.image, [fixed], colour, cv2.LINE_AA, _SHIFT)

    def draw_quad(self, quad: TexturedQuad) -> None:
        """Draw a textured rectangle; the fourth channel of a texture is its opacity."""
        right, down, corner = (
            self.R_world_camera.T @ np.array(v) - offset
            for v, offset in (
                (quad.right_m, 0.0),
                (quad.down_m, 0.0),
                (quad.corner_m, self.R_world_camera.T @ self.p_m),
            )
        )
        corners = np.array([corner, corner + right, corner + right + down, corner + down])
        kept: list[Floats] = []
        for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            if a[2] >= _NEAREST_M:
                kept.append(a)
            if (a[2] >= _NEAREST_M) != (b[2] >= _NEAREST_M):
                kept.append(a + (_NEAREST_M - a[2]) / (b[2] - a[2]) * (b - a))
        outline = np.array(kept).reshape(-1, 3)
        if len(outline) < 3:
            return
        pixels = self._pixels(outline)
        window = self._bounding_window(pixels)
        if window is None:
            return
        left, top, width, height = window
        moved = self.lens.matrix - np.array([(0, 0, left), (0, 0, top), (0, 0, 0)])
        rows, columns = quad.texture.shape[:2]
        scaled = np.stack((right / columns, down / rows, corner), axis=1)
        # The centre of a texture's first pixel is half a pixel within the sheet.
        scaled[:, 2] += 0.5 * (scaled[:, 0] + scaled[:, 1])
        drawn = cv2.warpPerspective(
            quad.texture,
            moved @ scaled,
            (width, height),
            flags=cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )
        mask = np.zeros((height, width), np.uint8)
        fixed = np.rint((pixels - (left, top)) * (1 << _SHIFT)).astype(np.int32)
        cv2.fillConvexPoly(mask, fixed, 255, cv2.LINE_AA, _SHIFT)
        if drawn.shape[2] == 4:
            mask = np.minimum(mask, drawn[:, :, 3])
        self._blend(window, np.asarray(drawn[:, :, :3], np.uint8), np.asarray(mask, np.uint8))
        if not self._depth:
            return
        normal = np.cross(right, down)
        self._set_depths(window, np.asarray(mask, np.uint8), normal / float(normal @ corner))

    def ellipsoid_depth(self, centre_m: Vec3, R_world_body: Floats, half_m: Vec3) -> None:
        """Set the distances of the visible front of an ellipsoid; the colours do not change."""
        if not self._depth:
            return
        A = self.R_world_camera.T @ R_world_body / np.array(half_m)
        centre = self.to_camera(centre_m)[0]
        reach = float(max(half_m))
        if centre[2] - reach < _NEAREST_M:
            return
        box = centre + reach * np.array([(-1, -1, -1), (1, 1, -1), (-1, 1, -1), (1, -1, -1)])
        window = self._bounding_window(self._pixels(box))
        if window is None:
            return
        left, top, width, height = window
        ray = self._rays(window)
        # |A^T (t ray - centre)| = 1, the nearer solution.
        d, c = ray @ A, A.T @ centre
        dd, dc = (d * d).sum(axis=2), d @ c
        root = dc * dc - dd * (float(c @ c) - 1.0)
        t = (dc - np.sqrt(np.maximum(root, 0.0))) / dd
        part = self.depth_m[top : top + height, left : left + width]
        np.copyto(part, t.astype(np.float32), where=(root > 0.0) & (t < part))

    def _pixels(self, points: Floats) -> Floats:
        """Project points of the camera frame that are in front of the lens."""
        i = self.lens
        pixels: Floats = points[:, :2] / points[:, 2:] * (i.fx_px, i.fy_px) + (i.cx_px, i.cy_px)
        return pixels

    def _bounding_window(self, pixels: Floats) -> tuple[int, int, int, int] | None:
        """Return x, y, width, height of the part of the image that the points span."""
        height, width = self.depth_m.shape
        low = np.floor(np.clip(pixels.min(axis=0), -2.0, 1e6)).astype(int)
        high = np.ceil(np.clip(pixels.max(axis=0), -2.0, 1e6)).astype(int) + 1
        left, top = max(0, int(low[0])), max(0, int(low[1]))
        right, bottom = min(width, int(high[0])), min(height, int(high[1]))
        if right - left < 1 or bottom - top < 1:
            return None
        return left, top, right - left, bottom - top

    def _rays(self, window: tuple[int, int, int, int]) -> Floats:
        """Return the directions of a window's pixels, z = 1: (h, w, 3)."""
        left, top, width, height = window
        i = self.lens
        x = (np.arange(left, left + width) - i.cx_px) / i.fx_px
        y = (np.arange(top, top + height) - i.cy_px) / i.fy_px
        ray = np.ones((height, width, 3))
        ray[:, :, 0], ray[:, :, 1] = x[None, :], y[:, None]
        return ray

    def _blend(self, window: tuple[int, int, int, int], drawn: Bytes, mask: Bytes) -> None:
        """Blend a drawing into the image with the opacity of the mask."""
        left, top, width, height = window
        part = self.image[top : top + height, left : left + width]
        cv2.copyTo(drawn, cv2.inRange(mask, 255, 255), part)
        edge = cv2.findNonZero(cv2.inRange(mask, 1, 254))
        if edge is not None:
            x, y = edge[:, 0, 0], edge[:, 0, 1]
            share = mask[y, x, None].astype(np.float32) / 255.0
            mixed = part[y, x] * (1.0 - share) + drawn[y, x] * share
            part[y, x] = np.rint(mixed).astype(np.uint8)

    def _set_depths(self, window: tuple[int, int, int, int], mask: Bytes, inverse: Floats) -> None:
        """Set the distances of a plane in which 1 / z = inverse . ray."""
        left, top, width, height = window
        i = self.lens
        x = (np.arange(left, left + width, dtype=np.float32) - i.cx_px) / i.fx_px
        y = (np.arange(top, top + height, dtype=np.float32) - i.cy_px) / i.fy_px
        over_z = (inverse[0] * x)[None, :] + (inverse[1] * y + inverse[2])[:, None]
        z = (1.0 / np.maximum(over_z, 1e-3)).astype(np.float32)
        part = self.depth_m[top : top + height, left : left + width]
        np.copyto(part, z, where=mask > 127)
