"""Point of a moving patch that is on the thing itself, not on the background seen through it.

Plain background between two people who walk together, or between legs, moves with them in the flow.
It is recognised by its appearance: it is as bright as the background around the patch.
"""

import cv2
import numpy as np

from gazerig.drivers.vision.motion.clustering import Group
from gazerig.drivers.vision.motion.image import Floats, Grey
from gazerig.drivers.vision.motion.optical_flow import Mask

_MARGIN_PX = 4
# Smallest difference of a thing's pixels from the background (standard deviations, grey levels).
_UNLIKE, _LEAST_LEVELS = 2.0, 12.0
# Smallest share of a thing that must differ for its appearance to be used.
_LEAST_SHARE = 0.25
# Share of the last image's choice that is kept, so that the point does not jump back and forth.
_KEPT = 0.5


def anchor(group: Group, grey: Grey, middle: Floats, offset: Floats) -> Floats:
    """Return a pixel of the thing, (2,), near its centre.

    grey: (h, w) image
    middle: (2,) centre of the patch
    offset: (2,) offset of the point from its centre in the previous image
    """
    apart = _standing_out(group, grey)
    if apart.mean() < _LEAST_SHARE:
        apart[:] = True
    places = np.column_stack((group.x[apart], group.y[apart])).astype(np.float64)
    wanted = middle + _KEPT * offset
    out: Floats = places[int(np.argmin(((places - wanted) ** 2).sum(axis=1)))]
    return out


def _standing_out(group: Group, grey: Grey) -> Mask:
    """Return a mask (n,) of a patch's pixels that differ in brightness from the background."""
    x, y, width, height = group.box
    left, top = max(0, x - _MARGIN_PX), max(0, y - _MARGIN_PX)
    crop = grey[top : y + height + _MARGIN_PX, left : x + width + _MARGIN_PX].astype(np.float32)
    outside = np.ones(crop.shape, dtype=np.float32)
    outside[group.y - top, group.x - left] = 0.0
    window = width + 2 * _MARGIN_PX, 2 * _MARGIN_PX + 1  # background is in horizontal strips
    edge = cv2.BORDER_CONSTANT
    count = np.maximum(cv2.blur(outside, window, borderType=edge), 1e-6)
    mean = cv2.blur(crop * outside, window, borderType=edge) / count
    square = cv2.blur(crop * crop * outside, window, borderType=edge) / count
    spread = np.sqrt(np.maximum(square - mean * mean, 0.0))
    unlike = np.abs(cv2.blur(crop, (3, 3)) - mean) > np.maximum(_UNLIKE * spread, _LEAST_LEVELS)
    out: Mask = unlike[group.y - top, group.x - left]
    return out
