"""A point of a moving patch that is on the thing itself, not on the ground seen through it.

Plain ground between two people who walk together, or between legs, goes along with them in
the flow. It is recognised by its appearance: it is as bright as the ground around the patch.
"""

import cv2
import numpy as np

from gazerig.drivers.vision.motion.clustering import Group
from gazerig.drivers.vision.motion.image import Floats, Grey
from gazerig.drivers.vision.motion.optical_flow import Mask

_MARGIN_PX = 4
# How far from the ground's brightness (standard deviations, grey levels) a thing's pixels are.
_UNLIKE, _LEAST_LEVELS = 2.0, 12.0
# A thing of which less stands out is not told from the ground by its looks at all.
_LEAST_SHARE = 0.25
# How much of the last image's choice is kept, so that the point does not jump to and fro.
_KEPT = 0.5


def anchor(group: Group, grey: Grey, middle: Floats, offset: Floats) -> Floats:
    """Return a pixel of the thing, (2,), near its middle.

    grey: (h, w) image
    middle: (2,) middle of the patch
    offset: (2,) how far from its middle the point was in the image before
    """
    apart = _standing_out(group, grey)
    if apart.mean() < _LEAST_SHARE:
        apart[:] = True
    places = np.column_stack((group.x[apart], group.y[apart])).astype(np.float64)
    wanted = middle + _KEPT * offset
    out: Floats = places[int(np.argmin(((places - wanted) ** 2).sum(axis=1)))]
    return out


def _standing_out(group: Group, grey: Grey) -> Mask:
    """Return which pixels of a patch, (n,), are not as bright as the ground around it."""
    x, y, width, height = group.box
    left, top = max(0, x - _MARGIN_PX), max(0, y - _MARGIN_PX)
    crop = grey[top : y + height + _MARGIN_PX, left : x + width + _MARGIN_PX].astype(np.float32)
    outside = np.ones(crop.shape, dtype=np.float32)
    outside[group.y - top, group.x - left] = 0.0
    window = width + 2 * _MARGIN_PX, 2 * _MARGIN_PX + 1  # ground lies in level strips
    edge = cv2.BORDER_CONSTANT
    count = np.maximum(cv2.blur(outside, window, borderType=edge), 1e-6)
    mean = cv2.blur(crop * outside, window, borderType=edge) / count
    square = cv2.blur(crop * crop * outside, window, borderType=edge) / count
    spread = np.sqrt(np.maximum(square - mean * mean, 0.0))
    unlike = np.abs(cv2.blur(crop, (3, 3)) - mean) > np.maximum(_UNLIKE * spread, _LEAST_LEVELS)
    out: Mask = unlike[group.y - top, group.x - left]
    return out
