"""Heat map of the recent gaze, drawn into the camera image."""

import cv2
import numpy as np

from gazerig.drivers.types import ImageArray
from gazerig.gaze.types import Floats
from gazerig.robot.dashboard.feed.gaze_trail import EVERY_S

_SMALL = 8  # pixels of the image for each pixel of the map
_BLUR = 2.6  # in pixels of the map
_FULL = 0.05  # of the map's blurred seconds: there it is hottest
_STRONGEST = 0.62


def draw_heat(image: ImageArray, points_px: Floats) -> None:
    """Draw the density of points (n, 2), pixels, over an image, in place."""
    height, width = image.shape[:2]
    low = np.zeros((-(-height // _SMALL), -(-width // _SMALL)), np.float32)
    cells = np.floor(points_px / _SMALL)
    inside = (cells >= 0).all(axis=1) & (cells[:, 0] < low.shape[1]) & (cells[:, 1] < low.shape[0])
    columns, rows = cells[inside].astype(int).T
    np.add.at(low, (rows, columns), EVERY_S)
    low = cv2.GaussianBlur(low, (0, 0), _BLUR).astype(np.float32)
    share = np.clip(low / _FULL, 0.0, 1.0)
    colours = cv2.applyColorMap((255.0 * share).astype(np.uint8), cv2.COLORMAP_INFERNO)
    size = (width, height)
    over = cv2.resize(colours, size, interpolation=cv2.INTER_LINEAR).astype(np.float32)
    part = cv2.resize(_STRONGEST * np.sqrt(share), size, interpolation=cv2.INTER_LINEAR)[..., None]
    image[:] = (image * (1.0 - part) + over * part).astype(np.uint8)
