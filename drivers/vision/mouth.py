"""Gap between the lips from a picture of the face, for faces too small or too many for a mesh.

An open mouth is darker than the skin around it. The sum of the darkness in a patch around it
follows gaps of less than a pixel, and hardly changes if the patch is misplaced, as the whole mouth
stays within it. Lips, teeth and a beard add a constant: only changes have a meaning.
"""

from dataclasses import replace

import cv2
import numpy as np

from gazerig.drivers.types import DetectedFace, FaceSigns, ImageArray
from gazerig.drivers.vision.clothing import face_head

# The patch on an adult: half its width and height, and its centre below the mouth's corners.
_HALF_WIDTH_M, _HALF_HEIGHT_M, _BELOW_M = 0.024, 0.0225, 0.0075
# Grey of the skin, as a percentile of the patch, and shades of it that are not yet dark.
_SKIN, _LIGHT = 70.0, 0.8
# Gap over the darkness of the patch per half its width, and the error of the gap in pixels.
# Correlation with the true gap: .85 on rendered faces with 12 pixels between the eyes; with that of
# a mesh: .89 on a filmed face with 23.
_GAP, _ERROR_PX = 1.55, 0.18
# A nose so far aside of eyes and mouth is that of a face turned away: behind it is background.
_ASIDE_M = 0.010


def with_mouth(image: ImageArray, face: DetectedFace) -> DetectedFace:
    """Return a face with the gap of its mouth; unchanged if it is turned away."""
    head = face_head(face)
    x, y = face.landmarks_px[3:].mean(axis=0).tolist()
    if head is None or (
        abs(head.x - 0.5 * (x + face.landmarks_px[:2, 0].mean())) > _ASIDE_M * head.px_m
    ):
        return face
    px_m = head.px_m
    half, high = _HALF_WIDTH_M * px_m, _HALF_HEIGHT_M * px_m
    size = round(2.0 * half) + 1, round(2.0 * high) + 1
    green = cv2.getRectSubPix(image, size, (x, y + _BELOW_M * px_m))[..., 1]
    dark = _LIGHT - green / max(np.percentile(green, _SKIN), 1.0)
    gap_m = _GAP * float(dark.clip(0.0).sum()) / (half * px_m)
    return replace(face, signs=FaceSigns(None, gap_m, _ERROR_PX / px_m))
