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


# Width above which changes are light, not things, and the limit of such changes in grey levels.
_LIGHT_PX, _LIGHT_STEP = 21, 8.0
LEAST_SIDE_PX = 48
"""Shortest side of an image that is searched for flow."""


class SmallImage(NamedTuple):
    """A scaled grey image.

    scale: (x, y) small pixels per pixel of the original image
    K: (3, 3) camera matrix of the small image
    fine_grey: the image before it was halved for the search; ``grey`` itself if it was not
    """

    grey: Grey
    scale: tuple[float, float]
    K: Floats
    captured_s: float
    fine_grey: Grey


def scale_down(
    image: NDArray[Any], work_px: int, lens: Intrinsics, captured_s: float
) -> SmallImage:
    """Scale an image so that its longer side is at most ``work_px``, and convert it to grey.

    It is scaled before it is converted, which is less work on a large image. For the search it is
    halved, unless it becomes too small: a finer flow shows smaller things and takes three to four
    times as long.

    Raises:
        ValueError: it is not an 8-bit image: grey, BGR or BGR with alpha.
    """
    channels = image.shape[2] if image.ndim == 3 else 1
    right = image.ndim in (2, 3) and channels in (1, 3, 4) and image.size > 0
    if not right or image.dtype != np.uint8:
        raise ValueError(
            "an image is (height, width), or that with 1, 3 or 4 channels, of uint8, not "
            f"{image.shape} of {image.dtype}"
        )
    height, width = image.shape[:2]
    shrink = min(1.0, work_px / max(width, height))
    size = max(1, round(width * shrink)), max(1, round(height * shrink))
    if size != (width, height):
        image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    fine = to_grey(image)
    grey = fine
    if min(size) // 2 >= LEAST_SIDE_PX:
        size = size[0] // 2, size[1] // 2
        grey = np.asarray(cv2.resize(fine, size, interpolation=cv2.INTER_AREA), np.uint8)
    scale = size[0] / width, size[1] / height
    return SmallImage(grey, scale, lens.scaled(*scale).matrix, captured_s, fine)


def to_grey(image: NDArray[Any]) -> Grey:
    """Return the brightness (h, w) of an image in BGR, BGR with alpha, or grey."""
    channels = image.shape[2] if image.ndim == 3 else 1
    if channels == 3:
        return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
    if channels == 4:
        return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGRA2GRAY), dtype=np.uint8)
    return np.ascontiguousarray(image.reshape(image.shape[:2]))


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


def upper_median(values: Floats) -> float:
    """Return the upper median of (n,) values, n > 0; five times faster than NumPy's."""
    half = len(values) // 2
    return float(np.partition(values, half)[half])


Mask = NDArray[np.bool_]
Flow = NDArray[np.float32]
"""(height, width, 2): x right, y down, pixels."""

# Below 8 px at the finest level of its pyramid, a quarter of the image, DIS reads outside its
# memory; its count of levels depends on the version of OpenCV.
_LARGEST_ASPECT = 4.0
# Margin around changes in which flow is computed.
_AROUND_PX = 8
_STILL_PX = 0.02
"""Largest motion of the corners that does not count as a turn."""


Window = tuple[slice, slice]
"""Rows and columns of a part of an image."""


class ImagePair(NamedTuple):
    """Two images, aligned by the turn that the joints measured.

    now: the newer image
    before: the older one, turned as predicted
    valid_mask: mask of its valid pixels whose flow stays inside
    flow: a point at x in ``now`` is at x + flow in ``before``
    H: (3, 3) pixels of the older image to those of ``before``
    fine_images: the same two images before they were scaled for the search
    window: part in which flow was computed; elsewhere it is 0
    """

    now: Grey
    before: Grey
    valid_mask: Mask
    flow: Flow
    H: Floats
    fine_images: tuple[Grey, Grey]
    window: Window = (slice(0, 0), slice(0, 0))

    def crop(self, window: Window) -> "ImagePair":
        """Return a part of both images with its flow."""
        return self._replace(
            now=self.now[window],
            before=self.before[window],
            valid_mask=self.valid_mask[window],
            flow=self.flow[window],
        )


class FlowSearch:
    """DIS with its buffers, for images of any supported size."""

    def __init__(self) -> None:
        # The slower presets smooth the flow more, which loses small things.
        self._dis = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_ULTRAFAST)
        self._dis.setFinestScale(0)

    def search(self, pair: ImagePair, window: Window | None = None) -> ImagePair:
        """Compute the flow in a part of the images; None: everywhere."""
        if window is None:
            window = slice(0, pair.now.shape[0]), slice(0, pair.now.shape[1])
        now, before = (np.ascontiguousarray(grey[window]) for grey in (pair.now, pair.before))
        found: Flow = np.zeros((*now.shape, 2), dtype=np.float32)  # initial guess, then result
        if found.size:
            self._dis.calc(now, before, found)
        flow: Flow = np.zeros((*pair.now.shape, 2), dtype=np.float32)
        flow[window] = found
        # Flow that ends outside the other image is unknown.
        known, (height, width) = pair.valid_mask.copy(), now.shape
        at_x = found[..., 0] + np.arange(width, dtype=np.float32)
        at_y = found[..., 1] + np.arange(height, dtype=np.float32)[:, None]
        known[window] &= (at_x >= 0) & (at_x <= width - 1) & (at_y >= 0) & (at_y <= height - 1)
        return pair._replace(flow=flow, valid_mask=known, window=window)


def align_images(now: SmallImage, before: SmallImage, H: Floats) -> ImagePair:
    """Align two images by turning the older one by ``H``; their flow is still 0."""
    grey, known = _turn_image(before.grey, H)
    fine = grey
    if before.fine_grey is not before.grey:
        fine, _ = _turn_image(
            before.fine_grey, _scale_homography(H, before.fine_grey.shape[0] / grey.shape[0])
        )
    flow: Flow = np.zeros((*grey.shape, 2), dtype=np.float32)
    return ImagePair(now.grey, grey, known, flow, H, (now.fine_grey, fine))


def changed_window(changed: Mask) -> Window:
    """Return the part of an image that changed.

    Args:
        changed: Mask (h, w).
    """
    height, width = changed.shape
    cells = cv2.resize(
        changed.astype(np.uint8), None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA
    )
    x, y, w, h = cv2.boundingRect(cells)
    if not w:
        return slice(0, 0), slice(0, 0)
    more = 2 * _AROUND_PX
    return (
        _widen(4 * y - _AROUND_PX, 4 * h + more, height),
        _widen(4 * x - _AROUND_PX, 4 * w + more, width),
    )


def _widen(start: int, length: int, most: int) -> slice:
    """Return a range of an image, at least as long as the flow search needs."""
    length = min(most, max(length, LEAST_SIDE_PX))
    start = max(0, min(start, most - length))
    return slice(start, start + length)


def is_searchable(grey: Grey) -> bool:
    """Return whether an image has a size and shape in which flow can be computed."""
    short, long = sorted(grey.shape)
    return bool(short >= LEAST_SIDE_PX and long <= _LARGEST_ASPECT * short)


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
    """Return points (n, 2) after a homography; infinite if they are behind the camera."""
    homogeneous = points_px @ H[:, :2].T + H[:, 2]
    depth = homogeneous[:, 2:]
    with np.errstate(divide="ignore", invalid="ignore"):
        out: Floats = np.where(depth > 1e-6, homogeneous[:, :2] / depth, np.inf)
    return out


def corners(shape: tuple[int, ...]) -> Floats:
    """Return the centres of an image's four corner pixels, (4, 2)."""
    height, width = shape[:2]
    return np.array([(0, 0), (width - 1, 0), (0, height - 1), (width - 1, height - 1)], float)


def gradients(grey: Grey) -> tuple[Plane, Plane]:
    """Return the gradients of brightness by x and y, grey levels per pixel, (h, w) each."""
    gx = cv2.Sobel(grey, cv2.CV_32F, 1, 0, scale=0.125)
    return np.asarray(gx, np.float32), np.asarray(
        cv2.Sobel(grey, cv2.CV_32F, 0, 1, scale=0.125), np.float32
    )


def _turn_image(grey: Grey, H: Floats) -> tuple[Grey, Mask]:
    """Turn an image; return it with a mask of its known pixels."""
    at = corners(grey.shape)
    height, width = grey.shape
    if np.abs(warp_points(H, at) - at).max() < _STILL_PX:
        return grey, np.ones(grey.shape, dtype=np.bool_)
    # The edge is replicated, as unknown pixels must not look like an edge to the search.
    turned = cv2.warpPerspective(grey, H, (width, height), borderMode=cv2.BORDER_REPLICATE)
    white = np.full(grey.shape, 255, dtype=np.uint8)
    known = cv2.warpPerspective(white, H, (width, height)) == 255
    return np.asarray(turned, dtype=np.uint8), known


def _scale_homography(H: Floats, scale: float) -> Floats:
    """Return a homography in pixels of an image that is larger by a factor."""
    S = np.array(
        [[scale, 0.0, 0.5 * scale - 0.5], [0.0, scale, 0.5 * scale - 0.5], [0.0, 0.0, 1.0]]
    )
    out: Floats = S @ H @ np.linalg.inv(S)
    return out
