"""The small grey images that are searched for motion, and the optical flow between them.

Pixels have their centres at whole numbers: an image of width w extends from -0.5 to w - 0.5, so
scaling by s takes u to s (u + 0.5) - 0.5.

Dense inverse search (Kroeger et al. 2016) finds motions of some 20 px; a head turns by more between
two images. The known turn is removed before the search, so that it only has to find the rest. The
flow is defined at the pixels of the newer image, as the present position of a thing matters.
"""

from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.pinhole import Intrinsics

Grey = NDArray[np.uint8]
"""(height, width)."""
Floats = NDArray[np.float64]
Plane = NDArray[np.float32]
"""(height, width)."""
Mask = NDArray[np.bool_]
Flow = NDArray[np.float32]
"""(height, width, 2): x right, y down, pixels."""

# Width above which changes are light, not things, and the limit of such changes in grey levels.
_LIGHT_PX, _LIGHT_STEP = 21, 8.0
# Change of a row's brightness above which the light changed, not the noise of single pixels; and
# grey level below which relative changes are noise.
_LEAST_GAIN, DARK = 0.02, np.float32(8.0)
# Size of the searched image relative to a frame of ``work_px``: a finer flow shows smaller things
# and takes three to four times as long.
_SEARCHED = 0.5
TO_FINE = np.array([(2.0, 0.0, 0.5), (0.0, 2.0, 0.5), (0.0, 0.0, 1.0)])
"""Pixels of the searched image to those of the fine one."""
TO_SEARCHED = np.linalg.inv(TO_FINE)
_LEAST_SIDE_PX = 48
"""Shortest side of an image that is searched for flow."""
# Below 8 px at the finest level of its pyramid, a quarter of the image, DIS reads outside its
# memory; its count of levels depends on the version of OpenCV.
_LARGEST_ASPECT = 4.0
# Largest motion of the corners that does not count as a turn.
_STILL_PX = 0.02


class SmallImage(NamedTuple):
    """A scaled grey image.

    scale: (x, y) small pixels per pixel of the original image
    K: (3, 3) camera matrix of the small image
    fine: the same image in twice the size
    """

    grey: Grey
    fine: Grey
    scale: tuple[float, float]
    K: Floats
    captured_s: float


def scale_down(
    image: NDArray[Any], work_px: int, lens: Intrinsics, captured_s: float
) -> SmallImage:
    """Scale an image, (h, w, 3) BGR or (h, w) grey, to the size in which flow is searched.

    It is scaled before it is converted to grey, which is less work on a large image.
    """
    height, width = image.shape[:2]
    shrink = _SEARCHED * min(1.0, work_px / max(width, height))
    size = max(1, round(width * shrink)), max(1, round(height * shrink))
    fine = cv2.resize(image, (2 * size[0], 2 * size[1]), interpolation=cv2.INTER_AREA)
    if fine.ndim == 3:
        fine = cv2.cvtColor(fine, cv2.COLOR_BGR2GRAY)
    grey = np.asarray(cv2.resize(fine, size, interpolation=cv2.INTER_AREA), np.uint8)
    scale = size[0] / width, size[1] / height
    K = lens.scaled(*scale).matrix
    return SmallImage(grey, np.asarray(fine, np.uint8), scale, K, captured_s)


def remove_illumination(change: Plane) -> Plane:
    """Return a change of brightness without that of the light, which covers wider areas."""
    # Clipped, as otherwise a dark coat would darken its surroundings.
    light = cv2.blur(np.clip(change, -_LIGHT_STEP, _LIGHT_STEP), (_LIGHT_PX, _LIGHT_PX))
    return np.asarray(change - light, np.float32)


def to_original_px(
    point_px: tuple[float, float], scale: tuple[float, float]
) -> tuple[float, float]:
    """Return the position of a point of the small image in the original image."""
    return (point_px[0] + 0.5) / scale[0] - 0.5, (point_px[1] + 0.5) / scale[1] - 0.5


class ImagePair(NamedTuple):
    """Two images, aligned by the turn that the joints measured.

    now: the newer image
    before: the older one, turned as predicted, in the light of the newer one
    valid_mask: mask of its valid pixels whose flow stays inside
    flow: a point at x in ``now`` is at x + flow in ``before``
    H: (3, 3) pixels of the older image to those of ``before``
    fine_now, fine_before: the same images in twice the size
    """

    now: Grey
    before: Grey
    valid_mask: Mask
    flow: Flow
    H: Floats
    fine_now: Grey
    fine_before: Grey


class FlowSearch:
    """DIS with its buffers, for images of any supported size."""

    def __init__(self) -> None:
        # The slower presets smooth the flow more, which loses small things.
        self._dis = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_ULTRAFAST)
        self._dis.setFinestScale(0)

    def search(self, pair: ImagePair) -> ImagePair:
        """Compute the flow of two images."""
        flow: Flow = np.zeros((*pair.now.shape, 2), dtype=np.float32)  # first guess, then result
        self._dis.calc(pair.now, pair.before, flow)
        # Flow that ends outside the other image is unknown.
        height, width = pair.now.shape
        x, y = cv2.split(add_grid(flow))
        known = pair.valid_mask & (x >= 0) & (x <= width - 1) & (y >= 0) & (y <= height - 1)
        return pair._replace(flow=flow, valid_mask=known)


def align_images(now: SmallImage, before: SmallImage, H: Floats) -> ImagePair:
    """Align two images by turning the older one by ``H``; their flow is still 0."""
    turned, known = _turn_image(before.grey, H)
    fine, _ = _turn_image(before.fine, TO_FINE @ H @ TO_SEARCHED)
    flow: Flow = np.zeros((*turned.shape, 2), dtype=np.float32)
    return ImagePair(now.grey, _adopt_light(now.grey, turned), known, flow, H, now.fine, fine)


def _adopt_light(now: Grey, before: Grey) -> Grey:
    """Return the older image in the light of the newer one.

    Exposure and lamps on 50 Hz, read row by row, change whole rows.
    """
    wanted, found = now + DARK, before + DARK
    gain = np.median(wanted / found, axis=1, keepdims=True)
    gain[np.abs(gain - 1.0) < _LEAST_GAIN] = 1.0
    return np.asarray(np.clip(found * gain - DARK, 0, 255).round(), np.uint8)


def is_searchable(grey: Grey) -> bool:
    """Return whether an image has a size and shape in which flow can be computed."""
    short, long = sorted(grey.shape)
    return bool(short >= _LEAST_SIDE_PX and long <= _LARGEST_ASPECT * short)


def turn_homography(R_now_before: Floats | None, now: SmallImage, before: SmallImage) -> Floats:
    """Return the homography of a turn of the camera about its lens: K R K^-1.

    R_now_before: (3, 3) turns directions from the older camera's axes into the newer's; None or not
        a number counts as no turn
    """
    if R_now_before is None or not np.isfinite(R_now_before).all():
        return np.eye(3)
    H: Floats = now.K @ np.asarray(R_now_before, dtype=np.float64) @ np.linalg.inv(before.K)
    return H


def warp_points(H: Floats, points_px: Floats) -> Floats:
    """Return points (n, 2) after a homography."""
    return np.asarray(cv2.perspectiveTransform(points_px[None], H)[0], np.float64)


def pixel_grid(shape: tuple[int, ...]) -> Flow:
    """Return the position of each pixel, (h, w, 2)."""
    height, width = shape[:2]
    x, y = np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32)
    return np.dstack(np.meshgrid(x, y))


def add_grid(flow: Flow) -> Flow:
    """Return the position to which each pixel's flow leads, (h, w, 2)."""
    return pixel_grid(flow.shape) + flow


def _turn_image(grey: Grey, H: Floats) -> tuple[Grey, Mask]:
    """Turn an image; return it with a mask of its known pixels."""
    height, width = grey.shape
    corners = np.array([(0, 0), (width - 1, 0), (0, height - 1), (width - 1, height - 1)], float)
    if np.abs(warp_points(H, corners) - corners).max() < _STILL_PX:
        return grey, np.ones(grey.shape, dtype=np.bool_)
    # The edge is replicated, as unknown pixels must not look like an edge to the search.
    turned = cv2.warpPerspective(grey, H, (width, height), borderMode=cv2.BORDER_REPLICATE)
    white = np.full(grey.shape, 255, dtype=np.uint8)
    known = cv2.warpPerspective(white, H, (width, height)) == 255
    return np.asarray(turned, dtype=np.uint8), known
